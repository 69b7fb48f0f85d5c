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
_BITS_OF_LOG = 65  # halvings of the bracket of all floats in log closure: to rounding
_MAX_FEW = 100  # closures: numpy evaluates 32 times as many in the time of a few calls
_MAX_FORCE = 1e150  # Phi whose stress counts as infinite
QUADRATURE_NODES = 8  # of the mean of the sines of degrading facets, as in native/host.h


class FirstLoadingResponse(NamedTuple):
    """First closure of an unsheared joint, in the limit of many cells.

    The normal stress is factor Phi(closure), less the sum over plastic_correction = (factors,
    depths) of factors Phi(closure - depths), for asperities that yield.
    """

    curve: FirstLoadingCurve
    factor: float  # `sum_facets`
    plastic_correction: tuple[Array, Array] | None = None  # `correct_for_yielding`
    degradation: "DegradingFacets | None" = None  # of facets that degrade by stress

    @classmethod
    def of(cls, curve: FirstLoadingCurve, theta: Array, scale: Array, asperity: Asperity) -> Self:
        """The response of facets with these inclinations and A, each (M,)."""
        factor = sum_facets(theta, scale, asperity.lam, asperity.mu)
        return cls(curve, factor, correct_for_yielding(theta, scale, asperity))

    def stress(self, closure: Array) -> Array:
        """Normal stress (Pa) at closures (m), infinite where it overflows."""
        stress: Array = self.factor * self.curve.force(closure)[0]
        if self.degradation is not None:
            facets = self.degradation
            depth = np.maximum(closure[..., None] - facets.yield_depth, 0.0)
            indented = self.curve.force(depth)[0]
            return facets.stress(self.curve.force(closure)[0], indented)
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


class DegradingFacets(NamedTuple):
    """M facets whose slopes decrease with the contact stress, in first closure without shear.

    Normal forces do not depend on the slopes, as the joint has not climbed: the contact stress is
    N = sum of A c1 (Phi - Phi at the plastic indentation). The shear force of facets that stick
    comes from all slopes that the facet had on the way; `stress` takes their mean over N, which is
    exact for elastic asperities. A joint with finite steps and cells differs by its accuracy.
    """

    theta: Array  # inclinations (M,)
    scale: Array  # A (M,)
    yield_depth: Array  # yield interference along y (M,), infinite for elastic asperities
    lam: float
    mu: float
    degradation_stress: float
    slope_residual: float

    def retention(self, relative_stress: Array) -> Array:
        """Slope retention at a contact stress over the degradation stress."""
        return self.slope_residual + (1 - self.slope_residual) / (1 + relative_stress)

    def sines(self, relative_stress: Array) -> Array:
        """Sines of the inclinations (..., M) at contact stresses (...) as in `retention`."""
        slope = np.tan(self.theta) * self.retention(relative_stress)[..., None]
        sines: Array = slope / np.sqrt(1 + slope**2)
        return sines

    def mean_sines(self, relative_stress: Array) -> Array:
        """Means of the sines over the contact stress from zero to this one."""
        x, weights = np.polynomial.legendre.leggauss(QUADRATURE_NODES)
        top = np.log1p(relative_stress)
        total: Array = np.zeros((*relative_stress.shape, len(self.theta)))
        for node, weight in zip(0.5 * (1 + x), 0.5 * weights, strict=True):
            share = np.exp(node * top) * (weight * top / np.where(top > 0, relative_stress, 1.0))
            total = total + self.sines(np.expm1(node * top)) * share[..., None]
        return np.where(top[..., None] > 0, total, self.sines(relative_stress))

    def stress(self, force: Array, indented: Array) -> Array:
        """Normal stress (...) in Pa.

        force: Phi (...) at the closure; indented: Phi at the plastic indentation (..., M), zero for
        elastic asperities.
        """
        c1 = np.cos(self.theta)
        overflows = force > _MAX_FORCE
        force = np.where(overflows, 0.0, force)
        elastic = np.maximum(force[..., None] - indented, 0.0)
        contact_stress = elastic @ (self.scale * c1)
        relative_stress = contact_stress / self.degradation_stress
        sines = self.sines(relative_stress)
        stick = self.mean_sines(relative_stress) * (force[..., None] / (c1 * self.lam))
        slip = self.mu * c1 * elastic / np.sqrt(1 - sines**2)
        friction: Array = (sines * np.minimum(stick, slip)) @ self.scale
        return np.where(overflows, np.inf, contact_stress + friction)


def find_closure(
    stress_at: Callable[[Array], Array], stress: Array, max_search_closure: float
) -> Array:
    """Closures (m) at normal stresses (Pa), by division of brackets of their logarithms.

    stress_at: normal stress at closures (...), increasing; max_search_closure: upper end of the
    search. Exact to rounding. Raises ValueError where no closure reaches a stress.
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
        bits = 5 if target.size <= _MAX_FEW else 1  # that an iteration adds
        fractions = np.arange(1, 2**bits)[:, None] / 2**bits
        for _ in range(_BITS_OF_LOG // bits):
            inner = low + fractions * (high - low)
            is_short = stress_at(np.exp(inner)) < target
            first_long = np.where(is_short.all(axis=0), len(inner), is_short.argmin(axis=0))
            bracket = np.concatenate([[low], inner, [high]])
            low = np.take_along_axis(bracket, first_long[None], 0)[0]
            high = np.take_along_axis(bracket, first_long[None] + 1, 0)[0]
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
