"""Explicit time steps: the largest that a stiffness leaves stable."""

import numpy as np
from numpy.typing import ArrayLike

from ..support.checks import Array, finite


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
