"""What the data of a fit fix and what they leave open: reasons and profile likelihoods."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..support.checks import Array
from .estimate import Estimate
from .priors import transform_of
from .problem import Problem
from .solve import minimise

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


def reasons(fit: Estimate) -> dict[str, str]:
    """Parameters that the data of a fit do not fix, each with the reason."""
    found: dict[str, str] = {}
    errors = np.sqrt(np.diag(fit.solution.covariance))
    for (name, share), error in zip(fit.prior_share.items(), errors, strict=True):
        if share > PRIOR_SHARE:
            found[name] = f"the priors supply {100 * share:.0f} % of its variance"
        elif error > (WIDEST if transform_of(name).log else 0.5):
            low, high = fit.interval(name)
            found[name] = f"the data leave it anywhere from {low:.3g} to {high:.3g}"
    if len(fit.problem.closures) == len(fit.problem.curves):
        stiff = next((n for n in ("asperity_density", "K") if n in fit.free), None)
        for name in _ONE_FACTOR:
            if name not in fit.free:
                other = f"the factor that {stiff} was fitted for" if stiff else "one factor"
                found[name] = f"held; acts on a closure curve only within {other}"
        if "overlap" not in fit.free:
            found["overlap"] = (
                "held; a closure curve cannot tell it from alpha, beta and the seating closure"
            )
    for name in ("eta", "alpha", "beta", *_ONE_FACTOR, "overlap"):
        if name not in fit.free:
            found.setdefault(name, "held, not fitted")
    return found


def profile(fit: Estimate, name: str, points: int, priors: bool) -> Profile:
    """Profile likelihood of one fitted parameter.

    With `priors` the priors of all parameters take part, as in the fit; without, the data alone.
    """
    at, solution = fit.index(name), fit.solution
    problem = fit.problem if priors else replace(fit.problem, priors={})
    low, high = problem.bounds()
    centre, sd = solution.x[at], float(np.sqrt(solution.covariance[at, at]))
    reach = max(4 * sd, 0.5)
    grid = np.linspace(max(low[at], centre - reach), min(high[at], centre + reach), points | 1)
    misfit, sigma = np.empty(grid.size), problem.sigma(fit.noise)
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
