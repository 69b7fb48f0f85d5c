"""What a fit found: the law, its parameters with their intervals, and what the data leave open."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..laws.joint_law import JointLaw
from ..support.checks import Array, one_of
from .forward import build, log_stress
from .measured import ShearCurve, sheared
from .priors import TRANSFORMS, Values
from .problem import Problem, Solution, derivative
from .shearing import Sheared

MISFITS = 1.5  # of the expected scatter: from this systematic misfit on the law is not the rock
PRIOR_SHARE = 0.05  # of the variance: up to here the data, not the priors, decide
WIDEST = math.log(2) / 1.96  # standard error of a logarithm: a factor of 2 either way
OPEN = 1e6  # upper over lower end of the interval of what nothing fixes
SOFTENING = 3  # points of one test on the fall of the bond, to know its cohesion by
AT_BOUND = 1e-6  # of the distance of the bounds
SMALL = 0.01  # of the largest stress or opening: larger ones have the bands of their logarithms
TRADED = ("mu", "a")  # friction and slopes, which shear stress alone cannot tell apart


@dataclass(frozen=True, eq=False)
class Estimates:
    """Outcome of a fit, in SI units.

    `free` names the fitted parameters in the order of `covariance`, the seating closure last;
    `parameters` holds all values; `noise`, `systematic_misfit` and `shape_differs` have an entry
    for each series: closure curve, shear stress, opening. `halved` is the change of shear stress
    and opening, of their largest, with half the steps and finer cells, `moved` (p,) what the
    rest of the way to infinitely many does to the parameters after their transforms, at most: their
    intervals are as much wider.
    """

    problem: Problem
    solution: Solution
    halved: float
    moved: Array

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the fitted parameters, the seating closure last."""
        return self.problem.free

    @property
    def parameters(self) -> dict[str, float]:
        """Every parameter, fitted or held, and the seating closure (m)."""
        return self.problem.unpack(self.solution.x)

    @cached_property
    def law(self) -> JointLaw:
        """The law of these parameters."""
        return build(self.parameters, self.problem.settings, self.problem.settings.law.plane)

    def interval(self, name: str) -> tuple[float, float]:
        """The 95 % interval of a fitted parameter, within its bounds."""
        one_of("fitted parameter", name, self.free)
        at, transform = self.free.index(name), TRANSFORMS[name]
        error = math.sqrt(self.solution.covariance[at, at])
        reach = self.solution.quantile * error + abs(self.moved[at])
        x, (low, high) = self.solution.x[at], self.problem.bounds()
        ends = max(x - reach, low[at]), min(x + reach, high[at])
        return transform.back(float(ends[0])), transform.back(float(ends[1]))

    @cached_property
    def at_bound(self) -> tuple[str, ...]:
        """Fitted parameters that the fit left at a bound: the data ask for what no law has."""
        low, high = self.problem.bounds()
        gap = np.minimum(self.solution.x - low, high - self.solution.x) / (high - low)
        if "mating_length" in self.free:  # of which the closure range is a bound too
            short = self.law.mating_length > (1 + AT_BOUND) * self.parameters["mating_length"]
            gap[self.free.index("mating_length")] *= not short
        return tuple(name for name, g in zip(self.free, gap, strict=True) if g < AT_BOUND)

    @cached_property
    def too_many(self) -> tuple[str, ...]:
        """Fitted parameters to hold, the vaguest first, so that the data alone fix the others.

        Without any opening friction is held before all others.
        """
        held = ["mu"] if self.traded else []
        kept = [k for k, name in enumerate(self.free) if name not in {"seating", *held}]
        while kept:
            C = np.linalg.inv(self.solution.information[np.ix_(kept, kept)])
            vague = np.sqrt(np.diag(C)) / self._widest[kept]
            if vague.max() <= 1:
                break
            held.append(self.free[kept.pop(int(np.argmax(vague)))])
        return tuple(held)

    @cached_property
    def not_identifiable(self) -> dict[str, str]:
        """Fitted parameters that these data do not fix, each with the reason."""
        found: dict[str, str] = {}
        errors = np.sqrt(np.diag(self.solution.covariance)) / self._widest
        for name, share, error in zip(self.free, self.solution.prior_share, errors, strict=True):
            if name in self.at_bound:
                found[name] = f"the fit ended at a bound, {self.parameters[name]:.3g}"
            elif name == "cohesion" and self._softening < SOFTENING:
                found[name] = (
                    f"at most {self._softening} points of a test lie where the bond softens: a "
                    "bond that breaks between two points shows no cohesion"
                )
            elif name in TRADED and self.traded:
                found[name] = "no opening was measured, and shear stress alone does not tell it"
            elif share > PRIOR_SHARE:
                found[name] = f"the priors supply {100 * share:.0f} % of its variance"
            elif error > 1:
                found[name] = f"the data leave it {self._spread(name)}"
        return found

    @property
    def _softening(self) -> int:
        """Points between begin and end of damage in pure shear, of the curve that has most."""
        assert self.law.bond is not None
        (_, begin), (_, end) = self.law.bond.limits
        ways = (np.abs(curve.shear) for curve in self.problem.shears)
        return max((int(np.sum((way * begin > 1) & (way * end < 1))) for way in ways), default=0)

    @property
    def _widest(self) -> Array:
        """Standard errors (p,) up to which a parameter is known."""
        return np.array([WIDEST if TRANSFORMS[name].log else 0.5 for name in self.free])

    def _spread(self, name: str) -> str:
        """The 95 % interval of a fitted parameter in words."""
        if name in self.at_bound:
            return "at a bound"
        low, high = self.interval(name)
        return "open" if TRANSFORMS[name].log and high > OPEN * low else f"{low:.3g} to {high:.3g}"

    @property
    def identifiable(self) -> tuple[str, ...]:
        """Fitted parameters that the data fix: to a factor of 2, the priors all but silent."""
        return tuple(name for name in self.free if name not in self.not_identifiable)

    @cached_property
    def systematic_misfit(self) -> tuple[float, ...]:
        """Misfit that neighbouring points of each series share, as residuals are.

        The root of the mean product of neighbouring residuals, 0 where that is negative: scatter
        averages out of it, the misfit of a curve of another shape does not.
        """
        curves = self.problem.split(self.problem.data(self.solution.x))
        return tuple(math.sqrt(max(float(np.mean(r[1:] * r[:-1])), 0.0)) for r in curves)

    @property
    def shape_differs(self) -> tuple[bool, ...]:
        """Whether each series shows that the rock deforms along another curve than the law."""
        pairs = zip(self.systematic_misfit, self.problem.series, strict=True)
        return tuple(misfit > MISFITS * one.expected.share for misfit, one in pairs)

    def predict(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) at closures (m) counted as in the closure test."""
        return self.law.normal_stress(np.asarray(closure, float) + self.parameters["seating"])

    @property
    def traded(self) -> bool:
        """Whether friction and slopes are fitted to shear stresses without any opening."""
        unmeasured = [curve.opening is None for curve in self.problem.shears]
        return bool(unmeasured) and all(unmeasured) and set(TRADED) <= set(self.free)

    @property
    def openings(self) -> Array:
        """95 % interval, low and high (2, 2), of the opening (m) in the shear test of the lowest
        normal stress, where `shear_band` reaches highest, and of the tangent of the largest
        dilation angle; NaN where the joint only closes.
        """
        curve = min(self.problem.shears, key=lambda one: np.mean(one.normal))

        def model(values: Values) -> Array:
            (test,) = sheared([curve], values, self.problem.settings)
            with np.errstate(invalid="ignore"):
                return np.log([test.dilation])

        opening = self.shear_band(curve)[1]
        most = opening[:, np.argmax(opening[1])]
        return np.stack([most, np.exp(self._band(model))[:, 0]], axis=1)

    def predict_shear(self, *curves: ShearCurve) -> list[Sheared]:
        """These tests by the fitted law."""
        return sheared(curves, self.parameters, self.problem.settings)

    def band(self, closure: ArrayLike) -> Array:
        """95 % band (2, n), low and high, in Pa of the curve `predict`.

        By the covariance of the parameters alone: the noise of a further point is not in it, nor
        that rock is not this law, which counts most beyond the largest fitted stress.
        """
        u, settings = np.atleast_1d(np.asarray(closure, float)), self.problem.settings
        return np.exp(self._band(lambda v: log_stress(v, v["seating"] + u, settings)))

    def shear_band(self, curve: ShearCurve) -> Array:
        """The same of shear stress and opening of a test (2, 2, rows): low and high of each.

        Worked out for arcsinh(value / small), which is the logarithm of large values but for a
        constant, and lets small ones change their sign.
        """

        def model(values: Values) -> Array:
            (test,) = sheared([curve], values, self.problem.settings)
            return np.stack([test.stress, test.opening])

        largest = np.abs(model(self.parameters)).max(axis=1, keepdims=True)
        small = np.maximum(SMALL * largest, 1e-300)
        return (small * np.sinh(self._band(lambda v: np.arcsinh(model(v) / small)))).swapaxes(0, 1)

    def _band(self, model: Callable[[Values], Array]) -> Array:
        """The 95 % band, low and high, of what a model gives of the parameters."""
        x, unpack = self.solution.x, self.problem.unpack
        slope = derivative(lambda x: model(unpack(x)), x, *self.problem.bounds())
        variance = np.einsum("...p,pq,...q->...", slope, self.solution.covariance, slope)
        centre, reach = model(self.parameters), self.solution.quantile * np.sqrt(variance)
        return np.stack([centre - reach, centre + reach])
