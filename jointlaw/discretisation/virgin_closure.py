"""Closure of an unsheared joint: its normal stress, and the inverse."""

import math
import sys
from typing import NamedTuple

import numpy as np

from ..support.checks import Array
from .virgin_curve import VirginCurve

_SMALLEST, _LARGEST = sys.float_info.min, sys.float_info.max


class VirginClosure(NamedTuple):
    """F1 = factor Phi(closure): the virgin curve summed over the facets, `facet_sum`."""

    curve: VirginCurve
    factor: float

    def stress(self, closure: Array) -> Array:
        """Normal stress (Pa) at closures (m), infinite where it overflows."""
        stress: Array = self.factor * self.curve.force(closure)[0]
        return stress

    def closure(self, stress: float, start: float) -> float:
        """Closure (m) at a normal stress (Pa), looked for from the closure `start` (m) on."""
        from scipy.optimize import brentq  # a third of the package's import time

        if stress < _SMALLEST:
            return 0.0

        def misfit(log_y: float) -> float:  # finite where the force is zero or overflows
            force = float(self.stress(np.array(math.exp(log_y))))
            return math.log(min(max(force, _SMALLEST), _LARGEST)) - math.log(stress)

        low = high = math.log(start)
        with np.errstate(over="ignore"):
            while misfit(high) < 0.0:
                high += 1.0
                if high > 700.0:
                    raise ValueError(f"normal_stress = {stress!r} Pa is beyond any closure")
            while misfit(low) > 0.0:
                low -= 1.0
            if low == high:
                return start
            return math.exp(brentq(misfit, low, high, xtol=1e-15, rtol=1e-15, maxiter=500))
