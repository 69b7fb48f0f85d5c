"""The narrow phase: which corners are over which edges, near them and in their range.

The range of a corner along an edge ends where what comes next is as deep: another corner that
takes over, or the next edge. So of the corners of two blocks that overlap the least deep are found.
"""

from collections.abc import Sequence

import numpy as np

from ..errors import Refused
from ..scene import Block
from .geometry import CORNER, Contacts, Outlines

TILT = np.sin(np.radians(CORNER + 1.5))  # how far a side of a corner may dip below the edge
CARRIED = 0.5  # share of an overlap that some joint must see
ROUNDING = 1e-10  # m: corners stay until their depth is wrong by this, so that none chatters


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

    def __call__(self, motion: np.ndarray, pairs: np.ndarray, known: set) -> Contacts:
        """The contacts between pairs (p, 2) of blocks; where two are equal, the known one is meant.

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
        all_near = Contacts(self.outlines, corner[near], edge[near], motion)
        ok = _in_range(all_near, known)
        n = len(pairs)
        seen = np.full(2 * n, -np.inf)
        np.maximum.at(seen, which[ok], all_near.closure[ok])
        true = -np.maximum(apart[:n], apart[n:])
        self._require_carried(pairs, true, np.maximum(seen[:n], seen[n:]), limit[:n])
        return Contacts(self.outlines, all_near.corner[ok], all_near.edge[ok], motion)

    def require_shallow(self, contacts: Contacts) -> None:
        """Refuse overlaps beyond run.max_overlap."""
        pressed, pairs = contacts.closure * (contacts.length > 0), [contacts.a, contacts.b]
        limit = self.depth_limit[pairs].min(axis=0)
        if (pressed > limit).any():
            i = int((pressed - limit).argmax())
            self._refuse_overlap((contacts.a[i], contacts.b[i]), pressed[i], limit[i])

    def _require_carried(self, pairs, true, seen, limit) -> None:
        if (deep := true > limit).any():
            i = int(deep.argmax())
            self._refuse_overlap(pairs[i], true[i], limit[i])
        lost = (true > 0.25 * self.skin) & (seen < CARRIED * true)
        if lost.any():
            p = int(lost.argmax())
            one, other = (self.blocks[n].name for n in pairs[p])
            raise Refused(
                f"blocks {one!r} and {other!r} overlap by {true[p]:.3g} m where no corner is over "
                "an edge that faces it: start the blocks apart, or resume with a smaller step"
            )

    def _refuse_overlap(self, pair, depth: float, limit: float) -> None:
        one, other = (self.blocks[n].name for n in pair)
        raise Refused(
            f"blocks {one!r} and {other!r} overlap by {depth:.3g} m: must stay below {limit:.3g} m "
            "(a share of the smaller block's width); resume with a smaller step, or use stiffer "
            "joints, lower loads or speeds, a larger run.corner_length or run.max_overlap"
        )


def _in_range(contacts: Contacts, known: set) -> np.ndarray:
    """Which corners are in the range of their edge.

    Of two corners at the limit between them only one is meant: the one that was there.
    """
    ok = (contacts.rise > -TILT).all(axis=0) & (contacts.inside >= -ROUNDING).all(axis=0)
    at_limit = ok & (contacts.inside.min(axis=0) <= ROUNDING)
    here = contacts.pairs
    corner, beyond, _ = contacts.following()
    rows = {here[i]: i for i in np.flatnonzero(at_limit).tolist()}
    for i in sorted(rows.values(), key=lambda i: here[i] not in known):
        other = rows.get((int(corner[i]), int(beyond[i])))
        if other is not None and ok[i]:
            ok[other] = False
    return ok
