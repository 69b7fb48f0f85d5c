"""The total form itself (Eq. 21-23, 33-37): accuracy, symmetries, limits, errors."""

import importlib
import math

import numpy as np
import pytest
from builders import law
from paper_laws import shapes

module = importlib.import_module("jointlaw.paper.secant")  # jl.secant may be the function
secant = module.secant


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
    monkeypatch.setattr(module, "_THETA_NODES", 72)
    monkeypatch.setattr(module, "_PHI_NODES", 56)
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
