"""Law points between the two ends of a long overlap of edge on edge, by linear interpolation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .tilt import raised, soft_size


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


def interpolate(between: Between, place: np.ndarray, ways: np.ndarray, soft: float) -> tuple:
    """Place, normal, closure, length of the points, and its derivatives `pull` and `twist`.

    place, ways (2, c): corners and unit vectors along the edges; soft (m): see `geometry`. At
    either end there is a corner of one block over the other's edge.
    """
    u, f, of = between, between.fraction, between.of
    ta, tb = ways[:, u.first], ways[:, u.second]
    t = ta - tb  # along both, so that the blocks may trade roles
    t /= np.sqrt(_dot(t, t))
    facing = np.array([[ta[1], -ta[0]], [-tb[1], tb[0]]])
    places, normals, closures, turns = [], [], [], []
    overlap = _dot(place[:, u.first_end] - place[:, u.first], t)
    for mine, yours, way in ((u.first, u.second_end, t), (u.first_end, u.second, -t)):
        one, other = place[:, mine], place[:, yours]
        inside = _dot(other - one, way)
        normal = np.where(inside > 0, *facing)
        places.append(np.where(inside > 0, other, one))
        normals.append(normal)
        closures.append(-_dot(other - one, normal))
        size, slope = soft_size(inside, soft)
        overlap = overlap - 0.5 * (inside + size)
        turns.append((one, other, 0.5 * (1 + slope)))
    at, normal, closure = (
        (1 - f) * ends[0][..., of] + f * ends[1][..., of] for ends in (places, normals, closures)
    )
    normal /= np.sqrt(_dot(normal, normal))
    sine, cosine = ta[1] * tb[0] - ta[0] * tb[1], -_dot(ta, tb)
    gone, slope = raised(sine, cosine)
    lies = (1 - gone) * (overlap > 0)
    (one0, other0, by0), (one1, other1, by1) = turns
    pull = (lies * (by1 - by0) * t)[:, of]
    across = np.stack([-t[1], t[0]])
    # Seen from the point: each end turns with its own block, the direction with the mean of both.
    twist = (1 - by1) * _dot(one1, across) - by1 * _dot(other1, across)
    twist -= (1 - by0) * _dot(one0, across) - by0 * _dot(other0, across)
    twist = twist[of] + 2 * (by1 - by0)[of] * _dot(at, across[:, of])
    twist = 0.5 * lies[of] * twist - (np.sign(sine) * slope * np.maximum(overlap, 0.0))[of]
    w = u.weight
    return at, normal, closure, w * (lies * overlap)[of], w * pull, w * twist


def _dot(p, q):
    return p[0] * q[0] + p[1] * q[1]
