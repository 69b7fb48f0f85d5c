"""Upper bounds of the stiffness `|C|` of asperities: docs/theory-incremental.md, "The tangent"."""

from functools import lru_cache

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import MAX_OFFSET_CURVATURE, UNDERFLOW


def stiffness_bound(k: FacetTables, y: Array) -> Array:
    """Upper bound (...) of `|C|` in Pa/m of joints whose facets have the closures y (M, ...)."""
    force, slope = k.curve.force(y)
    factor, limit = engagement_stiffness(k)
    elastic = (max(1.0, 1.0 / k.lam) + k.mu) * slope
    per_facet = elastic + k.mu * np.minimum(factor * slope, limit)
    bound = np.tensordot(k.area / k.c1, per_facet, 1)
    if k.interlock_decays:
        bound = bound + np.tensordot(curvature_stiffness(k), force, 1)
    return bound


def curvature_stiffness(k: FacetTables) -> Array:
    """Part of the bound by the rotation of the planes with slip, over Phi, for each facet (M,).

    Normal force, sliders and friction limit rotate and grow with the slope.
    """
    rate = MAX_OFFSET_CURVATURE / k.mating_length
    return rate * k.area * k.tan_theta * (k.c1 + k.mu * (1.0 + k.c1))


@lru_cache(maxsize=64)
def engagement_stiffness(k: FacetTables) -> tuple[float, float]:
    """Largest excess of G kappa'/kappa of a cell over kappa: relative to kappa, and absolute.

    Springs that engage in a loaded cell, or disengage, change its slider force by q kappa'/kappa,
    q being at most the friction limit of G. Mostly kappa bounds that rate. It is larger where few
    asperities touch before many do, as in heights of two groups.
    """
    curve = k.curve
    largest_relative = 0.0
    largest = 0.0
    pieces = len(curve.S)
    if pieces == 1:  # a power of y
        return largest_relative, largest
    # Phi'' is smooth within a piece of the table and jumps between two
    places = (np.arange(pieces)[:, None] + np.array([1e-9, 0.25, 0.5, 0.75, 1 - 1e-9])) / pieces
    with np.errstate(over="ignore", invalid="ignore"):  # heights may be as wide as floats are
        y = (curve.scale * places / (1 - places)).ravel() ** 2
        force, slope = curve.force(y)
        curvature = np.maximum(curve.curvature(y), 0.0)
    finite = np.isfinite(force) & np.isfinite(slope) & np.isfinite(curvature)
    y = y[finite]
    force = force[finite]
    slope = slope[finite]
    curvature = curvature[finite]
    cells = np.stack([k.cell_depth, k.cell_force, k.cell_slope], axis=-1)
    for limits in np.unique(cells, axis=0):  # one ring of facets
        low, force0, slope0 = limits[np.searchsorted(limits[:-1, 0], y, side="right") - 1].T
        G = force - force0 - slope0 * (y - low)
        kappa = slope - slope0
        resolved = (kappa > 1e-9 * slope) & (1e-9 * force < G) & (kappa > UNDERFLOW)
        ratio = np.divide(G, kappa, out=np.zeros_like(y), where=resolved)  # the rest is rounding
        excess = np.where(resolved, ratio * curvature - kappa, 0.0)
        relative = np.divide(excess, kappa, out=0.0 * y, where=resolved)
        largest_relative = max(largest_relative, float(relative.max(initial=0.0)))
        largest = max(largest, float(excess.max(initial=0.0)))
    return largest_relative, largest


def largest_climb(k: FacetTables, shear: Array) -> Array:
    """Largest increase (..., M) in m of the effective closure of each facet by shear.

    shear: displacement (...) in m in any direction. The facet's slope times the offset of this
    shear, limited by the mating length.
    """
    climb = shear / np.hypot(1.0, shear / k.mating_length)
    return climb[..., None] * np.linalg.norm(k.m[1:], axis=0)
