"""Closure of an unsheared joint: its normal stress, and the inverse."""

from __future__ import annotations

import math
import sys
from typing import NamedTuple

import numpy as np

from ..support.checks import Array
from .virgin_curve import VirginCurve

_RESOLVED = 1e8  # yield interferences
_SMALLEST, _LARGEST = sys.float_info.min, sys.float_info.max


class VirginClosure(NamedTuple):
    """First loading: F1 = factor Phi(closure), the virgin curve summed over the facets, less what
    yielding takes away."""

    curve: VirginCurve
    factor: float  # `facet_sum`
    yielding: tuple[Array, Array] | None = None  # `yield_sum`: F1 -= share Phi(closure - depth)

    def stress(self, closure: Array) -> Array:
        """Normal stress (Pa) at closures (m), infinite where it overflows."""
        stress: Array = self.factor * self.curve.force(closure)[0]
        if self.yielding is not None:
            share, depth = self.yielding
            stress = stress - self.curve.force(closure[..., None] - depth)[0] @ share
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
        farthest = 700.0
        if self.yielding is not None:  # beyond, the difference of forces is lost in rounding
            farthest = math.log(_RESOLVED) + math.log(float(np.max(self.yielding[1])))
        with np.errstate(over="ignore"):
            while misfit(high) < 0.0:
                high += 1.0
                if high > farthest:
                    raise ValueError(f"normal_stress = {stress!r} Pa is beyond any closure")
            while misfit(low) > 0.0:
                low -= 1.0
            if low == high:
                return start
            return math.exp(brentq(misfit, low, high, xtol=1e-15, rtol=1e-15, maxiter=500))
