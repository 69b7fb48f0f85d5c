"""Convex blocks: their corners, and their area, mass and inertia as pymunk computes them."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pymunk

LENGTH_TOLERANCE = 1e-7  # of the size of a rock or scene: shorter distances count as zero
MIN_EDGE = 1e-6  # of the longest edge
MIN_BEND = 1e-9  # sine of the angle at a corner


@dataclass(frozen=True, eq=False)
class Block:
    """A rigid convex block of the scene, at its position at time 0.

    corners (m, 2) in m, counter-clockwise; density in kg/m3; load (2,) in N at the centroid;
    velocity (2,) in m/s, spin in rad/s. prescribed: motions ("x", "y", "turn") that follow a drive
    or are fixed; of a fixed block none, or all.
    """

    name: str
    corners: np.ndarray
    density: float
    fixed: bool = False
    velocity: tuple[float, float] = (0.0, 0.0)
    spin: float = 0.0
    load: tuple[float, float] = (0.0, 0.0)
    prescribed: tuple[str, ...] = ()

    @cached_property
    def section(self) -> pymunk.Poly:
        """The section with its area (m2), mass (kg) and moment of inertia (kg m2) per metre of
        thickness. Corners are relative to corner 0, so that a distant block loses no digits."""
        shape = pymunk.Poly(None, (self.corners - self.corners[0]).tolist())
        shape.density = self.density
        return shape

    @property
    def moves(self) -> bool:
        """Whether the block moves: freely, or as fixed rock that a drive moves."""
        return not self.fixed or bool(self.prescribed)

    @property
    def centroid(self) -> np.ndarray:
        """Centre of gravity (m)."""
        return self.corners[0] + self.section.center_of_gravity

    @property
    def local(self) -> np.ndarray:
        """Corners (m) relative to the centroid."""
        return self.corners - self.centroid

    @cached_property
    def width(self) -> float:
        """Smallest width (m)."""
        return smallest_width(self.corners)

    @property
    def reach(self) -> float:
        """Distance (m) from the centroid to the farthest corner."""
        return float(np.hypot(*self.local.T).max())


def median_size(blocks: Iterable[Block]) -> float:
    """Side (m) of the square with the median area of some blocks."""
    return float(np.sqrt(np.median([block.section.area for block in blocks])))


def median_width(blocks: Iterable[Block]) -> float:
    """Median width (m) of the blocks that move."""
    return float(np.median([block.width for block in blocks if block.moves]))


def box(width: float, height: float, at=(0.0, 0.0), angle: float = 0.0) -> np.ndarray:
    """Corners (4, 2) of a box (m) centred at `at` (m) and rotated by `angle` (degrees)."""
    half = 0.5 * np.array([[-width, -height], [width, -height], [width, height], [-width, height]])
    return half @ rotation(np.radians(angle)).T + np.asarray(at, float)


def smallest_width(corners: np.ndarray) -> float:
    """Smallest width (m) of a polygon, over the directions of the edges between corners (m, 2)."""
    edge = np.roll(corners, -1, axis=0) - corners
    edge = edge[np.hypot(*edge.T) > 0]
    normal = np.stack([-edge[:, 1], edge[:, 0]]) / np.hypot(*edge.T)
    return float(np.ptp(corners @ normal, axis=0).min())


def rotation(angle: float) -> np.ndarray:
    """Rotation matrix (2, 2) of an angle in rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def find_shape_error(corners: np.ndarray) -> str | None:
    """Describe why corners (m, 2), three or more, are no convex block; None if they are one."""
    edge = np.roll(corners, -1, axis=0) - corners
    length = np.hypot(*edge.T)
    if length.min() < MIN_EDGE * length.max():
        return "has two corners (almost) at the same place"
    x, y = edge.T
    bend = (x * np.roll(y, -1) - y * np.roll(x, -1)) / (length * np.roll(length, -1))
    if (bend <= MIN_BEND).any():
        return "must be convex and listed counter-clockwise, without three corners on a line"
    return None
