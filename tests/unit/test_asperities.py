"""Heights of asperities (Eq. 11 to 13, and as a histogram). The virgin curve of a law with them
against its definition, its derivative, its inverse."""

import math
from dataclasses import dataclass
from pathlib import Path
from textwrap import dedent
from types import SimpleNamespace

import numpy as np
import pytest
from first_loading import first_loading
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

import jointlaw as jl

GAMMA = stats.gamma(4.0, scale=1e-6)


@given(alpha=st.floats(-0.9, 30.0), beta=st.floats(1e-9, 1e-3))
def test_from_moments(alpha, beta):
    h = jl.GammaHeights(alpha, beta, 2e-6, "individual")
    back = jl.GammaHeights.from_moments(h.mean, h.variance, 2e-6, "individual")
    # 1e-12 of alpha + 1, which is what the moments hold
    assert back.alpha == pytest.approx(h.alpha, rel=1e-12, abs=1e-12)
    assert back.beta == pytest.approx(h.beta, rel=1e-12)
    assert (back.overlap, back.formation) == (2e-6, "individual")
    assert (h.pdf(-1e-6), h.cdf(-1e-6)) == (0.0, 0.0)  # no height is below zero


def test_histogram_as_numpy_gives_it():
    sample, r = GAMMA.rvs(20000, random_state=1), np.linspace(0.0, 2e-5, 101)
    heights = jl.Heights(np.histogram(sample, bins=50), 0.0, "individual")
    # 1.63/sqrt(n) is the 1 % bound of Kolmogorov for a sample of n
    assert np.abs(heights.cdf(r) - GAMMA.cdf(r)).max() < 1.63 / 20000**0.5


@pytest.fixture(scope="module")
def exponential():
    """The class of CONTRIBUTING.md."""
    page = (Path(__file__).parents[2] / "CONTRIBUTING.md").read_text(encoding="utf-8")
    code = page[page.index("    @dataclass") : page.index("    law =")]
    names = {"np": np, "dataclass": dataclass}
    exec(dedent(code), names)
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

    class Listed(exponential):
        def breakpoints(self):
            return [0.0, 1e-6]

    class Nameless(exponential):
        __repr__ = object.__repr__

    class PerMicrometre(exponential):
        def pdf(self, r):
            return 1e-6 * super().pdf(r)

    for heights, message in {
        3: "has no overlap",
        ByAddress(1e-6): "must be equal, hash and print alike",
        Nameless(1e-6): "must be equal, hash and print alike",
        Listed(1e-6): "must be an array of two or more",
        PerMicrometre(1e-6): r"pdf\(r\) in 1/m must be >= 0 and the slope of cdf\(r\)",
        exponential(1e-6, -1e-6): "heights.overlap = -1e-06",
        exponential(1e-6, 0.0, "both"): "heights.formation = 'both'",
        Falling(1e-6): "ascending heights",
    }.items():
        with pytest.raises(ValueError, match=message):
            make_law(heights=heights)


CASES = {
    "population": jl.GammaHeights(3.82, 1.15e-6, 2e-6),
    "rough": jl.GammaHeights(6.14, 3.52e-6, 12e-6),
    "individual": jl.GammaHeights(3.82, 1.15e-6, 2e-6, "individual"),
    "no overlap": jl.GammaHeights(6.14, 3.52e-6, 0.0, "individual"),
    "histogram": jl.Heights(([1, 3, 2], [1e-6, 2e-6, 4e-6, 5e-6]), 0.5e-6, "individual"),
    "histogram, in touch": jl.Heights(([1, 3, 2], [0, 2e-6, 4e-6, 5e-6]), 3e-6, "individual"),
    "late uniform": jl.Heights(([1], [1e-6, 1.1e-5]), 0.0, "individual"),
}
# From touch far below an asperity to far beyond the last, and next to the edges of the histograms
Y = [*np.geomspace(1e-10, 1e-3, 15), 0.5e-6 * (1 + 1e-9), 1.5e-6 * (1 - 1e-9), 4.5e-6]


@pytest.fixture(scope="module", params=CASES)
def case(request, make_law):
    """A law with these heights."""
    return make_law(heights=CASES[request.param])


@pytest.mark.filterwarnings("ignore::scipy.integrate.IntegrationWarning")
def test_curve_and_slope(case):
    eta, h = case.asperity.eta, case.heights
    slow = SimpleNamespace(
        density=h.pdf, cumulative=h.cdf, overlap=h.overlap, formation=h.formation
    )
    force, slope = case.curve.force(np.array(Y))
    for y, F, K in zip(Y, force, slope, strict=True):
        exact, exact_slope = first_loading(y, eta, slow, h.breakpoints())
        # S = Phi/y^(1+eta), at most 1, is tabulated to 1e-10 (1e-9 at the edges of a histogram),
        # its derivative is one order lower
        assert F / y ** (1 + eta) == pytest.approx(exact / y ** (1 + eta), abs=1e-9)
        assert K / y**eta == pytest.approx(exact_slope / y**eta, abs=1e-6)


def test_slope_curvature_and_energy_are_derivatives(case):
    curve = case.curve
    y = np.geomspace(1e-8, 1e-4, 41) * 1.01
    h = 1e-4 * y
    force, slope = curve.force(y)

    def rate(f):
        return (f(y + h) - f(y - h)) / (2 * h)

    # against what the curve would be with all asperities in touch; central differences leave 1e-8,
    # more where asperities begin, and the table is a cubic, so that Phi'' is good to 1e-3
    for mine, alternative, most, size in (
        (slope, rate(lambda y: curve.force(y)[0]), 1e-6, y**0.5),
        (force, rate(curve.energy), 1e-6, y**1.5),
        (curve.curvature(y), rate(lambda y: curve.force(y)[1]), 2e-2, y**-0.5),
    ):
        np.testing.assert_allclose(mine / size, alternative / size, atol=most, rtol=0)


def test_no_tension_anywhere(case):
    y = np.concatenate([[-1.0, 0.0], np.geomspace(1e-300, 1e100, 500)])
    force, slope = case.curve.force(y)
    for never_falls_below_zero in (force, slope, np.diff(force), case.curve.energy(y)):
        assert (never_falls_below_zero >= 0).all()
    assert not np.any([force[:2], slope[:2]])


def test_closure_is_the_inverse_of_normal_stress(case):
    stress = np.geomspace(1.0, 1e10, 21)
    closure = case.closure(stress)
    assert (np.diff(closure) > 0).all()
    # the closure is solved to a few units in the last place
    np.testing.assert_allclose(case.normal_stress(closure), stress, rtol=1e-11)
    assert case.closure(0.0) == 0.0
    assert case.closure([[1e6]]).shape == (1, 1)


@pytest.mark.parametrize("stress", [5e-324, 1e-310, 1e-300, 1e300])
def test_closure_at_the_ends_of_the_number_range(make_law, stress):
    for heights in (None, CASES["no overlap"], CASES["histogram"]):
        assert math.isfinite(make_law(heights=heights).closure(stress))


# Which heights the reading "population" admits: the virgin curve must be convex
SMOOTH = {"alpha": 3.82, "beta": 1.15e-6, "overlap": 2e-6}
ROUGH = {"alpha": 6.14, "beta": 3.52e-6, "overlap": 12e-6}


@pytest.mark.parametrize(("heights", "least"), [(SMOOTH, 0.287), (ROUGH, 0.312)])
def test_least_exponent_of_the_printed_heights(make_law, heights, least):
    """Where `Phi` of Eq. 37 stops being convex, found by hand to three digits."""
    make_law(heights=jl.GammaHeights(**heights), eta=least)
    with pytest.raises(ValueError, match="not convex") as error:
        make_law(heights=jl.GammaHeights(**heights), eta=least - 0.001)
    for remedy in ('formation = "individual"', "broader", "larger overlap", "larger eta"):
        assert remedy in str(error.value)
    assert f"asperity.eta = {least - 0.001:g}" in str(error.value)


@pytest.mark.parametrize(
    ("heights", "eta"),
    [
        *(
            (jl.GammaHeights(**heights, formation="individual"), eta)
            for heights in (SMOOTH, ROUGH, SMOOTH | {"beta": 1e-9}, ROUGH | {"overlap": 0})
            for eta in (0.0, 1.0)
        ),
        *((jl.Heights(np.histogram(GAMMA.rvs(5000, random_state=n), n)), 0.5) for n in (5, 20)),
    ],
)
def test_individual_is_always_convex_and_the_default_for_any_histogram(make_law, heights, eta):
    make_law(heights=heights, eta=eta)
