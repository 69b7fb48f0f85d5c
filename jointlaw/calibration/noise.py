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

The residuals r_k of test k, with the derivative J_k by the parameters, then have the covariance

    V_k = S_k R(rho) S_k + J_k T J_k',

where S_k are the standard errors and T is the diagonal matrix of spread^2 for logarithms of
parameters and 0 for others. Level, rho and spread (the hyperparameters) have priors. The weight of
a point of a grid of them is its restricted likelihood, which allows for the part of the noise that
the parameters follow: with A = sum J_k' V_k^-1 J_k + L and b = sum J_k' V_k^-1 r_k + b_0 it is

    exp(-(sum (ln|V_k| + r_k' V_k^-1 r_k) + ln|A| - b' A^-1 b)/2)

(L and b_0 come from the priors of the parameters).

**The estimate does not use the correlation.** With V_k as weights, a fit would follow differences
of neighbouring residuals and ignore large smooth misfits, which are noise to it: a law of another
shape then misses the measured stresses by far. The weights of the estimate are independent,
W_k = S_k^2 + J_k T J_k'. Its covariance with residuals of covariance V_k is (sandwich estimator)

    C = A_0^-1 (sum J_k' W_k^-1 V_k W_k^-1 J_k + L) A_0^-1,  A_0 = sum J_k' W_k^-1 J_k + L.

The mean of C over the grid plus the covariance of the estimates is the covariance of the result.

V_k^-1 is never formed: with the information M_k = J_k' (S R S)^-1 J_k of a test alone,
J_k' V_k^-1 J_k = M_k (I + T M_k)^-1.

A residual that no noise can change must not be counted: the first row of a shear test is zero by
construction.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from ..support.checks import Array

LEVEL_FACTOR = 4.0  # the 95 % range of a level is from 1/4 to 4 times the expected one
# The same for a load cell far below its full scale, where some are much better than their grade
LEVEL_FACTORS = {"load cell": 30.0}
AUTOCORRELATIONS = np.array([0.0, 0.3, 0.6, 0.8, 0.9, 0.96])  # grid of rho
INDEPENDENCE = 0.4  # prior probability of rho = 0; all others are equally probable
SPREADS = np.array([0.0, 0.02, 0.04, 0.08, 0.16])  # grid of the spread
SPREAD_SCALE = 0.15  # of the half-normal density of the spread
# Probability of each spread, from the density and the width of its cell, to 0.24. A density of the
# standard deviation itself, nearly constant in the range of rock, instead of its logarithm: few
# specimens cannot exclude a large spread, and the intervals must say so (Gelman 2006)
SPREAD_WEIGHTS = np.diff([0.0, 0.01, 0.03, 0.06, 0.12, 0.24]) * np.exp(
    -0.5 * (SPREADS / SPREAD_SCALE) ** 2
)
# Standard deviations of the logarithm of a level. A normal density on the first has its standard
# deviation within 1 %, on the second, for more than `MAX_FINE_LEVELS`, within 5 %
_LEVEL_GRID = np.linspace(-2.6, 2.6, 5)
_COARSE_LEVEL_GRID = np.sqrt(3.0) * np.array([-1.0, 0.0, 1.0])
MAX_FINE_LEVELS = 3
_MAX_LEVEL = 3.3  # standard deviations of the prior
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
    prior_weight: mean of A_0^-1, (p, p), the derivative of the estimate by the gradient of the
        prior.
    noise: posterior of the hyperparameters.
    mode: the most probable hyperparameters.
    """

    step: Array
    covariance: Array
    prior_weight: Array
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
        {source: _level_sd(source) for source in keys},
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
    T = grid.spread[..., None] ** 2 * varies
    A = prior.information
    b = prior.gradient
    working_A = prior.information
    working_b = prior.gradient
    filling = prior.information
    deviance = np.zeros(())
    for test in tests:
        terms = _sum_series(test, grid)
        shared = _with_spread(terms.M, terms.v, T)
        A = A + shared.M
        b = b + shared.v
        deviance = deviance + terms.q - shared.reduction + terms.log_determinant
        deviance = deviance + shared.log_determinant
        working = _with_spread(terms.working_M, terms.working_v, T)
        working_A = working_A + working.M
        working_b = working_b + working.v
        # W^-1 J = J_white K, so that J' W^-1 V W^-1 J = K' (G + M T M) K
        inner = terms.G + terms.working_M @ (T[..., :, None] * terms.working_M)
        filling = filling + np.swapaxes(working.K, -1, -2) @ inner @ working.K
    deviance = deviance + np.linalg.slogdet(A)[1]
    deviance = deviance - np.einsum("...p,...p->...", b, np.linalg.solve(A, b[..., None])[..., 0])
    weight = grid.weights(deviance)
    inverse = np.asarray(np.linalg.inv(working_A), np.float64)
    steps: Array = -np.einsum("...pq,...q->...p", inverse, working_b)
    step = grid.mean(weight, steps, 1)
    deviation = steps - step
    products = np.asarray(deviation[..., :, None] * deviation[..., None, :], np.float64)
    conditional_covariance = grid.mean(weight, inverse @ filling @ inverse, 2)
    return Posterior(
        step=step,
        covariance=conditional_covariance + grid.mean(weight, products, 2),
        prior_weight=grid.mean(weight, inverse, 2),
        noise=grid.estimate(weight),
        mode=grid.point(np.unravel_index(int(np.argmax(weight)), weight.shape)),
    )


class _Shared(NamedTuple):
    """Terms of a test with the spread between specimens, on the grid.

    M, v: J' V^-1 J (..., p, p) and J' V^-1 r (..., p).
    K: (I + T M)^-1, (..., p, p).
    reduction: of r' V^-1 r by the spread.
    log_determinant: increase of ln|V| by the spread.
    """

    M: Array
    v: Array
    K: Array
    reduction: Array
    log_determinant: Array


def _with_spread(M: Array, v: Array, T: Array) -> _Shared:
    """Add the spread between specimens, of variances T (..., p), to the terms of a test."""
    B = np.eye(M.shape[-1]) + T[..., :, None] * M
    K = np.asarray(np.linalg.inv(B), np.float64)
    reduction = np.einsum("...p,...pq,...q,...q->...", v, K, T, v)
    shared_v = np.einsum("...qp,...q->...p", K, v)
    return _Shared(M @ K, shared_v, K, reduction, np.linalg.slogdet(B)[1])


def misfit(tests: Sequence[LinearTest], hyperparameters: Hyperparameters, varies: Array) -> float:
    """The sum over tests of r' W^-1 r for given hyperparameters.

    Parameters
    ----------
    tests: residuals, and derivatives for the spread between specimens.
    hyperparameters: the noise model.
    varies: as in `estimate_posterior`.
    """
    total = 0.0
    T = hyperparameters.spread**2 * varies
    for test in tests:
        M, v = _working_terms(test, hyperparameters)
        for series, residual in zip(test.series, test.residuals, strict=True):
            z = residual / series.sigma(hyperparameters.levels)
            total += float(z @ z)
        total -= float(_with_spread(M, v, T).reduction)
    return total


def parameter_gain(
    tests: Sequence[LinearTest], prior: Prior, hyperparameters: Hyperparameters, varies: Array
) -> Array:
    """Derivative (p, n) of fitted parameters by the residuals of all series, one after the other.

    Parameters
    ----------
    tests: the tests, linearised.
    prior: prior of the parameters.
    hyperparameters: the noise model.
    varies: as in `estimate_posterior`.
    """
    T = hyperparameters.spread**2 * varies
    A = prior.information
    columns = []
    for test in tests:
        shared = _with_spread(*_working_terms(test, hyperparameters), T)
        A = A + shared.M
        for series, J in zip(test.series, test.derivatives, strict=True):
            sigma = series.sigma(hyperparameters.levels)
            columns.append(shared.K.T @ (J.T / sigma**2))
    return np.asarray(np.linalg.solve(A, np.concatenate(columns, axis=1)))


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
    T = hyperparameters.spread**2 * varies
    residuals = []
    for test in tests:
        M, v = _working_terms(test, hyperparameters)
        deviation = -_with_spread(M, v, T).K @ (T * v)
        for residual, J in zip(test.residuals, test.derivatives, strict=True):
            residuals.append(residual + J @ deviation)
    return np.concatenate(residuals)


def _working_terms(test: LinearTest, hyperparameters: Hyperparameters) -> tuple[Array, Array]:
    """J' S^-2 J (p, p) and J' S^-2 r (p,) of a test, the terms of its estimate."""
    p = test.derivatives[0].shape[1]
    M = np.zeros((p, p))
    v = np.zeros(p)
    for series, residual, J in zip(*test, strict=True):
        sigma = series.sigma(hyperparameters.levels)
        H = J / sigma[:, None]
        M += H.T @ H
        v += H.T @ (residual / sigma)
    return M, v


def _correlate(rows: Array, rho: Array) -> Array:
    """The products R rows, where R_ij = rho^|i - j| is the correlation matrix of rows (P, n, p) at
    P points with rho (P,)."""
    index = np.arange(rows.shape[1])
    correlated = rows.copy()
    for value in np.unique(rho[rho != 0.0]):
        has_value = rho == value
        R = value ** np.abs(np.subtract.outer(index, index))
        correlated[has_value] = R @ rows[has_value]
    return correlated


def _decorrelate(rows: Array, rho: Array) -> Array:
    """Rows (P, n, p) with the correlations rho^|i - j|, rho (P,), as independent rows."""
    rho = rho[:, None, None]
    independent = rows.copy()
    independent[:, 1:] -= rho * rows[:, :-1]
    independent[:, 1:] /= np.sqrt(1 - rho**2)
    return independent


class _TestTerms(NamedTuple):
    """Terms of a test on the grid, without the spread between specimens.

    M, v, q, log_determinant: J' V^-1 J (..., p, p), J' V^-1 r (..., p), r' V^-1 r and ln|V|.
    working_M, working_v: the same with the independent weights W.
    G: J' W^-1 V W^-1 J, (..., p, p).
    """

    M: Any
    v: Any
    q: Any
    log_determinant: Any
    working_M: Any
    working_v: Any
    G: Any


def _sum_series(test: LinearTest, grid: "_Grid") -> _TestTerms:
    """The terms of a test, summed over its series."""
    total: list[Any] = [0.0] * len(_TestTerms._fields)
    for series, residual, J in zip(*test, strict=True):
        axes = grid.axes_of(series)
        points = [
            grid.hyperparameters(axes, point)
            for point in product(*(grid.values[axis] for axis in axes))
        ]
        terms = _series_terms(series, residual, J, points)
        total = [sum_ + grid.place(axes, term) for sum_, term in zip(total, terms, strict=True)]
    return _TestTerms(*total)


def _series_terms(
    series: Series, residual: Array, J: Array, points: Sequence[Hyperparameters]
) -> _TestTerms:
    """The terms of one series for the hyperparameters of P points, (P, ...) each."""
    sigma = np.array([series.sigma(point.levels) for point in points])
    rho = np.array([point.autocorrelation.get(series.test, 0.0) for point in points])
    p = J.shape[1]
    rows = np.column_stack([J, residual]) / sigma[..., None]
    white_rows = _decorrelate(rows, rho)
    products = np.swapaxes(white_rows, 1, 2) @ white_rows
    working_products = np.swapaxes(rows, 1, 2) @ rows
    H = rows[..., :p]
    return _TestTerms(
        M=products[:, :p, :p],
        v=products[:, :p, p],
        q=products[:, p, p],
        log_determinant=2 * np.log(sigma).sum(axis=1) + (len(residual) - 1) * np.log(1 - rho**2),
        working_M=working_products[:, :p, :p],
        working_v=working_products[:, :p, p],
        G=np.swapaxes(H, 1, 2) @ _correlate(H, rho),
    )


class _Grid:
    """The product grid of the hyperparameters: one axis for each level, each rho, and the spread.

    Arrays on the grid have these axes first; an array that does not depend on a hyperparameter has
    the length 1 along its axis.

    values: of each axis; of a level, its logarithm.
    """

    def __init__(self, previous: NoiseEstimate) -> None:
        self._sources = [*previous.mean.levels]
        self._tests = [*previous.autocorrelations]
        is_fine = len(self._sources) <= MAX_FINE_LEVELS
        deviates = _LEVEL_GRID if is_fine else _COARSE_LEVEL_GRID
        log_levels = [
            _level_axis(source, previous.mean.levels[source], previous.log_errors[source], deviates)
            for source in self._sources
        ]
        self.values = [*log_levels, *previous.autocorrelations.values(), previous.spreads]
        self.shape = tuple(axis.size for axis in self.values)
        self.spread = self.place((len(self.values) - 1,), previous.spreads)
        log_prior: Any = np.zeros(())
        for axis, (source, log_level) in enumerate(zip(self._sources, log_levels, strict=True)):
            log_prior = log_prior - 0.5 * self.place((axis,), log_level / _level_sd(source)) ** 2
        for k, rho in enumerate(previous.autocorrelations.values()):
            dependent = (1 - INDEPENDENCE) / (AUTOCORRELATIONS.size - 1)
            probability = np.where(rho == 0.0, INDEPENDENCE, dependent)
            log_prior = log_prior + self.place((len(log_levels) + k,), np.log(probability))
        if previous.has_specimens:
            probability = np.interp(previous.spreads, SPREADS, SPREAD_WEIGHTS)
            log_prior = log_prior + self.place((len(self.values) - 1,), np.log(probability))
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


def _level_sd(source: str) -> float:
    """Standard deviation of the prior of the logarithm of a level."""
    return float(np.log(LEVEL_FACTORS.get(source, LEVEL_FACTOR)) / 1.96)


def _level_axis(source: str, level: float, log_error: float, deviates: Array) -> Array:
    """Logarithms of a level about an estimate, within 3.3 deviations of the expected level."""
    sd = max(log_error, _MIN_LEVEL_SD)
    bound = max(_MAX_LEVEL * _level_sd(source) - deviates[-1] * sd, 0.0)
    return np.asarray(np.clip(np.log(level), -bound, bound) + sd * deviates)


def _probable(values: Array, probabilities: Array, all_values: Array) -> Array:
    """Values to keep on a grid: the probable ones, and their neighbours in `all_values`.

    values: the present grid, a part of `all_values`, with its probabilities.
    """
    is_probable = np.isin(all_values, values[probabilities > _MIN_PROBABILITY])
    neighbours = is_probable.copy()
    neighbours[1:] |= is_probable[:-1]
    neighbours[:-1] |= is_probable[1:]
    return all_values[neighbours]
