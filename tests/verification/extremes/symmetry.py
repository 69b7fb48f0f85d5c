"""A quarter turn exchanges the axes of a joint, and c for -c: also at the extremes."""

import numpy as np

from extremes.checks import path
from extremes.laws import ORDINARY, SCALE, build

QUARTER = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])  # v @ QUARTER turns v


def asymmetry(changes, seed=9, n=8, steps=24):
    """Largest difference of F, of its peak, between a path and the same turned by a quarter, on the
    joint of the opposite c; the 8 azimuths are turned onto themselves."""
    b, c = changes.get("b, c", (ORDINARY["b"], ORDINARY["c"]))
    one, other = (build(**changes | {"b, c": (b, sign * c)}).joints(n) for sign in (1, -1))
    gap, peak = 0.0, np.zeros(n)
    for d in path(np.random.default_rng(seed), n, steps, SCALE)[0]:
        F = one.update(d, tangent=False)[0]
        G = other.update(d @ QUARTER, tangent=False)[0]
        peak = np.maximum(peak, np.abs(F).max(axis=1))
        away = np.abs(G - F @ QUARTER).max(axis=1)
        gap = max(gap, float(np.max(away / np.where(peak > 0, peak, 1.0))))
    return gap
