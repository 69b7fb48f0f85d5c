"""Sums forces at the law points into forces and torques of the blocks."""

from __future__ import annotations

import numpy as np

from .geometry import Points


class Assembly:
    """Which blocks the law points push: a, b (n,) of the law points, and the number of blocks."""

    def __init__(self, a: np.ndarray, b: np.ndarray, blocks: int) -> None:
        self.a, self.b, self.blocks = a, b, blocks
        one = np.concatenate([3 * a, 3 * b])
        self._slot = np.concatenate([one, one + 1, one + 2])

    def __call__(self, motion: np.ndarray, points: Points, push, shear, energy=None) -> np.ndarray:
        """Forces and torques (blocks, 3) at a motion (6, blocks).

        Block b is pushed by `push` (N) along the normal and by `shear` (N) in the sense of sliding,
        block a by the opposite at the same place; energy (J/m): stored per length.
        """
        force, couple = (push - 1j * shear) * points.normal, 0.0
        if energy is not None:
            force -= energy * points.pull
            couple = energy * points.twist
        centre = motion[0] + 1j * motion[1]
        arms = (points.at - centre[self.a]).conj(), (points.at - centre[self.b]).conj()
        x, y = force.real, force.imag
        on_a, on_b = (arms[0] * force).imag, (arms[1] * force).imag
        parts = np.concatenate([-x, x, -y, y, couple - on_a, on_b - couple])
        return np.bincount(self._slot, parts, 3 * self.blocks).reshape(-1, 3)
