"""Empirical strength envelopes through tests at several normal stresses, to compare a fit with."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..support.checks import Array
from .measured import ShearCurve

# Coulomb's line; Barton's curve, tau = s tan(A - JRC log10 s); and a power law: what of normal
# stress s and shear stress is taken as a line, and back
FORMS: dict[str, tuple[Any, Any, Any]] = {
    "Coulomb": (lambda s: s, lambda s, tau: tau, lambda s, y: y),
    "Barton": (np.log10, lambda s, tau: np.arctan(tau / s), lambda s, y: s * np.tan(y)),
    "power law": (np.log, lambda s, tau: np.log(tau), lambda s, y: np.exp(y)),
}


def peak_and_last(stress: Array) -> Array:
    """The largest and the last shear stress (2,) in Pa."""
    return np.array([np.max(np.abs(stress)), abs(stress[-1])])


def envelope(name: str, curves: Sequence[ShearCurve], normal: float) -> Array:
    """Peak and last shear stress (2,) in Pa at a normal stress (Pa), by an envelope of `FORMS`.

    It is that of least squares through the tests of these curves, two or more.
    """
    across, up, back = FORMS[name]
    s = np.array([np.mean(curve.normal) for curve in curves])
    tau = np.stack([peak_and_last(curve.shear_stress) for curve in curves])
    slope, start = np.polyfit(across(s), up(s[:, None], tau), 1)
    return np.asarray(back(normal, slope * across(normal) + start))
