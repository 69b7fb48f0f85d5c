"""The bond in a step: docs/theory-incremental.md, "The bond"."""

from typing import NamedTuple

import numpy as np

from ..parameters.bond import Bond
from ..support.checks import Array


class Held(NamedTuple):
    """What the bond of B joints is after a step, and what it adds to the joint."""

    damage: Array  # (B,)
    F: Array  # (dim, B) in Pa
    stored: Array  # (B,) in J/m2
    lost: Array  # (B,) in J/m2, >= 0
    C: Array  # (dim, dim, B) in Pa/m


def hold(bond: Bond, delta: Array, old: Array) -> Held:
    """The bond after a step to the displacement delta (dim, B), with the damage `old` (B,) before.

    1. Damage D is what opening and slip ask for, and never less than before.
    2. Traction is (1 - D) K u, u the displacement less its closure; stored is (1 - D) psi.
    3. Lost is the integral of psi dD towards u, by the geometric mean of psi where the damage
       begins and ends to grow: exact where one mode acts alone, else in the limit of small steps.
    4. Tangent is (1 - D) K, less K u (dD/du)^T where the damage grows.
    """
    u = np.concatenate([np.minimum(delta[:1], 0.0), delta[1:]])
    K = np.array([[bond.normal_stiffness], *[[bond.shear_stiffness]] * (len(u) - 1)])
    squares = np.stack([u[0] * u[0], np.sum(u[1:] * u[1:], axis=0)])
    psi = 0.5 * (bond.normal_stiffness * squares[0] + bond.shear_stiffness * squares[1])
    found, slope = damage_at(bond, squares)
    grows = found > old
    damage = np.where(grows, found, old)
    softens = grows & (damage < 1.0)
    first = np.where(grows, beyond(bond, squares, old), 1.0)
    last = np.where(grows & ~softens, beyond(bond, squares, damage), 1.0)
    lost = np.where(grows, (damage - old) * psi / np.sqrt(first * last), 0.0)
    rate = u * half_axes(bond, damage)[[0, 1, 1][: len(u)]] ** 2
    rate = np.divide(rate, slope, out=np.zeros_like(u), where=softens)
    acts = np.stack([u[0] < 0.0, *[damage >= 0.0] * (len(u) - 1)])
    C = np.eye(len(u))[:, :, None] * ((1.0 - damage) * K * acts)
    C = C - (K * u)[:, None] * rate[None]
    return Held(damage, (1.0 - damage) * K * u, (1.0 - damage) * psi, lost, C)


def half_axes(bond: Bond, damage: Array) -> Array:
    """One over the opening and the slip (2, B) that the strength of this damage (B,) allows."""
    begin, end = (limit[:, None] for limit in bond.limits)
    return begin - damage * (begin - end)


def beyond(bond: Bond, squares: Array, damage: Array) -> Array:
    """1 (B,) where opening and slip, squared (2, B), are the strength of this damage."""
    p = half_axes(bond, damage)
    return squares[0] * (p[0] * p[0]) + squares[1] * (p[1] * p[1])


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
