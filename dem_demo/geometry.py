"""Corners on edges: overlap, closure, sliding and contact length. Numpy only, no law, no pymunk.

A law point is a corner over the line of an edge of another block. Its closure is the depth of the
corner below that line, so closure, shear and force share one normal and the work of the force on
the blocks is the work done on the joint. Where two edges lie on each other, the ends of their
overlap are such corners, and each carries half of the overlap; a corner that stands on an edge
carries a fixed length. In between the length changes smoothly with the tilt, and wherever it
changes it carries energy: `pull` and `twist` are its derivatives, and minus the stored energy per
length times these acts on the blocks, so that no energy is made or lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .between import Between, interpolate
from .shapes import Block
from .tilt import raised, soft_size


class Outlines:
    """Corners of all blocks in one list: edge i starts at corner i and ends at corner next[i].

    local (2, c): corners from the centroids; way (2, c): unit vectors along the edges; length (c,)
    of the edges; block, before, next (c,): numbers.
    """

    def __init__(self, blocks: Sequence[Block]) -> None:
        sizes = np.array([len(block.corners) for block in blocks])
        self.start = np.cumsum(sizes) - sizes
        self.block = np.repeat(np.arange(len(blocks)), sizes)
        first, size = self.start[self.block], sizes[self.block]
        place = np.arange(len(first)) - first
        self.next, self.before = first + (place + 1) % size, first + (place - 1) % size
        self.local = np.concatenate([block.local for block in blocks]).T.copy()
        edge = self.local[:, self.next] - self.local
        self.length = np.hypot(*edge)
        self.way = edge / self.length

    def place(self, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners and unit vectors along edges, (2, c) each, where the blocks are."""
        c, s = np.cos(motion[2])[self.block], np.sin(motion[2])[self.block]
        x = motion[:2, self.block]
        x[0] += c * self.local[0] - s * self.local[1]
        x[1] += s * self.local[0] + c * self.local[1]
        return x, np.stack([c * self.way[0] - s * self.way[1], s * self.way[0] + c * self.way[1]])


class Contacts:
    """Law points: k corners on edges, then the points between the ends of long overlaps.

    corner, edge (k,): numbers in the outlines; spacing: largest distance of law points (m);
    corner_length (m): of a corner that stands on an edge. a, b (n,): blocks of all law points,
    a < b; weight (n,): share of an overlap that a point carries.
    """

    def __init__(
        self,
        outlines: Outlines,
        corner: np.ndarray,
        edge: np.ndarray,
        corner_length: float,
        soft: float,
        spacing: float = np.inf,
        between: Between | None = None,
    ) -> None:
        self.outlines, self.corner, self.edge = outlines, corner, edge
        self.corner_length, self.soft = corner_length, soft
        self.spacing, self.between = spacing, between
        self.end, self.back = outlines.next[edge], outlines.before[corner]
        x, y = outlines.block[corner], outlines.block[edge]
        self.sign = np.where(x > y, 1.0, -1.0)  # +1: the corner belongs to block b
        self.sides = np.stack([self.back, corner])  # the edges that meet at the corner
        self.size = outlines.length[self.sides]
        self.share = 0.5 / spans(np.minimum(self.size, outlines.length[edge]), spacing)
        self.a, self.b, self.weight = np.minimum(x, y), np.maximum(x, y), self.share.min(axis=0)
        if between is not None:
            self.a = np.concatenate([self.a, between.a])
            self.b = np.concatenate([self.b, between.b])
            self.weight = np.concatenate([self.weight, between.weight])

    def __len__(self) -> int:
        return len(self.a)

    def at(self, corner: np.ndarray, edge: np.ndarray) -> Contacts:
        """The same law points on other corners and edges."""
        rest = self.corner_length, self.soft, self.spacing, self.between
        return Contacts(self.outlines, corner, edge, *rest)


def spans(length: np.ndarray, spacing: float) -> np.ndarray:
    """Into how many parts of at most `spacing` a length (m) is cut."""
    return np.maximum(np.ceil(length / spacing - 1e-9), 1).astype(int)


@dataclass(frozen=True, eq=False)
class Points:
    """Law points: n of them, of which the first k are corners. SI units.

    at (2, n): place; normal (2, n): from block a to block b; tangent (2, n): a quarter turn
    clockwise from it; closure (n,): positive when pressed together; length (n,): of the joint that
    the point stands for; pull (2, n), twist (n,): derivatives of the length by displacement (at
    the point) and rotation of b relative to a; along (2, n): relative velocity of b to a along
    normal and tangent. For the sides of the corners, that to the end of the edge first: rise
    (2, k) sine of the angle to the edge; overlap (2, k); inside (2, k): how far the corner is from
    the limit behind it, beyond which the next corner takes over if `own`, else the next edge.
    """

    at: np.ndarray
    normal: np.ndarray
    tangent: np.ndarray
    closure: np.ndarray
    length: np.ndarray
    pull: np.ndarray
    twist: np.ndarray
    along: np.ndarray
    rise: np.ndarray
    overlap: np.ndarray
    inside: np.ndarray
    own: np.ndarray


def evaluate(contacts: Contacts, motion: np.ndarray) -> Points:
    """Law points for a motion (6, n) of the blocks."""
    c = contacts
    place, ways = c.outlines.place(motion)
    at, start, end = place[:, c.corner], place[:, c.edge], place[:, c.end]
    edge = ways[:, c.edge]
    out = np.stack([edge[1], -edge[0]])  # away from the edge's block
    closure = -_dot(at - start, out)
    # Two sides: from the corner to the end of the edge, and to its start. All (2, 2, k).
    way = np.stack([edge, -edge], axis=1)
    side = np.stack([-ways[:, c.back], ways[:, c.corner]], axis=1)
    rest = np.stack([end - at, start - at], axis=1)
    rise, level = _dot(side, out[:, None]), _dot(side, way)
    both = way + side
    mean = both / np.maximum(np.sqrt(_dot(both, both)), 1e-9)
    overlap, pull, twist = _overlaps(rest, c.size * side, mean, c.soft)
    length, pull, twist = _lengths(c, rise, level, mean, overlap, pull, twist)
    inside, own = _limits(c, ways, way, side, both, rest)
    normal = c.sign * out
    if c.between is not None:
        more = interpolate(c.between, place, ways, c.soft)
        at, normal, closure, length, pull, twist = (
            np.concatenate(pair, axis=-1)
            for pair in zip((at, normal, closure, length, pull, twist), more, strict=True)
        )
    tangent = np.stack([normal[1], -normal[0]])
    along = _slide(c, motion, at, normal, tangent)
    return Points(
        at, normal, tangent, closure, length, pull, twist, along, rise, overlap, inside, own
    )


def _overlaps(rest, whole, mean, soft):
    """Overlap of each side with the edge (2, k), measured along the mean of both so that the blocks
    may trade roles; its derivatives by motion of the corner's block relative to the edge's.

    It runs from the corner or from what lies behind it, whichever comes later, to where the edge
    or the side ends, whichever comes first; within `soft` (m) of a tie the choice is gradual.
    """
    far, near, behind = _dot(rest, mean), _dot(whole, mean), -_dot(rest[:, ::-1], mean)
    size, slope = soft_size(far - near, soft)
    step, rate = soft_size(behind, soft)
    overlap = 0.5 * (far + near - size + behind - step)
    by_edge, by_end = 0.5 * (1 - slope), 0.5 * (rate - 1)
    pull = mean * (-by_edge - by_end)
    twist = by_edge * _across(rest, mean) + by_end * _across(rest[:, ::-1], mean)
    return overlap, pull, 0.5 * (twist - (1 - by_edge) * _across(whole, mean))


def _lengths(c, rise, level, mean, overlap, pull, twist):
    """Length of joint at the corners, with its derivatives by motion of block b relative to a."""
    up = rise > 0
    gone, bend = raised(rise, level)
    lies = c.share * (1 - gone) * (overlap > 0)
    stands = gone * up
    length = (lies * overlap).sum(axis=0) + c.corner_length * stands[0] * stands[1]
    # The tilt of the first side falls as the corner's block turns, that of the second rises.
    by_tilt = -c.share * np.maximum(overlap, 0.0) * np.where(up, bend, -bend)
    by_tilt += c.corner_length * bend * up * stands[::-1]
    twist = (lies * twist).sum(axis=0) - by_tilt[0] + by_tilt[1]
    return length, c.sign * (lies * pull).sum(axis=1), c.sign * twist


def _limits(c, ways, way, side, both, rest):
    """Where the range of a corner along its edge ends: at equal depth under what comes next.

    Behind the corner (seen along a side) the edge ends at a corner of its own. Of what follows
    there, the side of the corner's block or the next edge, the one that is turned less is next.
    """
    o = c.outlines
    following = np.stack([ways[:, o.before[c.edge]], -ways[:, c.end]], axis=1)
    turned = side[0] * following[1] - side[1] * following[0]
    own = np.stack([turned[0] <= 0, turned[1] >= 0])
    toward = np.where(own, both, way + following)
    return -_dot(rest[:, ::-1], toward), own


def _dot(p, q):
    return p[0] * q[0] + p[1] * q[1]


def _across(r, t):
    """Of r (2, ...) across t, to its left."""
    return t[0] * r[1] - t[1] * r[0]


def _slide(c, motion, at, normal, tangent):
    """Relative velocity of b to a at the points, along normal and tangent."""
    A, B = motion[:, c.a], motion[:, c.b]
    u = B[3] - A[3] - B[5] * (at[1] - B[1]) + A[5] * (at[1] - A[1])
    v = B[4] - A[4] + B[5] * (at[0] - B[0]) - A[5] * (at[0] - A[0])
    return np.stack([u * normal[0] + v * normal[1], u * tangent[0] + v * tangent[1]])


class Assembly:
    """Sums forces at the law points into forces and torques of the blocks."""

    def __init__(self, a: np.ndarray, b: np.ndarray, blocks: int) -> None:
        self.a, self.b, self.blocks = a, b, blocks
        one = np.concatenate([3 * a, 3 * b])
        self._slot = np.concatenate([one, one + 1, one + 2])

    def __call__(self, points: Points, push, drag, energy=None) -> np.ndarray:
        """Forces (n, 3) on the blocks; b is pushed by `push` along the normal, `drag` along the
        tangent (N), a by the opposite at the same place; energy (J/m) stored per contact length."""
        fx = push * points.normal[0] + drag * points.tangent[0]
        fy = push * points.normal[1] + drag * points.tangent[1]
        couple = np.zeros(len(fx))
        if energy is not None:
            fx, fy = fx - energy * points.pull[0], fy - energy * points.pull[1]
            couple = -energy * points.twist
        return np.bincount(
            self._slot, np.concatenate(self._parts(points.at, fx, fy, couple)), 3 * self.blocks
        ).reshape(-1, 3)

    def _parts(self, at, fx, fy, couple):
        xa, xb = self.centre_a, self.centre_b
        return (
            -fx, fx, -fy, fy,
            (at[1] - xa[1]) * fx - (at[0] - xa[0]) * fy - couple,
            (at[0] - xb[0]) * fy - (at[1] - xb[1]) * fx + couple,
        )  # fmt: skip

    def move(self, motion: np.ndarray) -> None:
        """Take the centroids from which torques are counted."""
        self.centre_a, self.centre_b = motion[:2, self.a], motion[:2, self.b]
