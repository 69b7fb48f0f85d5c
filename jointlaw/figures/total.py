"""Direct shear by the total form, at a kept closure or a kept normal stress.

With K_n a power of the deformation the total form is homogeneous: F(delta) = P(r0 + delta_1)
delta_1^(1+eta) f(t), with the ratio t = shear/closure. So a test is a walk along t: f comes from
`secant` once for each t, and the closure that keeps the normal stress from one scalar equation.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from .._checks import Array
from ..law import JointLaw
from ..secant import secant


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
    ratios: ArrayLike,
    azimuth: float = 0.0,
    closure: float | None = None,
    normal: float | None = None,
    contact: str = "exact",
) -> TotalShear:
    """Shear a joint by the total form to each ratio shear/closure.

    ratios: (rows,), >= 0; azimuth: direction of shear in rad; and either the closure (m) or the
    normal stress (Pa) that is kept. `contact` as in `secant`. Raises ValueError unless exactly one
    of the two is given.
    """
    if (closure is None) == (normal is None):
        raise ValueError("give either the closure (m) or the normal stress (Pa) that is kept")
    t = np.asarray(ratios, float)
    unit = replace(law, heights=None, closure_range=1.0)
    along = (math.cos(azimuth), math.sin(azimuth))
    results = [secant(unit, (1.0, r * along[0], r * along[1]), contact) for r in t]
    f = np.array([r.F for r in results])
    if closure is not None:
        size = np.full(t.shape, closure)
    else:
        size = np.array([_closure_at(law, float(f1), float(normal or 0.0)) for f1 in f[:, 0]])
    scale = _touching(law, size) * size ** (1 + law.asperity.eta)
    return TotalShear(
        closure=size,
        shear=t * size,
        F1=scale * f[:, 0],
        shear_stress=scale * (f[:, 1] * along[0] + f[:, 2] * along[1]),
        sliding=np.array([r.sliding for r in results]),
        separated=np.array([r.separated for r in results]),
    )


def total_closure(law: JointLaw, closure: Sequence[float] | Array) -> Array:
    """Normal stress (rows,) in Pa at each closure (m), without shear, by the total form."""
    size = np.asarray(closure, float)
    unit = replace(law, heights=None, closure_range=1.0)
    f1 = secant(unit, (1.0, 0.0, 0.0)).F[0]
    stress: Array = f1 * _touching(law, size) * size ** (1 + law.asperity.eta)
    return stress


def _touching(law: JointLaw, closure: Array) -> Array:
    """P(r0 + delta_1), one without heights."""
    if law.heights is None:
        return np.ones_like(closure)
    return np.asarray(law.heights.cdf(law.heights.overlap + closure))


def _closure_at(law: JointLaw, f1: float, normal: float) -> float:
    """The closure (m) at which P(r0 + delta_1) delta_1^(1+eta) f1 is the normal stress."""
    power = 1 + law.asperity.eta
    if law.heights is None:
        return float((normal / f1) ** (1 / power))

    def misfit(log_closure: float) -> float:
        touching = float(_touching(law, np.array(math.exp(log_closure))))
        return math.log(max(touching, 1e-300)) + power * log_closure + math.log(f1 / normal)

    return math.exp(brentq(misfit, -80.0, 10.0, xtol=1e-12))
