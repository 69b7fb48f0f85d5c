"""Least squares with priors: estimate, covariance, noise, and how much the priors decided.

Minimised is sum (r/sigma)^2 + sum ((x - centre)/sd)^2 over the free parameters x (mostly
logarithms), r being the residuals of the data. The noise sigma of every curve is estimated in turn
with the parameters, see `measured.Noise`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import special
from scipy.optimize import least_squares

from ..support.checks import Array
from .measured import Noise, estimate_noise
from .problem import Problem

ROUNDS = 12  # at most, of fitting and estimating the noise in turn
NOISE_WEIGHT = 4.0  # degrees of freedom that the expectation of the noise is worth
Function = Callable[[Array], Array]


class Solution(NamedTuple):
    """Outcome of `solve`, p parameters after their transforms."""

    x: Array
    covariance: Array  # (p, p)
    noise: tuple[Noise, ...]  # per curve
    freedom: float  # degrees of freedom that the noise was estimated with
    prior_share: Array  # (p,) share of each variance that the priors contribute

    def quantile(self, level: float) -> float:
        """Standard errors either way that hold a parameter with this probability."""
        if not 0 < level < 1:
            raise ValueError(f"level = {level!r} is out of bounds: it must lie between 0 and 1")
        if math.isinf(self.freedom):
            return float(special.ndtri(0.5 + level / 2))
        return float(special.stdtrit(self.freedom, 0.5 + level / 2))


def solve(problem: Problem, starts: Sequence[Array]) -> Solution:
    """Best of several starts, then parameters and noise in turn until both stand.

    With C = (D + L)^-1 the covariance, D the information of the data and L that of the priors,
    C = C D C + C L C: the share of the priors in the variance of a parameter is the ratio of the
    diagonals of C L C and C.
    """
    expected = tuple(curve.expected for curve in problem.curves)
    steepness = [curve.steepness for curve in problem.curves]
    cuts = np.cumsum([s.size for s in steepness])[:-1]
    low, high = problem.bounds()
    noise, sigma = expected, problem.sigma(expected)
    fits = [minimise(partial(problem.residuals, sigma=sigma), x, low, high) for x in starts]
    best = min(fits, key=lambda fit: float(fit.cost))
    for _ in range(ROUNDS):
        r = problem.data(best.x)
        weighted = derivative(problem.data, best.x, low, high) / sigma[:, None]
        Jp = derivative(problem.prior, best.x, low, high)
        precision = Jp.T @ Jp
        C = np.linalg.pinv(weighted.T @ weighted + precision, hermitian=True)
        leverage = np.einsum("ip,pq,iq->i", weighted, C, weighted)
        if all(n.known for n in noise):
            break
        pieces = zip(expected, np.split(r, cuts), np.split(leverage, cuts), steepness, strict=True)
        previous, noise = noise, tuple(estimate_noise(*piece) for piece in pieces)
        if noise == previous:
            break
        sigma = problem.sigma(noise)
        best = minimise(partial(problem.residuals, sigma=sigma), best.x, low, high)
    known = all(n.known for n in noise)
    freedom = np.inf if known else NOISE_WEIGHT + r.size - float(np.sum(leverage))
    share = np.diag(C @ precision @ C) / np.diag(C)
    return Solution(best.x, np.asarray(C, np.float64), noise, freedom, share)


def minimise(residuals: Function, start: Array, low: Array, high: Array) -> Any:
    """One least squares problem, from one start; the result of `least_squares`."""
    margin = 1e-9 * (high - low)
    inside = np.clip(start, low + margin, high - margin)
    return least_squares(residuals, inside, bounds=(low, high), x_scale="jac", xtol=1e-9)


def derivative(f: Function, x: Array, low: Array, high: Array) -> Array:
    """Derivative (n, p) of a function within bounds, by central differences."""
    columns = []
    for k in range(x.size):
        up, down = x.copy(), x.copy()
        up[k], down[k] = min(x[k] + 1e-4, high[k]), max(x[k] - 1e-4, low[k])
        columns.append((f(up) - f(down)) / (up[k] - down[k]))
    return np.stack(columns, -1)
