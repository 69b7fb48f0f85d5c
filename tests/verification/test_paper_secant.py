"""The total form itself (Eq. 21-23, 33-37): accuracy, symmetries, limits, errors."""

import importlib
import math

import numpy as np
import pytest
from builders import law
from paper_integrals import shapes

module = importlib.import_module("jointlaw.paper.secant")  # jl.secant may be the function
secant = module.secant


def random_cases(count):
    draw = np.random.default_rng(37)
    for i, o in enumerate(shapes(count)):
        lam, mu, delta = draw.uniform(1.0, 1.5), draw.uniform(0.0, 1.0), draw.normal(size=3)
        delta[0] = abs(delta[0]) if i % 4 else delta[0]  # every fourth may open
        found = law(o.a, o.b, o.c, eta=(0.0, 0.5, 0.3)[i % 3], lam=lam, mu=mu)
        yield found, delta, ("exact", "series")[i % 2]


def test_quadrature_error_is_as_claimed(monkeypatch):
    # the docstring's claim is 1e-8 of |C| at worst; the finer rule is the reference
    cases = [(*case, secant(*case)) for case in random_cases(24)]
    monkeypatch.setattr(module, "_THETA_NODES", 72)
    monkeypatch.setattr(module, "_PHI_NODES", 56)
    errors = []
    for found, delta, contact, coarse in cases:
        assert min(coarse.sliding, coarse.separated) > -1e-12
        assert coarse.sliding + coarse.separated < 1 + 1e-12
        fine = secant(found, delta, contact)
        error = np.abs([coarse.Ce - fine.Ce, coarse.Cp - fine.Cp]).max()
        errors.append(error / np.abs(fine.Ce).max())
    assert max(errors) < 1e-7
    assert np.median(errors) < 1e-10


def test_full_slip_agrees_with_the_incremental_law():
    # where all asperities in touch slide both forms are f_s = mu f_n; what is left apart is the
    # direction of sliding, which on a path that bends lags behind that of the total displacement
    found = law(6.0, 0.0, 0.0, lam=1.0, mu=0.3, resolution="reference")
    joint = found.joint()
    joint.update([1.0, 0.0, 0.0])
    for _ in range(100):
        F, _ = joint.update([0.0, 0.03, 0.0])
    assert pytest.approx(secant(found, [1.0, 3.0, 0.0]).F[:2], rel=5e-3) == F[:2]


def test_isotropic_interface_has_no_preferred_azimuth():
    found, (cos, sin) = law(2.0, 0.5, 0.0), (math.cos(0.7), math.sin(0.7))
    along = secant(found, [1.0, 1.5, 0.0]).F
    turned = secant(found, [1.0, 1.5 * cos, 1.5 * sin]).F
    exact = [along[0], along[1] * cos, along[1] * sin]
    np.testing.assert_allclose(turned, exact, rtol=1e-12)  # the same nodes, turned


def test_heights_scale_the_total_form_by_their_count():
    """Eq. 37: N is counted up to r = r0 + delta_1 (printed: delta_i)
    Misprint: only the closure changes the overlap; Eq. 21 to 23 are scaled by P(r0 + δ₁)
    """
    plain, counted = law(), law(formation="population")
    ratio = secant(counted, [0.4, 0.3, 0.1]).F / secant(plain, [0.4, 0.3, 0.1]).F
    np.testing.assert_allclose(ratio, counted.heights.cdf(2.4), rtol=1e-13)
    assert not secant(counted, [-2.5, 3.0, 0.0]).F.any()  # r0 + delta_1 < 0: no contact


def test_limits():
    for eta in (0.0, 0.5):
        result = secant(law(eta=eta), [0.0, 0.0, 0.0])
        assert not result.F.any()
        assert result.separated == pytest.approx(1.0)
        np.testing.assert_allclose(result.Ce, result.Cp, atol=1e-14)
    frictionless = secant(law(mu=0.0), [1.0, 0.5, 0.0])
    assert frictionless.sliding == pytest.approx(1.0)
    assert frictionless.F[0] > 0


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
