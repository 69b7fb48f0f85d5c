"""Interlock that decays with slip: docs/theory-incremental.md, "Loss of interlock with slip".

The faces of a joint interlock (are mated) at the position in which they were formed: asperities of
one face fit into hollows of the other, and slip makes a facet climb along its whole slope. With the
distance from that position the faces fit less and less, so a facet climbs less per slip. This is
modelled by an offset: at the in-plane displacement p a facet climbs as if the displacement was

    o = p / sqrt(1 + |p|^2/D^2),        D: the mating length

Near p = 0, o = p. Far away |o| approaches D, so dilation ends. The effective closure of a facet is
y = m . (closure, o), and its slope in the direction of p is tan(theta) do/dp. The normal n and the
directions s, t in the plane of a facet therefore rotate with slip; as the normal force stays on the
facet, its size is multiplied by gamma = |n|. All of these are the `Planes` of a step.

With asperity degradation the slopes are multiplied by the slope retention (0 to 1) as well.

Vectors of a facet are first written along axis 1, along its azimuth e and across it, where all
facets have the same formulas; `to_joint_axes` rotates them to the axes of the joint.
"""

from typing import NamedTuple

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import ROUNDING_TOLERANCE, UNDERFLOW, UNMATED_DISTANCE


class Planes(NamedTuple):
    """The planes of all facets at one displacement; B is 1 if they are the same in all joints."""

    g: Array  # dy/dd = (1, slope of the facet) (dim, M, B)
    n: Array  # c1 g, the normal of the facet of an interlocked joint (dim, M, B)
    basis: Array  # in-facet directions s and t (2, dim, M, B)
    gamma: Array  # |n|: normal force over A Phi, 1 if interlocked, c1 far from there (M, B)


class PlaneDerivatives(NamedTuple):
    """Derivatives of `Planes` by the in-plane displacement, whose axis comes before M."""

    n: Array  # (dim, dim - 1, M, B)
    basis: Array  # (2, dim, dim - 1, M, B)
    gamma: Array  # (dim - 1, M, B)


def offset(k: FacetTables, p: Array) -> Array:
    """The offset o (dim - 1, B) in m at the in-plane displacement p (dim - 1, B) in m."""
    if not k.interlock_decays:
        return p
    x = p / k.mating_length
    return p / np.sqrt(1 + np.sum(x * x, axis=0))


def effective_closure(k: FacetTables, delta: Array, slope_retention: Array) -> Array:
    """Effective closure y (M, B) in m of every facet: its normal approach over c1 = cos theta.

    The sum m . (closure, offset), m = n/c1 being the facet normal scaled to a unit normal
    component. `offset` computes the offset from the shear displacement `delta[1:]`; the retention
    (B,) lowers the slopes of a law that degrades. Values below the underflow threshold become 0.
    """
    y = k.m[0][:, None] * delta[0]
    for row, o in zip(k.m[1:], offset(k, delta[1:]), strict=True):
        y = y + row[:, None] * (slope_retention * o if k.slopes_change else o)
    return np.where(np.abs(y) < UNDERFLOW, 0.0, y)


def first_touch(k: FacetTables) -> Array:
    """Displacement (dim,) in m at which the faces of an unmated joint first touch.

    Its shear is 100 mating lengths along axis 2, where no interlock is left. Its closure is
    negative: the joint is open by the height of the facet that touches first, and a little more,
    so that no facet bears. Raises ValueError for a law with `closure_only` or with an infinite
    mating length, whose faces always interlock.
    """
    if k.dim == 1:
        raise ValueError("mated=False: a joint with closure_only is always mated")
    if not k.interlock_decays:
        raise ValueError(
            "mated=False: with an infinite mating_length a joint stays mated however far it slips; "
            "give the law a finite one"
        )
    p = np.zeros((k.dim - 1, 1))
    p[0] = UNMATED_DISTANCE * k.mating_length
    highest = np.max(k.m[1:].T @ offset(k, p))
    return np.array([-(1 + ROUNDING_TOLERANCE) * highest, *p[:, 0]])


def planes(k: FacetTables, p: Array, slope_retention: Array) -> Planes:
    """Gradients, normals, tangents and friction factor gamma of the facets' planes.

    p: in-plane displacement (dim - 1, B) in m; slope_retention: (B,). A facet's slope along p
    decays with slip where interlock decays. Without decay the planes are constant, and the arrays
    have length one along B.
    """
    if not k.interlock_decays:
        one = np.ones((1, 1))
        return Planes(k.m[:, :, None], k.n[:, :, None], np.stack([k.s, k.t])[..., None], one)
    along, across, m, N = _slopes(k, p, slope_retention)
    one = np.ones_like(along)
    zero = np.zeros_like(along)
    g = to_joint_axes(k, np.stack([one, along, across]))
    s = to_joint_axes(k, np.stack([-along, one, zero]) / m)
    t = to_joint_axes(k, np.stack([-across, -along * across, m * m]) / (m * N))
    c1 = k.c1[:, None]
    return Planes(g, c1 * g, np.stack([s, t]), c1 * N)


def plane_derivatives(k: FacetTables, p: Array, slope_retention: Array) -> PlaneDerivatives:
    """Derivatives of the planes by the in-plane displacement p (dim - 1, B)."""
    w, x, z = _relative_offset(k, p)
    rate = -slope_retention * k.tan_theta[:, None] * w * w / k.mating_length
    along_along = 3 * x * (1 - x * x)
    along_across = z * (1 - 3 * x * x)
    across_across = x * (1 - 3 * z * z)
    e = k.azimuth[:, :, None]
    dim = k.dim
    # derivatives of the slopes by p in the axes of the joint
    d_along = (rate * (along_along * e + along_across * _perpendicular(e)))[: dim - 1]
    d_across = (rate * (along_across * e + across_across * _perpendicular(e)))[: dim - 1]
    return _derivatives(k, p, slope_retention, d_along, d_across)


def retention_derivatives(k: FacetTables, p: Array, slope_retention: Array) -> PlaneDerivatives:
    """Derivatives of the planes by the slope retention (B,), as `plane_derivatives` by p.

    The axis before M has one entry. The slopes are proportional to the retention.
    """
    along, across, _, _ = _slopes(k, p, np.ones_like(slope_retention))
    return _derivatives(k, p, slope_retention, along[None], across[None])


def _derivatives(
    k: FacetTables, p: Array, slope_retention: Array, d_along: Array, d_across: Array
) -> PlaneDerivatives:
    """Derivatives of the planes where those of the slopes are d_along, d_across (..., M, B)."""
    along, across, m, N = _slopes(k, p, slope_retention)
    one = np.ones_like(along)
    zero = np.zeros_like(along)
    t = np.stack([-across, -along * across, m * m]) / (m * N)
    s_by_along = np.stack([-one, -along, zero]) / m**3
    t_by_along = np.stack([zero, -across, 2 * along]) / (m * N) - t * along * (m**-2 + N**-2)
    t_by_across = np.stack([-one, -along, zero]) / (m * N) - t * across / N**2

    def chain(by_along: Array, by_across: Array) -> Array:
        along_part = to_joint_axes(k, by_along)[:, None] * d_along
        return along_part + to_joint_axes(k, by_across)[:, None] * d_across

    c1 = k.c1[:, None]
    n = c1 * chain(np.stack([zero, one, zero]), np.stack([zero, zero, one]))
    basis = np.stack([chain(s_by_along, 0 * t), chain(t_by_along, t_by_across)])
    return PlaneDerivatives(n, basis, c1 * (along * d_along + across * d_across) / N)


def to_joint_axes(k: FacetTables, v: Array) -> Array:
    """Vectors (3, M, B) along axis 1, azimuth and across it, in the joint's axes (dim, M, B)."""
    e = k.azimuth[:, :, None]
    return np.concatenate([v[:1], v[1] * e + v[2] * _perpendicular(e)])[: k.dim]


def _perpendicular(e: Array) -> Array:
    return np.stack([-e[1], e[0]])


def _relative_offset(k: FacetTables, p: Array) -> tuple[Array, Array, Array]:
    """sqrt(1 - |o/D|^2) (B,), and o/D along and across every azimuth (M, B)."""
    relative = np.concatenate([p, np.zeros((2 - len(p), p.shape[1]))]) / k.mating_length
    w = 1 / np.sqrt(1 + np.sum(relative * relative, axis=0))
    x, z = (np.einsum("im,ib->mb", e, w * relative) for e in (k.azimuth, _perpendicular(k.azimuth)))
    return w, x, z


def _slopes(k: FacetTables, p: Array, slope_retention: Array) -> tuple[Array, Array, Array, Array]:
    """Slope of every facet, retention tan(theta) (do/dp) e, along the azimuth and across it.

    Then the roots of 1 + along^2 and of 1 + along^2 + across^2, all (M, B).
    """
    w, x, z = _relative_offset(k, p)
    steepest = slope_retention * k.tan_theta[:, None] * w
    along = steepest * (1 - x * x)
    across = -steepest * x * z
    m2 = 1 + along**2
    return along, across, np.sqrt(m2), np.sqrt(m2 + across**2)
