"""The noise model of fits: its marginalised posterior against direct integration, and the coverage
of 95 % intervals for correlated residuals and for specimens that differ."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import stats

import jointlaw as jl
from jointlaw.calibration.noise import (
    INDEPENDENCE,
    LEVEL_FACTOR,
    LinearTest,
    NoiseEstimate,
    Prior,
    Series,
    estimate_posterior,
    misfit,
    parameter_gain,
    prior_estimate,
    specimen_residuals,
)

SIGMA = 0.02
LEVEL_SD = np.log(LEVEL_FACTOR) / 1.96


def linear_tests(rng, truth, points, level=1.0, rho=0.0, spread=0.0):
    """Tests that are linear in p = 2 parameters, with noise, linearised at zero."""
    tests = []
    for n in points:
        J = rng.standard_normal((n, 2))
        noise = rng.standard_normal(n)
        for k in range(1, n):
            noise[k] = rho * noise[k - 1] + np.sqrt(1 - rho**2) * noise[k]
        specimen = truth + spread * rng.standard_normal(2)
        residual = -J @ specimen + level * SIGMA * noise
        series = Series("shear", "stress", {"shear stress": np.full(n, SIGMA)})
        tests.append(LinearTest([series], [residual], [J]))
    return tests


def covariance_matrix(test, level, rho, spread):
    """The covariance of the residuals of a test, as the module defines it."""
    n = test.residuals[0].size
    distance = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    J = test.derivatives[0]
    return (level * SIGMA) ** 2 * rho**distance + spread**2 * J @ J.T


def test_posterior_equals_direct_integration():
    """The likelihood of each grid point by the normal density of all residuals; the sandwich
    estimator by matrices.
    """
    rng = np.random.default_rng(0)
    tests = linear_tests(rng, np.array([0.1, -0.05]), (4, 6), rho=0.6, spread=0.05)
    prior = Prior(np.diag([4.0, 9.0]), np.zeros(2))
    varies = np.array([True, True])
    series = [one for test in tests for one in test.series]
    previous = prior_estimate(series, has_specimens=True)
    posterior = estimate_posterior(tests, prior, varies, previous)

    J = np.concatenate([test.derivatives[0] for test in tests])
    r = np.concatenate([test.residuals[0] for test in tests])
    log_levels = LEVEL_SD * np.linspace(-2.6, 2.6, 5)
    rhos = previous.autocorrelations["shear"]
    log_weights, steps, covariances, spreads = [], [], [], []
    for log_level, rho, spread in product(log_levels, rhos, previous.spreads):
        V = np.zeros((r.size, r.size))
        V[:4, :4] = covariance_matrix(tests[0], np.exp(log_level), rho, spread)
        V[4:, 4:] = covariance_matrix(tests[1], np.exp(log_level), rho, spread)
        evidence = stats.multivariate_normal(
            np.zeros(r.size), V + J @ np.linalg.inv(prior.information) @ J.T
        ).logpdf(r)
        probability = INDEPENDENCE if rho == 0 else (1 - INDEPENDENCE) / 5
        # a half-normal density over cells between the middles of neighbours, the last to 0.24
        width = {0.0: 0.01, 0.02: 0.02, 0.04: 0.03, 0.08: 0.06, 0.16: 0.12}[spread]
        probability *= width * stats.norm.pdf(spread, scale=0.15)
        log_weights.append(evidence - (log_level / LEVEL_SD) ** 2 / 2 + np.log(probability))
        W = np.zeros((r.size, r.size))
        W[:4, :4] = covariance_matrix(tests[0], np.exp(log_level), 0.0, spread)
        W[4:, 4:] = covariance_matrix(tests[1], np.exp(log_level), 0.0, spread)
        weights = np.linalg.solve(W, J)
        inverse = np.linalg.inv(J.T @ weights + prior.information)
        covariances.append(inverse @ (weights.T @ V @ weights + prior.information) @ inverse)
        steps.append(-inverse @ weights.T @ r)
        spreads.append(spread)
    weight = np.exp(log_weights - np.max(log_weights))
    weight /= weight.sum()
    step = weight @ np.array(steps)
    deviation = np.array(steps) - step
    covariance = np.einsum("k,kij->ij", weight, covariances)
    covariance += np.einsum("k,ki,kj->ij", weight, deviation, deviation)
    # rounding of the matrix inverses
    np.testing.assert_allclose(posterior.step, step, rtol=1e-9)
    np.testing.assert_allclose(posterior.covariance, covariance, rtol=1e-9)
    assert posterior.noise.mean.spread == pytest.approx(weight @ np.array(spreads), rel=1e-9)


def test_misfit_gain_and_specimens_of_one_noise_model():
    """By matrices: r' W^-1 r, the gain, and the residuals of the best specimens."""
    tests = linear_tests(np.random.default_rng(1), np.array([0.1, 0.2]), (5, 7), rho=0.5)
    varies = np.array([True, False])
    estimate = prior_estimate([tests[0].series[0]], has_specimens=True)
    model = replace_mean(estimate, 1.5, 0.6, 0.1)
    prior = Prior(np.array([[2.0, 0.3], [0.3, 1.0]]), np.zeros(2))
    total = 0.0
    information = prior.information
    weights = []
    residuals = []
    for test in tests:
        J = test.derivatives[0]
        r = test.residuals[0]
        noise = covariance_matrix(test, 1.5, 0.0, 0.0)
        W = noise + 0.1**2 * np.outer(J[:, 0], J[:, 0])
        total += r @ np.linalg.solve(W, r)
        weights.append(np.linalg.solve(W, J))
        information = information + J.T @ weights[-1]
        residuals.append(noise @ np.linalg.solve(W, r))  # the normal mean of the noise
    gain = np.linalg.solve(information, np.concatenate(weights).T)
    assert misfit(tests, model, varies) == pytest.approx(total, rel=1e-9)
    np.testing.assert_allclose(parameter_gain(tests, prior, model, varies), gain, rtol=1e-8)
    without_specimens = specimen_residuals(tests, model, varies)
    np.testing.assert_allclose(without_specimens, np.concatenate(residuals), rtol=1e-8)


def replace_mean(estimate, level, rho, spread):
    """The mean of an estimate with these values of all hyperparameters."""
    mean = estimate.mean
    levels = dict.fromkeys(mean.levels, level)
    return mean._replace(levels=levels, autocorrelation={"shear": rho}, spread=spread)


def iterate(tests, has_specimens):
    """The posterior with the grid of the noise levels centred on the estimate."""
    prior = Prior(1e-4 * np.eye(2), np.zeros(2))
    estimate = prior_estimate([tests[0].series[0]], has_specimens)
    for _ in range(4):
        posterior = estimate_posterior(tests, prior, np.array([True, True]), estimate)
        estimate = posterior.noise
    return posterior


@pytest.mark.parametrize(
    ("points", "rho", "spread"),
    [
        ((2, 2, 2), 0.0, 0.0),
        pytest.param((30, 30), 0.0, 0.0, marks=pytest.mark.slow),
        ((30, 30), 0.9, 0.0),
        pytest.param((15, 15, 15), 0.0, 0.06, marks=pytest.mark.slow),
        ((15, 15, 15, 15), 0.9, 0.06),
    ],
)
def test_intervals_contain_the_true_parameters(points, rho, spread):
    """In 88 % or more of 200 cases: two points of three tests are the least favourable."""
    rng = np.random.default_rng(2)
    truth = np.array([0.1, -0.2])
    covered = np.zeros(2)
    for _ in range(100):
        tests = linear_tests(rng, truth, points, 1.5, rho, spread)
        posterior = iterate(tests, has_specimens=True)
        error = np.sqrt(np.diag(posterior.covariance))
        covered += np.abs(posterior.step - truth) <= 1.96 * error
    assert covered.sum() >= 0.88 * 200


def test_noise_is_recognised():
    """Level, autocorrelation and spread of 20 tests of 30 points."""
    truth = np.array([0.1, -0.2])
    for level, rho, spread in ((1.0, 0.0, 0.0), (2.0, 0.9, 0.0), (0.5, 0.0, 0.08)):
        tests = linear_tests(np.random.default_rng(3), truth, (30,) * 20, level, rho, spread)
        mean = iterate(tests, has_specimens=True).noise.mean
        assert mean.levels["shear stress"] == pytest.approx(level, rel=0.15)
        assert mean.autocorrelation["shear"] == pytest.approx(rho, abs=0.05)
        assert mean.spread == pytest.approx(spread, abs=0.02)


@pytest.fixture(scope="module")
def curves():
    """Two tests of one law with 2 % of noise."""
    law = true_law(0.0)
    rng = np.random.default_rng(4)
    shear = np.linspace(0.0, 6e-3, 13)
    tests = []
    for normal in (1e6, 3e6):
        stress, opening = jl.ShearCurve(shear, np.ones(13), normal).predict(law)
        stress = stress + 0.02 * stress.max() * rng.standard_normal(13) * (shear > 0)
        opening = opening + 0.02 * opening.max() * rng.standard_normal(13) * (shear > 0)
        tests.append(jl.ShearCurve(shear, stress, normal, opening=opening))
    return tests


def true_law(plane=None):
    return jl.JointLaw(
        orientation=jl.Orientation(3.0),
        asperity=jl.Asperity(K=9.637e8, lam=1.167, eta=0.5, mu=0.55),
        heights=jl.GammaHeights(3.7, 1e-5, 0.0, "individual"),
        asperity_density=3e5,
        mating_length=4e-3,
        plane=plane,
    )


@pytest.mark.slow
def test_one_specimen_gives_narrower_intervals(curves):
    """By default the spread between two specimens is nearly unknown, and doubles the intervals."""
    free = ("mu", "a")
    specimens = jl.fit_curves(curves, law=true_law(), free=free)
    one = jl.fit_curves(curves, law=true_law(), free=free, one_specimen=True)
    for name in free:
        low, high = one.interval(name)
        wide_low, wide_high = specimens.interval(name)
        assert 1.3 * (high - low) < wide_high - wide_low
        assert wide_low < low < high < wide_high
    assert "All tests are on one specimen" in one.report()
    assert "Spread between specimens" in specimens.report()
    assert isinstance(one.solution.noise, NoiseEstimate)
    assert one.solution.noise.mean.spread == 0.0


@pytest.mark.slow
def test_curves_of_specimens_that_differ_have_the_shape_of_the_law(curves):
    """Different friction is spread; a law without its mating length has another shape."""
    weak, strong = curves
    weak = replace(weak, shear_stress=0.8 * weak.shear_stress)
    fit = jl.fit_curves([weak, strong], law=true_law(), free=("mu", "a", "mating_length"))
    assert fit.solution.noise.mean.spread > 0.05
    assert not any(fit.shape_differs)
    endless = replace(true_law(), mating_length=np.inf)
    fit = jl.fit_curves(curves, law=endless, free=("mu", "a"))
    assert any(fit.shape_differs)
    assert "the intervals assume that they have the same" in " ".join(fit.report().split())


def test_rows_without_noise_are_not_counted():
    """The first row of a shear test is zero by construction; three points have two residuals."""
    curve = jl.ShearCurve([0.0, 1e-3, 1e-2], [0.0, 1e6, 8e5], 1e6, opening=[0.0, 1e-4, 5e-4])
    sizes = {one.quantity: one.sigma().size for one in curve.series}
    assert sizes["stress"] == sizes["opening"] == 2
    stress, opening = curve.predict(true_law(0.0))
    assert abs(stress[0]) < 1e-6  # Pa
    assert opening[0] == 0.0
