"""Corners on edges: overlap, closure, sliding and contact length. Numpy only, no law, no pymunk.

A law point is a corner over the line of an edge of another block. Its closure is the depth of the
corner below that line, so closure, shear and force share one normal and the work of the force on
the blocks is the work done on the joint. Where two edges lie on each other, the ends of their
overlap are such corners, and each carries half of the overlap; a corner that stands on an edge
carries a fixed length. In between the length changes smoothly with the tilt, and wherever it
changes it carries energy: `pull` and `twist` are its derivatives, and minus the stored energy per
length times these acts on the blocks, so that no energy is made or lost.

Vectors are complex numbers x + iy: conj(p) q holds their dot product and their cross product, and
dividing by the direction of an edge takes all into its frame.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..scene import Block
from .edge_points import EdgePoints, interpolate, spans
from .smoothing import raised, soft_size

LEVEL = 1e-6  # sine of a tilt that is none, for corners past the limit of their range
_AHEAD = np.array([[1.0], [-1.0]])  # the sides of a corner: towards the edge's end, and its start


class Outlines:
    """Corners of all blocks in one list: edge i starts at corner i and ends at corner next[i].

    local (c,): corners from the centroids; way (c,): directions of the edges; length (c,) of the
    edges; block, before, next (c,): numbers; number (c,): of each edge in its block; start
    (blocks,): first corner of each block.
    """

    def __init__(self, blocks: Sequence[Block]) -> None:
        sizes = np.array([len(block.corners) for block in blocks])
        self.start = np.cumsum(sizes) - sizes
        self.block = np.repeat(np.arange(len(blocks)), sizes)
        first, size = self.start[self.block], sizes[self.block]
        self.number = np.arange(len(first)) - first
        self.next, self.before = first + (self.number + 1) % size, first + (self.number - 1) % size
        self.local = np.concatenate([block.local for block in blocks]) @ [1, 1j]
        edge = self.local[self.next] - self.local
        self.length = np.abs(edge)
        self.way = edge / self.length

    def place(self, motion: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Corners and directions of edges (c,) for a motion (6, n) of the blocks."""
        turn = np.exp(1j * motion[2])[self.block]
        return (motion[0] + 1j * motion[1])[self.block] + turn * self.local, turn * self.way

    def flatter(self, corner: np.ndarray, rise: np.ndarray) -> np.ndarray:
        """The edge at each corner (k,) that lies flatter; rise (2, k) as in `Points`."""
        return np.where(rise[0] < rise[1], self.before[corner], corner)

    def interfaces(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """Block, edge, block, edge (k, 4) of edges (k,) that meet, the first block first."""
        edges = np.sort([one, other], axis=0)
        return np.stack([self.block[edges], self.number[edges]], axis=1).reshape(4, -1).T


class Contacts:
    """Law points: k corners on edges, then the points along the edges of long overlaps.

    corner, edge (k,): numbers in the outlines; corner_length (m): of a corner that stands on an
    edge; soft (m): over which the end of an edge takes over from another; spacing: largest distance
    of law points (m). a, b (n,): blocks of all law points, a < b; weight (n,): share of an overlap
    that a point carries.
    """

    def __init__(
        self,
        outlines: Outlines,
        corner: np.ndarray,
        edge: np.ndarray,
        corner_length: float,
        soft: float,
        spacing: float = np.inf,
        along: EdgePoints | None = None,
    ) -> None:
        self.outlines, self.corner, self.edge = outlines, corner, edge
        self.corner_length, self.soft = corner_length, soft
        self.spacing, self.along = spacing, along
        o = outlines
        x, y = o.block[corner], o.block[edge]
        self.sign = np.where(x > y, 1.0, -1.0)  # +1: the corner belongs to block b
        self.sides = np.stack([o.before[corner], corner])  # the edges that meet at the corner
        self.size, self.length = o.length[self.sides], o.length[edge]
        # In the frame of the edge: its end and start, and the edges beyond, behind each side.
        self.ends = self.length * np.array([[1.0], [0.0]])
        self.behind = np.stack([o.before[edge], o.next[edge]])
        self.following = _AHEAD * o.way[self.behind] / o.way[edge]
        self.share = 0.5 / spans(np.minimum(self.size, self.length), spacing)
        self.a, self.b, self.weight = np.minimum(x, y), np.maximum(x, y), self.share.min(axis=0)
        if along is not None:
            self.a = np.concatenate([self.a, along.a])
            self.b = np.concatenate([self.b, along.b])
            self.weight = np.concatenate([self.weight, along.weight])

    def __len__(self) -> int:
        return len(self.a)

    def at(
        self, corner: np.ndarray, edge: np.ndarray, along: EdgePoints | None = None
    ) -> "Contacts":
        """Law points on other corners and edges, all else the same."""
        rest = self.corner_length, self.soft, self.spacing, along
        return Contacts(self.outlines, corner, edge, *rest)

    def pairs(self) -> list[tuple[int, int]]:
        """Corner and edge of each of the k corners."""
        return list(zip(self.corner.tolist(), self.edge.tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class Points:
    """Law points: n of them, of which the first k are corners. SI units, vectors complex.

    at (n,): place; normal (n,): from block a to block b; closure (n,): positive when pressed
    together; length (n,): of the joint that the point stands for; pull (n,) vector and twist (n,):
    derivatives of the length by displacement (at the point) and rotation of b relative to a;
    opening, sliding (n,): velocity of b relative to a along the normal and a quarter turn
    clockwise from it. Of the sides (2, k): rise, sine of the angle to the edge; overlap (m);
    inside (m), what the corner is away from the limit behind it in terms of its depth; beyond it
    the next corner takes over if `own`, else the next edge.
    """

    at: np.ndarray
    normal: np.ndarray
    closure: np.ndarray
    length: np.ndarray
    pull: np.ndarray
    twist: np.ndarray
    opening: np.ndarray
    sliding: np.ndarray
    rise: np.ndarray
    overlap: np.ndarray
    inside: np.ndarray
    own: np.ndarray


def evaluate(contacts: Contacts, motion: np.ndarray) -> Points:
    """Law points for a motion (6, n) of the blocks."""
    c = contacts
    place, ways = c.outlines.place(motion)
    at, edge = place[c.corner], ways[c.edge]
    frame = edge.conj()
    here = (at - place[c.edge]) * frame  # in the frame of the edge: its block is on the left
    side = ways[c.sides] * (-_AHEAD * frame)
    rest = c.ends - here
    both = _AHEAD + side
    mean = both / np.maximum(np.abs(both), 1e-9)
    rise, level = -side.imag, _AHEAD * side.real
    overlap, pull, twist = _overlaps(rest, c.size * side, mean, c.soft)
    length, pull, twist = _lengths(c, rise, level, overlap, pull, twist)
    # Behind a corner its edge ends at another corner. Of what follows there, a side of this corner
    # or the next edge of the other block, the one that is turned less is next; the limit is where
    # both are equally deep. The raised end of an edge on an edge has its side next.
    own = (_AHEAD * (side.conj() * c.following).imag <= 0) | (rise[::-1] < 0)
    toward = np.where(own, both, _AHEAD + c.following)
    inside = -(rest[::-1] * toward.conj()).real
    inside *= np.where(own, np.abs(rise) + LEVEL, 1.0)
    normal, closure, pull = c.sign * (-1j * edge), here.imag, pull * edge
    if c.along is not None:
        more = interpolate(c.along, place, ways, c.soft)
        at, normal, closure, length, pull, twist = (
            np.concatenate(pair)
            for pair in zip((at, normal, closure, length, pull, twist), more, strict=True)
        )
    v = _velocity(motion, c.b, at) - _velocity(motion, c.a, at)
    v *= normal.conj()
    return Points(
        at, normal, closure, length, pull, twist, v.real, -v.imag, rise, overlap, inside, own
    )


def _overlaps(rest, whole, mean, soft):
    """Overlap of each side with the edge (2, k), measured along the mean of both so that the blocks
    may trade roles; its derivatives by motion of the corner's block relative to the edge's.

    It runs from the corner or from what lies behind it, whichever comes later, to where the edge
    or the side ends, whichever comes first; within `soft` (m) of a tie the choice is gradual.
    """
    along = mean.conj()
    rest, whole = rest * along, whole * along
    back = rest[::-1] * (along * mean[::-1])
    size, slope = soft_size(rest.real - whole.real, soft)
    step, rate = soft_size(back.real, soft)
    overlap = 0.5 * (rest.real + whole.real - size - back.real - step)
    by_edge, by_end = 0.5 - 0.5 * slope, -0.5 - 0.5 * rate
    twist = by_edge * (rest.imag + whole.imag) + by_end * back.imag - whole.imag
    return overlap, -(by_edge + by_end) * mean, 0.5 * twist


def _lengths(c, rise, level, overlap, pull, twist):
    """Length of joint at the corners, with its derivatives by motion of block b relative to a."""
    up = rise > 0
    gone, bend = raised(rise, level)
    held = np.maximum(overlap, 0.0)
    lies = c.share * (1 - gone) * (overlap > 0)
    stands = gone * up
    length = (lies * held).sum(axis=0) + c.corner_length * stands[0] * stands[1]
    # The tilt of the first side falls as the corner's block turns, that of the second rises.
    by_tilt = c.corner_length * up * stands[::-1] - c.share * held * np.sign(rise)
    twist = (lies * twist - _AHEAD * bend * by_tilt).sum(axis=0)
    return length, c.sign * (lies * pull).sum(axis=0), c.sign * twist


def _velocity(motion, block, at):
    x, y, _, u, v, spin = motion
    return (u + 1j * v)[block] + 1j * spin[block] * (at - (x + 1j * y)[block])


class Assembly:
    """Sums forces at the law points into forces and torques of the blocks.

    a, b (n,): blocks of the law points; blocks: how many there are.
    """

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
