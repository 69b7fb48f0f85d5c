"""First-loading response: normal stress of a joint that is closed for the first time, unsheared."""

import math
import sys
from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np

from ..parameters.asperity import Asperity
from ..support.checks import Array
from .first_loading_curve import FirstLoadingCurve

_MAX_YIELD_INTERFERENCES = 1e8  # then Phi less its value one interference earlier has 8 digits
_MIN_FLOAT = sys.float_info.min
_BISECTIONS = 63  # of all floats in log closure: to rounding


class FirstLoadingResponse(NamedTuple):
    """First closure of an unsheared joint, in the limit of many cells.

    The normal stress is factor Phi(closure), less the sum over plastic_correction = (factors,
    depths) of factors Phi(closure - depths), for asperities that yield.
    """

    curve: FirstLoadingCurve
    factor: float  # `sum_facets`
    plastic_correction: tuple[Array, Array] | None = None  # `correct_for_yielding`

    @classmethod
    def of(cls, curve: FirstLoadingCurve, theta: Array, scale: Array, asperity: Asperity) -> Self:
        """The response of facets with these inclinations and A, each (M,)."""
        factor = sum_facets(theta, scale, asperity.lam, asperity.mu)
        return cls(curve, factor, correct_for_yielding(theta, scale, asperity))

    def stress(self, closure: Array) -> Array:
        """Normal stress (Pa) at closures (m), infinite where it overflows."""
        stress: Array = self.factor * self.curve.force(closure)[0]
        if self.plastic_correction is not None:
            factors, depths = self.plastic_correction
            stress = stress - self.curve.force(closure[..., None] - depths)[0] @ factors
        return stress

    @property
    def max_search_closure(self) -> float:
        """Closure (m) beyond which stresses, or their differences, are lost in rounding."""
        if self.plastic_correction is None:
            return 1e304
        return _MAX_YIELD_INTERFERENCES * float(np.max(self.plastic_correction[1]))


def find_closure(
    stress_at: Callable[[Array], Array], stress: Array, max_search_closure: float
) -> Array:
    """Closures (m) at normal stresses (Pa), by bisection of the logarithm of the closure.

    stress_at: normal stress at closures, increasing; max_search_closure: upper end of the search.
    Exact to rounding. Raises ValueError where no closure reaches a stress.
    """
    closure = np.zeros_like(stress)
    target = stress[stress >= _MIN_FLOAT]
    low = np.full(target.shape, math.log(_MIN_FLOAT))
    high = np.full(target.shape, math.log(max_search_closure))
    with np.errstate(over="ignore"):
        is_out_of_range = ~(stress_at(np.exp(high)) >= target)
        if is_out_of_range.any():
            smallest = target[is_out_of_range].min()
            raise ValueError(f"normal_stress = {smallest:g} Pa is beyond any closure")
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            is_short = stress_at(np.exp(middle)) < target
            low = np.where(is_short, middle, low)
            high = np.where(is_short, high, middle)
    closure[stress >= _MIN_FLOAT] = np.exp(high)
    return closure


def correct_for_yielding(
    theta: Array, scale: Array, asperity: Asperity
) -> tuple[Array, Array] | None:
    """Factors and depths, each (2 M,), of the correction of first loading for yielding.

    A spring gains no more normal force beyond the yield interference, and no more shear force
    once it slips under the normal force that it then has. None if asperities do not yield.
    """
    if math.isinf(asperity.yield_interference):
        return None
    shear = np.minimum(np.tan(theta) / asperity.lam, asperity.mu)
    depth = asperity.yield_interference / np.cos(theta)
    delay = np.divide(asperity.mu, shear, out=np.ones_like(shear), where=shear > 0)
    factors = np.concatenate([scale * np.cos(theta), scale * np.sin(theta) * shear])
    return factors, np.concatenate([depth, depth * delay])


def sum_facets(theta: Array, scale: Array, lam: float, mu: float) -> float:
    """Normal stress over Phi in pure closure.

    The sum of scale (cos theta + sin theta min(tan theta/lam, mu)) over the facets (M,).
    """
    shear = np.minimum(np.tan(theta) / lam, mu)
    return float(np.sum(scale * (np.cos(theta) + np.sin(theta) * shear)))
