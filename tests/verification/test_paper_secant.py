"""The total form itself (Eq. 21-23, 33-37): known values, symmetries, accuracy, errors."""

import importlib
import math

import numpy as np
import pytest

import jointlaw as jl
from jointlaw import closed_form, presets
from jointlaw.paper.runs import total_closure, total_shear

module = importlib.import_module("jointlaw.paper.secant")  # jl.secant may be the function
secant = module.secant


def law(a=3.0, b=0.0, c=0.0, eta=0.0, lam=1.0, mu=0.6, heights=None):
    return jl.JointLaw(
        orientation=jl.Orientation(a, b, c),
        asperity=jl.Asperity(K=1.0, lam=lam, eta=eta, mu=mu),
        heights=heights,
        asperity_density=1.0,
        closure_range=1.0,
    )


def random_cases(count):
    draw = np.random.default_rng(37)
    for i in range(count):
        b = draw.uniform(-1, 2)
        bound = 1 / 3 - b / 6
        found = law(
            1 + draw.exponential(2.0), b, draw.uniform(-bound, bound), (0.0, 0.5, 0.3)[i % 3],
            draw.uniform(1.0, 1.5), draw.uniform(0.0, 1.0),
        )  # fmt: skip
        delta = draw.normal(size=3)
        delta[0] = abs(delta[0]) if i % 4 else delta[0]  # every fourth may open
        yield found, delta, ("exact", "series")[i % 2]


@pytest.mark.parametrize(("a", "known"), [(2, 1.0081), (3, 0.7952), (6, 0.6451)])
def test_known_shear_resistance(a, known):
    F = secant(law(a), [1.0, 2.0, 0.0]).F
    assert F[1] / F[0] == pytest.approx(known, abs=6e-5)  # digits of docs/paper.md, Fig. 14


def test_stiffness_gives_the_force_and_shares_stay_shares():
    for found, delta, contact in random_cases(40):
        result = secant(found, delta, contact)
        np.testing.assert_array_equal(result.F, (result.Ce - result.Cp) @ delta)
        assert -1e-12 < result.sliding < 1 + 1e-12
        assert -1e-12 < result.separated < 1 + 1e-12
        assert result.sliding + result.separated < 1 + 1e-12


def test_quadrature_error_falls_as_claimed(monkeypatch):
    # the docstring's claim is 1e-8 of |C| at worst; the finer rule is the reference
    cases = [(*case, secant(*case)) for case in random_cases(45)]
    monkeypatch.setattr(module, "_THETA_NODES", 72)
    monkeypatch.setattr(module, "_PHI_NODES", 56)
    errors = []
    for found, delta, contact, coarse in cases:
        fine = secant(found, delta, contact)
        size = np.abs(fine.Ce).max()
        errors.append(
            max(np.abs(coarse.Ce - fine.Ce).max(), np.abs(coarse.Cp - fine.Cp).max()) / size
        )
    assert max(errors) < 1e-7
    assert np.median(errors) < 1e-10


def test_linear_asperities_give_both_tables():
    found = law(2.5, 0.5, 0.1, lam=2.0, mu=0.1)
    result = secant(found, [0.7, 0.0, 0.0])
    o = found.orientation
    # Gauss rules on smooth panels: rounding
    np.testing.assert_allclose(np.diag(result.Ce), closed_form.elastic(o, 2.0, 1.0), rtol=1e-12)
    np.testing.assert_allclose(
        np.diag(result.Cp), closed_form.inelastic(o, 2.0, 1.0, 0.1), rtol=1e-12
    )


def test_full_slip_agrees_with_the_incremental_law():
    # where all asperities in touch slide both forms are f_s = mu f_n; what is left apart is the
    # direction of sliding, which on a path that bends lags behind that of the total displacement:
    # docs/paper.md, Fig. 14, has 0.696 against 0.694 at delta_2 = 4 delta_1
    found = law(6.0, eta=0.5, mu=0.3)
    fine = jl.JointLaw(
        orientation=found.orientation, asperity=found.asperity, asperity_density=1.0,
        closure_range=1.0, resolution=jl.Resolution(24, 48, 1),
    )  # fmt: skip
    joint = fine.joint()
    joint.update([1.0, 0.0, 0.0])
    for _ in range(400):
        F, _ = joint.update([0.0, 0.0075, 0.0])
    exact = secant(found, [1.0, 3.0, 0.0]).F
    np.testing.assert_allclose(F[:2], exact[:2], rtol=5e-3)


def test_isotropic_interface_has_no_preferred_azimuth():
    found = law(2.0, 0.5, 0.0, eta=0.5, lam=1.2)
    along = secant(found, [1.0, 1.5, 0.0]).F
    turned = secant(found, [1.0, 1.5 * math.cos(0.7), 1.5 * math.sin(0.7)]).F
    back = [turned[0], turned[1] * math.cos(0.7) + turned[2] * math.sin(0.7)]
    np.testing.assert_allclose(back, along[:2], rtol=1e-12)  # the same nodes, turned


def test_heights_scale_the_total_form_by_their_count():
    heights = jl.GammaHeights(3.82, 1.15, 2.0)
    plain, counted = law(eta=0.5), law(eta=0.5, heights=heights)
    ratio = secant(counted, [0.4, 0.3, 0.1]).F / secant(plain, [0.4, 0.3, 0.1]).F
    np.testing.assert_allclose(ratio, heights.cdf(2.4), rtol=1e-13)
    assert not secant(counted, [-2.5, 3.0, 0.0]).F.any()  # r0 + delta_1 < 0: no contact


def test_no_displacement_no_force():
    for eta in (0.0, 0.5):
        result = secant(law(eta=eta), [0.0, 0.0, 0.0])
        assert not result.F.any()
        assert result.separated == pytest.approx(1.0)
        np.testing.assert_allclose(result.Ce, result.Cp, atol=1e-14)


def test_frictionless_asperities_slide_at_once():
    result = secant(law(mu=0.0), [1.0, 0.5, 0.0])
    assert result.sliding == pytest.approx(1.0)
    # frictionless: F is the sum of normal forces, n . F > 0 and no shear but theirs
    assert result.F[0] > 0


def test_total_shear_keeps_what_it_promises():
    found = presets.load("biegel-smooth")
    test = total_shear(found, np.radians([0, 30, 60, 89, 100]), normal=10e6)
    np.testing.assert_allclose(test.F1, 10e6, rtol=1e-9)  # root found to 1e-12 in log(size)
    kept = total_shear(found, np.radians([0, 30, 60]), closure=1e-7)
    np.testing.assert_allclose(kept.closure, 1e-7, rtol=1e-12)
    delta = [kept.closure[2], kept.shear[2], 0.0]
    np.testing.assert_allclose(secant(found, delta).F[1], kept.shear_stress[2], rtol=1e-9)
    stress = total_closure(found, [1e-7])
    np.testing.assert_allclose(stress, kept.F1[0], rtol=1e-9)


def test_total_shear_ends_where_dilation_has_lost_the_contacts():
    found = presets.load("biegel-smooth")
    test = total_shear(found, np.radians(np.arange(90, 120, 2.0)), normal=10e6)
    assert len(test.F1) < 15
    assert (test.closure > -found.heights.overlap).all()


@pytest.mark.parametrize("delta", [[1.0, 0.0], [1.0, math.nan, 0.0], [math.inf, 0.0, 0.0]])
def test_bad_displacement_is_refused(delta):
    with pytest.raises(ValueError, match="delta"):
        secant(law(), delta)


def test_bad_options_are_refused():
    with pytest.raises(ValueError, match="contact"):
        secant(law(), [1.0, 0.0, 0.0], "mindlin")
    with pytest.raises(ValueError, match=r"asperity\.eta"):
        secant(law(eta=1.5), [1.0, 0.0, 0.0], "series")
    with pytest.raises(ValueError, match="either"):
        total_shear(law(), [0.1])
