"""Least squares with priors: estimate, covariance, noise, and how much the priors decided.

Minimised is sum (r/sigma)^2 + sum ((x - centre)/sd)^2 over the free parameters x (mostly
logarithms), r being the residuals of the data. The noise sigma of every curve is estimated in turn
with the parameters, see `noise`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..support.checks import Array
from .noise import Noise, estimate

ROUNDS = 12  # at most, of fitting and estimating the noise in turn
NOISE_WEIGHT = 4.0  # degrees of freedom that the expectation of the noise is worth
Residuals = Callable[[Array], Array]


class Rows(NamedTuple):
    """Residuals of all curves, one after the other, and what their noise depends on."""

    residuals: Residuals
    steepness: tuple[Array, ...]
    expected: tuple[Noise, ...]

    def sigma(self, noise: Sequence[Noise]) -> Array:
        """Standard errors of all residuals."""
        return np.concatenate([n.sigma(s) for n, s in zip(noise, self.steepness, strict=True)])


class Solution(NamedTuple):
    """Outcome of `solve`, on the scale of the fit (p parameters)."""

    x: Array
    covariance: Array  # (p, p)
    noise: tuple[Noise, ...]  # per curve
    freedom: float  # degrees of freedom that the noise was estimated with
    prior_share: Array  # (p,) share of each variance that the priors contribute


def solve(
    rows: Rows, prior: Residuals, starts: Sequence[Array], low: Array, high: Array
) -> Solution:
    """Best of several starts, then parameters and noise in turn until both stand.

    With C = (D + L)^-1 the covariance, D the information of the data and L that of the priors,
    C = C D C + C L C: the share of the priors in the variance of a parameter is the ratio of the
    diagonals of C L C and C.
    """
    noise = rows.expected
    sigma = rows.sigma(noise)
    fits = [minimise(rows.residuals, sigma, prior, start, low, high) for start in starts]
    best = min(fits, key=lambda fit: float(fit.cost))
    for _ in range(ROUNDS):
        r, J, Jp = _linear(rows.residuals, prior, best.x, low, high)
        weighted = J / sigma[:, None]
        precision = Jp.T @ Jp
        C = np.linalg.pinv(weighted.T @ weighted + precision, hermitian=True)
        leverage = np.einsum("ip,pq,iq->i", weighted, C, weighted)
        if all(n.known for n in noise):
            break
        cuts = np.cumsum([s.size for s in rows.steepness])[:-1]
        pieces = zip(
            rows.expected, np.split(r, cuts), np.split(leverage, cuts), rows.steepness, strict=True
        )
        previous, noise = noise, tuple(estimate(*piece) for piece in pieces)
        if noise == previous:
            break
        sigma = rows.sigma(noise)
        best = minimise(rows.residuals, sigma, prior, best.x, low, high)
    known = all(n.known for n in noise)
    freedom = np.inf if known else NOISE_WEIGHT + r.size - float(np.sum(leverage))
    share = np.diag(C @ precision @ C) / np.diag(C)
    return Solution(best.x, np.asarray(C, np.float64), noise, freedom, share)


def minimise(
    data: Residuals, sigma: Array, prior: Residuals, start: Array, low: Array, high: Array
) -> Any:
    """One least squares problem, from one start; the result of `least_squares`."""

    def residuals(x: Array) -> Array:
        return np.concatenate([data(x) / sigma, prior(x)])

    margin = 1e-9 * (high - low)
    inside = np.clip(start, low + margin, high - margin)
    return least_squares(residuals, inside, bounds=(low, high), x_scale="jac", xtol=1e-9)


def _linear(
    data: Residuals, prior: Residuals, x: Array, low: Array, high: Array
) -> tuple[Array, Array, Array]:
    """Data residuals, and the derivatives of data and prior residuals by central differences."""
    columns, prior_columns = [], []
    for k in range(x.size):
        up, down = x.copy(), x.copy()
        up[k], down[k] = min(x[k] + 1e-4, high[k]), max(x[k] - 1e-4, low[k])
        width = up[k] - down[k]
        columns.append((data(up) - data(down)) / width)
        prior_columns.append((prior(up) - prior(down)) / width)
    return data(x), np.stack(columns, -1), np.stack(prior_columns, -1)
