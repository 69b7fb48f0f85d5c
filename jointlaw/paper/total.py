"""Direct shear by the total form, at a kept closure or a kept normal stress.

With K_n a power of the deformation the total form is homogeneous, but for the count of asperities
in touch: for delta = size (cos tilt, sin tilt), F = P(r0 + delta_1) size^(1+eta) f(tilt). So a test
is a walk along the tilt: f comes from `secant` once for each, the size from one scalar equation.
Beyond 90 degrees the joint has dilated above the closure at which it first touched.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq, minimize_scalar

from ..law import JointLaw
from ..support.checks import Array
from .secant import secant


@dataclass(frozen=True, eq=False)
class TotalShear:
    """Shear test by the total form: arrays over its rows (rows,).

    closure, shear in m; F1 and shear_stress (along the azimuth of the test) in Pa; sliding and
    separated as shares of all orientations.
    """

    closure: Array
    shear: Array
    F1: Array
    shear_stress: Array
    sliding: Array
    separated: Array


def total_shear(
    law: JointLaw,
    tilts: ArrayLike,
    azimuth: float = 0.0,
    closure: float | None = None,
    normal: float | None = None,
    contact: str = "exact",
) -> TotalShear:
    """Shear a joint by the total form to each tilt arctan(shear/closure).

    tilts: (rows,) in rad, ascending from 0; azimuth: direction of shear in rad; and either the
    closure (m) or the normal stress (Pa) that is kept. `contact` as in `secant`. The rows end where
    the normal stress cannot be kept. Raises ValueError unless exactly one of the two is given.
    """
    if (closure is None) == (normal is None):
        raise ValueError("give either the closure (m) or the normal stress (Pa) that is kept")
    unit = replace(law, heights=None, closure_range=1.0)
    rows = []
    for tilt in np.asarray(tilts, float):
        cos, sin = math.cos(tilt), math.sin(tilt)
        along = np.array([math.cos(azimuth), math.sin(azimuth)])
        result = secant(unit, (cos, *(sin * along)), contact)
        f1, shear = float(result.F[0]), float(result.F[1:] @ along)
        size = closure / cos if closure is not None else _size(law, cos, f1, float(normal or 0.0))
        if size is None:
            break
        scale = float(_touching(law, size * cos)) * size ** (1 + law.asperity.eta)
        shares = (result.sliding, result.separated)
        rows.append((size * cos, size * sin, scale * f1, scale * shear, *shares))
    return TotalShear(*np.array(rows).reshape(-1, 6).T)


def total_closure(law: JointLaw, closure: Sequence[float] | Array) -> Array:
    """Normal stress (rows,) in Pa at each closure (m), without shear, by the total form."""
    size = np.asarray(closure, float)
    unit = replace(law, heights=None, closure_range=1.0)
    f1 = secant(unit, (1.0, 0.0, 0.0)).F[0]
    stress: Array = f1 * _touching(law, size) * size ** (1 + law.asperity.eta)
    return stress


def _touching(law: JointLaw, closure: float | Array) -> Array:
    """P(r0 + delta_1), one without heights."""
    if law.heights is None:
        return np.ones_like(closure)
    return np.asarray(law.heights.cdf(law.heights.overlap + closure))


def _size(law: JointLaw, cos: float, f1: float, normal: float) -> float | None:
    """The least size (m) at which P(r0 + size cos) size^(1+eta) f1 is the normal stress."""
    power = 1 + law.asperity.eta
    if not f1 > 0:
        return None
    if law.heights is None:
        return float((normal / f1) ** (1 / power))

    def misfit(log_size: float) -> float:
        touching = float(_touching(law, math.exp(log_size) * cos))
        return math.log(max(touching, 1e-300)) + power * log_size + math.log(f1 / normal)

    high = 10.0
    if cos < 0:  # dilated: contacts are lost as the size grows, so the stress has a largest value
        top = math.log(max(law.heights.overlap, 1e-12) / -cos)
        high = float(minimize_scalar(lambda x: -misfit(x), bounds=(top - 20, top)).x)
    if misfit(high) < 0:
        return None
    return math.exp(brentq(misfit, -80.0, high, xtol=1e-12))
