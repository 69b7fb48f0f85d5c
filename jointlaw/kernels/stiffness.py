"""How stiff asperities may be: bounds of `|C|`, docs/theory-incremental.md, "The tangent"."""

from functools import lru_cache

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import MAX_OFFSET_CURVATURE, UNDERFLOW


def stiffness_of(k: FacetTables, y: Array) -> Array:
    """Upper bound (...) of `|C|` in Pa/m of joints whose facets have the closures y (M, ...)."""
    force, slope = k.curve.force(y)
    more, most = joining(k)
    per_slope = (max(1.0, 1.0 / k.lam) + k.mu) * slope + k.mu * np.minimum(more * slope, most)
    bound = np.tensordot(k.area / k.c1, per_slope, 1)
    return bound + np.tensordot(bend_of(k), force, 1) if k.fades else bound


def bend_of(k: FacetTables) -> Array:
    """What the bending of slopes that fade adds to the bound, over Phi, for each facet (M,).

    Normal force, sliders and friction limit turn and grow with the slope.
    """
    return (
        (MAX_OFFSET_CURVATURE / k.mating_length) * k.area * k.steep * (k.c1 + k.mu * (1.0 + k.c1))
    )


@lru_cache(maxsize=64)
def joining(k: FacetTables) -> tuple[float, float]:
    """By how much G kappa'/kappa of a depth cell exceeds kappa at most: over kappa, and alone.

    Springs that join a cell under load, or part, change its force by q kappa'/kappa, q being at
    most the friction limit of G. Mostly kappa bounds that rate. It is more where few asperities
    touch before many do, as in heights of two groups.
    """
    curve, more, most = k.curve, 0.0, 0.0
    pieces = len(curve.S)
    if pieces == 1:  # a power of y
        return more, most
    # Phi'' is smooth within a piece of the table and jumps between two
    places = (np.arange(pieces)[:, None] + np.array([1e-9, 0.25, 0.5, 0.75, 1 - 1e-9])) / pieces
    with np.errstate(over="ignore", invalid="ignore"):  # heights may be as wide as floats are
        y = (curve.scale * places / (1 - places)).ravel() ** 2
        force, slope = curve.force(y)
        bend = np.maximum(curve.curvature(y), 0.0)
    sound = np.isfinite(force) & np.isfinite(slope) & np.isfinite(bend)
    y, force, slope, bend = y[sound], force[sound], slope[sound], bend[sound]
    cells = np.stack([k.depth, k.depth_force, k.depth_slope], axis=-1)
    for limits in np.unique(cells, axis=0):  # one ring of facets
        low, force0, slope0 = limits[np.searchsorted(limits[:-1, 0], y, side="right") - 1].T
        G, kappa = force - force0 - slope0 * (y - low), slope - slope0
        seen = (kappa > 1e-9 * slope) & (1e-9 * force < G) & (kappa > UNDERFLOW)
        share = np.divide(G, kappa, out=np.zeros_like(y), where=seen)  # the rest is rounding
        excess = np.where(seen, share * bend - kappa, 0.0)
        more = max(more, float(np.divide(excess, kappa, out=0.0 * y, where=seen).max(initial=0.0)))
        most = max(most, float(excess.max(initial=0.0)))
    return more, most


def rises(k: FacetTables, shear: Array) -> Array:
    """By how much shear (...) in m, in any direction, closes each facet at most (..., M), in m."""
    climbed = shear / np.hypot(1.0, shear / k.mating_length)
    return climbed[..., None] * np.linalg.norm(k.m[1:], axis=0)
