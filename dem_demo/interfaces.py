"""Which edges face each other, and the identity of every law point through time.

A law point is (block, edge, block, edge, place along the overlap), with the blocks in their order
in the scene: reversed pairs, rocking and re-contact find the same joint again. The list is renewed
only when something has moved far enough to matter; between renewals its geometry is plain arrays.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from .geometry import Edges, place_corners
from .shapes import Block

Key = tuple[int, int, int, int]

ANGLE = np.radians(5.0)  # edges that meet at a larger angle are a corner on an edge: not carried
CARRIED = 0.5  # share of an overlap that some joint must see


class Refused(RuntimeError):
    """A state that the method cannot carry; the run leaves a snapshot that replays it."""


class Interfaces:
    """The edge pairs within reach, as arrays sorted by key, renewed from pymunk's pairs.

    skin: pymunk reports pairs within 2 skins; an edge pair counts from a gap of 1 skin and is
    forgotten beyond 1.5 (m). spacing: largest distance of law points along an overlap (m).
    max_overlap: largest depth as a share of the smaller block's width.
    """

    def __init__(
        self, blocks: Sequence[Block], skin: float, spacing: float, max_overlap: float
    ) -> None:
        self.blocks, self.skin, self.spacing = blocks, skin, spacing
        most = max(len(block.corners) for block in blocks)
        pad = [np.minimum(np.arange(most), len(b.corners) - 1) for b in blocks]
        self._corner = np.array([b.local[p] for b, p in zip(blocks, pad, strict=True)])
        self._next = np.array(
            [np.roll(b.local, -1, axis=0)[p] for b, p in zip(blocks, pad, strict=True)]
        )
        self._real = np.array([np.arange(most) < len(b.corners) for b in blocks])
        self._reach = np.array([b.reach for b in blocks])
        self._fixed = np.array([b.fixed for b in blocks])
        self.depth_limit = max_overlap * np.array([b.width for b in blocks])
        self.keys: list[Key] = []
        self.edges = self._arrays([])
        self.renewed_at: np.ndarray | None = None

    @property
    def of_points(self) -> list[tuple[Key, int]]:
        """Identity of every law point, in the order of the geometry's arrays: ends, then inner."""
        m, e = len(self.keys), self.edges
        place = np.concatenate([np.zeros(m, int), np.full(m, -1), np.zeros(len(e.inner_of), int)])
        count: dict[int, int] = {}
        for i, of in enumerate(e.inner_of.tolist()):
            place[2 * m + i] = count[of] = count.get(of, 0) + 1
        return [(self.keys[of], int(k)) for of, k in zip(e.of.tolist(), place, strict=True)]

    def stale(self, motion: np.ndarray) -> bool:
        """Has a block moved or turned so far that an edge pair could be missing?"""
        if self.renewed_at is None:
            return True
        moved = np.abs(motion[:3] - self.renewed_at)
        return bool((moved[0] + moved[1] + moved[2] * self._reach).max() > 0.25 * self.skin)

    def renew(self, motion: np.ndarray, near: Iterable[tuple[int, int]]) -> bool:
        """Look again at pymunk's pairs; True if the list of edge pairs has changed."""
        self.renewed_at = motion[:3].copy()
        pairs = np.array(sorted(p for p in near if not self._fixed[list(p)].all()), int)
        pairs = pairs.reshape(-1, 2)
        facing, depth = self._facing(motion, pairs)
        self._require_carried(pairs, facing, depth)
        keys = [
            (int(pairs[p, 0]), int(i), int(pairs[p, 1]), int(j))
            for p, i, j in zip(*np.nonzero(facing), strict=True)
        ]
        if keys == self.keys:
            return False
        self.adopt(keys)
        return True

    def adopt(self, keys: list[Key]) -> None:
        """Take a list of edge pairs as it is."""
        self.keys = keys
        self.edges = self._arrays(keys)

    def _arrays(self, keys: list[Key]) -> Edges:
        table = np.array(keys, int).reshape(-1, 4)
        (a, i, b, j), m = table.T, len(table)
        ends = [self._corner[a, i], self._next[a, i], self._corner[b, j], self._next[b, j]]
        length = np.hypot(*(ends[1] - ends[0]).T)
        shorter = np.minimum(length, np.hypot(*(ends[3] - ends[2]).T))
        spans = np.maximum(np.ceil(shorter / self.spacing - 1e-9), 1).astype(int)
        inner_of = np.repeat(np.arange(m), spans - 1)
        inner_at = np.concatenate([np.arange(1, n) / n for n in spans]) if m else np.zeros(0)
        of_ends = np.concatenate([np.arange(m), np.arange(m)])
        weight = np.concatenate([0.5 / spans[of_ends], 1.0 / spans[inner_of]])
        return Edges(a, b, np.concatenate(ends).T.copy(), length, inner_of, inner_at, weight)

    def _facing(self, motion: np.ndarray, pairs: np.ndarray):
        """For pairs (p, 2): mask (p, i, j) of facing edges and the depth (p, i, j) seen there."""
        every = np.arange(len(self.blocks)).repeat(self._corner.shape[1])
        shape = (2, *self._corner.shape[:2])
        place = place_corners(self._corner.reshape(-1, 2).T, every, motion).reshape(shape)
        end = place_corners(self._next.reshape(-1, 2).T, every, motion).reshape(shape)
        a, b = pairs.T
        a0, a1 = place[:, a, :, None], end[:, a, :, None]
        b0, b1 = place[:, b, None, :], end[:, b, None, :]
        la, lb = np.hypot(*(a1 - a0)), np.hypot(*(b1 - b0))
        ta, tb = (a1 - a0) / la, (b1 - b0) / lb
        turned = ta[0] * tb[1] - ta[1] * tb[0]
        opposite = (ta * tb).sum(axis=0) < 0
        s0, s1 = ((b1 - a0) * ta).sum(axis=0), ((b0 - a0) * ta).sum(axis=0)
        overlap = np.minimum(s1, la) - np.maximum(s0, 0)
        d0, d1 = (ta[1] * (b - a0)[0] - ta[0] * (b - a0)[1] for b in (b1, b0))
        # Depth of B's edge line below A's edge line at both ends of the overlap.
        span = np.where(np.abs(s1 - s0) > 1e-12, s1 - s0, 1.0)
        at_lo = -(d0 + (d1 - d0) * (np.maximum(s0, 0) - s0) / span)
        at_hi = -(d0 + (d1 - d0) * (np.minimum(s1, la) - s0) / span)
        depth = np.maximum(at_lo, at_hi)
        old = np.zeros(depth.shape, bool)
        row = {tuple(p): n for n, p in enumerate(pairs.tolist())}
        for i, (one, edge, other, opposing) in enumerate(self.keys):
            if (one, other) in row:
                old[row[one, other], edge, opposing] = i >= 0
        gap = np.where(old, 1.5, 1.0) * self.skin
        widest = 10 * np.minimum(self.depth_limit[a], self.depth_limit[b])[:, None, None]
        facing = (
            opposite
            & (np.abs(turned) < np.sin(ANGLE) * np.where(old, 1.5, 1.25))
            & (overlap > -gap)
            & (depth > -gap)
            & (depth < widest)
            & self._real[a][:, :, None]
            & self._real[b][:, None, :]
        )
        return facing, self._depths(place, end, pairs, depth, facing)

    def _depths(self, place, end, pairs, depth, facing):
        """Overlap of each pair (negative for a gap) and the part of it that joints see: (2, p)."""
        apart = np.full(len(pairs), -np.inf)
        for one, other in (pairs.T, pairs.T[::-1]):
            start = place[:, one]
            t = end[:, one] - start
            t /= np.hypot(*t)
            d = place[:, other][:, :, None, :] - start[:, :, :, None]
            above = (t[1][:, :, None] * d[0] - t[0][:, :, None] * d[1]).min(axis=2)
            apart = np.maximum(apart, above.max(axis=1))
        seen = np.where(facing, depth, -np.inf).max(axis=(1, 2), initial=-np.inf)
        return np.stack([-apart, seen])

    def _require_carried(self, pairs, facing, depth) -> None:
        limit = np.minimum(self.depth_limit[pairs[:, 0]], self.depth_limit[pairs[:, 1]])
        true, seen = depth
        if (deep := true > limit).any():
            self.refuse_overlap(pairs[deep.argmax()], true[deep.argmax()], limit[deep.argmax()])
        lost = (true > 0.25 * self.skin) & (seen < CARRIED * true)
        if lost.any():
            p = int(lost.argmax())
            one, other = (self.blocks[n].name for n in pairs[p])
            raise Refused(
                f"blocks {one!r} and {other!r} overlap by {true[p]:.3g} m at a corner that no edge "
                f"faces within {np.degrees(ANGLE):.0f} degrees: corner contacts are not carried; "
                "start the blocks closer to parallel, or drop them from less height"
            )

    def refuse_overlap(self, pair, depth: float, limit: float) -> None:
        """Raise for an overlap beyond the limit."""
        one, other = (self.blocks[n].name for n in pair)
        raise Refused(
            f"blocks {one!r} and {other!r} overlap by {depth:.3g} m: must stay below {limit:.3g} m "
            "(a share of the smaller block's width); use stiffer joints, lower loads or speeds, or "
            "a larger run.max_overlap"
        )
