"""Explicit time steps: how stiff a joint may be, and the largest step that this leaves stable.

docs/theory-incremental.md, "The tangent".
"""

import numpy as np
from numpy.typing import ArrayLike

from ..discretisation.tables import Tables
from ..support.checks import Array, finite

BEND = 0.8587  # largest |d2o/dp2| times the mating length: 1.5/1.25^2.5, half a length from mate


def stiffness_per_facet(k: Tables) -> tuple[Array, Array]:
    """Bounds (M,) of the part of `|C|` in Pa/m that each facet adds, over its Phi' and its Phi.

    The second is what the bending of slopes that fade adds: normal force, sliders and friction
    limit turn and grow with the slope.
    """
    per_slope: Array = (max(1.0, 1.0 / k.lam) + k.mu) * (k.area / k.c1)
    bend = (BEND / k.mating_length) * k.area * k.steep * (k.c1 + k.mu * (1.0 + k.c1))
    return per_slope, bend


def stiffness_of(k: Tables, y: Array) -> Array:
    """Upper bound (B,) of `|C|` in Pa/m of joints whose facets have the closures y (M, B)."""
    per_slope, bend = stiffness_per_facet(k)
    force, slope = k.curve.force(y)
    bound: Array = per_slope @ slope
    return bound + bend @ force if k.fades else bound


def largest_stiffness(k: Tables, y: Array, rise: Array) -> Array:
    """Upper bound (...) of `|C|` in Pa/m at closures y (...) in m, under shear in any direction.

    rise: by how much the shear closes each facet at most (..., M), in m. Of two opposite facets,
    which are alike, one closes by that much, and the other opens.
    """
    per_slope, bend = stiffness_per_facet(k)
    force, slope = k.curve.force(y)
    stiffness: Array = np.sum(per_slope) * slope
    if k.fades:
        stiffness = stiffness + np.sum(bend) * force
    if rise.any():
        force, slope = k.curve.force(y[..., None] + rise)
        steep = slope @ per_slope
        stiffness = 0.5 * (stiffness + (steep + force @ bend if k.fades else steep))
    return stiffness


def stable_step(mass: ArrayLike, area: ArrayLike, stiffness: Array) -> Array:
    """2 sqrt(m/(K area)) in s, infinite where nothing touches.

    mass: reduced mass in kg, > 0; area: in m2, > 0; stiffness: K in Pa/m.
    """
    m, a = finite("mass", mass, "kg"), finite("area", area, "m2")
    if not ((m > 0).all() and (a > 0).all()):
        raise ValueError(f"mass = {m} kg, area = {a} m2 are out of bounds: both must be > 0")
    with np.errstate(divide="ignore"):
        step: Array = 2 * np.sqrt(m / (stiffness * a))
    return step
