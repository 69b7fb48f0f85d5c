"""Prescribed motions at work: velocities of driven blocks, and when they are sent back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..scene.drives import Drive


class Drives:
    """The drives of a scene. reversed_at (d,): when each was told to go back, inf before (s)."""

    def __init__(self, drives: tuple[Drive, ...]) -> None:
        self.drives = drives
        self.rows = np.array([d.block for d in drives], int)
        self.axes = np.array([d.axis for d in drives], int)
        self._still = np.array([len(d.times) == 1 for d in drives])
        self._reverses = np.array([d.back is not None for d in drives], bool)

    def velocity(self, t: float, dt: float, reversed_at: np.ndarray) -> np.ndarray:
        """Velocities that carry the drives exactly from t to t + dt."""
        out = np.zeros(len(self.drives))
        for i, (d, at) in enumerate(zip(self.drives, reversed_at, strict=True)):
            if not self._still[i]:
                out[i] = (d(t + dt, at) - d(t, at)) / dt
        return out

    def waiting(self, t: float, reversed_at: np.ndarray) -> bool:
        """Is there a drive still to be sent back?"""
        return bool((self._reverses & (t < reversed_at)).any())

    def reverse(
        self, t: float, reversed_at: np.ndarray, slid: Callable[[int, int], float]
    ) -> np.ndarray:
        """Send back those drives whose block has slid far enough; slid(block, base) in m."""
        out = reversed_at.copy()
        for i, d in enumerate(self.drives):
            if d.back and t < out[i] and slid(d.back.block, d.block) > d.back.slid:
                out[i] = t
        return out
