"""The narrow phase: which corners are over which edges, near them and in their range.

The range of a corner along an edge ends where what comes next is as deep: another corner that
takes over, or the next edge. So of the corners of two blocks that overlap the least deep are found.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..errors import Refused
from ..scene import Block
from .geometry import Contacts, Outlines, Points, evaluate
from .smoothing import CORNER

TILT = np.sin(np.radians(CORNER + 1.5))  # how far a side of a corner may dip below the edge
CARRIED = 0.5  # share of an overlap that some joint must see
ROUNDING = 1e-10  # m: corners stay until their depth is wrong by this, so that none chatters


class Found(NamedTuple):
    """Corners on edges (k,), their depth (m), and of their sides (2, k) the sine of the angle to
    the edge and the overlap with it (m)."""

    corner: np.ndarray
    edge: np.ndarray
    depth: np.ndarray
    rise: np.ndarray
    overlap: np.ndarray


class NarrowPhase:
    """Finds the corners over edges of pairs of blocks that are near each other.

    skin: largest gap, times 1.5 (m); max_overlap: largest depth as a share of the smaller block's
    width.
    """

    def __init__(
        self, blocks: Sequence[Block], outlines: Outlines, skin: float, max_overlap: float
    ) -> None:
        self.blocks, self.outlines, self.skin = blocks, outlines, skin
        sizes = np.array([len(block.corners) for block in blocks])
        place = np.arange(sizes.max())
        self._corners = np.where(place < sizes[:, None], outlines.start[:, None] + place, -1)
        self.depth_limit = max_overlap * np.array([b.width for b in blocks])

    def __call__(self, motion: np.ndarray, pairs: np.ndarray, known: Contacts) -> Found:
        """Corners between pairs (p, 2) of blocks; where two are equal, the known one is meant.

        Raises Refused for an overlap that is too deep, or that no corner sees.
        """
        x, y = np.concatenate([pairs, pairs[:, ::-1]]).T
        corner, edge = np.broadcast_arrays(
            self._corners[x][:, :, None], self._corners[y][:, None, :]
        )
        place, ways = self.outlines.place(motion)
        depth = ((place[corner] - place[edge]) * ways[edge].conj()).imag
        height = np.where(corner < 0, np.inf, -depth)
        apart = np.where(edge[:, 0] < 0, -np.inf, height.min(axis=1)).max(axis=1)
        limit = np.minimum(self.depth_limit[x], self.depth_limit[y])
        near = (height < 1.5 * self.skin) & (height > -1.5 * limit[:, None, None])
        near &= (corner >= 0) & (edge >= 0)
        which = np.nonzero(near)[0]
        corner, edge = corner[near], edge[near]
        contacts = known.at(corner, edge)
        points = evaluate(contacts, motion)
        ok = (points.rise > -TILT).all(axis=0) & (points.inside >= -ROUNDING).all(axis=0)
        _choose(contacts, points, ok, set(known.pairs()))
        n = len(pairs)
        seen = np.full(2 * n, -np.inf)
        np.maximum.at(seen, which[ok], points.closure[ok])
        true = -np.maximum(apart[:n], apart[n:])
        self._require_carried(pairs, true, np.maximum(seen[:n], seen[n:]), limit[:n])
        sides = points.rise[:, ok], points.overlap[:, ok]
        return Found(corner[ok], edge[ok], points.closure[ok], *sides)

    def _require_carried(self, pairs, true, seen, limit) -> None:
        if (deep := true > limit).any():
            self.refuse_overlap(pairs[deep.argmax()], true[deep.argmax()], limit[deep.argmax()])
        lost = (true > 0.25 * self.skin) & (seen < CARRIED * true)
        if lost.any():
            p = int(lost.argmax())
            one, other = (self.blocks[n].name for n in pairs[p])
            raise Refused(
                f"blocks {one!r} and {other!r} overlap by {true[p]:.3g} m where no corner is over "
                "an edge that faces it: start the blocks apart, or resume with a smaller step"
            )

    def refuse_overlap(self, pair, depth: float, limit: float) -> None:
        """Raise for an overlap beyond the limit."""
        one, other = (self.blocks[n].name for n in pair)
        raise Refused(
            f"blocks {one!r} and {other!r} overlap by {depth:.3g} m: must stay below {limit:.3g} m "
            "(a share of the smaller block's width); resume with a smaller step, or use stiffer "
            "joints, lower loads or speeds, a larger run.corner_length or run.max_overlap"
        )


def _choose(contacts: Contacts, points: Points, ok: np.ndarray, known: set) -> None:
    """Of two corners at the limit between them only one is meant: the one that was there."""
    edge = ok & (points.inside.min(axis=0) <= ROUNDING)
    if not edge.any():
        return
    here = contacts.pairs()
    corner, beyond, _ = what_is_next(contacts, points)
    rows = {here[i]: i for i in np.flatnonzero(edge).tolist()}
    for i in sorted(rows.values(), key=lambda i: here[i] not in known):
        other = rows.get((int(corner[i]), int(beyond[i])))
        if other is not None and ok[i]:
            ok[other] = False


def what_is_next(c: Contacts, points: Points):
    """Corner and edge that come next at the nearer limit of each corner's range, and whether the
    corner at the end of the edge takes over there."""
    side, k = points.inside.argmin(axis=0), np.arange(len(c.corner))
    trade = points.own[side, k]
    corner_there = np.where(side == 0, c.edge, c.outlines.next[c.edge])
    corner, edge = np.where(trade, corner_there, c.corner), c.behind[side, k]
    return corner, np.where(trade, c.sides[side, k], edge), trade
