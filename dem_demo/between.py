"""Law points between the two ends of a long overlap of edge on edge, by linear interpolation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .tilt import raised


@dataclass(frozen=True, eq=False)
class Between:
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


def interpolate(between: Between, place: np.ndarray, ways: np.ndarray) -> tuple:
    """Place, normal, closure, length of the points, and its derivatives `pull` and `twist`.

    place, ways (2, c): corners and unit vectors along the edges. The ends are as in `geometry`:
    at either end a corner of one block over the other's edge.
    """
    u, f, of = between, between.fraction, between.of
    ta, tb = ways[:, u.first], ways[:, u.second]
    t = ta - tb  # along both, so that the blocks may trade roles
    t /= np.sqrt(t[0] * t[0] + t[1] * t[1])
    facing = np.array([[ta[1], -ta[0]], [-tb[1], tb[0]]])
    ends = []
    for own, other, way in ((u.first, u.second_end, t), (u.first_end, u.second, -t)):
        d = place[:, other] - place[:, own]
        by_b = d[0] * way[0] + d[1] * way[1] > 0
        normal = np.where(by_b, *facing)
        closure = -(d[0] * normal[0] + d[1] * normal[1])
        ends.append((np.where(by_b, place[:, other], place[:, own]), normal, closure, by_b))
    (at0, n0, c0, b0), (at1, n1, c1, b1) = ends
    at = (1 - f) * at0[:, of] + f * at1[:, of]
    normal = (1 - f) * n0[:, of] + f * n1[:, of]
    normal /= np.sqrt(normal[0] ** 2 + normal[1] ** 2)
    closure = (1 - f) * c0[of] + f * c1[of]
    overlap = ((at1 - at0) * t).sum(axis=0)
    sine, cosine = ta[1] * tb[0] - ta[0] * tb[1], -(ta * tb).sum(axis=0)
    gone, slope = raised(sine, cosine)
    lies, held = (1 - gone) * (overlap > 0), np.maximum(overlap, 0.0)
    pull = (lies * (b1.astype(float) - b0) * t)[:, of]
    across = np.stack([-t[1], t[0]])[:, of]
    low, high = (((end[:, of] - at) * across).sum(axis=0) for end in (at0, at1))
    twist = lies[of] * ((b0[of] - 0.5) * low - (b1[of] - 0.5) * high)
    twist -= (np.sign(sine) * slope * held)[of]
    w = u.weight
    return at, normal, closure, w * (lies * held)[of], w * pull, w * twist
