"""Convex blocks: their corners, and what pymunk says of them."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pymunk

EXACT = 1e-7  # share of the size of a rock or scene below which a distance is zero


@dataclass(frozen=True, eq=False)
class Block:
    """A rigid convex block of the scene, in its place at time 0.

    corners (m, 2) in m, counter-clockwise; density in kg/m3; load (2,) in N at the centroid;
    velocity (2,) in m/s, spin in rad/s; `held` names the motions ("x", "y", "turn") that a drive
    prescribes: of fixed rock none, or all.
    """

    name: str
    corners: np.ndarray
    density: float
    fixed: bool = False
    velocity: tuple[float, float] = (0.0, 0.0)
    spin: float = 0.0
    load: tuple[float, float] = (0.0, 0.0)
    held: tuple[str, ...] = ()

    @cached_property
    def section(self) -> pymunk.Poly:
        """The section with its area (m2), mass (kg) and moment of inertia (kg m2) of a metre of
        thickness; pymunk has it from corner 0, so that a far block loses no digits."""
        shape = pymunk.Poly(None, (self.corners - self.corners[0]).tolist())
        shape.density = self.density
        return shape

    @property
    def moves(self) -> bool:
        """Does it move, by forces or as fixed rock by a drive?"""
        return not self.fixed or bool(self.held)

    @property
    def centroid(self) -> np.ndarray:
        """Centre of gravity (m)."""
        return self.corners[0] + self.section.center_of_gravity

    @property
    def local(self) -> np.ndarray:
        """Corners (m) measured from the centroid."""
        return self.corners - self.centroid

    @cached_property
    def width(self) -> float:
        """Smallest width (m)."""
        return smallest_width(self.corners)

    @property
    def reach(self) -> float:
        """Distance (m) from the centroid to the farthest corner."""
        return float(np.hypot(*self.local.T).max())


def usual_size(blocks: Iterable[Block]) -> float:
    """Side (m) of the square with the median area of some blocks."""
    return float(np.sqrt(np.median([block.section.area for block in blocks])))


def usual_width(blocks: Iterable[Block]) -> float:
    """Median width (m) of the blocks that move."""
    return float(np.median([block.width for block in blocks if block.moves]))


def box(width: float, height: float, at=(0.0, 0.0), angle: float = 0.0) -> np.ndarray:
    """Corners of a box centred at `at`, turned by `angle` (degrees)."""
    half = 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    return half @ turn(np.radians(angle)).T + np.asarray(at, float)


def smallest_width(corners: np.ndarray) -> float:
    """Smallest width (m) over the directions of the edges between corners (m, 2)."""
    edge = np.roll(corners, -1, axis=0) - corners
    edge = edge[np.hypot(*edge.T) > 0]
    normal = np.stack([-edge[:, 1], edge[:, 0]]) / np.hypot(*edge.T)
    return float(np.ptp(corners @ normal, axis=0).min())


def turn(angle: float) -> np.ndarray:
    """Rotation matrix for an angle in rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


def check_convex(corners: np.ndarray) -> str | None:
    """What is wrong with corners (m, 2), three or more; None if nothing is."""
    edge = np.roll(corners, -1, axis=0) - corners
    length = np.hypot(*edge.T)
    if length.min() < 1e-6 * length.max():
        return "has two corners (almost) at the same place"
    x, y = edge.T
    bend = (x * np.roll(y, -1) - y * np.roll(x, -1)) / (length * np.roll(length, -1))
    if (bend <= 1e-9).any():
        return "must be convex and listed counter-clockwise, without three corners on a line"
    return None
