"""The result of a fit: the law, its parameters with intervals, and which of them are identifiable.

A parameter is identifiable if the data determine it, given the fixed parameters: its 95 % interval
is within a factor of 2 either way, the priors contribute little to its variance, and the fit did
not end at a bound. Two cases need more than the covariance:

- **Trade-off of friction and slopes.** Less friction and more dilation give the same shear stress.
  Without any measured opening `mu` and `a` are determined together at best, and neither is called
  identifiable, whatever the local covariance is.
- **Cohesion of a brittle bond.** If a bond breaks between two measured points, the misfit does not
  depend on its cohesion there; the local covariance is meaningless.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..laws.joint_law import JointLaw
from ..support.checks import Array, one_of
from .forward import build_law, log_stress
from .measured import MIN_CLOSURE_POINTS, ShearCurve, simulate_curves
from .noise import Series
from .priors import TRANSFORMS, Values
from .problem import (
    CLOSURE_PARAMETERS,
    QUANTILE,
    Problem,
    Solution,
    central_differences,
    solve,
    starting_points,
)
from .shearing import SimulatedTest

MAX_AUTOCORRELATED_MISFIT = 1.5  # of the expected noise: with more the shape of the law differs
MAX_PRIOR_SHARE = 0.05  # of the variance of an identifiable parameter
MAX_LOG_ERROR = math.log(2) / 1.96  # standard error of a logarithm: 95 % interval of a factor of 2
MAX_ERROR = 0.5  # standard error of a parameter without a logarithm
UNBOUNDED_RATIO = 1e6  # upper over lower end of an interval that is reported as unbounded
MIN_SOFTENING_POINTS = 3  # of one test, while a bond softens, to determine its cohesion
BOUND_MARGIN = 1e-6  # of the distance of the bounds
SMALL_STRESS = 0.01  # of the largest shear stress: larger ones have logarithmic bands
EXTRAPOLATION_FACTOR = 2.0  # of the miss of the last third, see `Estimates.extrapolation_error`
MIN_EXTRAPOLATION_POINTS = 6  # of a closure curve
CURVE_QUANTITIES = ("stress", "opening")
TRADE_OFF = ("mu", "a")  # friction and slopes, which shear stress alone cannot separate


@dataclass(frozen=True, eq=False)
class Estimates:
    """Result of a fit, in SI units.

    `free` names the free parameters in the order of `covariance`, `preload_closure` last;
    `parameters` has all values; `autocorrelated_misfit` and `shape_differs` have one entry
    per series of `series_names`: closure curve, shear stress, opening.

    problem: the problem that was solved.
    solution: its solution.
    discretisation_error: change of shear stress and opening, relative to the largest, with half the
        steps and finer cells.
    discretisation_shift: (p,) upper bound of the change of the transformed parameters with
        infinitely many steps; the intervals include it.
    """

    problem: Problem
    solution: Solution
    discretisation_error: float
    discretisation_shift: Array

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters, `preload_closure` last."""
        return self.problem.free

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters, free and fixed, and `preload_closure` (m)."""
        return self.problem.unpack(self.solution.x)

    @cached_property
    def law(self) -> JointLaw:
        """The law of these parameters."""
        return build_law(self.parameters, self.problem.settings, self.problem.settings.law.plane)

    def interval(self, name: str) -> tuple[float, float]:
        """The 95 % confidence interval of a free parameter, within its bounds."""
        one_of("fitted parameter", name, self.free)
        index = self.free.index(name)
        transform = TRANSFORMS[name]
        error = math.sqrt(self.solution.covariance[index, index])
        half_width = QUANTILE * error + abs(self.discretisation_shift[index])
        x = self.solution.x[index]
        low, high = self.problem.bounds()
        lower = max(x - half_width, low[index])
        upper = min(x + half_width, high[index])
        return transform.back(float(lower)), transform.back(float(upper))

    @cached_property
    def at_bound(self) -> tuple[str, ...]:
        """Free parameters that the fit left at a bound: no law agrees better with the data."""
        low, high = self.problem.bounds()
        gap = np.minimum(self.solution.x - low, high - self.solution.x) / (high - low)
        if "mating_length" in self.free:  # the closure range is a lower bound of a law too
            fitted = self.parameters["mating_length"]
            is_raised = self.law.mating_length > (1 + BOUND_MARGIN) * fitted
            gap[self.free.index("mating_length")] *= not is_raised
        return tuple(name for name, g in zip(self.free, gap, strict=True) if g < BOUND_MARGIN)

    @cached_property
    def parameters_to_fix(self) -> tuple[str, ...]:
        """Free parameters to fix so that the data determine the others, least constrained first.

        Friction comes first if it trades off with slopes without any measured opening. The preload
        closure is never named. Empty where the data determine all free parameters.
        """
        to_fix = ["mu"] if self.has_trade_off else []
        not_fixed = {"preload_closure", *to_fix}
        remaining = [k for k, name in enumerate(self.free) if name not in not_fixed]
        while remaining:
            C = np.linalg.inv(self.solution.information[np.ix_(remaining, remaining)])
            relative_errors = np.sqrt(np.diag(C)) / self._max_errors[remaining]
            if relative_errors.max() <= 1:
                break
            to_fix.append(self.free[remaining.pop(int(np.argmax(relative_errors)))])
        return tuple(to_fix)

    @cached_property
    def not_identifiable(self) -> dict[str, str]:
        """Free parameters that these data do not determine, each with the reason."""
        reasons: dict[str, str] = {}
        errors = np.sqrt(np.diag(self.solution.covariance)) / self._max_errors
        prior_shares = self.solution.prior_share
        for name, prior_share, error in zip(self.free, prior_shares, errors, strict=True):
            if name in self.at_bound:
                reasons[name] = f"the fit ended at a bound, {self.parameters[name]:.3g}"
            elif name == "cohesion" and self._softening_points < MIN_SOFTENING_POINTS:
                reasons[name] = (
                    f"at most {self._softening_points} points of a test are measured while the "
                    "bond softens: if a bond breaks between two points, they do not determine its "
                    "cohesion"
                )
            elif name in TRADE_OFF and self.has_trade_off:
                reasons[name] = (
                    "no opening was measured, and shear stress alone does not determine it"
                )
            elif prior_share > MAX_PRIOR_SHARE:
                reasons[name] = f"the priors supply {100 * prior_share:.0f} % of its variance"
            elif error > 1:
                reasons[name] = f"its 95 % interval is {self._interval_text(name)}"
        return reasons

    @property
    def _softening_points(self) -> int:
        """Largest number of measured points of a test at which the bond would soften in pure shear.

        These are the points whose displacement lies between the onset of damage and failure.
        """
        assert self.law.bond is not None
        (_, begin), (_, end) = self.law.bond.limits
        slips = (np.abs(curve.shear) for curve in self.problem.shears)
        return max(
            (int(np.sum((slip * begin > 1) & (slip * end < 1))) for slip in slips), default=0
        )

    @property
    def _max_errors(self) -> Array:
        """Largest standard errors (p,) of identifiable parameters."""
        return np.array(
            [MAX_LOG_ERROR if TRANSFORMS[name].log else MAX_ERROR for name in self.free]
        )

    def _interval_text(self, name: str) -> str:
        """The 95 % interval of a free parameter in words."""
        if name in self.at_bound:
            return "at a bound"
        low, high = self.interval(name)
        if TRANSFORMS[name].log and high > UNBOUNDED_RATIO * low:
            return "unbounded"
        return f"{low:.3g} to {high:.3g}"

    @property
    def identifiable(self) -> tuple[str, ...]:
        """Free parameters that the data determine to a factor of 2, given the fixed parameters."""
        return tuple(name for name in self.free if name not in self.not_identifiable)

    @cached_property
    def autocorrelated_misfit(self) -> tuple[float, ...]:
        """Misfit that neighbouring points of each series have in common, relative as residuals.

        The root of the mean product of neighbouring residuals, 0 if it is negative. Independent
        noise averages out; the misfit of a curve of another shape does not. The residuals are
        those of the most probable parameters of each specimen: specimens that differ have the same
        shape.
        """
        residuals = self.problem.split(self.solution.specimen_residuals)
        return tuple(
            math.sqrt(max(float(np.mean(r[1:] * r[:-1])), 0.0))
            for r, series in zip(residuals, self.problem.series, strict=True)
            if series.quantity in CURVE_QUANTITIES
        )

    @property
    def shape_differs(self) -> tuple[bool, ...]:
        """Whether each series has another shape than the curve of the law.

        True where the autocorrelated part of its misfit exceeds a multiple of its noise level.
        """
        pairs = zip(self.autocorrelated_misfit, self._curve_series, strict=True)
        return tuple(
            misfit > MAX_AUTOCORRELATED_MISFIT * float(series.sigma().min())
            for misfit, series in pairs
        )

    @property
    def _curve_series(self) -> list[Series]:
        """The series that are curves."""
        return [one for one in self.problem.series if one.quantity in CURVE_QUANTITIES]

    @property
    def series_names(self) -> list[str]:
        """Name of the test and of the quantity of each measured curve."""
        return [
            f"{curve.name}, {series.quantity}"
            for curve in self.problem.curves
            for series in curve.series
            if series.quantity in CURVE_QUANTITIES
        ]

    def predict(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) at closures (m) with the origin of the closure test."""
        total_closure = np.asarray(closure, float) + self.parameters["preload_closure"]
        return self.law.normal_stress(total_closure)

    @property
    def has_trade_off(self) -> bool:
        """Whether friction and slopes are fitted to shear stresses without any opening."""
        lacks_opening = [curve.opening is None for curve in self.problem.shears]
        return bool(lacks_opening) and all(lacks_opening) and set(TRADE_OFF) <= set(self.free)

    @property
    def opening_interval(self) -> Array:
        """95 % intervals of the largest opening and dilation at the lowest normal stress.

        Low and high (2, 2) of the opening (m), where `shear_band` is highest, and of the tangent of
        the largest dilation angle; NaN if the joint only closes.
        """
        curve = min(self.problem.shears, key=lambda one: np.mean(one.normal))

        def dilation(values: Values) -> Array:
            (test,) = simulate_curves([curve], values, self.problem.settings)
            return np.array([test.dilation])

        opening = self.shear_band(curve)[1]
        largest = opening[:, np.argmax(opening[1])]
        interval = self._confidence_band(dilation)[:, 0]
        if interval.mean() <= 0:
            interval = np.full(2, np.nan)
        return np.stack([largest, np.maximum(interval, 0.0)], axis=1)

    def predict_shear(self, *curves: ShearCurve) -> list[SimulatedTest]:
        """Simulate tests with the fitted law."""
        return simulate_curves(curves, self.parameters, self.problem.settings)

    def band(self, closure: ArrayLike, of_specimen: bool = False) -> Array:
        """95 % confidence band (2, n), low and high, in Pa of the curve `predict`.

        It follows from the covariance of the parameters. It is no prediction band: the noise of a
        further point is not included. Beyond the largest fitted closure it is wider by
        `extrapolation_error`.

        Parameters
        ----------
        closure: in m, (n,), with the origin of the closure test.
        of_specimen: whether the band is of one specimen, wider by the spread between specimens.
        """
        u = np.atleast_1d(np.asarray(closure, float))
        settings = self.problem.settings
        low, high = self._confidence_band(
            lambda values: log_stress(values, values["preload_closure"] + u, settings), of_specimen
        )
        centre = (low + high) / 2
        half_width = np.hypot((high - low) / 2, self.extrapolation_error(u))
        return np.exp(np.stack([centre - half_width, centre + half_width]))

    def extrapolation_error(self, closure: ArrayLike) -> Array:
        """Error (n,) of the logarithm of the stress beyond the fitted closure test, 95 %.

        No law is exactly that of the rock, and the difference grows beyond the data. It is measured
        with the data: the last third of the fitted points is predicted from the others. The error
        is twice the root mean square of the larger half of that distance, and grows with the root
        of the distance from the last point, over the last third. Zero within the data, and for
        cycles or fewer than six points.

        closure: in m, (n,), with the origin of the closure test.
        """
        u = np.atleast_1d(np.asarray(closure, float))
        if self._extrapolation is None:
            return np.zeros(u.size)
        miss, start, end = self._extrapolation
        distance = np.maximum(u - end, 0.0) / (end - start)
        return np.asarray(EXTRAPOLATION_FACTOR * miss * np.sqrt(distance))

    @cached_property
    def _extrapolation(self) -> tuple[float, float, float] | None:
        """Miss of the last third of the closure curve, and the closures (m) at its ends."""
        curve = self.problem.closure
        if curve is None or curve.cycle or curve.stress.size < MIN_EXTRAPOLATION_POINTS:
            return None
        free = tuple(name for name in self.free if name in CLOSURE_PARAMETERS)
        if not free:
            return None
        n = max(math.ceil(2 * curve.stress.size / 3), MIN_CLOSURE_POINTS)
        part = replace(
            self.problem,
            closure=curve.up_to(n),
            shears=(),
            free=free,
            values=self.parameters,
        )
        values = part.unpack(solve(part, starting_points(part, has_law=True)).x)
        rest = slice(n, None)
        closure = values["preload_closure"] + curve.closure[rest]
        predicted = log_stress(values, closure, self.problem.settings)
        misses = predicted - np.log(curve.stress[rest])
        last = misses[-max(1, misses.size // 2) :]
        return (
            float(np.sqrt(np.mean(last**2))),
            float(curve.closure[n - 1]),
            float(curve.closure[-1]),
        )

    def shear_band(self, curve: ShearCurve, of_specimen: bool = False) -> Array:
        """95 % confidence bands of shear stress (Pa) and opening (m) of a test.

        The band of the stress is that of arcsinh(stress/small), which is a logarithm for large
        stresses and allows small ones to change their sign. The opening, a sum of dilation and
        compression, may have any sign: its band is linear.

        Parameters
        ----------
        curve: the test.
        of_specimen: whether the band is of one specimen, wider by the spread between specimens.

        Returns low and high of each, (2, 2, rows).
        """
        if curve not in self._linear_tests:
            self._linear_tests[curve] = self._linear_test(curve)
        small, centre, J = self._linear_tests[curve]
        half_width = self._half_width(J, of_specimen)
        stress, opening = np.stack([centre - half_width, centre + half_width]).swapaxes(0, 1)
        return np.stack([small * np.sinh(stress), opening])

    def _linear_test(self, curve: ShearCurve) -> tuple[float, Array, Array]:
        """The stress that is small, and arcsinh(stress/small) and opening (2, rows) of a test with
        their derivative (2, rows, p).
        """

        def model(values: Values) -> Array:
            (test,) = simulate_curves([curve], values, self.problem.settings)
            return np.stack([np.arcsinh(test.stress / small), test.opening])

        (fitted,) = self.predict_shear(curve)
        small = max(SMALL_STRESS * float(np.max(np.abs(fitted.stress))), 1e-300)
        return small, model(self.parameters), self._derivative(model)

    @cached_property
    def _linear_tests(self) -> dict[ShearCurve, tuple[float, Array, Array]]:
        """The tests that `shear_band` was asked for, see `_linear_test`."""
        return {}

    @property
    def correlation(self) -> Array:
        """Correlation (p, p) of the free parameters, after their transforms."""
        errors = np.sqrt(np.diag(self.solution.covariance))
        return np.asarray(self.solution.covariance / np.outer(errors, errors))

    def _confidence_band(
        self, model: Callable[[Values], Array], of_specimen: bool = False
    ) -> Array:
        """The 95 % confidence band, low and high, of a function of the parameters."""
        centre = model(self.parameters)
        half_width = self._half_width(self._derivative(model), of_specimen)
        return np.stack([centre - half_width, centre + half_width])

    def _derivative(self, model: Callable[[Values], Array]) -> Array:
        """Derivative (..., p) of a function of the parameters at their estimate."""
        unpack = self.problem.unpack
        bounds = self.problem.bounds()
        return central_differences(lambda x: model(unpack(x)), self.solution.x, *bounds)

    def _half_width(self, J: Array, of_specimen: bool) -> Array:
        """Half-width (...) of the 95 % band of a function with the derivative J (..., p)."""
        covariance = self.solution.covariance
        if of_specimen and self.solution.noise.has_specimens:
            spread = self.solution.noise.mean.spread
            covariance = covariance + np.diag(spread**2 * self.problem.varies)
        variance = np.einsum("...p,pq,...q->...", J, covariance, J)
        return np.asarray(QUANTILE * np.sqrt(variance))
