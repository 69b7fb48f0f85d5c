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

from .between import Between
from .geometry import Contacts, Outlines, Points, evaluate, spans
from .shapes import Block
from .tilt import CORNER

Key = tuple[int, int, int, int]  # block, edge, block, edge

TILT = np.sin(np.radians(CORNER + 1.5))  # how far a side of a corner may dip below the edge
CARRIED = 0.5  # share of an overlap that some joint must see
ROUNDING = 1e-10  # m: corners stay until their depth is wrong by this, so that none chatters


class Refused(RuntimeError):
    """A state that the method cannot carry; the run leaves a snapshot that replays it."""


class Interfaces:
    """The law points within reach, renewed from pymunk's pairs.

    skin: pymunk reports pairs within 2 skins; a corner counts from a gap of 1 skin and is
    forgotten beyond 1.5 (m). spacing: largest distance of law points along an overlap (m).
    max_overlap: largest depth as a share of the smaller block's width. law_of: names the law of a
    key. After `renew` or `follow`: contacts, and of their corners: keys when found, numbers,
    crushed (m), the depth that each had to give up (see `Simulation.hand_over`).
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
        self.blocks, self.skin, self.spacing, self.law_of = blocks, skin, spacing, law_of
        self.outlines, self.corner_length = Outlines(blocks), corner_length
        self.soft = 0.25 * skin  # m: over which the end of one edge gives way to that of another
        most = max(len(block.corners) for block in blocks)
        place = np.arange(most)
        self._corners = np.array(
            [
                np.where(place < len(block.corners), start + place, -1)
                for block, start in zip(blocks, self.outlines.start, strict=True)
            ]
        )
        self._reach = np.array([b.reach for b in blocks])
        self._fixed = np.array([b.fixed for b in blocks])
        self.depth_limit = max_overlap * np.array([b.width for b in blocks])
        none = np.zeros(0, int)
        self.adopt(none, none, [], none, np.zeros(0), [], 0)
        self.renewed_at: np.ndarray | None = None
        self.urgent = True  # must be renewed, whatever has moved

    def adopt(self, corner, edge, keys, numbers, crushed, overlaps, given: int) -> None:
        """Take law points as they are: corners on edges, and overlaps with points between."""
        between = self._between(overlaps)
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
            corner, edge, trade = _beyond(c, points)
            self.contacts = c.at(np.where(out, corner, c.corner), np.where(out, edge, c.edge))
            points = evaluate(self.contacts, motion)
            doubled = len(set(_pairs(self.contacts))) < len(self.numbers)
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
        corner, edge, closure, rise, overlap = self._within_reach(motion, pairs.reshape(-1, 2))
        keys = self._keys(corner, edge, rise)
        known: dict[tuple[int, int], int] = {}
        for i, who in enumerate(_pairs(self.contacts)):
            known.setdefault(who, i)
        fresh, stay = [], []
        for i, who in enumerate(zip(corner.tolist(), edge.tolist(), strict=True)):
            old = known.get(who)
            if old is not None and (closure[i] > 0 or self._same(self.keys[old], keys[i])):
                stay.append((old, i))
            elif closure[i] > -self.skin:
                fresh.append(i)
        stay.sort()
        old = [o for o, _ in stay]
        chosen = [i for _, i in stay] + fresh
        here = corner[chosen], edge[chosen]
        overlaps = self._long_overlaps(*here, rise[:, chosen], overlap[:, chosen])
        same = len(stay) == len(self.numbers) and not fresh and overlaps == self.overlaps
        lost = np.maximum(closure[fresh], 0.0) * (not pressed)
        self.adopt(
            *here,
            [self.keys[o] for o in old] + [keys[i] for i in fresh],
            np.concatenate([self.numbers[old], self.given + np.arange(len(fresh))]).astype(int),
            np.concatenate([self.crushed[old], lost]),
            overlaps,
            self.given + len(fresh),
        )
        return not same

    def _same(self, one: Key, other: Key) -> bool:
        return one == other or self.law_of(one) == self.law_of(other)

    def _within_reach(self, motion, pairs):
        """Corners that are over an edge of another block, near it and in its range."""
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
        rest = self.corner_length, self.soft, self.spacing
        contacts = Contacts(self.outlines, corner, edge, *rest)
        points = evaluate(contacts, motion)
        ok = (points.rise > -TILT).all(axis=0) & (points.inside >= -ROUNDING).all(axis=0)
        self._choose(contacts, points, ok)
        n = len(pairs)
        seen = np.full(2 * n, -np.inf)
        np.maximum.at(seen, which[ok], points.closure[ok])
        true = -np.maximum(apart[:n], apart[n:])
        self._require_carried(pairs, true, np.maximum(seen[:n], seen[n:]), limit[:n])
        return corner[ok], edge[ok], points.closure[ok], points.rise[:, ok], points.overlap[:, ok]

    def _choose(self, contacts: Contacts, points: Points, ok: np.ndarray) -> None:
        """Of two corners at the limit between them only one is meant: the one that was there."""
        edge = ok & (points.inside.min(axis=0) <= ROUNDING)
        if not edge.any():
            return
        here, known = _pairs(contacts), set(_pairs(self.contacts))
        corner, beyond, _ = _beyond(contacts, points)
        rows = {here[i]: i for i in np.flatnonzero(edge).tolist()}
        for i in sorted(rows.values(), key=lambda i: here[i] not in known):
            other = rows.get((int(corner[i]), int(beyond[i])))
            if other is not None and ok[i]:
                ok[other] = False

    def _keys(self, corner, edge, rise) -> list[Key]:
        """Blocks and edges that meet: of the two sides of a corner the one that lies flatter."""
        o = self.outlines
        side = np.where(rise[0] < rise[1], o.before[corner], corner)
        ends = np.minimum(side, edge), np.maximum(side, edge)
        first, second = (np.stack([o.block[e], e - o.start[o.block[e]]]) for e in ends)
        return [tuple(key) for key in np.concatenate([first, second]).T.tolist()]

    def _long_overlaps(self, corner, edge, rise, overlap) -> list[Key]:
        """Edges that lie on each other and are long enough for law points between the ends."""
        if not np.isfinite(self.spacing):
            return []
        o, out = self.outlines, set()
        sides = np.stack([o.before[corner], corner])
        for s, i in np.argwhere((np.abs(rise) < TILT) & (overlap > -self.skin)).tolist():
            pair = sorted((int(sides[s, i]), int(edge[i])))
            if spans(o.length[pair].min(), self.spacing) > 1:
                one, other = (int(o.block[e]) for e in pair)
                out.add((one, pair[0] - int(o.start[one]), other, pair[1] - int(o.start[other])))
        return sorted(out)

    def _between(self, overlaps: list[Key]) -> Between | None:
        if not overlaps:
            return None
        o = self.outlines
        a, i, b, j = np.array(overlaps, int).T
        first, second = o.start[a] + i, o.start[b] + j
        parts = spans(np.minimum(o.length[first], o.length[second]), self.spacing)
        of = np.repeat(np.arange(len(a)), parts - 1)
        fraction = np.concatenate([np.arange(1, n) / n for n in parts])
        ends = o.next[first], o.next[second]
        return Between(first, second, *ends, a[of], b[of], of, fraction, 1.0 / parts[of])

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


def _beyond(c: Contacts, points: Points):
    """Corner and edge that come next at the nearer limit of each corner's range, and whether the
    corner at the end of the edge takes over there."""
    side, k = points.inside.argmin(axis=0), np.arange(len(c.corner))
    trade = points.own[side, k]
    corner_there = np.where(side == 0, c.edge, c.outlines.next[c.edge])
    corner, edge = np.where(trade, corner_there, c.corner), c.behind[side, k]
    return corner, np.where(trade, c.sides[side, k], edge), trade


def _pairs(c: Contacts) -> list[tuple[int, int]]:
    return list(zip(c.corner.tolist(), c.edge.tolist(), strict=True))
