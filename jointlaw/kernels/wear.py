"""Slopes that wear by the work of friction, docs/theory-incremental.md, "Wear"."""

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from .cells import Cells, compliance, reciprocal


def worn_share(k: FacetTables, worn: Array, work: Array) -> Array:
    """The share (B,) of the slopes that is gone after the work (B,) of friction in J/m2."""
    now = (k.slope_residual - 1) * np.expm1(-work / k.slope_wear)
    return np.maximum(worn, now)


def lowered(
    k: FacetTables, old: Cells, now: Cells, strength: Array, q: Array
) -> tuple[Array, Array]:
    """q where slopes have worn and joints have not moved, and what sliders lose by it (B,) in J/m2.

    As in a step without an increment: springs that part take their force along, and friction
    limits q.
    """
    kept = np.minimum(now.kappa * reciprocal(old.kappa), 1.0)
    kept = np.where(now.kappa < old.kappa, kept, 1.0)
    q2 = q[0] ** 2 + q[1] ** 2
    size = kept * np.sqrt(q2)
    cap = strength * now.G
    share = kept * np.divide(cap, size, out=np.ones_like(size), where=size > cap)
    lost = q2 * (reciprocal(old.kappa) - share**2 * reciprocal(now.kappa))
    return share * q, np.sum(compliance(k) * lost, axis=(0, 1))
