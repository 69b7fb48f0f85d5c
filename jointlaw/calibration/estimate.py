"""What a solution says: parameters, intervals, bands, and what the data fix and leave open."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..law import JointLaw
from ..support.checks import Array
from .forward import build, log_stress
from .measured import ClosureCurve, Noise
from .priors import transform_of
from .problem import Problem, Solution, derivative, minimise

# Standard error of ln(stress) per doubling of the stress beyond the data, from curves of other
# laws: power laws of exponent 1.5 to 6 and Gaussian heights, lower half fitted, upper predicted
MODEL_ERROR = 0.03
# The same per unit of `Estimate.wander`, from hyperbolas and logarithms (benchmarks/held_out.py)
WANDER_ERROR = 6.0
WANDERS = 1.5  # of the expected scatter: from this `Estimate.wander` on the law is not the rock
PRIOR_SHARE = 0.05  # of the variance: up to here the data, not the priors, decide
WIDEST = math.log(2) / 1.96  # standard error of a logarithm: a factor of 2 either way
# What acts on a closure curve only as one factor: N lam K times a sum over the inclinations
_ONE_FACTOR = ("asperity_density", "K", "lam", "mu", "a", "b", "c")


class Profile(NamedTuple):
    """Misfit against one parameter, all others free: closed where the data bound it.

    `values` (n,) in SI units, `deviance` (n,) = rise of sum (r/sigma)^2 over its least value, `low`
    and `high` the ends of the 95 % interval or None where it is open.
    """

    name: str
    values: Array
    deviance: Array
    low: float | None
    high: float | None

    @property
    def closed(self) -> bool:
        """Whether the data bound the parameter on both sides."""
        return self.low is not None and self.high is not None


@dataclass(frozen=True, eq=False)
class Estimate:
    """A problem and its solution, in SI units; `Fit` adds words and pictures."""

    problem: Problem
    solution: Solution

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the fitted parameters, the seating closures last."""
        return self.problem.free

    @property
    def parameters(self) -> Mapping[str, float]:
        """Every parameter in SI units, fitted or held, and the seating closures (m); read-only."""
        return MappingProxyType(self._values)

    @cached_property
    def _values(self) -> dict[str, float]:
        return self.problem.unpack(self.solution.x)  # a proxy of it could not be pickled

    @cached_property
    def law(self) -> JointLaw:
        """The law of these parameters."""
        settings = self.problem.settings
        return build(self.parameters, settings, settings.plane)

    @property
    def noise(self) -> tuple[Noise, ...]:
        """Noise of every curve: `share` of the stress and `absolute` of the closure (m)."""
        return self.solution.noise

    @property
    def bends_otherwise(self) -> tuple[bool, ...]:
        """Whether each closure curve shows that the rock does not close as the law does."""
        pairs = zip(self.wander, self.problem.closures, strict=True)
        return tuple(wander > WANDERS * curve.expected.share for wander, (_, curve) in pairs)

    @cached_property
    def wander(self) -> tuple[float, ...]:
        """Misfit that neighbouring points of each closure curve share, as a part of the stress.

        The root of the mean product of neighbouring residuals, 0 where that is negative: scatter
        averages out of it, a curve that bends otherwise than the law does not.
        """
        v, found = self.parameters, []
        for seating, curve in self.problem.closures:
            r = curve.residuals(v, v[seating], self.problem.settings)
            found.append(math.sqrt(max(float(np.mean(r[1:] * r[:-1])), 0.0)))
        return tuple(found)

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the fitted parameters in SI units, in the order of `free`."""
        slope = [transform_of(name).slope(self.parameters[name]) for name in self.free]
        return self.solution.covariance * np.outer(slope, slope)

    @property
    def standard_error(self) -> dict[str, float]:
        """Standard error of every fitted parameter in SI units."""
        return dict(zip(self.free, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def prior_share(self) -> dict[str, float]:
        """Share of the variance of every fitted parameter that the priors contribute."""
        return dict(zip(self.free, self.solution.prior_share.tolist(), strict=True))

    def index(self, name: str) -> int:
        """Number of a fitted parameter in `free`; raises ValueError for any other."""
        if name not in self.free:
            raise ValueError(f"{name!r} was not fitted; fitted are {', '.join(self.free)}")
        return self.free.index(name)

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Interval of a fitted parameter (SI units) that holds it with this probability."""
        at, transform = self.index(name), transform_of(name)
        reach = self.solution.quantile(level) * math.sqrt(self.solution.covariance[at, at])
        x = float(self.solution.x[at])
        return transform.back(x - reach), transform.back(x + reach)

    def predict(self, closure: ArrayLike, curve: int = 1) -> Any:
        """Normal stress (Pa) at closures (m) counted as in the closure curve number `curve`."""
        seating = self.parameters[self.closure_curve(curve)[0]]
        return self.law.normal_stress(np.asarray(closure, float) + seating)

    def band(
        self, closure: ArrayLike, level: float = 0.95, curve: int = 1, measured: bool = True
    ) -> tuple[Array, Array]:
        """Band (low, high) in Pa around `predict`.

        closure: in m, as in `predict`; level: probability; measured: whether the band is for a
        point yet to be measured, noise included, or for the curve itself. Beyond the largest
        fitted stress it widens by 3 % (one standard error) per doubling of the stress, for the law
        is not the rock, and by six times `wander`, where the points say so themselves. For cycles
        it is that of a first loading, in shares of the largest stress as their residuals are.
        """
        name, data = self.closure_curve(curve)
        u = np.atleast_1d(np.asarray(closure, float))

        def model(x: Array, step: float = 0.0) -> Array:
            v = self.problem.unpack(x)
            return log_stress(v, v[name] + u + step, self.problem.settings)

        centre = model(self.solution.x)
        slope = derivative(model, self.solution.x, *self.problem.bounds())
        variance = np.einsum("ip,pq,iq->i", slope, self.solution.covariance, slope)
        # residuals of cycles are shares of the largest stress
        scale = data.stress.max() / np.exp(centre) if data.cycle else 1.0
        if measured:
            noise = self.noise[self.problem.curves.index(data)]
            step = 1e-4 * float(np.ptp(data.closure))
            rise = model(self.solution.x, step) - centre
            variance = variance + (scale * noise.sigma(rise / step / scale)) ** 2
        beyond = np.maximum(centre - np.log(data.stress.max()), 0.0)
        wander = scale * self.wander[curve - 1]
        model_error = np.hypot(MODEL_ERROR, WANDER_ERROR * wander)
        variance = variance + wander**2 + (model_error * beyond / math.log(2)) ** 2
        reach = self.solution.quantile(level) * np.sqrt(variance)
        if data.cycle:
            return np.exp(centre) * np.maximum(1 - reach, 0.0), np.exp(centre) * (1 + reach)
        return np.exp(centre - reach), np.exp(centre + reach)

    def closure_curve(self, number: int) -> tuple[str, ClosureCurve]:
        """A closure curve, counted from 1, with the name of its seating closure."""
        closures = self.problem.closures
        if not 1 <= number <= len(closures):
            raise ValueError(
                f"curve = {number!r} is out of bounds: this fit has {len(closures)} closure "
                "curves, counted from 1"
            )
        return closures[number - 1]

    @property
    def identifiable(self) -> tuple[str, ...]:
        """Fitted parameters that the data fix: to a factor of 2, the priors all but silent."""
        return tuple(name for name in self.free if name not in self.not_identifiable)

    @cached_property
    def not_identifiable(self) -> dict[str, str]:
        """Parameters that these data do not fix, each with the reason."""
        found: dict[str, str] = {}
        errors = np.sqrt(np.diag(self.solution.covariance))
        for (name, share), error in zip(self.prior_share.items(), errors, strict=True):
            if share > PRIOR_SHARE:
                found[name] = f"the priors supply {100 * share:.0f} % of its variance"
            elif error > (WIDEST if transform_of(name).log else 0.5):
                low, high = self.interval(name)
                found[name] = f"the data leave it anywhere from {low:.3g} to {high:.3g}"
        if len(self.problem.closures) == len(self.problem.curves):
            stiff = next((n for n in ("asperity_density", "K") if n in self.free), None)
            for name in _ONE_FACTOR:
                if name not in self.free:
                    other = f"the factor that {stiff} was fitted for" if stiff else "one factor"
                    found[name] = f"held; acts on a closure curve only within {other}"
            if "overlap" not in self.free:
                found["overlap"] = (
                    "held; a closure curve cannot tell it from alpha, beta and the seating closure"
                )
        for name in ("eta", "alpha", "beta", *_ONE_FACTOR, "overlap"):
            if name not in self.free:
                found.setdefault(name, "held, not fitted")
        return found

    def profile(self, name: str, points: int = 21, priors: bool = False) -> Profile:
        """Profile likelihood of one fitted parameter.

        With `priors` the priors of all parameters take part, as in the fit; without, the data
        alone.
        """
        at, solution = self.index(name), self.solution
        problem = self.problem if priors else replace(self.problem, priors={})
        low, high = problem.bounds()
        centre, sd = solution.x[at], float(np.sqrt(solution.covariance[at, at]))
        reach = max(4 * sd, 0.5)
        grid = np.linspace(max(low[at], centre - reach), min(high[at], centre + reach), points | 1)
        misfit, sigma = np.empty(grid.size), problem.sigma(self.noise)
        middle = int(np.argmin(np.abs(grid - centre)))
        for side in (range(middle, grid.size), range(middle - 1, -1, -1)):
            others = np.delete(solution.x, at)
            for k in side:
                misfit[k], others = _least_misfit(problem, sigma, at, float(grid[k]), others)
        deviance = misfit - misfit.min()
        best = int(np.argmin(deviance))
        limit = solution.quantile(0.95) ** 2
        back = transform_of(name).back

        def crossing(side: range) -> float | None:
            for i in side:
                j = i + side.step
                if deviance[j] > limit:
                    part = (limit - deviance[i]) / (deviance[j] - deviance[i])
                    return back(float(grid[i] + part * (grid[j] - grid[i])))
            return None

        values = np.array([back(float(x)) for x in grid])
        down, up = crossing(range(best, 0, -1)), crossing(range(best, grid.size - 1))
        return Profile(name, values, deviance, down, up)


def _least_misfit(
    problem: Problem, sigma: Array, at: int, value: float, others: Array
) -> tuple[float, Array]:
    """Least sum of squares with one parameter held at a value, and the others (p - 1,) there."""

    def residuals(y: Array) -> Array:
        return problem.residuals(np.insert(y, at, value), sigma)

    if not others.size:
        return float(np.sum(residuals(others) ** 2)), others
    low, high = (np.delete(bound, at) for bound in problem.bounds())
    found = minimise(residuals, others, low, high)
    return 2 * float(found.cost), found.x
