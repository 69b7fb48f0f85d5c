"""Distributions of asperity heights: Eq. 11 to 13, by name, frozen, as a histogram."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import jointlaw as jl

SMOOTH = jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6)
CHI2 = {"df": 2 * (SMOOTH.alpha + 1), "scale": SMOOTH.beta / 2}  # the same distribution
R = np.linspace(0.0, 2e-5, 101)


@given(alpha=st.floats(-0.9, 30.0), beta=st.floats(1e-9, 1e-3))
def test_from_moments(alpha, beta):
    h = jl.GammaHeights(alpha, beta, 2e-6, "individual")
    back = jl.GammaHeights.from_moments(h.mean, h.variance, 2e-6, "individual")
    # 1e-12 of alpha + 1, which is what the moments hold
    assert back.alpha == pytest.approx(h.alpha, rel=1e-12, abs=1e-12)
    assert back.beta == pytest.approx(h.beta, rel=1e-12)
    assert (back.overlap, back.formation) == (2e-6, "individual")


def test_gamma_density_is_eq_12():
    a, b = SMOOTH.alpha, SMOOTH.beta
    printed = R**a * np.exp(-R / b) / (math.gamma(a + 1) * b ** (a + 1))
    np.testing.assert_allclose(SMOOTH.pdf(R), printed, rtol=1e-12)
    assert SMOOTH.pdf(-1e-6) == 0.0
    assert SMOOTH.cdf(-1e-6) == 0.0


@pytest.mark.parametrize(
    "heights",
    [
        jl.Heights("chi2", 2e-6, parameters=CHI2),
        jl.Heights("gamma", 2e-6, parameters={"a": SMOOTH.alpha + 1, "scale": SMOOTH.beta}),
    ],
    ids=["chi2", "gamma by name"],
)
def test_other_ways_to_the_same_distribution(make_law, heights):
    np.testing.assert_allclose(heights.pdf(R), SMOOTH.pdf(R), rtol=1e-12)
    np.testing.assert_allclose(heights.cdf(R), SMOOTH.cdf(R), rtol=1e-12)
    law, same = make_law(heights=heights), make_law(heights=SMOOTH)
    for closure in (1e-9, 1e-7, 3e-6):
        assert law.normal_stress(closure) == pytest.approx(same.normal_stress(closure), rel=1e-9)


def test_histogram_as_numpy_gives_it():
    sample = stats.gamma(4.0, scale=1e-6).rvs(20000, random_state=1)
    heights = jl.Heights(np.histogram(sample, bins=50), 0.0, "individual")
    # 1.63/sqrt(n) is the 1 % bound of Kolmogorov for a sample of n
    assert np.abs(heights.cdf(R) - stats.gamma.cdf(R, 4.0, scale=1e-6)).max() < 1.63 / 20000**0.5


@pytest.mark.parametrize(
    ("distribution", "told"),
    [
        ("chi3", "'chi3' is unknown"),
        ("binom", "continuous"),
        ("norm_gen", "unknown"),
        (5, "unknown"),
        (stats.uniform, "unknown"),
        (([1, 2], [0.0, 1.0]), "2 counts need 3 edges, got 2"),
        (([], [0.0]), "need"),
        (([1, 2], [0.0, 2.0, 1.0]), "ascending"),
        (([1, 2], [-1.0, 0.0, 1.0]), ">= 0"),
        (([1, -2], [0.0, 1.0, 2.0]), "counts must be"),
        (([0, 0], [0.0, 1.0, 2.0]), "not all zero"),
        (([1, float("nan")], [0.0, 1.0, 2.0]), "counts must be"),
        (("one", "two"), "numpy.histogram"),
        (([1, 2], [0.0, 1.0, 2.0], "extra"), "numpy.histogram"),
    ],
    ids=lambda value: getattr(value, "name", repr(value)),
)
def test_bad_distributions(distribution, told):
    with pytest.raises(ValueError, match=r"heights\.distribution") as error:
        jl.Heights(distribution, 0.0, "individual")
    assert told in str(error.value)


@pytest.mark.parametrize(
    ("parameters", "told"),
    [
        ({}, ".*df"),
        ({"dff": 3.0}, ".*dff"),
        ({"df": -3.0}, " = .*out of bounds"),
        ({"df": "3"}, r"\.df = '3'"),
        ({"df": float("nan")}, r"\.df = nan"),
        (5, " = 5"),
        ("df", " = 'df'"),
    ],
)
def test_bad_parameters_of_a_distribution(parameters, told):
    with pytest.raises(ValueError, match=rf"heights\.parameters{told}"):
        jl.Heights("chi2", 2e-6, parameters=parameters)
