"""Section 4, one asperity and its power law: Eq. 33 to 37, and the incremental law beside them; and
the total form itself (Eq. 21-23, 33-37): accuracy, limits, errors."""

import math

import numpy as np
import pytest
from builders import law
from paper_laws import shapes
from scipy.integrate import quad

import jointlaw as jl
from jointlaw.paper.closed_form import Shape, inelastic
from jointlaw.paper.secant import secant, series_limit, shear_factor

MU, LAM = 0.4, 1.2
RESOLUTIONS = ["fast", "reference", jl.Resolution(1, 3, 1)]
FORMATIONS = [None, "population", "individual"]


def flat(resolution, formation=None):
    """A joint whose asperities face its normal within 1e-9 rad."""
    more = {"resolution": resolution, "formation": formation}
    return law(a=1e9, b=0.0, c=0.0, mu=MU, lam=LAM, **more).joint()


def test_hertz_mindlin_parameters():
    """Eq. 34: G = 20 GPa, nu = 0.3, R = 40 um give K = 200 GPa um^1/2, lambda = 1.2
    Holds: K = 198.4 GPa µm^1/2, λ = 1.214
    """
    asperity = jl.Asperity.hertz_mindlin(20e9, 0.3, 40e-6, 0.3)
    assert pytest.approx(198.4e6, rel=3e-4) == asperity.K  # GPa um^(1/2) is 1e6 Pa m^(1/2)
    assert asperity.lam == pytest.approx(1.7 / 1.4, rel=1e-15)


def error_of_equation_35(cells):
    """Largest error of F2/(mu F1) at closure 1, up to just past full slip."""
    joint = flat(jl.Resolution(1, 3, cells))
    joint.update([1.0, 0.0, 0.0])
    full, worst = MU * LAM, 0.0
    for x in np.append(np.linspace(0.005, 1.1, 110), 1.0 - 0.7 ** np.arange(10, 40)):
        F = joint.trial([0.0, x * full, 0.0], tangent=False)[0]
        exact = 1.0 - (1.0 - min(x, 1.0)) ** 1.5
        worst = max(worst, abs(F[1] / (MU * F[0]) - exact))
    return worst


def test_shear_law_of_an_asperity():
    """Eq. 35: K_s falls from 3 K_n/2 lambda to K_n/lambda at sliding
    Holds: and the incremental law on flat facets follows Eq. 35 to 2e-4 μ f_n with 64 depth cells
    """
    x = np.linspace(1e-6, 1.0, 50)
    assert x * shear_factor(x, 0.5) == pytest.approx(1 - (1 - x) ** 1.5, rel=1e-9)
    assert shear_factor([0.0, 1.0], 0.5) == pytest.approx([1.5, 1.0], abs=1e-11)
    cells = np.array([4, 16, 64, 256])
    errors = [error_of_equation_35(n) for n in cells]
    # piecewise linear in slip: second order away from the singular end of Phi''
    assert -np.polyfit(np.log(cells), np.log(errors), 1)[0] > 1.5
    assert errors[2:] == pytest.approx([2e-4, 0.0], abs=1e-4)


def test_series_of_the_shear_law():
    """Eq. 36: the series falls from 3 K_n/2 lambda to 1.063 K_n/lambda at sliding
    One reading: 1.5 to 1.0625, so f_s would be 1.0625 μ f_n at sliding, and up to 1.196: it must be
    capped, and reaches the cap at d_s = 0.899 μλ d_n already
    """
    x = np.linspace(0.0, 2.0, 20001)
    factor = shear_factor(x, 0.5, "series")
    assert (factor[0], factor[10000]) == pytest.approx((1.5, 1.0625), rel=1e-14)
    assert (x * factor).max() == pytest.approx(1.196, abs=5e-4)
    assert series_limit(0.5) == pytest.approx(0.899, abs=5e-4)


def test_sliding_angle_of_the_power_law():
    """Section 4: theta_s = arctan(lambda mu) for the power law
    Holds: with Eq. 35; the capped series of Eq. 36 slides at arctan 0.899 λμ already
    """
    for contact, reach in (("exact", 1.0), ("series", series_limit(0.5))):
        share = secant(law(3.0, 0.0, 0.0, lam=LAM, mu=0.3), [1.0, 0.0, 0.0], contact).sliding
        assert math.acos(share) / 3 == pytest.approx(math.atan(reach * 0.36), abs=1e-11)


def test_limits_of_the_sliding_domain():
    """Eq. 37b: the sliding domain runs from 0 to theta_s
    Misprint: those are the asperities that do not slide: at μ = 0 they would give C11p = 0 where
    Eq. 31 has 2 K_s/3; the text above it and Eq. 29 (θ_s to π/2a) are right
    """
    for start, C11p in ((0.0, 2 / 3), (math.pi / 2, 0.0)):
        assert quad(lambda x: math.sin(x) ** 3, start, math.pi / 2)[0] == pytest.approx(C11p)
    assert inelastic(Shape(1.0), 1.0, 1.0, 0.0)[0] == pytest.approx(2 / 3, rel=1e-14)


def test_heights_scale_the_total_form_by_their_count():
    """Eq. 37: N is counted up to r = r0 + delta_1 (printed: delta_i)
    Misprint: only the closure changes the overlap; Eq. 21 to 23 are scaled by P(r0 + δ₁)
    """
    plain, counted = law(), law(formation="population")
    ratio = secant(counted, [0.4, 0.3, 0.1]).F / secant(plain, [0.4, 0.3, 0.1]).F
    np.testing.assert_allclose(ratio, counted.heights.cdf(2.4), rtol=1e-13)
    assert not secant(counted, [-2.5, 3.0, 0.0]).F.any()  # r0 + delta_1 < 0: no contact


@pytest.mark.parametrize("resolution", RESOLUTIONS, ids=str)
@pytest.mark.parametrize("formation", FORMATIONS)
def test_oblique_loading_does_not_slip(resolution, formation):
    joint, ratio = flat(resolution, formation), 0.99 * MU * LAM
    direction = np.array([1.0, ratio * np.cos(0.5), ratio * np.sin(0.5)])
    joint.update([-1.0, 0.0, 0.0])
    # no slip below mu lam, and only the last third of the first step is in contact
    for step in (1.5, 1e-3, 2.0):
        F = joint.update(step * direction)[0]
        # exact at any number of cells; facets lean by 1e-9, their pairs cancel
        assert np.hypot(F[1], F[2]) == pytest.approx(ratio / LAM * F[0], rel=1e-10)
        assert joint.measures().sliding == 0.0


@pytest.mark.parametrize("resolution", RESOLUTIONS, ids=str)
@pytest.mark.parametrize("formation", FORMATIONS)
def test_full_slip_carries_mu_times_the_normal_force(resolution, formation):
    joint, along = flat(resolution, formation), np.array([0.0, np.cos(2.3), np.sin(2.3)])
    joint.update([0.8, 0.0, 0.0])
    for d in (3.0 * along, -7.0 * along, 4.0 * along + [0.5, 0.0, 0.0], -2.0 * along):
        F = joint.update(d)[0]
        # every cell sits at its cap along one line: rounding
        exact = np.sign(d @ along) * MU * F[0] * along[1:]
        assert F[1:] == pytest.approx(exact, rel=0.0, abs=1e-12 * MU * F[0])
        assert joint.measures()[:2] == pytest.approx((1.0, 1.0), abs=1e-12)
    F = joint.update([-0.4, 0.0, 0.0])[0]  # slip is kept in proportion while the joint opens
    assert np.hypot(F[1], F[2]) == pytest.approx(MU * F[0], rel=1e-12)


def test_quadrature_error_is_as_claimed(monkeypatch):
    # the docstring's claim is 1e-8 of |C| at worst; the finer rule is the reference
    draw = np.random.default_rng(37)
    cases = [
        (law(o.a, o.b, o.c, eta=eta, mu=draw.uniform(0.0, 1.0)), draw.normal(size=3), contact)
        for o in shapes(4)
        for eta in (0.0, 0.5, 0.3)
        for contact in ("exact", "series")
    ]
    coarse = [secant(*case) for case in cases]
    monkeypatch.setattr("jointlaw.paper.secant._THETA_NODES", 72)
    monkeypatch.setattr("jointlaw.paper.secant._PHI_NODES", 56)
    for case, found in zip(cases, coarse, strict=True):
        fine = secant(*case)
        error = np.abs([found.Ce - fine.Ce, found.Cp - fine.Cp]).max()
        assert error <= 1e-7 * np.abs(fine.Ce).max()
        assert -1e-12 < found.sliding < found.sliding + found.separated + 1e-9 < 1 + 1e-8


@pytest.mark.parametrize("eta", [0.0, 0.5])
def test_no_displacement_no_force(eta):
    result = secant(law(eta=eta), [0.0, 0.0, 0.0])
    assert not result.F.any()
    assert result.separated == pytest.approx(1.0)
    np.testing.assert_allclose(result.Ce, result.Cp, atol=1e-14)


@pytest.mark.parametrize(
    ("eta", "delta", "contact", "named"),
    [
        (0.5, [1.0, 0.0], "exact", "delta"),
        (0.5, [1.0, math.nan, 0.0], "exact", "delta"),
        (0.5, [1e200, 0.0, 0.0], "exact", "largest_reach"),
        (0.5, [1.0, 0.0, 0.0], "mindlin", "contact"),
        (1.5, [1.0, 0.0, 0.0], "series", r"asperity\.eta"),
    ],
)
def test_bad_input_is_refused(eta, delta, contact, named):
    with pytest.raises(ValueError, match=named):
        secant(law(eta=eta), delta, contact)
