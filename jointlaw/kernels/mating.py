"""Slopes that fade with the distance from the mated position: docs/theory-incremental.md, "Mating".

Vectors of a facet are first written along axis 1, along its azimuth e and across it, where one
facet is like another; `in_axes` turns them into the axes of the joint.
"""

from typing import NamedTuple

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import ROUNDING_TOLERANCE, UNMATED_DISTANCE


class Planes(NamedTuple):
    """The planes of all facets at one place; B is 1 where they are the same in all joints."""

    g: Array  # dy/dd = (1, slope of the facet now) (dim, M, B)
    n: Array  # c1 g: the normal of a mated joint's facet (dim, M, B)
    basis: Array  # in-facet directions s and t (2, dim, M, B)
    gamma: Array  # |n|: normal force over A Phi, 1 where mated and c1 far from there (M, B)


class Turning(NamedTuple):
    """Derivatives of `Planes` by the in-plane displacement, whose axis comes before M."""

    n: Array  # (dim, dim - 1, M, B)
    basis: Array  # (2, dim, dim - 1, M, B)
    gamma: Array  # (dim - 1, M, B)


def offset(k: FacetTables, p: Array) -> Array:
    """The offset o (dim - 1, B) that facets climb at the in-plane displacement p (dim - 1, B)."""
    if not k.fades:
        return p
    x = p / k.mating_length
    return p / np.sqrt(1 + np.sum(x * x, axis=0))


def first_touch(k: FacetTables) -> Array:
    """Displacement (dim,) in m from the mated position, at first touch, along axis 2.

    Raises ValueError for asperities that are always mated.
    """
    if k.dim == 1:
        raise ValueError("mated=False: a joint with closure_only is always mated")
    if not k.fades:
        raise ValueError(
            "mated=False: with an infinite mating_length a joint stays mated however far it slips; "
            "give the law a finite one"
        )
    p = np.zeros((k.dim - 1, 1))
    p[0] = UNMATED_DISTANCE * k.mating_length
    highest = np.max(k.m[1:].T @ offset(k, p))
    return np.array([-(1 + ROUNDING_TOLERANCE) * highest, *p[:, 0]])


def planes(k: FacetTables, p: Array, slopes: Array) -> Planes:
    """The planes at p (dim - 1, B), where the share `slopes` (B,) of the slopes is left."""
    if not k.fades:
        one = np.ones((1, 1))
        return Planes(k.m[:, :, None], k.n[:, :, None], np.stack([k.s, k.t])[..., None], one)
    along, across, m, N = _slope(k, p, slopes)
    one, none = np.ones_like(along), np.zeros_like(along)
    g = in_axes(k, np.stack([one, along, across]))
    s = in_axes(k, np.stack([-along, one, none]) / m)
    t = in_axes(k, np.stack([-across, -along * across, m * m]) / (m * N))
    c1 = k.c1[:, None]
    return Planes(g, c1 * g, np.stack([s, t]), c1 * N)


def turning(k: FacetTables, p: Array, slopes: Array) -> Turning:
    """How the planes turn where p (dim - 1, B) changes."""
    along, across, m, N = _slope(k, p, slopes)
    w, x, z = _place(k, p)
    bend = -slopes * k.steep[:, None] * w * w / k.mating_length
    ee, ez, zz = 3 * x * (1 - x * x), z * (1 - 3 * x * x), x * (1 - 3 * z * z)
    e, dim = k.azimuth[:, :, None], k.dim  # the derivatives of the slope, by p in the axes
    d_along = (bend * (ee * e + ez * _across(e)))[: dim - 1]
    d_across = (bend * (ez * e + zz * _across(e)))[: dim - 1]
    one, none = np.ones_like(along), np.zeros_like(along)
    t = np.stack([-across, -along * across, m * m]) / (m * N)
    s_by_along = np.stack([-one, -along, none]) / m**3
    t_by_along = np.stack([none, -across, 2 * along]) / (m * N) - t * along * (m**-2 + N**-2)
    t_by_across = np.stack([-one, -along, none]) / (m * N) - t * across / N**2

    def by_p(by_along: Array, by_across: Array) -> Array:
        v, u = in_axes(k, by_along)[:, None], in_axes(k, by_across)[:, None]
        return v * d_along + u * d_across

    c1 = k.c1[:, None]
    n = c1 * by_p(np.stack([none, one, none]), np.stack([none, none, one]))
    basis = np.stack([by_p(s_by_along, 0 * t), by_p(t_by_along, t_by_across)])
    return Turning(n, basis, c1 * (along * d_along + across * d_across) / N)


def in_axes(k: FacetTables, v: Array) -> Array:
    """Vectors (3, M, B) along axis 1, the azimuth, and across it, in the axes (dim, M, B)."""
    e = k.azimuth[:, :, None]
    return np.concatenate([v[:1], v[1] * e + v[2] * _across(e)])[: k.dim]


def _across(e: Array) -> Array:
    return np.stack([-e[1], e[0]])


def _place(k: FacetTables, p: Array) -> tuple[Array, Array, Array]:
    """Root of 1 - |o/D|^2 (B,), and o/D along and across every azimuth (M, B)."""
    far = np.concatenate([p, np.zeros((2 - len(p), p.shape[1]))]) / k.mating_length
    w = 1 / np.sqrt(1 + np.sum(far * far, axis=0))
    x, z = (np.einsum("im,ib->mb", e, w * far) for e in (k.azimuth, _across(k.azimuth)))
    return w, x, z


def _slope(k: FacetTables, p: Array, slopes: Array) -> tuple[Array, Array, Array, Array]:
    """Slope of every facet now, slopes tan(theta) (do/dp) e: along the azimuth and across it.

    Then the roots of 1 + along^2 and of 1 + along^2 + across^2, all (M, B).
    """
    w, x, z = _place(k, p)
    steep = slopes * k.steep[:, None] * w
    along, across = steep * (1 - x * x), -steep * x * z
    m2 = 1 + along**2
    return along, across, np.sqrt(m2), np.sqrt(m2 + across**2)
