"""Asperity degradation by the work of shear: docs/theory-incremental.md, "Asperity degradation"."""

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from .cells import Cells, reciprocal, slider_compliance


def degrade_slopes(k: FacetTables, lost_slopes: Array, shear_work: Array) -> Array:
    """Lost fraction (B,) of the slopes after the work of shear (B,) in J/m2.

    lost_slopes: the fraction (B,) before; it never decreases.
    """
    lost = (k.slope_residual - 1) * np.expm1(-shear_work / k.slope_wear)
    return np.maximum(lost_slopes, lost)


def degrade_sliders(
    k: FacetTables, before: Cells, after: Cells, strength: Array, q: Array
) -> tuple[Array, Array]:
    """Slider forces q after slopes have decreased at rest, and dissipated energy (B,) in J/m2.

    before, after: the cells before and after the decrease. strength: friction limit of |q| over G.
    Each force is multiplied by kappa after/kappa before, the share of its springs that is still
    engaged, where that ratio is below one; then it is limited by friction at the new G. The energy
    that both discard is dissipated.
    """
    remaining = np.minimum(after.kappa * reciprocal(before.kappa), 1.0)
    remaining = np.where(after.kappa < before.kappa, remaining, 1.0)
    q2 = q[0] ** 2 + q[1] ** 2
    size = remaining * np.sqrt(q2)
    limit = strength * after.G
    scale = remaining * np.divide(limit, size, out=np.ones_like(size), where=size > limit)
    dissipated = q2 * (reciprocal(before.kappa) - scale**2 * reciprocal(after.kappa))
    return scale * q, np.sum(slider_compliance(k) * dissipated, axis=(0, 1))
