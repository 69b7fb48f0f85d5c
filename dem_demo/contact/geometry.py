"""Corners on edges: overlap, closure, sliding and contact length. No law, no pymunk.

A contact is a corner over the line of an edge of another block. Its closure is the depth of the
corner below that line, so closure, shear and force share one normal and the work of the force on
the blocks is the work done on the joint. Where two edges lie on each other, the ends of their
overlap are such corners, and each carries half of the overlap; a corner that stands on an edge
carries a fixed length. In between the length changes smoothly with the tilt, and wherever it
changes it carries energy: `pull` and `twist` are its derivatives, and minus the stored energy per
length times these acts on the blocks, so that no energy is made or lost.

`jointlaw/native/blocks.c` works it out. Vectors are complex numbers x + iy here: conj(p) q holds
their dot product and their cross product.
"""

from collections.abc import Sequence

import numpy as np

from ..compiled import World, address
from ..scene import Block

TIE = 1e-9  # sine of an angle that is none but for rounding, as in blocks.c


class Outlines:
    """Corners of all blocks in one list: edge i starts at corner i and ends at corner after[i].

    local (c,): corners from the centroids; way (c,): directions of the edges; side (c,): their
    lengths; block, before, after (c,): numbers; start (blocks + 1,): first corner of each block,
    and c. corner_length (m): of joint at a corner that stands on an edge; soft (m): over which the
    end of one edge gives way to that of another.
    """

    def __init__(self, blocks: Sequence[Block], corner_length: float, soft: float) -> None:
        self.corner_length, self.soft = corner_length, soft
        sizes = np.array([len(block.corners) for block in blocks])
        self.start = np.concatenate([[0], np.cumsum(sizes)])
        self.block = np.repeat(np.arange(len(blocks)), sizes)
        each = np.split(np.arange(self.start[-1]), self.start[1:-1])
        self.after, self.before = (
            np.concatenate([np.roll(corners, by) for corners in each]) for by in (-1, 1)
        )
        self.local = np.concatenate([block.local for block in blocks]) @ [1, 1j]
        edge = self.local[self.after] - self.local
        self.side = np.abs(edge)
        self.way = edge / self.side
        self.placed, self.turned = np.empty((2, len(edge)), complex)  # corners and ways now

    def world(self, motion: np.ndarray, contacts: int = 0) -> World:
        """What the compiled step knows of them at a motion (6, n), and of how many contacts."""
        world = World(blocks=len(self.start) - 1, corners=len(self.block), contacts=contacts,
                      corner_length=self.corner_length, soft=self.soft)  # fmt: skip
        world.bind(self, "local", "way", "side", "block", "before", "after", "placed", "turned",
                   motion=np.ascontiguousarray(motion, float))  # fmt: skip
        return world


class Contacts:
    """k corners on edges at a motion of the blocks; SI units, vectors complex.

    corner, edge (k,): numbers in the outlines; a, b (k,): their blocks, a < b.
    at (k,): place; normal (k,): from block a to block b; closure (k,): positive when pressed
    together; length (k,): of the joint that the contact stands for; was (k,): the same before
    corners went on to other edges, when last followed; pull (k,) vector and twist (k,): derivatives
    of the length by displacement (at the contact) and rotation of b relative to a; opening, sliding
    (k,): velocity of b relative to a along the normal and a quarter turn clockwise from it. Of the
    sides (2, k), the edges that meet at the corner: rise, sine of the angle to the edge; carried,
    length of joint of a side that lies on the edge (m); inside (m), what the corner is away from
    the limit behind it in terms of its depth; beyond it the next corner takes over if `own`, else
    the next edge.
    """

    def __init__(
        self, outlines: Outlines, corner: np.ndarray, edge: np.ndarray, motion: np.ndarray
    ) -> None:
        """Corners (k,) on edges (k,) for a motion (6, n) of the blocks."""
        self.outlines, k = outlines, len(corner)
        self.corner, self.edge = np.array(corner, np.int64), np.array(edge, np.int64)
        self.a, self.b, out = np.empty((3, k), np.int64)
        self.at, self.normal, self.pull = np.empty((3, k), complex)
        self.closure, self.length, self.was, self.twist, self.opening, self.sliding = np.empty(
            (6, k)
        )
        self.rise, self.carried, self.inside = np.empty((3, 2, k))
        self.own = np.empty((2, k), bool)
        arrays = {name: a for name, a in vars(self).items() if isinstance(a, np.ndarray)}
        self.world = outlines.world(motion, k)
        self.world.bind(**arrays, out=out)
        self.world.call("place")

    @property
    def codes(self) -> np.ndarray:
        """One number (k,) for corner and edge of each contact."""
        return self.corner * len(self.outlines.block) + self.edge

    @property
    def way(self) -> np.ndarray:
        """Directions (k,) of the edges."""
        return self.outlines.turned[self.edge]

    @property
    def edges(self) -> np.ndarray:
        """The edges (k, 2) that meet, in the order of their blocks: of the two at a corner the
        flatter one counts."""
        flatter = np.where(
            self.rise[0] < self.rise[1] - TIE, self.outlines.before[self.corner], self.corner
        )
        return np.sort([flatter, self.edge], axis=0).T

    def following(self) -> np.ndarray:
        """One number (k,), as in `codes`, for what comes next at the nearer limit of each range."""
        corner, edge = np.empty((2, len(self.corner)), np.int64)
        self.world.call("following", address(corner), address(edge))
        return corner * len(self.outlines.block) + edge

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
        place = (3 * np.concatenate([self.a, self.b]) + np.arange(3)[:, None]).ravel()
        return np.bincount(place, parts, 3 * motion.shape[1]).reshape(-1, 3)
