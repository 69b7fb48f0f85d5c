"""Distributions of asperity heights: Eq. 11 to 13, and as a histogram."""

from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import jointlaw as jl

R = np.linspace(0.0, 2e-5, 101)


@given(alpha=st.floats(-0.9, 30.0), beta=st.floats(1e-9, 1e-3))
def test_from_moments(alpha, beta):
    h = jl.GammaHeights(alpha, beta, 2e-6, "individual")
    back = jl.GammaHeights.from_moments(h.mean, h.variance, 2e-6, "individual")
    # 1e-12 of alpha + 1, which is what the moments hold
    assert back.alpha == pytest.approx(h.alpha, rel=1e-12, abs=1e-12)
    assert back.beta == pytest.approx(h.beta, rel=1e-12)
    assert (back.overlap, back.formation) == (2e-6, "individual")


def test_no_height_is_below_zero():
    heights = jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6)
    assert (heights.pdf(-1e-6), heights.cdf(-1e-6)) == (0.0, 0.0)


def test_histogram_as_numpy_gives_it():
    sample = stats.gamma(4.0, scale=1e-6).rvs(20000, random_state=1)
    heights = jl.Heights(np.histogram(sample, bins=50), 0.0, "individual")
    # 1.63/sqrt(n) is the 1 % bound of Kolmogorov for a sample of n
    assert np.abs(heights.cdf(R) - stats.gamma.cdf(R, 4.0, scale=1e-6)).max() < 1.63 / 20000**0.5


@pytest.mark.parametrize(
    ("distribution", "told"),
    [
        (5, "must be"),
        ("chi2", "GammaHeights"),
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


def test_the_default_formation_takes_any_histogram(make_law):
    for bins in (5, 20):
        sample = stats.gamma(4.0, scale=1e-6).rvs(5000, random_state=bins)
        make_law(heights=jl.Heights(np.histogram(sample, bins=bins)))


@pytest.fixture(scope="module")
def exponential():
    """The class of CONTRIBUTING.md."""
    page = Path(__file__).parents[2] / "CONTRIBUTING.md"
    text = page.read_text(encoding="utf-8").partition("    @dataclass")[2]
    code = dedent("    @dataclass" + text.partition("    law =")[0])
    names = {"np": np, "dataclass": dataclass}
    exec(code, names)
    return names["Exponential"]


def test_a_class_of_the_user_works_and_no_file_can_name_it(make_law, exponential):
    law = make_law(heights=exponential(3e-6))
    same = make_law(heights=jl.GammaHeights(0.0, 3e-6, 0.0, "individual"))
    ours, exact = (one.joint().update([5e-7, 2e-7, 0.0])[0] for one in (law, same))
    np.testing.assert_allclose(ours, exact, rtol=1e-8, atol=1.0)
    with pytest.raises(ValueError, match=r"^heights = .*no file can name Exponential"):
        law.to_toml()


def test_what_is_no_distribution_of_heights_is_refused(make_law, exponential):
    class ByAddress(exponential):
        __hash__ = object.__hash__

    class Falling(exponential):
        def breakpoints(self):
            return np.array([1e-6, 0.0])

    for heights, told in {
        3: "has no overlap",
        ByAddress(1e-6): "must be equal and hash alike",
        exponential(1e-6, -1e-6): "heights.overlap = -1e-06",
        exponential(1e-6, 0.0, "both"): "heights.formation = 'both'",
        Falling(1e-6): "ascending heights",
    }.items():
        with pytest.raises(ValueError, match=told):
            make_law(heights=heights)
