"""What the data of a fit fix and what they leave open: reasons and profile likelihoods."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..support.checks import Array
from .fit import PRIOR_SHARE, WIDEST, Fit
from .measured import ClosureCurve
from .priors import scale_of
from .solve import minimise

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


def reasons(fit: Fit) -> dict[str, str]:
    """Parameters that the data of a fit do not fix, each with the reason."""
    found: dict[str, str] = {}
    closure_only = all(isinstance(c, ClosureCurve) for c in fit.problem.curves)
    for k, name in enumerate(fit.free):
        share = float(fit.solution.prior_share[k])
        error = float(np.sqrt(fit.solution.covariance[k, k]))
        wide = error > (WIDEST if scale_of(name).log else 0.5)
        if share > PRIOR_SHARE:
            found[name] = f"the priors supply {100 * share:.0f} % of its variance"
        elif wide:
            low, high = fit.interval(name)
            found[name] = f"the data leave it anywhere from {low:.3g} to {high:.3g}"
    if closure_only:
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


def profile(fit: Fit, name: str, points: int, priors: bool) -> Profile:
    """Profile likelihood of one fitted parameter.

    With `priors` the priors of all parameters take part, as in the fit; without, the data alone.
    """
    at = fit._index(name)
    problem = fit.problem if priors else fit.without_priors()
    low, high = problem.bounds()
    centre, sd = fit.solution.x[at], float(np.sqrt(fit.solution.covariance[at, at]))
    reach = max(4 * sd, 0.5)
    grid = np.linspace(max(low[at], centre - reach), min(high[at], centre + reach), points | 1)
    misfit = np.empty(grid.size)
    sigma = problem.rows.sigma(fit.noise)
    others = np.arange(len(fit.free)) != at
    middle = int(np.argmin(np.abs(grid - centre)))
    for side in (range(middle, grid.size), range(middle - 1, -1, -1)):
        x = fit.solution.x.copy()
        for k in side:
            x[at] = grid[k]

            def full(y: Array, x: Array = x) -> Array:
                z = x.copy()
                z[others] = y
                return z

            if others.any():
                found = minimise(
                    _after(problem.data, full),
                    sigma,
                    _after(problem.prior, full),
                    x[others],
                    low[others],
                    high[others],
                )
                x = full(found.x)
                misfit[k] = 2 * float(found.cost)
            else:
                misfit[k] = float(
                    np.sum((problem.data(x) / sigma) ** 2) + np.sum(problem.prior(x) ** 2)
                )
    deviance = misfit - misfit.min()
    best = int(np.argmin(deviance))
    limit = fit._quantile(0.95) ** 2
    scale = scale_of(name)

    def crossing(side: range) -> float | None:
        for i in side:
            j = i + side.step
            if deviance[j] > limit:
                part = (limit - deviance[i]) / (deviance[j] - deviance[i])
                return scale.back(float(grid[i] + part * (grid[j] - grid[i])))
        return None

    values = np.array([scale.back(float(x)) for x in grid])
    down, up = crossing(range(best, 0, -1)), crossing(range(best, grid.size - 1))
    return Profile(name, values, deviance, down, up)


def _after(f: Callable[[Array], Array], g: Callable[[Array], Array]) -> Callable[[Array], Array]:
    """f of g."""
    return lambda y: f(g(y))
