"""The cohesive bond in a step: docs/theory-incremental.md, "Cohesive bond"."""

import numpy as np

from ..parameters.bond import Bond
from ..support.checks import Array
from .element import Element, ElementResponse


class BondElement(Element):
    """The bond of a joint, with its damage."""

    native_name = "bonded"
    damage_row = "damage"

    def __init__(self, bond: Bond) -> None:
        self.bond = bond
        self.rows = {"damage": 1}
        self.row_bounds = {"damage": (0.0, 1.0)}
        self.tensile_strength = bond.tension
        self.tensile_opening = float(1.0 / bond.limits[1][0])
        self.tensile_stiffness = bond.normal_stiffness

    def numbers(self) -> dict[str, float]:
        onset, failure = self.bond.limits
        return {
            "bond_normal_stiffness": self.bond.normal_stiffness,
            "bond_shear_stiffness": self.bond.shear_stiffness,
            "inverse_onset_opening": float(onset[0]),
            "inverse_onset_slip": float(onset[1]),
            "inverse_failure_opening": float(failure[0]),
            "inverse_failure_slip": float(failure[1]),
        }

    def step(
        self, delta: Array, d: Array, state: Array, new: Array, tangent: bool
    ) -> ElementResponse:
        """As `Element.step`.

        1. Damage D follows from opening and slip (`damage_at`), and never decreases.
        2. Traction is (1 - D) K u, u the displacement without closure; stored is (1 - D) psi.
        3. Dissipated is the integral of psi dD in the direction of u, by the geometric mean of psi
           where the damage begins and ends to grow: exact in one mode, else first-order accurate.
        4. Tangent is (1 - D) K, less K u (dD/du)^T where the damage grows.
        """
        bond = self.bond
        old = state[0]
        u, K = self._opening_and_slip(delta + d)
        squares, psi = self._energy(u)
        driven, slope = damage_at(bond, squares)
        grows = driven > old
        damage = np.where(grows, driven, old)
        new[0] = damage
        softens = grows & (damage < 1.0)
        onset = np.where(grows, strength_ratio(bond, squares, old), 1.0)
        final = np.where(grows & ~softens, strength_ratio(bond, squares, damage), 1.0)
        dissipated = np.where(grows, (damage - old) * psi / np.sqrt(onset * final), 0.0)
        rate = u * inverse_axes(bond, damage)[[0, 1, 1][: len(u)]] ** 2
        rate = np.divide(rate, slope, out=np.zeros_like(u), where=softens)
        acts = np.stack([u[0] < 0.0, *[damage >= 0.0] * (len(u) - 1)])
        secant = np.eye(len(u))[:, :, None] * ((1.0 - damage) * K * acts)
        C = secant - (K * u)[:, None] * rate[None]
        return ElementResponse((1.0 - damage) * K * u, dissipated, C)

    def stored_energy(self, delta: Array, state: Array) -> Array:
        u, _ = self._opening_and_slip(delta)
        return (1.0 - state[0]) * self._energy(u)[1]

    def stiffness(self, delta: Array, state: Array) -> Array:
        """As `Element.stiffness`, without softening, which lowers it."""
        return (1.0 - state[0]) * max(self.bond.normal_stiffness, self.bond.shear_stiffness)

    def shear_stiffness(self, delta: Array, stress: float) -> float:
        """As `Element.shear_stiffness`, of the intact bond."""
        return self.bond.shear_stiffness if len(delta) > 1 else 0.0

    def first_loading_stiffness(self, closure: Array, reduction: float) -> Array:
        """As `Element.first_loading_stiffness`: a reduction divides shear stiffness by F^2."""
        shear = self.bond.shear_stiffness / reduction**2
        return np.full(closure.shape, max(self.bond.normal_stiffness, shear))

    def _opening_and_slip(self, delta: Array) -> tuple[Array, Array]:
        """Opening and slip u (dim, B), and their stiffnesses (dim, 1)."""
        u = np.concatenate([np.minimum(delta[:1], 0.0), delta[1:]])
        stiffness = [self.bond.normal_stiffness, *[self.bond.shear_stiffness] * (len(u) - 1)]
        return u, np.array(stiffness)[:, None]

    def _energy(self, u: Array) -> tuple[Array, Array]:
        """Squares (2, B) of opening and slip, and psi (B,), the energy of the intact bond."""
        squares = np.stack([u[0] * u[0], np.sum(u[1:] * u[1:], axis=0)])
        K = self.bond.normal_stiffness, self.bond.shear_stiffness
        return squares, 0.5 * (K[0] * squares[0] + K[1] * squares[1])


def inverse_axes(bond: Bond, damage: Array) -> Array:
    """One over the half axes (2, B) of the strength ellipse at this damage (B,): opening, slip."""
    onset, failure = (limit[:, None] for limit in bond.limits)
    return onset - damage * (onset - failure)


def strength_ratio(bond: Bond, squares: Array, damage: Array) -> Array:
    """Left side of the strength ellipse (B,), for squares (2, B) of opening and slip; 1 on it."""
    axes = inverse_axes(bond, damage)
    return squares[0] * (axes[0] * axes[0]) + squares[1] * (axes[1] * axes[1])


def damage_at(bond: Bond, squares: Array) -> tuple[Array, Array]:
    """Damage D (B,) at which squares (2, B) of opening and slip are on the strength ellipse.

    The smaller root of opening^2 (onset - D fall)^2 + slip^2 (onset - D fall)^2 = 1, with fall =
    onset - failure of each mode; 0 within the strength of the intact bond, and 1 where no root is
    below 1. Also half the derivative of the left side by -D at the root.
    """
    onset, failure = bond.limits
    fall = onset - failure
    mixed = onset[1] * failure[0] - onset[0] * failure[1]
    quadratic = squares[0] * (fall[0] * fall[0]) + squares[1] * (fall[1] * fall[1])
    slope = np.sqrt(np.maximum(quadratic - squares[0] * squares[1] * (mixed * mixed), 0.0))
    excess = strength_ratio(bond, squares, np.zeros(1)) - 1.0
    divisor = squares[0] * (onset[0] * fall[0]) + squares[1] * (onset[1] * fall[1]) + slope
    softens = (excess > 0.0) & (strength_ratio(bond, squares, np.ones(1)) < 1.0)
    damage = np.divide(excess, divisor, out=np.where(excess > 0.0, 1.0, 0.0), where=softens)
    return np.minimum(damage, 1.0), slope
