"""The contacts within reach: which corners are over which edges, and the identity of each.

The range of a corner along an edge ends where what comes next is as deep: another corner that
takes over, or the next edge. So of the corners of two blocks that overlap the least deep are found.

A contact is a number given when its corner came within reach of an edge. It keeps its number, and
with it its joint, while the corner slides along the edge, turns on it from one side of the block to
the next, or trades roles with another corner at the end of an edge. New contacts are looked for
only when something has moved far enough to matter; between such renewals the geometry is plain
arrays.
"""

from collections.abc import Iterable

import numpy as np

from ..errors import Refused
from ..scene import Key, Scene, smallest_width
from .geometry import CORNER, Contacts, Outlines

TILT = np.sin(np.radians(CORNER + 1.5))  # how far a side of a corner may dip below the edge
CARRIED = 0.5  # share of an overlap that some joint must see
ROUNDING = 1e-10  # m: corners stay until their depth is wrong by this, so that none chatters

Identity = tuple[Key, int]


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


class Tracker:
    """Follows the contacts of a scene.

    contacts: at the motion followed to, on corner and edge (k,); keys (k, 4): block, edge, block,
    edge of each when found; numbers (k,): their names for life; offset (k,): closure offset, the
    depth (m) that each had to give up (see `Simulation._transfer`); given: numbers given so far;
    renewed_at (3, blocks): motion when last renewed; urgent: must be renewed, whatever has moved.
    skin: pymunk reports pairs within 2 skins; a corner counts from a gap of 1 skin and is forgotten
    beyond 1.5 (m).
    """

    def __init__(self, scene: Scene, motion: np.ndarray) -> None:
        self.blocks = blocks = scene.blocks
        self.law_of, self.skin = scene.law_of, scene.run.skin
        self.outlines = Outlines(blocks, scene.run.corner_length, 0.25 * self.skin)
        sizes = np.array([len(block.corners) for block in blocks])
        place = np.arange(sizes.max())
        self._corners = np.where(place < sizes[:, None], self.outlines.start[:, None] + place, -1)
        self._deepest = scene.run.max_overlap * np.array(
            [smallest_width(b.corners) for b in blocks]
        )
        self._reach = np.array([block.reach for block in blocks])
        none = np.zeros(0, int)
        self.corner, self.edge, self.numbers, self.keys = none, none, none, none.reshape(0, 4)
        self.offset = np.zeros(0)
        self.given, self.renewed_at, self.urgent = 0, motion[:3].copy(), False
        self.place(motion)

    @property
    def identities(self) -> list[Identity]:
        """Key and number of every contact."""
        return list(zip(map(tuple, self.keys.tolist()), self.numbers.tolist(), strict=True))

    @property
    def closure(self) -> np.ndarray:
        """Closure (k,) that the joints see: the depth less the closure offset."""
        return self.contacts.closure - np.where(self.contacts.closure > 0, self.offset, 0.0)

    def stale(self, motion: np.ndarray) -> bool:
        """Has a block moved or turned so far that a corner could be missing?"""
        x, y, turned = motion[:3] - self.renewed_at
        moved = np.hypot(x, y) + np.abs(turned) * self._reach
        return self.urgent or bool(moved.max() > 0.25 * self.skin)

    def place(self, motion: np.ndarray) -> None:
        """The contacts at a motion (6, n), all on the same edges."""
        self.contacts = Contacts(self.outlines, self.corner, self.edge, motion)

    def follow(self, motion: np.ndarray) -> np.ndarray | None:
        """Bring the contacts to a motion (6, n), each to the corner and edge where it is by then.

        Corners that have left the range of their edge go on to what is next there. Returns the
        length (k,) of joint that each stood for before (m), or None if all stayed.
        """
        c = Contacts(self.outlines, self.corner, self.edge, motion)
        before = c.length if (c.inside < -ROUNDING).any() else None
        for _ in range(8):
            out = (c.inside < -ROUNDING).any(axis=0)
            if not out.any():
                break
            corner, edge, trade = c.following()
            there = np.where(out, corner, c.corner), np.where(out, edge, c.edge)
            c = Contacts(self.outlines, *there, motion)
            if len(set(c.pairs)) < len(self.numbers) or not trade[out].all():
                self.urgent = True  # there may be something new next to it
        self.contacts, self.corner, self.edge = c, c.corner, c.edge
        return before

    def renew(
        self, motion: np.ndarray, near: Iterable[tuple[int, int]], pressed: bool = True
    ) -> bool:
        """Look again at pymunk's pairs: has the list of contacts changed?

        Of new contacts that are pressed already, the closure counts (`pressed`, at the start of a
        run) or becomes their closure offset, so that they make no energy.
        """
        pairs = np.array(sorted(p for p in near if not all(self.blocks[n].fixed for n in p)), int)
        known: dict[tuple[int, int], int] = {}
        for i, who in enumerate(self.contacts.pairs):
            known.setdefault(who, i)
        found = self._found(motion, pairs.reshape(-1, 2), set(known))
        laws = [self.law_of(key) for key in found.interfaces.tolist()]
        mine, fresh, stay = [self.law_of(key) for key in self.keys.tolist()], [], []
        for i, who in enumerate(found.pairs):
            old = known.get(who)
            if old is not None and (found.closure[i] > 0 or mine[old] == laws[i]):
                stay.append((old, i))
            elif found.closure[i] > -self.skin:
                fresh.append(i)
        stay.sort()
        old, changed = [o for o, _ in stay], len(stay) < len(self.numbers) or bool(fresh)
        chosen = [i for _, i in stay] + fresh
        lost = np.maximum(found.closure[fresh], 0.0) * (not pressed)
        new = self.given + np.arange(len(fresh))
        self.keys = np.concatenate([self.keys[old], found.interfaces[fresh]]).astype(int)
        self.numbers = np.concatenate([self.numbers[old], new]).astype(int)
        self.offset = np.concatenate([self.offset[old], lost])
        self.corner, self.edge = found.corner[chosen], found.edge[chosen]
        self.place(motion)
        self.given, self.renewed_at, self.urgent = self.given + len(fresh), motion[:3].copy(), False
        return changed

    def between(self, one: int, other: int) -> np.ndarray:
        """Mask (k,) of the contacts between two blocks."""
        return (self.contacts.a == min(one, other)) & (self.contacts.b == max(one, other))

    def _found(self, motion: np.ndarray, pairs: np.ndarray, known: set) -> Contacts:
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
        limit = np.minimum(self._deepest[x], self._deepest[y])
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

    def require_shallow(self) -> None:
        """Refuse overlaps beyond run.max_overlap."""
        c = self.contacts
        pairs = np.stack([c.a, c.b], axis=1)
        self._require_depth(pairs, c.closure * (c.length > 0), self._deepest[pairs].min(axis=1))

    def _require_carried(self, pairs, true, seen, limit) -> None:
        self._require_depth(pairs, true, limit)
        lost = (true > 0.25 * self.skin) & (seen < CARRIED * true)
        if lost.any():
            p = int(lost.argmax())
            one, other = (self.blocks[n].name for n in pairs[p])
            raise Refused(
                f"blocks {one!r} and {other!r} overlap by {true[p]:.3g} m where no corner is over "
                "an edge that faces it: start the blocks apart, or resume with a smaller step"
            )

    def _require_depth(self, pairs, depth, limit) -> None:
        if (depth > limit).any():
            i = int((depth - limit).argmax())
            one, other = (self.blocks[n].name for n in pairs[i])
            raise Refused(
                f"blocks {one!r} and {other!r} overlap by {depth[i]:.3g} m: must stay below "
                f"{limit[i]:.3g} m (a share of the smaller block's width); resume with a smaller "
                "step, or use stiffer joints, lower loads or speeds, a larger run.corner_length or "
                "run.max_overlap"
            )
