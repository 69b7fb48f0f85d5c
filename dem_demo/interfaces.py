"""Which corners are over which edges, and the identity of every law point through time.

A law point is a number given when its corner came within reach of an edge. It keeps its number,
and with it its joint, while the corner slides along the edge, turns on it from one side of the
block to the next, or trades roles with another corner at the end of an edge. New law points are
looked for only when something has moved far enough to matter; between such renewals the geometry
is plain arrays.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from .between import Between, spans
from .geometry import Contacts, Outlines, Points, evaluate
from .search import ROUNDING, TILT, Found, Key, Refused, Search, what_is_next
from .shapes import Block

__all__ = ["ROUNDING", "Interfaces", "Refused"]


class Interfaces:
    """The law points within reach, renewed from pymunk's pairs.

    skin: pymunk reports pairs within 2 skins; a corner counts from a gap of 1 skin and is
    forgotten beyond 1.5 (m). spacing: largest distance of law points along an overlap (m).
    max_overlap: largest depth as a share of the smaller block's width. law_of: names the law of a
    key. After `renew` or `follow`: contacts, and of their corners: keys when found, numbers,
    crushed (m), the depth that each had to give up (see `handover`).
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
        self.search = Search(blocks, self.outlines, skin, max_overlap)
        self._reach = np.array([b.reach for b in blocks])
        self._fixed = np.array([b.fixed for b in blocks])
        none = np.zeros(0, int)
        self.adopt(none, none, [], none, np.zeros(0), [], 0)
        self.renewed_at: np.ndarray | None = None
        self.urgent = True  # must be renewed, whatever has moved

    def adopt(self, corner, edge, keys, numbers, crushed, overlaps, given: int) -> None:
        """Take law points as they are: corners on edges, and overlaps with points between."""
        between = Between.on(self.outlines, overlaps, self.spacing) if overlaps else None
        rest = self.corner_length, self.soft, self.spacing, between
        self.contacts = Contacts(self.outlines, corner, edge, *rest)
        self.keys, self.numbers, self.crushed = keys, numbers, crushed
        self.overlaps, self.given = overlaps, given

    @property
    def of_points(self) -> list[tuple[Key, int]]:
        """Identity of every law point: key and number; below 0 for the points between."""
        corners = list(zip(self.keys, self.numbers.tolist(), strict=True))
        if self.contacts.between is None:
            return corners
        count: dict[int, int] = {}
        for of in self.contacts.between.of.tolist():
            count[of] = count.get(of, 0) + 1
            corners.append((self.overlaps[of], -count[of]))
        return corners

    def stale(self, motion: np.ndarray) -> bool:
        """Has a block moved or turned so far that a corner could be missing?"""
        if self.urgent:
            return True
        x, y, turned = motion[:3] - self.renewed_at
        moved = np.hypot(x, y) + np.abs(turned) * self._reach
        return bool(moved.max() > 0.25 * self.skin)

    def closure(self, points: Points) -> np.ndarray:
        """Closure (n,) that the joints see: of the depth less what has been crushed at a corner.

        A corner that has opened is whole again: another part of it will touch next.
        """
        if not self.crushed.any():
            return points.closure
        k = len(self.crushed)
        self.crushed[points.closure[:k] <= 0] = 0.0
        return points.closure - np.pad(self.crushed, (0, len(points.closure) - k))

    def follow(self, points: Points, motion: np.ndarray) -> Points:
        """Let corners that have left the range of their edge go on to what is next there."""
        for _ in range(8):
            past = points.inside < -ROUNDING
            if not past.any():
                break
            c, out = self.contacts, past.any(axis=0)
            corner, edge, trade = what_is_next(c, points)
            there = np.where(out, corner, c.corner), np.where(out, edge, c.edge)
            self.contacts = c.at(*there, c.between)
            points = evaluate(self.contacts, motion)
            doubled = len(set(self.contacts.pairs())) < len(self.numbers)
            if doubled or not trade[out].all():
                self.urgent = True  # there may be something new next to it
        return points

    def renew(
        self, motion: np.ndarray, near: Iterable[tuple[int, int]], pressed: bool = True
    ) -> bool:
        """Look again at pymunk's pairs; True if the list of law points has changed.

        Of new law points that are pressed already, the closure counts (`pressed`, at the start of a
        run) or is crushed, so that they make no energy.
        """
        self.renewed_at, self.urgent = motion[:3].copy(), False
        pairs = np.array(sorted(p for p in near if not self._fixed[list(p)].all()), int)
        found = self.search(motion, pairs.reshape(-1, 2), self.contacts)
        keys, known, fresh, stay = found.keys(self.outlines), {}, [], []
        for i, who in enumerate(self.contacts.pairs()):
            known.setdefault(who, i)
        for i, who in enumerate(zip(found.corner.tolist(), found.edge.tolist(), strict=True)):
            old = known.get(who)
            if old is not None and (found.depth[i] > 0 or self._same(self.keys[old], keys[i])):
                stay.append((old, i))
            elif found.depth[i] > -self.skin:
                fresh.append(i)
        stay.sort()
        old = [o for o, _ in stay]
        chosen = [i for _, i in stay] + fresh
        overlaps = self._long_overlaps(found, chosen)
        same = len(stay) == len(self.numbers) and not fresh and overlaps == self.overlaps
        lost = np.maximum(found.depth[fresh], 0.0) * (not pressed)
        self.adopt(
            found.corner[chosen],
            found.edge[chosen],
            [self.keys[o] for o in old] + [keys[i] for i in fresh],
            np.concatenate([self.numbers[old], self.given + np.arange(len(fresh))]).astype(int),
            np.concatenate([self.crushed[old], lost]),
            overlaps,
            self.given + len(fresh),
        )
        return not same

    def _same(self, one: Key, other: Key) -> bool:
        return one == other or self.law_of(one) == self.law_of(other)

    def _long_overlaps(self, found: Found, chosen: list[int]) -> list[Key]:
        """Edges that lie on each other and are long enough for law points between the ends."""
        if not np.isfinite(self.spacing):
            return []
        o, out = self.outlines, set()
        sides = np.stack([o.before[found.corner], found.corner])[:, chosen]
        lies = (np.abs(found.rise) < TILT) & (found.overlap > -self.skin)
        for s, i in np.argwhere(lies[:, chosen]).tolist():
            pair = sorted((int(sides[s, i]), int(found.edge[chosen[i]])))
            if spans(o.length[pair].min(), self.spacing) > 1:
                one, other = (int(o.block[e]) for e in pair)
                out.add((one, pair[0] - int(o.start[one]), other, pair[1] - int(o.start[other])))
        return sorted(out)
