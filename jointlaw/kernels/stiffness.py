"""How stiff asperities may be: bounds of `|C|`, docs/theory-incremental.md, "The tangent"."""

from functools import lru_cache

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from ..support.thresholds import BEND, UNDERFLOW


def stiffness_per_facet(k: FacetTables) -> tuple[Array, Array]:
    """Bounds (M,) of the part of `|C|` in Pa/m that each facet adds, over its Phi' and its Phi.

    The second is what the bending of slopes that fade adds: normal force, sliders and friction
    limit turn and grow with the slope.
    """
    sliding = k.mu * steepest_gain(k)
    per_slope: Array = (max(1.0, 1.0 / k.lam) + sliding) * (k.area / k.c1)
    bend = (BEND / k.mating_length) * k.area * k.steep * (k.c1 + k.mu * (1.0 + k.c1))
    return per_slope, bend


@lru_cache(maxsize=64)
def steepest_gain(k: FacetTables) -> float:
    """Largest G kappa'/kappa^2 of any depth cell, at least 1.

    Springs that join a cell under load take up force at the rate q kappa'/kappa, q being at most
    the friction limit of G. Up to 1 the limit itself, which grows with kappa, bounds that rate. It
    is more where few asperities touch before many do, as in heights of two groups.
    """
    curve, worst = k.curve, 1.0
    pieces = len(curve.S)
    if pieces == 1:  # a power of y, below 1
        return worst
    # Phi'' is smooth within a piece of the table and jumps between two
    places = (np.arange(pieces)[:, None] + np.array([1e-9, 0.25, 0.5, 0.75, 1 - 1e-9])) / pieces
    y = (curve.scale * places / (1 - places)).ravel() ** 2
    force, slope = curve.force(y)
    bend = np.maximum(curve.curvature(y), 0.0)
    cells = np.stack([k.depth, k.depth_force, k.depth_slope], axis=-1)
    for limits in np.unique(cells, axis=0):  # one ring of facets
        low, force0, slope0 = limits[np.searchsorted(limits[:-1, 0], y, side="right") - 1].T
        G, kappa = force - force0 - slope0 * (y - low), slope - slope0
        seen = (kappa > 1e-9 * slope) & (1e-9 * force < G) & (kappa > UNDERFLOW)
        share = np.divide(G, kappa, out=np.zeros_like(y), where=seen)  # the rest is rounding
        gain = np.divide(share * bend, kappa, out=np.zeros_like(y), where=seen)
        worst = max(worst, float(gain.max()))
    return worst


def stiffness_of(k: FacetTables, y: Array) -> Array:
    """Upper bound (B,) of `|C|` in Pa/m of joints whose facets have the closures y (M, B)."""
    per_slope, bend = stiffness_per_facet(k)
    force, slope = k.curve.force(y)
    bound: Array = per_slope @ slope
    return bound + bend @ force if k.fades else bound


def rises(k: FacetTables, shear: Array) -> Array:
    """By how much shear (...) in m, in any direction, closes each facet at most (..., M), in m."""
    climbed = shear / np.hypot(1.0, shear / k.mating_length)
    return climbed[..., None] * np.linalg.norm(k.m[1:], axis=0)


def largest_stiffness(k: FacetTables, closure: Array, shear: Array) -> Array:
    """Upper bound (...) of `|C|` in Pa/m at closures (...) in m, under shear in any direction.

    shear: distance (...) from the mated position, in m. It closes one of two opposite facets, which
    are alike, and opens the other.
    """
    rise = rises(k, shear)
    per_slope, bend = stiffness_per_facet(k)
    force, slope = k.curve.force(closure)
    stiffness: Array = np.sum(per_slope) * slope
    if k.fades:
        stiffness = stiffness + np.sum(bend) * force
    if rise.any():
        force, slope = k.curve.force(closure[..., None] + rise)
        steep = slope @ per_slope
        stiffness = 0.5 * (stiffness + (steep + force @ bend if k.fades else steep))
    return stiffness
