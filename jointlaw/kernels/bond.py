"""The bond in a step: docs/theory-incremental.md, "The bond"."""

from typing import NamedTuple

import numpy as np

from ..parameters.bond import Bond
from ..support.checks import Array


class Held(NamedTuple):
    """What the bond of B joints is after a step, and what it adds to the joint."""

    damage: Array  # (B,)
    F: Array  # (dim, B) in Pa
    lost: Array  # (B,) in J/m2, >= 0
    C: Array  # (dim, dim, B) in Pa/m


def hold(bond: Bond, delta: Array, old: Array) -> Held:
    """The bond after a step to the displacement delta (dim, B), with the damage `old` (B,) before.

    1. Damage D is what opening and slip ask for, and never less than before.
    2. Traction is (1 - D) K u, u the displacement less its closure.
    3. Lost is the integral of psi dD towards u, by the geometric mean of psi where the damage
       begins and ends to grow: exact where one mode acts alone, else in the limit of small steps.
    4. Tangent is (1 - D) K, less K u (dD/du)^T where the damage grows.
    """
    u, K = stretch(delta), stiffness(bond, len(delta))
    squares = squares_of(u)
    found, slope = damage_at(bond, squares)
    grows = found > old
    damage = np.where(grows, found, old)
    softens = grows & (damage < 1.0)
    first = np.where(grows, beyond(bond, squares, old), 1.0)
    last = np.where(grows & ~softens, beyond(bond, squares, damage), 1.0)
    lost = np.where(grows, (damage - old) * psi(bond, squares) / np.sqrt(first * last), 0.0)
    rate = u * half_axes(bond, damage)[[0, 1, 1][: len(u)]] ** 2
    rate = np.divide(rate, slope, out=np.zeros_like(u), where=softens)
    acts = np.stack([u[0] < 0.0, *[damage >= 0.0] * (len(u) - 1)])
    C = np.eye(len(u))[:, :, None] * ((1.0 - damage) * K * acts)
    return Held(damage, traction(bond, delta, damage), lost, C - (K * u)[:, None] * rate[None])


def stretch(delta: Array) -> Array:
    """What strains the bond (dim, B): the displacement less its closure."""
    return np.concatenate([np.minimum(delta[:1], 0.0), delta[1:]])


def stiffness(bond: Bond, dim: int) -> Array:
    """K of every component (dim, 1) in Pa/m."""
    return np.array([[bond.normal_stiffness], *[[bond.shear_stiffness]] * (dim - 1)])


def half_axes(bond: Bond, damage: Array) -> Array:
    """One over the opening and the slip (2, B) that the strength of this damage (B,) allows."""
    begin, end = (limit[:, None] for limit in bond.limits)
    return begin - damage * (begin - end)


def traction(bond: Bond, delta: Array, damage: Array) -> Array:
    """The bond's part of the traction (dim, B) in Pa."""
    return (1.0 - damage) * stiffness(bond, len(delta)) * stretch(delta)


def stored(bond: Bond, delta: Array, damage: Array) -> Array:
    """The bond's part of the stored energy (B,) in J/m2."""
    return (1.0 - damage) * psi(bond, squares_of(stretch(delta)))


def squares_of(u: Array) -> Array:
    """Opening and slip, squared (2, B)."""
    return np.stack([u[0] * u[0], np.sum(u[1:] * u[1:], axis=0)])


def beyond(bond: Bond, squares: Array, damage: Array) -> Array:
    """1 (B,) where opening and slip, squared (2, B), are the strength of this damage."""
    p = half_axes(bond, damage)
    return squares[0] * (p[0] * p[0]) + squares[1] * (p[1] * p[1])


def psi(bond: Bond, squares: Array) -> Array:
    """Elastic energy (B,) in J/m2 of a whole bond."""
    return 0.5 * (bond.normal_stiffness * squares[0] + bond.shear_stiffness * squares[1])


def damage_at(bond: Bond, squares: Array) -> tuple[Array, Array]:
    """Damage d (B,) that opening and slip, squared (2, B), ask for: the smaller root of

    opening^2 (begin - d soft)^2 + slip^2 (begin - d soft)^2 = 1, soft = begin - end of each,
    0 where they are within the strength and 1 where no root is below 1. Also half the slope of the
    left side by -d at the root.
    """
    begin, end = bond.limits
    soft = begin - end
    turn = begin[1] * end[0] - begin[0] * end[1]
    inside = squares[0] * (soft[0] * soft[0]) + squares[1] * (soft[1] * soft[1])
    slope = np.sqrt(np.maximum(inside - squares[0] * squares[1] * (turn * turn), 0.0))
    over = beyond(bond, squares, np.zeros(1)) - 1.0
    bottom = squares[0] * (begin[0] * soft[0]) + squares[1] * (begin[1] * soft[1]) + slope
    softens = (over > 0.0) & (beyond(bond, squares, np.ones(1)) < 1.0)
    found = np.divide(over, bottom, out=np.where(over > 0.0, 1.0, 0.0), where=softens)
    return np.minimum(found, 1.0), slope
