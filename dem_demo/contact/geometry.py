"""Corners on edges: overlap, closure, sliding and contact length. Numpy only, no law, no pymunk.

A contact is a corner over the line of an edge of another block. Its closure is the depth of the
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

import numpy as np

from ..scene import Block

FACE, CORNER = 2.0, 5.0  # degrees: up to the first an edge lies on another, from the second not
TIE, EVEN = 1e-9, 1e-10  # sine of an angle, and m, up to which two are the same but for rounding
LEVEL = 1e-6  # sine of a tilt that is none, for corners past the limit of their range
_LOW, _HIGH = np.sin(np.radians([FACE, CORNER]))
_AHEAD = np.array([[1.0], [-1.0]])  # the sides of a corner: towards the edge's end, and its start
_END = np.array([[1.0], [0.0]])


class Outlines:
    """Corners of all blocks in one list: edge i starts at corner i and ends at corner next[i].

    local (c,): corners from the centroids; way (c,): directions of the edges; length (c,) of the
    edges; block, before, next (c,): numbers; number (c,): of each edge in its block; start
    (blocks,): first corner of each block. corner_length (m): of joint at a corner that stands on
    an edge; soft (m): over which the end of one edge gives way to that of another.
    """

    def __init__(self, blocks: Sequence[Block], corner_length: float, soft: float) -> None:
        self.corner_length, self.soft = corner_length, soft
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


class Contacts:
    """k corners on edges at a motion of the blocks; SI units, vectors complex.

    corner, edge (k,): numbers in the outlines; a, b (k,): their blocks, a < b.
    at (k,): place; normal (k,): from block a to block b; closure (k,): positive when pressed
    together; length (k,): of the joint that the contact stands for; pull (k,) vector and twist
    (k,): derivatives of the length by displacement (at the contact) and rotation of b relative to
    a; opening, sliding (k,): velocity of b relative to a along the normal and a quarter turn
    clockwise from it. Of the sides (2, k), the edges that meet at the corner: rise, sine of the
    angle to the edge; carried, length of joint of a side that lies on the edge (m); inside (m),
    what the corner is away from the limit behind it in terms of its depth; beyond it the next
    corner takes over if `own`, else the next edge.
    """

    def __init__(
        self, outlines: Outlines, corner: np.ndarray, edge: np.ndarray, motion: np.ndarray
    ) -> None:
        """Corners (k,) on edges (k,) for a motion (6, n) of the blocks."""
        self.outlines, self.corner, self.edge, o = outlines, corner, edge, outlines
        place, ways = o.place(motion)
        x, y = o.block[corner], o.block[edge]
        self.a, self.b = np.minimum(x, y), np.maximum(x, y)
        sign = np.where(x > y, 1.0, -1.0)
        self.sides = np.stack([o.before[corner], corner])
        self.behind = np.stack([o.before[edge], o.next[edge]])
        self.at, way = place[corner], ways[edge]
        frame = way.conj()
        here = (self.at - place[edge]) * frame  # in the frame of the edge: its block is on the left
        side = ways[self.sides] * (-_AHEAD * frame)
        rest = o.length[edge] * _END - here
        both = _AHEAD + side
        mean = both / np.maximum(np.abs(both), 1e-9)
        self.rise, level = -side.imag, _AHEAD * side.real
        overlap, pull, twist = _overlaps(rest, o.length[self.sides] * side, mean, o.soft)
        self.length, self.carried, pull, twist = _lengths(o, self.rise, level, overlap, pull, twist)
        self.pull, self.twist = sign * pull * way, sign * twist
        # Behind a corner its edge ends at another corner. Of what follows there, a side of this
        # corner or the next edge of the other block, the one that is turned less is next; the limit
        # is where both are equally deep. The raised end of an edge on an edge has its side next.
        # Drawn joints are parallel but for rounding, which must not choose: they count as parallel.
        beyond = _AHEAD * o.way[self.behind] / o.way[edge]
        self.own = (_AHEAD * (side.conj() * beyond).imag <= TIE) | (self.rise[::-1] < -TIE)
        toward = np.where(self.own, both, _AHEAD + beyond)
        self.inside = -(rest[::-1] * toward.conj()).real
        self.inside *= np.where(self.own, np.abs(self.rise) + LEVEL, 1.0)
        self.normal, self.closure = sign * (-1j * way), here.imag
        v = _velocity(motion, self.b, self.at) - _velocity(motion, self.a, self.at)
        v *= self.normal.conj()
        self.opening, self.sliding = v.real, -v.imag

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Corner and edge of each contact."""
        return list(zip(self.corner.tolist(), self.edge.tolist(), strict=True))

    @property
    def interfaces(self) -> np.ndarray:
        """Block, edge, block, edge (k, 4) that meet, the first block first.

        Of the two edges at a corner the flatter one counts.
        """
        o = self.outlines
        flatter = np.where(self.rise[0] < self.rise[1] - TIE, o.before[self.corner], self.corner)
        edges = np.sort([flatter, self.edge], axis=0)
        return np.stack([o.block[edges], o.number[edges]], axis=1).reshape(4, -1).T

    def following(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Corner and edge that come next at the nearer limit of each corner's range, and whether
        the corner at the end of the edge takes over there."""
        o, side, k = self.outlines, self.inside.argmin(axis=0), np.arange(len(self.corner))
        trade = self.own[side, k]
        there = np.where(side == 0, self.edge, o.next[self.edge])
        edge = np.where(trade, self.sides[side, k], self.behind[side, k])
        return np.where(trade, there, self.corner), edge, trade

    def assemble(self, motion: np.ndarray, push, shear, energy=0.0) -> np.ndarray:
        """Forces and torques (blocks, 3) at a motion (6, blocks).

        Block b is pushed by `push` (N) along the normal and by `shear` (N) in the sense of sliding,
        block a by the opposite at the same place; energy (J/m): stored per length.
        """
        force = (push - 1j * shear) * self.normal - energy * self.pull
        couple = energy * self.twist
        centre = motion[0] + 1j * motion[1]
        on_a, on_b = (((self.at - centre[x]).conj() * force).imag for x in (self.a, self.b))
        x, y = force.real, force.imag
        parts = np.concatenate([-x, x, -y, y, couple - on_a, on_b - couple])
        row = 3 * np.concatenate([self.a, self.b])
        place = np.concatenate([row, row + 1, row + 2])
        return np.bincount(place, parts, 3 * motion.shape[1]).reshape(-1, 3)


def _overlaps(rest, whole, mean, soft):
    """Overlap of each side with the edge (2, k), measured along the mean of both so that the blocks
    may trade roles; its derivatives by motion of the corner's block relative to the edge's.

    It runs from the corner or from what lies behind it, whichever comes later, to where the edge
    or the side ends, whichever comes first; within `soft` (m) of a tie the choice is gradual.
    """
    along = mean.conj()
    rest, whole = rest * along, whole * along
    back = rest[::-1] * (along * mean[::-1])
    size, slope = _soft_size(rest.real - whole.real, soft)
    step, rate = _soft_size(back.real, soft)
    overlap = 0.5 * (rest.real + whole.real - size - back.real - step)
    by_edge, by_end = 0.5 - 0.5 * slope, -0.5 - 0.5 * rate
    twist = by_edge * (rest.imag + whole.imag) + by_end * back.imag - whole.imag
    return overlap, -(by_edge + by_end) * mean, 0.5 * twist


def _lengths(o, rise, level, overlap, pull, twist):
    """Length of joint at the corners and that of each side, and the derivatives of the length by
    motion of the corner's block relative to the edge's."""
    up = rise > 0
    gone, bend = _raised(rise, level)
    held = np.maximum(overlap, 0.0)
    lies = 0.5 * (1 - gone) * (overlap > EVEN)
    stands = gone * up
    length = (lies * held).sum(axis=0) + o.corner_length * stands[0] * stands[1]
    # The tilt of the first side falls as the corner's block turns, that of the second rises.
    by_tilt = o.corner_length * up * stands[::-1] - 0.5 * held * np.sign(rise)
    twist = (lies * twist - _AHEAD * bend * by_tilt).sum(axis=0)
    return length, lies * held, (lies * pull).sum(axis=0), twist


def _raised(sine: np.ndarray, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """0 for an edge that lies on the other, 1 for one that does not, smooth between; and its
    derivative by the size of the tilt (1/rad). sine, cosine: of the tilt, any shape."""
    part = (np.abs(sine) - _LOW) / (_HIGH - _LOW)
    part = np.minimum(np.maximum(part, cosine <= 0), 1.0)
    return part * part * (3 - 2 * part), 6 / (_HIGH - _LOW) * part * (1 - part) * cosine


def _soft_size(x: np.ndarray, soft: float) -> tuple[np.ndarray, np.ndarray]:
    """|x| and its derivative, without the kink: differs from |x| only within `soft` of 0."""
    size = np.abs(x)
    part = np.minimum(size / soft, 1.0)
    return size * part * (2 - part), np.sign(x) * part * (4 - 3 * part)


def _velocity(motion, block, at):
    x, y, _, u, v, spin = motion
    return (u + 1j * v)[block] + 1j * spin[block] * (at - (x + 1j * y)[block])
