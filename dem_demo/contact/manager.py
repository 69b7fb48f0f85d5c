"""The contacts within reach: which corners are over which edges, and the identity of each.

The range of a corner along an edge ends where what comes next is as deep: another corner that
takes over, or the next edge. So of the corners of two blocks that overlap the least deep are found.

A contact begins when a corner comes within reach of an edge. It keeps its joint while the corner
slides along the edge, turns on it from one side of the block to the next, or trades roles with
another corner at the end of an edge. New contacts are looked for only next to blocks that have
moved far enough to matter; between such renewals the geometry is plain arrays.
"""

import numpy as np

from ..compiled import address
from ..scene import Scene, SceneError
from .geometry import Contacts, Outlines

TILT = np.sin(np.radians(6.5))  # how far a side of a corner may dip below the edge
CARRIED = 0.5  # share of an overlap that some joint must see
ROUNDING = 1e-10  # m: corners stay until their depth is wrong by this, so that none chatters
STALE = 0.25  # share of its skin that a block may move until its contacts are looked for
SEEN = 0.001  # of its skin: who has moved less keeps its contacts when others are looked for


def _in_range(contacts: Contacts, known: np.ndarray) -> np.ndarray:
    """Which corners are in the range of their edge; known (k,): was it there before?

    Of two corners at the limit between them only one is meant: the one that was there.
    """
    ok = (contacts.rise > -TILT).all(axis=0) & (contacts.inside >= -ROUNDING).all(axis=0)
    here = np.flatnonzero(ok & (contacts.inside.min(axis=0) <= ROUNDING))
    at_limit = dict(zip(contacts.codes[here].tolist(), here.tolist(), strict=True))
    first, meant = here[np.argsort(~known[here], kind="stable")], ok.tolist()
    for i, beyond in zip(first.tolist(), contacts.following()[first].tolist(), strict=True):
        if beyond in at_limit:
            meant[at_limit[beyond]] &= not meant[i]
    return np.array(meant, bool)


class ContactManager:
    """Follows the contacts of a scene.

    contacts: at the motion followed to, on corner and edge (k,); keys (k, 2): edges that met when
    found; law (k,): number of the law between these; offset (k,): closure offset (m): above zero
    the depth that a contact had to give up (see `Simulation._transfer`), until it opens; below zero
    less the closure from the stress of before, for life; renewed_at (3, blocks): motion when the
    contacts of each block were last looked for; urgent (blocks,): must be looked for, wherever the
    block is.
    skins (blocks,): pymunk reports pairs within the sum of their skins; a corner counts from a gap
    of the mean and is forgotten beyond 1.5 of it (m).
    """

    def __init__(self, scene: Scene, motion: np.ndarray) -> None:
        self.blocks = blocks = scene.blocks
        self.skins = scene.skins
        self.outlines = Outlines(blocks, scene.run.corner_length, scene.run.soft)
        self.deepest = scene.run.max_overlap * np.array([block.width for block in blocks])
        self.reach = np.array([block.reach for block in blocks])
        self.fixed = np.array([block.fixed for block in blocks])
        number = {name: i for i, name in enumerate(scene.laws)}
        self._default, start = number[scene.default_law], self.outlines.start
        self._of_edge = np.full(start[-1], -1)
        for (block, edge), law in scene.edge_laws.items():
            self._of_edge[start[block] + edge] = number[law]
        # for the second block of a contact, for its first, and for both: later ones overrule
        self._of_blocks = [
            (sides, sorted(meant), number[law])
            for sides in ([1], [0], [0, 1])
            for meant, law in scene.pairs.items()
            if len(meant) == len(sides)
        ]
        none = np.zeros(0, int)
        self.law, self.keys, self.offset = none, none.reshape(0, 2), np.zeros(0)
        self.urgent = np.zeros(len(blocks), bool)
        self.renewed_at = np.full((3, len(blocks)), np.nan)  # never
        self.contacts = Contacts(self.outlines, none, none, motion)

    @property
    def closure(self) -> np.ndarray:
        """Closure (k,) that the joints see: the depth less the closure offset."""
        counts = (self.contacts.closure > 0) | (self.offset < 0)
        return self.contacts.closure - np.where(counts, self.offset, 0.0)

    def follow(self, motion: np.ndarray) -> None:
        """Bring the contacts to a motion (6, n), each to the corner and edge where it is by then.

        Corners that have left the range of their edge go on to what is next there.
        """
        self.contacts.world.bind(motion=motion, urgent=self.urgent)
        self.contacts.world.call("follow")

    def renew(self, motion: np.ndarray, near: np.ndarray, pressed: bool = True) -> np.ndarray:
        """Look again at the pairs (p, 2) of near blocks of which one has moved.

        Of new contacts that are pressed already, the closure counts (`pressed`, at the start of a
        run) or becomes their closure offset, so that they make no energy. Returns for each contact
        its place (k,) in the list before, -1 for a new one.
        """
        x, y, turned = motion[:3] - self.renewed_at
        moved = np.hypot(x, y) + np.abs(turned) * self.reach
        which = self.urgent | ~(moved <= SEEN * self.skins)
        self.renewed_at[:, which], self.urgent[:] = motion[:3, which], False
        pairs = near[which[near].any(axis=1) & ~self.fixed[near].all(axis=1)]
        now, k = self.contacts, len(self.law)
        asked = np.flatnonzero(which[now.a] | which[now.b])
        found, keys = self._found(motion, pairs, now.codes[asked])
        _, again, place = np.intersect1d(found.codes, now.codes[asked], return_indices=True)
        old = np.full(len(keys), -1)
        old[again] = asked[place]
        law = self.laws_of(keys)
        stays = (old >= 0) & ((found.closure > 0) | (np.append(self.law, -1)[old] == law))
        fresh = ~stays & (found.closure > -self._skin(found.a, found.b))
        gone = np.setdiff1d(asked, old[stays], assume_unique=True)
        rows = np.setdiff1d(np.arange(k), gone, assume_unique=True)
        if len(rows) == k and not fresh.any():
            return rows
        lost = np.maximum(found.closure[fresh], 0.0) * (not pressed)
        self.keys = np.concatenate([self.keys[rows], keys[fresh]])
        self.law = np.concatenate([self.law[rows], law[fresh]])
        self.offset = np.concatenate([self.offset[rows], lost])
        corner = np.concatenate([now.corner[rows], found.corner[fresh]])
        edge = np.concatenate([now.edge[rows], found.edge[fresh]])
        self.contacts = Contacts(self.outlines, corner, edge, motion)
        return np.concatenate([rows, np.full(len(lost), -1)])

    def between(self, one: int, other: int) -> np.ndarray:
        """Mask (k,) of the contacts between two blocks."""
        return (self.contacts.a == min(one, other)) & (self.contacts.b == max(one, other))

    def _skin(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return 0.5 * (self.skins[a] + self.skins[b])

    def laws_of(self, edges: np.ndarray) -> np.ndarray:
        """Number (k,) of the law of edges (k, 2) that meet, in the order of their blocks.

        The law of a [[joint]] table if one names both blocks, or one of them (that of the block
        that comes first in the scene, if both have one); else that of the joint set that cut both
        edges; else the scene's.
        """
        one, other = self._of_edge[edges].T
        out = np.where((one == other) & (one >= 0), one, self._default)
        blocks = self.outlines.block[edges]
        for sides, meant, law in self._of_blocks:
            out[(blocks[:, sides] == meant).all(axis=1)] = law
        return out

    def _found(
        self, motion: np.ndarray, pairs: np.ndarray, known: np.ndarray
    ) -> tuple[Contacts, np.ndarray]:
        """The contacts between pairs (p, 2) of blocks and the edges (k, 2) that meet there; where
        two are equal, that of a code in `known` is meant.

        Raises SceneError for an overlap that is too deep, or that no corner sees.
        """
        n = len(pairs)
        limit, skin = self.deepest[pairs].min(axis=1), self._skin(*pairs.T)
        near, deepest = 1.5 * skin, 1.5 * limit
        apart, room, most = np.empty((2, n)), 0, 64
        world = self.outlines.world(motion)
        pairs, start = np.ascontiguousarray(pairs, np.int64), self.outlines.start
        given = [address(array) for array in (pairs, start, near, deepest)]
        while most > room:  # again where there was no room for all
            room = most
            out = np.empty((3, room), np.int64)
            most = world.call("find", n, *given, room, *map(address, out), address(apart))
        corner, edge, pair = out[:, :most]
        every = Contacts(self.outlines, corner, edge, motion)
        ok = _in_range(every, np.isin(every.codes, known))
        seen = np.full(2 * n, -np.inf)
        np.maximum.at(seen, pair[ok], every.closure[ok])
        self._require_carried(pairs, -apart.max(axis=0), seen.reshape(2, n).max(axis=0), limit)
        found = Contacts(self.outlines, corner[ok], edge[ok], motion)
        return found, found.edges

    def _require_carried(self, pairs, true, seen, limit) -> None:
        if (true > limit).any():
            i = int((true - limit).argmax())
            self.refuse(pairs[i], true[i])
        lost = (true > 0.25 * self._skin(*pairs.T)) & (seen < CARRIED * true)
        if lost.any():
            p = int(lost.argmax())
            one, other = (self.blocks[n].name for n in pairs[p])
            raise SceneError(
                f"blocks {one!r} and {other!r} overlap by {true[p]:.3g} m where no corner is over "
                "an edge that faces it: start the blocks apart, or resume with a smaller step"
            )

    def refuse(self, pair, depth: float) -> None:
        """Refuse an overlap (m) of two blocks beyond run.max_overlap."""
        one, other = (self.blocks[n].name for n in pair)
        raise SceneError(
            f"blocks {one!r} and {other!r} overlap by {depth:.3g} m: must stay below "
            f"{self.deepest[list(pair)].min():.3g} m (a share of the smaller block's width); "
            "draw them apart, resume with a smaller step, or use stiffer joints, lower loads or "
            "speeds, a larger run.corner_length or run.max_overlap"
        )
