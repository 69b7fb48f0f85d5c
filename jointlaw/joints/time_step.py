"""Explicit time steps: how stiff a joint may be, and the largest step that this leaves stable.

docs/theory-incremental.md, "The tangent".
"""

import numpy as np
from numpy.typing import ArrayLike

from ..discretisation.tables import Tables
from ..support.checks import Array, finite


def stiffness_per_facet(k: Tables) -> Array:
    """Upper bound (M,) of the part of `|C|` in Pa/m that each facet adds, over its Phi'."""
    per_facet: Array = (max(1.0, 1.0 / k.lam) + k.mu) * (k.area / k.c1)
    return per_facet


def largest_stiffness(k: Tables, y: Array, rise: Array) -> Array:
    """Upper bound (...) of `|C|` in Pa/m at closures y (...) in m, under shear in any direction.

    rise: by how much the shear closes each facet at most (..., M), in m. Of two opposite facets,
    which are alike, one closes by that much, and the other opens.
    """
    per_facet = stiffness_per_facet(k)
    stiffness: Array = np.sum(per_facet) * k.curve.force(y)[1]
    if rise.any():
        steep = k.curve.force(y[..., None] + rise)[1] @ per_facet
        stiffness = 0.5 * (stiffness + steep)
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
