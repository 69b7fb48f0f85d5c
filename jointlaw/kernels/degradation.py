"""Asperity degradation, by work and by stress: docs/theory-incremental.md, "Asperity degradation".

The slopes of all facets are multiplied by the retention

    rho = s + (1 - s) exp(-W/slope_wear) u,      u = 1/(1 + N/degradation_stress)

s: `slope_residual`. W: work of shear so far, at the beginning of a step. N: the largest contact
stress so far, the stress that the normal forces of the asperities bear, the sum of A c1 Phi over
the facets. Without friction it is the normal stress.

A step takes the slopes that belong to its own contact stress. Slopes of facets that are in touch
because the joint has dilated depend on the contact stress, and the contact stress on the slopes: a
small decrease of the slopes relieves facets that have climbed far. Slopes by the contact stress of
the old slopes would therefore decrease by many times too much. `degrade_by_stress` solves for both.
With x = climb of a facet at full slopes, y = closure + rho x, the equation in the factor u,

    u N(s + w u) - S (1 - u) = 0,      S = degradation_stress, w = (1 - s) exp(-W/slope_wear)

has one root in (0, 1], because the left side increases with u: of two opposite facets, the one
that climbs (x > 0) bears more, so N does not decrease with the slopes. For elastic asperities it is
convex, too, and Newton's method from above converges without overshoot.

A zero increment is neutral: it finds the contact stress that the state has stored.
"""

from typing import NamedTuple

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import FACTOR_CONVERGENCE, MAX_FACTOR_ITERATIONS
from .cells import Cells, evaluate_cells, reciprocal, slider_compliance
from .interlock import offset
from .plasticity import sets_own_indentation, subtract_plastic, update_indentation


class AsperityState(NamedTuple):
    """The parts of the rows (rows, B) of asperities in a state, as views."""

    q: Array  # slider forces times lam (2, M, D, B)
    indentation: Array  # plastic indentation of every facet (M, B); no rows unless they yield
    plastic_work: Array  # (B,) in J/m2, or no rows
    lost_slopes: Array  # lost fraction of the slopes (B,); no rows unless they degrade
    shear_work: Array  # (B,) in J/m2 that degrades slopes, or no rows
    peak_contact_stress: Array  # (B,) in Pa, the largest so far, or no rows

    @property
    def slope_retention(self) -> Array:
        """Remaining fraction of the slopes (B,)."""
        return 1 - self.lost_slopes if self.lost_slopes.size else np.ones(self.q.shape[-1])


class ContactStress(NamedTuple):
    """Stress that the normal forces of asperities bear, and its derivative by the retention."""

    stress: Array  # N (B,) in Pa
    slope: Array  # dN/drho (B,) in Pa, >= 0


def degrade_slopes(k: FacetTables, old: AsperityState) -> Array:
    """Lost fraction (B,) of the slopes after the work of shear so far; it never decreases."""
    lost = (k.slope_residual - 1) * np.expm1(-old.shear_work / k.slope_wear)
    if k.degrades_by_stress:
        u = stress_factor(k, old.peak_contact_stress)
        lost = lost + stress_weight(k, old) * (1 - u)
    return np.maximum(old.lost_slopes, lost)


def degrade_sliders(
    k: FacetTables, before: Cells, after: Cells, strength: Array, q: Array, beyond: float
) -> tuple[Array, Array]:
    """Slider forces q after slopes have decreased at rest, and dissipated energy (B,) in J/m2.

    As in a zero increment: springs that disengage release their force, and friction limits q.
    beyond: relative to the friction limit, as in `FrictionTolerances`.
    """
    remaining = np.minimum(after.kappa * reciprocal(before.kappa), 1.0)
    remaining = np.where(after.kappa < before.kappa, remaining, 1.0)
    q2 = q[0] ** 2 + q[1] ** 2
    size = remaining * np.sqrt(q2)
    limit = strength * after.G
    scale = remaining * np.divide(
        limit, size, out=np.ones_like(size), where=size > (1 + beyond) * limit
    )
    dissipated = q2 * (reciprocal(before.kappa) - scale**2 * reciprocal(after.kappa))
    return scale * q, np.sum(slider_compliance(k) * dissipated, axis=(0, 1))


def climb(k: FacetTables, delta: Array) -> Array:
    """Climb x (M, B) in m of every facet at full slopes: y = closure + rho x."""
    return np.einsum("jm,jb->mb", k.m[1:], offset(k, delta[1:]))


def slope_energy_rate(k: FacetTables, delta: Array, cells: Cells) -> Array:
    """Derivative (M, B) in J/m2 of the energy of the normal springs by the retention."""
    return (k.area * k.c1)[:, None] * climb(k, delta) * cells.force


def stress_factor(k: FacetTables, stress: Array) -> Array:
    """Factor u (B,), 0 to 1, of the slopes after this largest contact stress (B,) in Pa."""
    return 1 / (1 + stress / k.degradation_stress)


def stress_weight(k: FacetTables, state: AsperityState) -> Array:
    """Weight w (B,) of u in the retention, at the work of shear so far."""
    retained = np.ones(state.q.shape[-1])
    return (1 - k.slope_residual) * (
        np.exp(-state.shear_work / k.slope_wear) if k.degrades else retained
    )


def contact_stress(
    k: FacetTables, closure: Array, x: Array, retention: Array, indentation: Array
) -> ContactStress:
    """Contact stress at this retention (B,).

    closure: of the joints (B,); x: `climb` of the facets (M, B); indentation: plastic indentation
    (M, B) before the step, no rows unless asperities yield.
    """
    y = closure + retention * x
    after = evaluate_cells(k, y)
    slope = after.slope * x
    if k.yields:
        z = update_indentation(k, indentation, y)
        plastic = evaluate_cells(k, z)
        after = subtract_plastic(after, plastic)
        indenting = np.where(sets_own_indentation(k, y, z), x, x[k.opposite])
        softening = np.where(z > indentation, plastic.slope * indenting, 0.0)
        slope = np.where(after.force > 0, after.slope * x - softening, 0.0)
    scale = k.area * k.c1
    return ContactStress(scale @ after.force, scale @ slope)


def degrade_by_stress(
    k: FacetTables, delta: Array, old: AsperityState, lost: Array
) -> tuple[Array, Array, Array]:
    """Slopes that belong to the contact stress at the end of a step.

    Parameters
    ----------
    delta: displacement (dim, B) in m at the end of the step.
    old: state before the step.
    lost: lost slopes (B,) at the beginning of the step, after degradation by work.

    Returns lost slopes (B,), the largest contact stress (B,) in Pa, and the derivative (B,) in 1/Pa
    of the retention by the contact stress at fixed slopes, which the tangent needs: zero where the
    contact stress is below the largest one so far, because the slopes then stay.
    """
    S = k.degradation_stress
    peak = old.peak_contact_stress
    weight = stress_weight(k, old)
    x = climb(k, delta)
    now = contact_stress(k, delta[0], x, 1 - lost, old.indentation)
    exceeds = now.stress > peak
    new_lost = lost
    u = stress_factor(k, peak)
    low = np.zeros_like(u)
    high = u
    searches = exceeds
    for _ in range(MAX_FACTOR_ITERATIONS):
        if not searches.any():
            break
        excess = u * now.stress - S * (1 - u)
        high = np.where(excess > 0, u, high)
        low = np.where(excess > 0, low, u)
        next_u = u - excess / (now.stress + u * weight * now.slope + S)
        next_u = np.where((next_u > low) & (next_u < high), next_u, 0.5 * (low + high))
        searches = searches & (np.abs(next_u - u) > FACTOR_CONVERGENCE * u)
        u = np.where(searches, next_u, u)
        new_lost = np.where(exceeds, np.maximum(lost, 1 - k.slope_residual - weight * u), lost)
        now = contact_stress(k, delta[0], x, 1 - new_lost, old.indentation)
    rate = -weight / (S / u**2 + weight * now.slope)
    return (
        new_lost,
        np.where(exceeds, np.maximum(now.stress, peak), peak),
        np.where(new_lost > lost, rate, 0.0),
    )
