"""First loading: the normal stress of a joint that is closed for the first time, unsheared."""

import math
import sys
from collections.abc import Callable
from typing import NamedTuple, Self

import numpy as np

from ..parameters.asperity import Asperity
from ..support.checks import Array
from .virgin_curve import VirginCurve

_RESOLVED = 1e8  # yield interferences: Phi less its value one earlier has 8 digits
_SMALLEST = sys.float_info.min
_HALVINGS = 63  # of all floats in log closure: to rounding


class FirstLoading(NamedTuple):
    """First closure of an unsheared joint: F1 = factor Phi, less what yielding takes away."""

    curve: VirginCurve
    factor: float  # `facet_sum`
    yielding: tuple[Array, Array] | None = None  # `yield_sum`: F1 -= share Phi(closure - depth)

    @classmethod
    def of(cls, curve: VirginCurve, theta: Array, scale: Array, asperity: Asperity) -> Self:
        """That of facets of these inclinations and A (M,)."""
        factor = facet_sum(theta, scale, asperity.lam, asperity.mu)
        return cls(curve, factor, yield_sum(theta, scale, asperity))

    def stress(self, closure: Array) -> Array:
        """Normal stress (Pa) at closures (m), infinite where it overflows."""
        stress: Array = self.factor * self.curve.force(closure)[0]
        if self.yielding is not None:
            share, depth = self.yielding
            stress = stress - self.curve.force(closure[..., None] - depth)[0] @ share
        return stress

    @property
    def farthest(self) -> float:
        """Closure (m) beyond which stresses, or their differences, are lost in rounding."""
        return 1e304 if self.yielding is None else _RESOLVED * float(np.max(self.yielding[1]))


def closure_at(stress_of: Callable[[Array], Array], stress: Array, farthest: float) -> Array:
    """Closures (m) up to `farthest` at normal stresses (Pa), by bisection of log closure.

    Exact to rounding. Raises ValueError where no closure reaches a stress.
    """
    found = np.zeros_like(stress)
    wanted = stress[stress >= _SMALLEST]
    low, high = (np.full(wanted.shape, math.log(y)) for y in (_SMALLEST, farthest))
    with np.errstate(over="ignore"):
        if (far := ~(stress_of(np.exp(high)) >= wanted)).any():
            raise ValueError(f"normal_stress = {wanted[far].min():g} Pa is beyond any closure")
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            short = stress_of(np.exp(middle)) < wanted
            low, high = np.where(short, middle, low), np.where(short, high, middle)
    found[stress >= _SMALLEST] = np.exp(high)
    return found


def yield_sum(theta: Array, scale: Array, asperity: Asperity) -> tuple[Array, Array] | None:
    """What yielding takes from F1 under first closure: share (2 M,) times Phi(closure - depth).

    Springs stop to gain normal force at the yield interference, and shear force where they slip
    under the normal force that they then have.
    """
    if math.isinf(asperity.yield_interference):
        return None
    shear = np.minimum(np.tan(theta) / asperity.lam, asperity.mu)
    depth = asperity.yield_interference / np.cos(theta)
    late = np.divide(asperity.mu, shear, out=np.ones_like(shear), where=shear > 0)
    share = np.concatenate([scale * np.cos(theta), scale * np.sin(theta) * shear])
    return share, np.concatenate([depth, depth * late])


def facet_sum(theta: Array, scale: Array, lam: float, mu: float) -> float:
    """Sum of scale (cos theta + sin theta min(tan theta/lam, mu)): F1/Phi under pure closure."""
    shear = np.minimum(np.tan(theta) / lam, mu)
    return float(np.sum(scale * (np.cos(theta) + np.sin(theta) * shear)))
