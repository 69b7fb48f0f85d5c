"""The law points within reach, and the identity of each through time.

A law point is a number given when its corner came within reach of an edge. It keeps its number,
and with it its joint, while the corner slides along the edge, turns on it from one side of the
block to the next, or trades roles with another corner at the end of an edge. New law points are
looked for only when something has moved far enough to matter; between such renewals the geometry
is plain arrays.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..scene import Block, Key
from .edge_points import EdgePoints, spans
from .geometry import Contacts, Outlines, Points, evaluate
from .narrow_phase import ROUNDING, TILT, Found, NarrowPhase, what_is_next

Identity = tuple[Key, int]


@dataclass(frozen=True, eq=False)
class LawPoints:
    """The law points of a moment: k corners on edges, then the points along long overlaps.

    keys: of the k corners when found; numbers (k,): their names for life; closure_offset (k,): the
    depth (m) that each had to give up (see `dynamics.step`); overlaps: edges on edges that
    have points along them; given: numbers given so far; renewed_at (3, blocks): motion when last
    renewed; urgent: must be renewed, whatever has moved.
    """

    contacts: Contacts
    keys: list[Key]
    numbers: np.ndarray
    closure_offset: np.ndarray
    overlaps: list[Key]
    given: int
    renewed_at: np.ndarray
    urgent: bool

    @property
    def identities(self) -> list[Identity]:
        """Key and number of every law point; numbers below 0 for those along an overlap."""
        points = list(zip(self.keys, self.numbers.tolist(), strict=True))
        if self.contacts.along is None:
            return points
        count: dict[int, int] = {}
        for of in self.contacts.along.of.tolist():
            count[of] = count.get(of, 0) + 1
            points.append((self.overlaps[of], -count[of]))
        return points

    def closure(self, points: Points) -> np.ndarray:
        """Closure (n,) that the joints see: the depth less the closure offset of its corner."""
        k = len(self.closure_offset)
        offset = np.where(points.closure[:k] > 0, self.closure_offset, 0.0)
        return points.closure - np.pad(offset, (0, len(points.closure) - k))

    def reopened(self, points: Points) -> "LawPoints":
        """Without the offset of corners that have opened: another part of them touches next."""
        opened = points.closure[: len(self.closure_offset)] <= 0
        if not self.closure_offset[opened].any():
            return self
        return replace(self, closure_offset=np.where(opened, 0.0, self.closure_offset))


class Tracker:
    """Follows the law points of some blocks; what it is given it leaves alone.

    skin: pymunk reports pairs within 2 skins; a corner counts from a gap of 1 skin and is
    forgotten beyond 1.5 (m). spacing: largest distance of law points along an overlap (m).
    max_overlap: largest depth as a share of the smaller block's width. corner_length: of joint at
    a corner that stands on an edge (m). law_of: names the law of a key.
    """

    def __init__(
        self,
        blocks: Sequence[Block],
        skin: float,
        spacing: float,
        max_overlap: float,
        corner_length: float,
        law_of: Callable[[Key], str],
    ) -> None:
        self.skin, self.spacing, self.law_of = skin, spacing, law_of
        self.outlines, self.corner_length = Outlines(blocks), corner_length
        self.soft = 0.25 * skin  # m: over which the end of one edge gives way to that of another
        self.narrow_phase = NarrowPhase(blocks, self.outlines, skin, max_overlap)
        self._reach = np.array([b.reach for b in blocks])
        self._fixed = np.array([b.fixed for b in blocks])

    def law_points(
        self, corner, edge, keys, numbers, closure_offset, overlaps, given, renewed_at
    ) -> LawPoints:
        """Law points of corners on edges, and of overlaps with points along them."""
        along = EdgePoints.on(self.outlines, overlaps, self.spacing) if overlaps else None
        rest = self.corner_length, self.soft, self.spacing, along
        contacts = Contacts(self.outlines, corner, edge, *rest)
        return LawPoints(
            contacts, keys, numbers, closure_offset, overlaps, given, renewed_at, False
        )

    def none(self, motion: np.ndarray) -> LawPoints:
        """No law points, before the first renewal."""
        none = np.zeros(0, int)
        return self.law_points(none, none, [], none, np.zeros(0), [], 0, motion[:3].copy())

    def stale(self, law_points: LawPoints, motion: np.ndarray) -> bool:
        """Has a block moved or turned so far that a corner could be missing?"""
        if law_points.urgent:
            return True
        x, y, turned = motion[:3] - law_points.renewed_at
        moved = np.hypot(x, y) + np.abs(turned) * self._reach
        return bool(moved.max() > 0.25 * self.skin)

    def evaluate(
        self, law_points: LawPoints, motion: np.ndarray
    ) -> tuple[LawPoints, Points, np.ndarray]:
        """Law points at a motion (6, n), each at the corner and edge where it is by then.

        Corners that have left the range of their edge go on to what is next there. The last of the
        results is the length (n,) of joint that each stood for before (m).
        """
        contacts, urgent = law_points.contacts, law_points.urgent
        points = evaluate(contacts, motion)
        length = points.length
        if points.inside.min(initial=0.0) >= -ROUNDING:
            return law_points, points, length
        for _ in range(8):
            past = points.inside < -ROUNDING
            if not past.any():
                break
            c, out = contacts, past.any(axis=0)
            corner, edge, trade = what_is_next(c, points)
            there = np.where(out, corner, c.corner), np.where(out, edge, c.edge)
            contacts = c.at(*there, c.along)
            points = evaluate(contacts, motion)
            doubled = len(set(contacts.pairs())) < len(law_points.numbers)
            if doubled or not trade[out].all():
                urgent = True  # there may be something new next to it
        return replace(law_points, contacts=contacts, urgent=urgent), points, length

    def renew(
        self,
        law_points: LawPoints,
        motion: np.ndarray,
        near: Iterable[tuple[int, int]],
        pressed: bool = True,
    ) -> tuple[LawPoints, bool]:
        """Look again at pymunk's pairs; also: has the list of law points changed?

        Of new law points that are pressed already, the closure counts (`pressed`, at the start of a
        run) or becomes their closure offset, so that they make no energy.
        """
        pairs = np.array(sorted(p for p in near if not self._fixed[list(p)].all()), int)
        found = self.narrow_phase(motion, pairs.reshape(-1, 2), law_points.contacts)
        flat = self.outlines.flatter(found.corner, found.rise)
        keys = list(map(tuple, self.outlines.interfaces(flat, found.edge).tolist()))
        known, fresh, stay = {}, [], []
        for i, who in enumerate(law_points.contacts.pairs()):
            known.setdefault(who, i)
        for i, who in enumerate(zip(found.corner.tolist(), found.edge.tolist(), strict=True)):
            old = known.get(who)
            if old is not None and (
                found.depth[i] > 0 or self.law_of(law_points.keys[old]) == self.law_of(keys[i])
            ):
                stay.append((old, i))
            elif found.depth[i] > -self.skin:
                fresh.append(i)
        stay.sort()
        old = [o for o, _ in stay]
        chosen = [i for _, i in stay] + fresh
        overlaps, given = self._long_overlaps(found, chosen), law_points.given
        lost = np.maximum(found.depth[fresh], 0.0) * (not pressed)
        renewed = self.law_points(
            found.corner[chosen],
            found.edge[chosen],
            [law_points.keys[o] for o in old] + [keys[i] for i in fresh],
            np.concatenate([law_points.numbers[old], given + np.arange(len(fresh))]).astype(int),
            np.concatenate([law_points.closure_offset[old], lost]),
            overlaps,
            given + len(fresh),
            motion[:3].copy(),
        )
        same = len(stay) == len(law_points.numbers) and not fresh
        return renewed, not (same and overlaps == law_points.overlaps)

    def _long_overlaps(self, found: Found, chosen: list[int]) -> list[Key]:
        """Edges that lie on each other and are long enough for law points between the ends."""
        if not np.isfinite(self.spacing):
            return []
        o, out = self.outlines, set()
        sides = np.stack([o.before[found.corner], found.corner])[:, chosen]
        lies = (np.abs(found.rise) < TILT) & (found.overlap > -self.skin)
        for s, i in np.argwhere(lies[:, chosen]).tolist():
            pair = sides[s, i], found.edge[chosen[i]]
            if spans(o.length[list(pair)].min(), self.spacing) > 1:
                out.add(tuple(o.interfaces(*pair)[0].tolist()))
        return sorted(out)
