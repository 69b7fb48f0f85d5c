"""Edge against edge: overlap, closure and sliding at the law points. Numpy only, no law, no pymunk.

Each end of an overlap is a corner of one edge over the line of the other. The closure there is
the depth of that corner below that line, so closure, shear and force share one normal and the work
of the force on the blocks is the work done on the joint.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class Edges:
    """Interfaces as arrays: m pairs of edges, edge A of block `first`, edge B of `second`.

    corners (2, 4 m): start and end of edge A, start and end of edge B, each from its block's
    centroid; length (m,) of edge A; inner (list of law points between the two ends) as interface
    numbers `inner_of` with their fractions `inner_at` along the overlap; weight (k,): share of the
    overlap length that each law point carries.
    """

    first: np.ndarray
    second: np.ndarray
    corners: np.ndarray
    length: np.ndarray
    inner_of: np.ndarray
    inner_at: np.ndarray
    weight: np.ndarray

    def __post_init__(self) -> None:
        m = len(self.first)
        set_ = object.__setattr__
        set_(self, "corner_block", np.repeat([self.first, self.second], 2, axis=0).ravel())
        of = np.concatenate([np.arange(m), np.arange(m), self.inner_of])
        set_(self, "of", of)  # interface of each law point
        set_(self, "a", self.first[of])
        set_(self, "b", self.second[of])


@dataclass(frozen=True, eq=False)
class Points:
    """Law points: k = 2 m ends, then the points between. All arrays (k,) or (2, k), SI units.

    at: place; normal: from block A to block B; tangent: a quarter turn clockwise from it; closure:
    positive when pressed together; length: share of the overlap; tilt (m,): angle between the two
    edges in rad; along (2, k): relative velocity of B to A along normal and tangent.
    """

    at: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    closure: np.ndarray
    length: np.ndarray
    tilt: np.ndarray
    along: np.ndarray


def evaluate(edges: Edges, motion: np.ndarray) -> Points:
    """Law points of the interfaces for a motion (6, n) of the blocks."""
    m = len(edges.first)
    place = place_corners(edges.corners, edges.corner_block, motion)
    a0, a1, b0, b1 = place[:, :m], place[:, m : 2 * m], place[:, 2 * m : 3 * m], place[:, 3 * m :]
    ta = (a1 - a0) / edges.length
    tb = b1 - b0
    tb /= np.sqrt(tb[0] * tb[0] + tb[1] * tb[1])
    tilt = ta[1] * tb[0] - ta[0] * tb[1]  # the edges run in opposite senses
    # Ends: 0 at the start of A (end of B), 1 at the end of A (start of B).
    corner_a, corner_b = place[:, : 2 * m], np.concatenate([b1, b0], axis=1)
    d = corner_b - corner_a
    t = ta - tb  # along both, so that the blocks may trade roles
    t /= np.sqrt(t[0] * t[0] + t[1] * t[1])
    span = (a1[0] - a0[0]) * t[0] + (a1[1] - a0[1]) * t[1]
    inside = d * np.concatenate([t, -t], axis=1)
    inside = inside[0] + inside[1]
    length = span - np.maximum(inside[:m], 0) - np.maximum(inside[m:], 0)
    by_b = inside > 0  # corner of B over edge A, else corner of A over edge B
    facing = np.array([[ta[1], -ta[0]], [-tb[1], tb[0]]])
    normal = np.where(by_b, *np.concatenate([facing, facing], axis=2))
    closure = -(d[0] * normal[0] + d[1] * normal[1])
    at = np.where(by_b, corner_b, corner_a)
    if len(edges.inner_of):
        at, normal, closure = _with_inner(edges, at, normal, closure)
    tangent = np.stack([normal[1], -normal[0]])
    along = _slide(edges, motion, at, normal, tangent)
    share = np.maximum(length, 0.0)[edges.of] * edges.weight
    return Points(at, normal, tangent, closure, share, tilt, along)


def place_corners(local: np.ndarray, block: np.ndarray, motion: np.ndarray) -> np.ndarray:
    """Corners (2, k), given from the centroids, in the places where their blocks are."""
    c, s = np.cos(motion[2])[block], np.sin(motion[2])[block]
    x = motion[:2, block]
    x[0] += c * local[0] - s * local[1]
    x[1] += s * local[0] + c * local[1]
    return x


def _with_inner(edges, at, normal, closure):
    """Add the points between the ends, by linear interpolation."""
    lo, hi = edges.inner_of, edges.inner_of + len(edges.first)
    f = edges.inner_at
    between = (1 - f) * normal[:, lo] + f * normal[:, hi]
    between /= np.sqrt(between[0] ** 2 + between[1] ** 2)
    at = np.concatenate([at, (1 - f) * at[:, lo] + f * at[:, hi]], axis=1)
    closure = np.concatenate([closure, (1 - f) * closure[lo] + f * closure[hi]])
    return at, np.concatenate([normal, between], axis=1), closure


def _slide(edges, motion, at, normal, tangent):
    """Relative velocity of B to A at the points, along normal and tangent."""
    A, B = motion[:, edges.a], motion[:, edges.b]
    u = B[3] - A[3] - B[5] * (at[1] - B[1]) + A[5] * (at[1] - A[1])
    v = B[4] - A[4] + B[5] * (at[0] - B[0]) - A[5] * (at[0] - A[0])
    return np.stack([u * normal[0] + v * normal[1], u * tangent[0] + v * tangent[1]])


class Assembly:
    """Sums forces at the law points into forces and torques of the blocks."""

    def __init__(self, edges: Edges, blocks: int) -> None:
        self.edges, self.blocks = edges, blocks
        one = np.concatenate([3 * edges.a, 3 * edges.b])
        self._slot = np.concatenate([one, one + 1, one + 2])

    def __call__(self, points: Points, push: np.ndarray, drag: np.ndarray) -> np.ndarray:
        """Forces (n, 3) on the blocks; B is pushed by `push` along the normal, `drag` along the
        tangent (N), A by the opposite at the same place."""
        fx = push * points.normal[0] + drag * points.tangent[0]
        fy = push * points.normal[1] + drag * points.tangent[1]
        return np.bincount(
            self._slot, np.concatenate(self._parts(points.at, fx, fy)), 3 * self.blocks
        ).reshape(-1, 3)

    def _parts(self, at, fx, fy):
        xa, xb = self.centre_a, self.centre_b
        return (
            -fx, fx, -fy, fy,
            (at[1] - xa[1]) * fx - (at[0] - xa[0]) * fy,
            (at[0] - xb[0]) * fy - (at[1] - xb[1]) * fx,
        )  # fmt: skip

    def move(self, motion: np.ndarray) -> None:
        """Take the centroids from which torques are counted."""
        self.centre_a, self.centre_b = motion[:2, self.edges.a], motion[:2, self.edges.b]
