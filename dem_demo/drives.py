"""Prescribed motions: a base that tilts, a machine that shears."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

AXES = {"x": 0, "y": 1, "turn": 2}


@dataclass(frozen=True)
class Drive:
    """Motion of one block along "x" or "y" (m) or "turn" (rad) about its centroid.

    Straight lines between (times, values), rounded over `ease` seconds at every corner so that the
    machine does not strike the rock; before and after them the block rests.
    """

    block: int
    axis: int
    times: tuple[float, ...]
    values: tuple[float, ...]
    ease: float

    def __call__(self, t: float) -> float:
        """Prescribed displacement at time t."""
        if self.ease == 0:
            return float(np.interp(t, self.times, self.values))
        low, high = t - 0.5 * self.ease, t + 0.5 * self.ease
        knots = np.array([low, *(s for s in self.times if low < s < high), high])
        values = np.interp(knots, self.times, self.values)
        return float(np.sum(0.5 * (values[1:] + values[:-1]) * np.diff(knots)) / self.ease)


class Drives:
    """All prescribed motions of a scene."""

    def __init__(self, drives: tuple[Drive, ...]) -> None:
        self.drives = drives
        self.rows = np.array([d.block for d in drives], int)
        self.axes = np.array([d.axis for d in drives], int)

    def velocity(self, t: float, dt: float) -> np.ndarray:
        """Velocities that carry the drives exactly from t to t + dt."""
        return np.array([(d(t + dt) - d(t)) / dt for d in self.drives])
