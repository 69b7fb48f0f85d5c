"""The bond in a step: docs/theory-incremental.md, "The bond"."""

import numpy as np

from ..parameters.bond import Bond
from ..support.checks import Array
from .element import Element, ElementResponse


class Bonded(Element):
    """The bond of a joint, with its damage."""

    native_name = "bonded"

    def __init__(self, bond: Bond) -> None:
        self.bond = bond
        self.rows = {"damage": 1}
        self.tensile_strength = bond.tension
        self.tensile_opening = float(1.0 / bond.limits[1][0])
        self.tensile_stiffness = bond.normal_stiffness

    def numbers(self) -> dict[str, float]:
        begin, end = self.bond.limits
        return {
            "bond_normal_stiffness": self.bond.normal_stiffness,
            "bond_shear_stiffness": self.bond.shear_stiffness,
            "inverse_onset_opening": float(begin[0]),
            "inverse_onset_slip": float(begin[1]),
            "inverse_failure_opening": float(end[0]),
            "inverse_failure_slip": float(end[1]),
        }

    def step(
        self, delta: Array, d: Array, state: Array, new: Array, tangent: bool
    ) -> ElementResponse:
        """As `Element.step`.

        1. Damage D is what opening and slip ask for, and never less than before.
        2. Traction is (1 - D) K u, u the displacement less its closure; stored is (1 - D) psi.
        3. Lost is the integral of psi dD towards u, by the geometric mean of psi where the damage
           begins and ends to grow: exact where one mode acts alone, else in the limit of small
           steps.
        4. Tangent is (1 - D) K, less K u (dD/du)^T where the damage grows.
        """
        bond, old = self.bond, state[0]
        u, K = self._opened(delta + d)
        squares, psi = self._energy(u)
        found, slope = damage_at(bond, squares)
        grows = found > old
        damage = new[0] = np.where(grows, found, old)
        softens = grows & (damage < 1.0)
        first = np.where(grows, beyond(bond, squares, old), 1.0)
        last = np.where(grows & ~softens, beyond(bond, squares, damage), 1.0)
        lost = np.where(grows, (damage - old) * psi / np.sqrt(first * last), 0.0)
        rate = u * half_axes(bond, damage)[[0, 1, 1][: len(u)]] ** 2
        rate = np.divide(rate, slope, out=np.zeros_like(u), where=softens)
        acts = np.stack([u[0] < 0.0, *[damage >= 0.0] * (len(u) - 1)])
        whole = np.eye(len(u))[:, :, None] * ((1.0 - damage) * K * acts)
        return ElementResponse((1.0 - damage) * K * u, lost, whole - (K * u)[:, None] * rate[None])

    def stored(self, delta: Array, state: Array) -> Array:
        return (1.0 - state[0]) * self._energy(self._opened(delta)[0])[1]

    def stiffness(self, delta: Array, state: Array) -> Array:
        """As `Element.stiffness`; softening, which lowers it, is left out."""
        return (1.0 - state[0]) * max(self.bond.normal_stiffness, self.bond.shear_stiffness)

    def shear_stiffness(self, delta: Array, stress: float) -> float:
        """As `Element.shear_stiffness`, of the whole bond."""
        return self.bond.shear_stiffness if len(delta) > 1 else 0.0

    def first_loading_stiffness(self, closure: Array, reduction: float) -> Array:
        """As `Element.first_loading_stiffness`: a reduction divides shear stiffness by F^2."""
        shear = self.bond.shear_stiffness / reduction**2
        return np.full(closure.shape, max(self.bond.normal_stiffness, shear))

    def _opened(self, delta: Array) -> tuple[Array, Array]:
        """Opening and slip u (dim, B), and their stiffnesses (dim, 1)."""
        u = np.concatenate([np.minimum(delta[:1], 0.0), delta[1:]])
        stiffness = [self.bond.normal_stiffness, *[self.bond.shear_stiffness] * (len(u) - 1)]
        return u, np.array(stiffness)[:, None]

    def _energy(self, u: Array) -> tuple[Array, Array]:
        """Squares (2, B) of opening and slip, and psi (B,), the energy of the whole bond."""
        squares = np.stack([u[0] * u[0], np.sum(u[1:] * u[1:], axis=0)])
        K = self.bond.normal_stiffness, self.bond.shear_stiffness
        return squares, 0.5 * (K[0] * squares[0] + K[1] * squares[1])


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
