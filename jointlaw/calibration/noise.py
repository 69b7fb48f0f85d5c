"""Measurement noise: its level, autocorrelation, and the spread between specimens.

A confidence interval is only as good as the noise model behind it. Three properties of laboratory
tests make the residuals of a fit differ from independent noise of known level:

- **The level is unknown**, and a test of three points cannot determine it. One level is estimated
  for each quantity (normal stress and closure of a closure test, shear stress, opening), from the
  residuals of all tests.
- **Neighbouring residuals are correlated**: gauges drift, asperities are few, and a law has not
  exactly the shape of the rock. The correlation of residuals i and j is rho^|i - j|.
- **Specimens differ.** The logarithms of the parameters of a specimen differ from the parameters of
  the joint by independent normal deviates with one standard deviation, the spread. Without it, many
  points of two specimens would determine the joint far too well.

The residuals of test k then have the covariance

    V_k = S_k R(rho) S_k + spread^2 J_k J_k',

with the diagonal matrix S_k of standard errors and the derivative J_k of the residuals by the
logarithms of the parameters. Level, rho and spread (the hyperparameters) have priors, and for each
point of a grid of them the posterior of the parameters x is normal near the present ones: with
A = sum J_k' V_k^-1 J_k + L and b = sum J_k' V_k^-1 r_k + b_0 its mean is x - A^-1 b and its
covariance A^-1 (L and b_0 come from the priors of the parameters). The weight of a grid point is
its restricted likelihood, exp(-(sum (ln|V_k| + r_k' V_k^-1 r_k) + ln|A| - b' A^-1 b)/2), which
allows for the part of the noise that the parameters follow. Averages over the grid give the result:
the covariance of x is the mean of A^-1 plus the covariance of the means.

V_k^-1 is never formed. With T = spread^2 for logarithms of parameters and 0 for others, and the
information M_k = J_k' (S R S)^-1 J_k of a test alone, J_k' V_k^-1 J_k = M_k (I + T M_k)^-1.

A residual that no noise can change must not be counted: the first row of a shear test is zero by
construction.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..support.checks import Array

LEVEL_FACTOR = 4.0  # the 95 % range of a level is from 1/4 to 4 times the expected one
MAX_LEVEL_FACTOR = 10.0  # largest and smallest level relative to the expected one, either way
AUTOCORRELATIONS = np.array([0.0, 0.3, 0.6, 0.8, 0.9, 0.96])  # grid of rho
INDEPENDENCE = 0.4  # prior probability of rho = 0; all others are equally probable
SPREADS = np.array([0.0, 0.02, 0.04, 0.08, 0.16])  # grid of the spread, equally probable
_LEVEL_SD = np.log(LEVEL_FACTOR) / 1.96
# standard deviations of the logarithm of a level: a normal density is integrated within 1 %
_LEVEL_GRID = np.linspace(-2.6, 2.6, 5)
_MIN_LEVEL_SD = 0.05  # of the logarithm: a narrower grid is not needed
_MIN_PROBABILITY = 1e-3  # of a value of rho or of the spread that stays on the grid


class Series(NamedTuple):
    """One measured quantity of a test.

    test: kind of the test, "closure" or "shear"; all tests of a kind have one autocorrelation.
    quantity: its name, of the axis that the residuals belong to.
    errors: expected standard errors of the residuals, (n,) each, by their sources. The variance of
        a residual is the sum over the sources. All series with a source have one level of it.
    is_known: whether these are known: levels and an autocorrelation are then not estimated.
    """

    test: str
    quantity: str
    errors: dict[str, Array]
    is_known: bool = False

    def sigma(self, levels: Mapping[str, float] | None = None) -> Array:
        """Standard errors of the residuals, (n,).

        levels: noise levels relative to the expected ones by source; None for the expected noise.
        """
        scale = {} if levels is None or self.is_known else levels
        variances = [(scale.get(name, 1.0) * error) ** 2 for name, error in self.errors.items()]
        return np.asarray(np.sqrt(sum(variances)), np.float64)


class LinearTest(NamedTuple):
    """The series of one test (one specimen), linearised at the present parameters.

    series: its measured quantities.
    residuals: of each series, (n,).
    derivatives: of the residuals of each series by the p parameters, (n, p).
    """

    series: Sequence[Series]
    residuals: Sequence[Array]
    derivatives: Sequence[Array]


class Prior(NamedTuple):
    """Normal prior of p parameters: minus its log density is x' L x / 2 + b_0' x.

    information: L, (p, p).
    gradient: b_0, (p,), for x relative to the present parameters.
    """

    information: Array
    gradient: Array


class Hyperparameters(NamedTuple):
    """Noise levels, autocorrelations and spread between specimens.

    levels: noise level relative to the expected one, by source of noise.
    autocorrelation: rho by kind of test.
    spread: standard deviation between specimens of the logarithm of a parameter.
    """

    levels: dict[str, float]
    autocorrelation: dict[str, float]
    spread: float


class NoiseEstimate(NamedTuple):
    """Posterior of the hyperparameters.

    mean: their posterior means.
    log_errors: standard deviation of the logarithm of each level.
    autocorrelations: probable values by kind of test, of `AUTOCORRELATIONS`.
    spreads: probable values, of `SPREADS`; zero alone if all tests are on one specimen.
    """

    mean: Hyperparameters
    log_errors: dict[str, float]
    autocorrelations: dict[str, Array]
    spreads: Array

    @property
    def has_specimens(self) -> bool:
        """Whether each test is on its own specimen."""
        return self.spreads.size > 1


class Posterior(NamedTuple):
    """Posterior of p parameters, averaged over the hyperparameters.

    step: change of the parameters to their posterior mean, (p,).
    covariance: (p, p).
    conditional_covariance: mean of the covariances for given hyperparameters, (p, p).
    information: mean information of data and prior, (p, p).
    noise: posterior of the hyperparameters.
    mode: the most probable hyperparameters.
    """

    step: Array
    covariance: Array
    conditional_covariance: Array
    information: Array
    noise: NoiseEstimate
    mode: Hyperparameters


def prior_estimate(series: Sequence[Series], has_specimens: bool) -> NoiseEstimate:
    """The prior of the hyperparameters.

    Parameters
    ----------
    series: all series of a fit.
    has_specimens: whether each test is on its own specimen.
    """
    estimated = [one for one in series if not one.is_known]
    keys = sorted({source for one in estimated for source in one.errors})
    tests = sorted({one.test for one in estimated})
    expected = Hyperparameters(dict.fromkeys(keys, 1.0), dict.fromkeys(tests, 0.0), 0.0)
    spreads = SPREADS if has_specimens else np.zeros(1)
    return NoiseEstimate(
        expected,
        dict.fromkeys(keys, _LEVEL_SD),
        dict.fromkeys(tests, AUTOCORRELATIONS),
        spreads,
    )


def estimate_posterior(
    tests: Sequence[LinearTest], prior: Prior, varies: Array, previous: NoiseEstimate
) -> Posterior:
    """The posterior of the parameters near the present ones, averaged over the hyperparameters.

    Parameters
    ----------
    tests: the tests, linearised at the present parameters.
    prior: prior of the parameters.
    varies: whether each parameter is a logarithm that differs between specimens, (p,).
    previous: an earlier estimate, about which the grid of the levels is centred.
    """
    grid = _Grid(previous)
    spread_variance = grid.spread[..., None] ** 2 * varies
    information = prior.information
    gradient = prior.gradient
    deviance = np.zeros(())
    for test in tests:
        M, v, q, log_determinant = _sum_series(test, grid)
        if previous.has_specimens:
            B = np.eye(varies.size) + spread_variance[..., :, None] * M
            K = np.linalg.inv(B)
            q = q - np.einsum("...p,...pq,...q,...q->...", v, K, spread_variance, v)
            v = np.einsum("...qp,...q->...p", K, v)
            M = M @ K
            log_determinant = log_determinant + np.linalg.slogdet(B)[1]
        information = information + M
        gradient = gradient + v
        deviance = deviance + q + log_determinant
    C = np.asarray(np.linalg.inv(information), np.float64)
    steps: Array = -np.einsum("...pq,...q->...p", C, gradient)
    deviance = deviance + np.linalg.slogdet(information)[1]
    deviance = deviance + np.einsum("...p,...p->...", gradient, steps)
    weight = grid.weights(deviance)
    step = grid.mean(weight, steps, 1)
    deviation = steps - step
    products = np.asarray(deviation[..., :, None] * deviation[..., None, :], np.float64)
    between = grid.mean(weight, products, 2)
    conditional_covariance = grid.mean(weight, C, 2)
    return Posterior(
        step=step,
        covariance=conditional_covariance + between,
        conditional_covariance=conditional_covariance,
        information=grid.mean(weight, information, 2),
        noise=grid.estimate(weight),
        mode=grid.point(np.unravel_index(int(np.argmax(weight)), weight.shape)),
    )


def misfit(tests: Sequence[LinearTest], hyperparameters: Hyperparameters, varies: Array) -> float:
    """The sum over tests of r' V^-1 r for given hyperparameters.

    Parameters
    ----------
    tests: residuals, and derivatives for the spread between specimens.
    hyperparameters: the noise model.
    varies: as in `estimate_posterior`.
    """
    total = 0.0
    variance = hyperparameters.spread**2 * varies
    for test in tests:
        M = np.zeros((varies.size, varies.size))
        v = np.zeros(varies.size)
        for series, residual, J in zip(*test, strict=True):
            z = _whiten(residual, series, hyperparameters)
            H = _whiten(J, series, hyperparameters)
            M += H.T @ H
            v += H.T @ z
            total += float(z @ z)
        K = np.linalg.inv(np.eye(varies.size) + variance[:, None] * M)
        total -= float(v @ K @ (variance * v))
    return total


def parameter_gain(
    tests: Sequence[LinearTest], C: Array, hyperparameters: Hyperparameters, varies: Array
) -> Array:
    """Derivative (p, n) of fitted parameters by the residuals of all series, one after the other.

    Parameters
    ----------
    tests: the tests, linearised.
    C: covariance of the parameters for given hyperparameters, (p, p).
    hyperparameters: the noise model.
    varies: as in `estimate_posterior`.
    """
    variance = hyperparameters.spread**2 * varies
    columns = []
    for test in tests:
        H = [_whiten(J, one, hyperparameters) for one, _, J in zip(*test, strict=True)]
        M = sum((one.T @ one for one in H), np.zeros(C.shape))
        # J' V^-1 = (I + M T)^-1 J' S^-1 R^-1 S^-1
        factor = C @ np.linalg.inv(np.eye(varies.size) + M * variance)
        for series, white in zip(test.series, H, strict=True):
            unit_residuals = _whiten(np.eye(white.shape[0]), series, hyperparameters)
            columns.append(factor @ white.T @ unit_residuals)
    return np.concatenate(columns, axis=1)


def specimen_residuals(
    tests: Sequence[LinearTest], hyperparameters: Hyperparameters, varies: Array
) -> Array:
    """Residuals of all series with the most probable parameters of each specimen, (n,).

    These are the residuals without the differences between specimens.

    Parameters
    ----------
    tests: the tests, linearised at the parameters of the joint.
    hyperparameters: the noise model.
    varies: as in `estimate_posterior`.
    """
    variance = hyperparameters.spread**2 * varies
    residuals = []
    for test in tests:
        M = np.zeros((varies.size, varies.size))
        v = np.zeros(varies.size)
        for series, residual, J in zip(*test, strict=True):
            H = _whiten(J, series, hyperparameters)
            M += H.T @ H
            v += H.T @ _whiten(residual, series, hyperparameters)
        deviation = -np.linalg.solve(np.eye(varies.size) + variance[:, None] * M, variance * v)
        for residual, J in zip(test.residuals, test.derivatives, strict=True):
            residuals.append(residual + J @ deviation)
    return np.concatenate(residuals)


def _whiten(rows: Array, series: Series, hyperparameters: Hyperparameters) -> Array:
    """Residuals, or their derivatives, transformed to independent ones of unit variance."""
    scaled = (rows.T / series.sigma(hyperparameters.levels)).T
    if series.is_known:
        return scaled
    return _decorrelate(scaled, hyperparameters.autocorrelation[series.test])


def _decorrelate(rows: Array, rho: float) -> Array:
    """Rows (n, ...) with the correlation rho^|i - j|, transformed to independent rows."""
    independent = rows.copy()
    independent[1:] -= rho * rows[:-1]
    independent[1:] /= np.sqrt(1 - rho**2)
    return independent


def _sum_series(test: LinearTest, grid: "_Grid") -> tuple[Array, Array, Array, Array]:
    """Terms of a test on the grid, V being its covariance without spread.

    Returns J' V^-1 J (..., p, p), J' V^-1 r (..., p), r' V^-1 r and ln|V| (...).
    """
    M: Any = 0.0
    v: Any = 0.0
    q: Any = 0.0
    log_determinant: Any = 0.0
    for series, residual, J in zip(*test, strict=True):
        axes = grid.axes_of(series)
        terms = []
        for point in product(*(grid.values[axis] for axis in axes)):
            hyperparameters = grid.hyperparameters(axes, point)
            z = _whiten(residual, series, hyperparameters)
            H = _whiten(J, series, hyperparameters)
            rho = hyperparameters.autocorrelation.get(series.test, 0.0)
            log_sigma = np.log(series.sigma(hyperparameters.levels))
            log_det = 2 * np.sum(log_sigma) + (z.size - 1) * np.log(1 - rho**2)
            terms.append((H.T @ H, H.T @ z, z @ z, log_det))
        placed = [grid.place(axes, np.array(column)) for column in zip(*terms, strict=True)]
        M = M + placed[0]
        v = v + placed[1]
        q = q + placed[2]
        log_determinant = log_determinant + placed[3]
    return M, v, q, log_determinant


class _Grid:
    """The product grid of the hyperparameters: one axis for each level, each rho, and the spread.

    Arrays on the grid have these axes first; an array that does not depend on a hyperparameter has
    the length 1 along its axis.

    values: of each axis; of a level, its logarithm.
    """

    def __init__(self, previous: NoiseEstimate) -> None:
        self._sources = [*previous.mean.levels]
        self._tests = [*previous.autocorrelations]
        log_levels = [
            _level_axis(previous.mean.levels[source], previous.log_errors[source])
            for source in self._sources
        ]
        self.values = [*log_levels, *previous.autocorrelations.values(), previous.spreads]
        self.shape = tuple(axis.size for axis in self.values)
        self.spread = self.place((len(self.values) - 1,), previous.spreads)
        log_prior: Any = np.zeros(())
        for axis, log_level in enumerate(log_levels):
            log_prior = log_prior - 0.5 * self.place((axis,), log_level / _LEVEL_SD) ** 2
        for k, rho in enumerate(previous.autocorrelations.values()):
            dependent = (1 - INDEPENDENCE) / (AUTOCORRELATIONS.size - 1)
            probability = np.where(rho == 0.0, INDEPENDENCE, dependent)
            log_prior = log_prior + self.place((len(log_levels) + k,), np.log(probability))
        self._log_prior = log_prior

    def axes_of(self, series: Series) -> tuple[int, ...]:
        """The axes of the hyperparameters of a series: its levels and its autocorrelation."""
        if series.is_known:
            return ()
        levels = sorted(self._sources.index(source) for source in series.errors)
        return (*levels, len(self._sources) + self._tests.index(series.test))

    def hyperparameters(self, axes: Sequence[int], point: Sequence[float]) -> Hyperparameters:
        """The hyperparameters with these values along some axes; the others are left out."""
        values = dict(zip(axes, point, strict=True))
        n = len(self._sources)
        return Hyperparameters(
            {s: float(np.exp(values[k])) for k, s in enumerate(self._sources) if k in values},
            {t: float(values[n + k]) for k, t in enumerate(self._tests) if n + k in values},
            float(values.get(len(self.values) - 1, 0.0)),
        )

    def place(self, axes: Sequence[int], values: Array) -> Array:
        """Values for the points along some axes, in ascending order, placed on the grid.

        values: (n, ...), n being the product of the lengths of the axes.
        """
        lengths = [size if axis in axes else 1 for axis, size in enumerate(self.shape)]
        return values.reshape(*lengths, *values.shape[1:])

    def weights(self, deviance: Array) -> Array:
        """Probabilities of the grid points; deviance: -2 times the log likelihood."""
        log_weight = np.broadcast_to(self._log_prior - 0.5 * deviance, self.shape)
        weight = np.exp(log_weight - log_weight.max())
        return np.asarray(weight / weight.sum())

    def mean(self, weight: Array, values: Array, n_trailing: int) -> Array:
        """Mean over the grid of values with `n_trailing` further axes."""
        trailing = values.shape[values.ndim - n_trailing :]
        full = np.broadcast_to(values, self.shape + trailing)
        return np.tensordot(weight, full, axes=weight.ndim)

    def estimate(self, weight: Array) -> NoiseEstimate:
        """The posterior of the hyperparameters with these weights."""
        marginals = []
        for k in range(weight.ndim):
            others = tuple(axis for axis in range(weight.ndim) if axis != k)
            marginals.append(weight.sum(axis=others))
        n = len(self._sources)
        levels = {}
        log_errors = {}
        for source, log_level, marginal in zip(
            self._sources, self.values[:n], marginals[:n], strict=True
        ):
            log_mean = float(marginal @ log_level)
            levels[source] = float(np.exp(log_mean))
            log_errors[source] = float(np.sqrt(marginal @ (log_level - log_mean) ** 2))
        autocorrelation = {}
        probable = {}
        for k, test in enumerate(self._tests):
            autocorrelation[test] = float(marginals[n + k] @ self.values[n + k])
            probable[test] = _probable(self.values[n + k], marginals[n + k], AUTOCORRELATIONS)
        spread = float(marginals[-1] @ self.values[-1])
        spreads = self.values[-1]
        if spreads.size > 1:
            spreads = _probable(spreads, marginals[-1], SPREADS)
        return NoiseEstimate(
            Hyperparameters(levels, autocorrelation, spread), log_errors, probable, spreads
        )

    def point(self, index: Sequence[Any]) -> Hyperparameters:
        """The hyperparameters of a grid point."""
        point = [float(axis[k]) for axis, k in zip(self.values, index, strict=True)]
        return self.hyperparameters(range(len(point)), point)


def _level_axis(level: float, log_error: float) -> Array:
    """Logarithms of a level about an estimate, within the largest and smallest level."""
    sd = max(log_error, _MIN_LEVEL_SD)
    bound = np.log(MAX_LEVEL_FACTOR) - _LEVEL_GRID[-1] * sd
    return np.asarray(np.clip(np.log(level), -bound, bound) + sd * _LEVEL_GRID)


def _probable(values: Array, probabilities: Array, all_values: Array) -> Array:
    """The values with a considerable probability, and the neighbours of these in `all_values`."""
    is_probable = np.isin(all_values, values[probabilities > _MIN_PROBABILITY])
    neighbours = is_probable.copy()
    neighbours[1:] |= is_probable[:-1]
    neighbours[:-1] |= is_probable[1:]
    return all_values[neighbours]
