"""Law points along a long overlap of edge on edge, between its two ends: linear interpolation."""

from dataclasses import dataclass

import numpy as np

from .smoothing import raised, soft_size


@dataclass(frozen=True, eq=False)
class EdgePoints:
    """Points between the ends of m overlaps of edge `first` of block a with `second` of block b.

    first, second, first_end, second_end (m,): numbers of corners at the edges' ends; a, b (i,):
    blocks of each point; of (i,): its overlap; fraction (i,): its place along that; weight (i,):
    its share of it.
    """

    first: np.ndarray
    second: np.ndarray
    first_end: np.ndarray
    second_end: np.ndarray
    a: np.ndarray
    b: np.ndarray
    of: np.ndarray
    fraction: np.ndarray
    weight: np.ndarray

    @classmethod
    def on(
        cls, outlines, overlaps: list[tuple[int, int, int, int]], spacing: float
    ) -> "EdgePoints":
        """Points at most `spacing` (m) apart on overlaps (block, edge, block, edge)."""
        o = outlines
        a, i, b, j = np.array(overlaps, int).T
        first, second = o.start[a] + i, o.start[b] + j
        parts = spans(np.minimum(o.length[first], o.length[second]), spacing)
        of = np.repeat(np.arange(len(a)), parts - 1)
        fraction = np.concatenate([np.arange(1, n) / n for n in parts])
        ends = o.next[first], o.next[second]
        return cls(first, second, *ends, a[of], b[of], of, fraction, 1.0 / parts[of])


def spans(length: np.ndarray, spacing: float) -> np.ndarray:
    """Into how many parts of at most `spacing` a length (m) is cut."""
    return np.maximum(np.ceil(length / spacing - 1e-9), 1).astype(int)


def interpolate(along: EdgePoints, place: np.ndarray, ways: np.ndarray, soft: float) -> tuple:
    """Place, normal, closure, length of the points, and its derivatives `pull` and `twist`.

    place, ways (c,): corners and directions of edges; soft (m): see `geometry`. At
    either end there is a corner of one block over the other's edge.
    """
    u, f, of = along, along.fraction, along.of
    ta, tb = ways[u.first], ways[u.second]
    t = ta - tb  # along both, so that the blocks may trade roles
    t /= np.abs(t)
    ends, turns = [], []
    overlap = ((place[u.first_end] - place[u.first]) * t.conj()).real
    for mine, yours, way in ((u.first, u.second_end, t), (u.first_end, u.second, -t)):
        one, other = place[mine], place[yours]
        inside = ((other - one) * way.conj()).real
        by_b = inside > 0
        normal = np.where(by_b, -1j * ta, 1j * tb)
        closure = ((one - other) * normal.conj()).real
        ends.append((np.where(by_b, other, one), normal, closure))
        size, slope = soft_size(inside, soft)
        overlap = overlap - 0.5 * (inside + size)
        turns.append((one, other, 0.5 * (1 + slope)))
    at, normal, closure = (
        (1 - f) * low[of] + f * high[of] for low, high in zip(*ends, strict=True)
    )
    normal /= np.abs(normal)
    tilt = -ta.conj() * tb
    gone, slope = raised(tilt.imag, tilt.real)
    lies = (1 - gone) * (overlap > 0)
    (one0, other0, by0), (one1, other1, by1) = turns
    pull = (lies * (by1 - by0) * t)[of]
    # Seen from the point: each end turns with its own block, the direction with the mean of both.
    ends_turn = (1 - by1) * one1 - by1 * other1 - (1 - by0) * one0 + by0 * other0
    turn = ends_turn[of] + 2 * (by1 - by0)[of] * at
    twist = 0.5 * lies[of] * (turn * t.conj()[of]).imag
    twist -= (np.sign(tilt.imag) * slope * np.maximum(overlap, 0.0))[of]
    w = u.weight
    return at, normal, closure, w * (lies * overlap)[of], w * pull, w * twist
