"""Whole closure cycles: what yielding explains, and the compliance of rock and machine."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import trapezoid

import jointlaw as jl
from jointlaw.calibration import datasets, unloading
from jointlaw.calibration.measured import ClosureCurve, first_loading

FREE = ("asperity_density", "alpha", "beta", "yield_interference")


def loss(stress, closure):
    """Work that a cycle loses, as a share of that of loading."""
    top = int(np.argmax(stress))
    up = trapezoid(stress[: top + 1], closure[: top + 1])
    return 1 + trapezoid(stress[top:], closure[top:]) / up


@pytest.fixture(scope="module")
def grimsel():
    """The cycle without points 19 and 25, that its authors interpolated or extrapolated."""
    stress, closure = datasets.load("grimsel_vd1_closure")
    keep = np.isin(np.arange(1, 26), (19, 25), invert=True)
    return stress[keep], closure[keep]


def response(fit, closure):
    """Stress of the fitted law itself along closures."""
    joint = replace(fit.law, plane=None, closure_only=True, resolution="reference").joint()
    moves = np.diff(fit.parameters["seating"] + closure, prepend=0.0)
    return np.array([joint.update([d])[0][0] for d in moves])


@pytest.fixture(scope="module")
def cycle(grimsel):
    return jl.fit_closure(*grimsel, free=FREE, cycle=True, noise=0.02)


def test_one_length_explains_the_loop_of_the_measured_cycle(cycle, grimsel):
    stress, closure = grimsel
    model, top = response(cycle, closure), int(np.argmax(stress))
    # 36 % of 39 %, and -7 % at the top: loop and top pull against each other
    assert loss(model, closure) == pytest.approx(loss(stress, closure), abs=0.08)
    assert model[top] == pytest.approx(stress[top], rel=0.10)
    assert "yield_interference" in cycle.identifiable
    elastic = replace(cycle.law, asperity=replace(cycle.law.asperity, yield_interference=np.inf))
    joint = replace(elastic, closure_only=True, resolution="reference").joint()
    moves = np.diff(cycle.parameters["seating"] + closure, prepend=0.0)
    assert (
        loss(np.array([joint.update([d])[0][0] for d in moves]), closure) < 0.12
    )  # friction alone


def test_the_upper_half_is_predicted_with_the_length_of_the_cycle(cycle, grimsel):
    stress, closure = grimsel
    top = int(np.argmax(stress)) + 1
    low = stress[:top] < 5.3e6
    fixed = {"yield_interference": cycle.parameters["yield_interference"]}
    fit = jl.fit_closure(stress[:top][low], closure[:top][low], fixed=fixed)
    # the length is that of the whole cycle: no prediction from loading alone
    assert response(fit, closure[:top])[-1] == pytest.approx(stress[top - 1], rel=0.04)


def test_parameters_come_back_from_a_cycle_that_they_made():
    law = jl.JointLaw(
        orientation=jl.Orientation(3.0), heights=jl.GammaHeights(3.0, 2e-5, 0.0, "individual"),
        asperity=jl.Asperity(1e9, 1.17, 0.5, 0.6, yield_interference=2e-5), asperity_density=1e6,
    )  # fmt: skip
    record = jl.closure_test(replace(law, closure_only=True).joint(), [5e6, 10e6], steps=12)
    rock = 3e-12
    fit = jl.fit_closure(
        record.F1, record.closure + rock * record.F1, law=law, cycle=True, compliance=rock,
        free=("asperity_density", "yield_interference"), noise=0.01, seating=0.0,
    )  # fmt: skip
    # shear forces fall with normal ones in the forward model: a few per cent
    assert fit.parameters["yield_interference"] == pytest.approx(2e-5, rel=0.08)


@pytest.fixture(scope="module")
def cycles():
    """Three cycles of a law that yields, the last one below the largest stress before it."""
    law = jl.JointLaw(
        orientation=jl.Orientation(3.0), heights=jl.GammaHeights(3.0, 2e-5, 0.0, "individual"),
        asperity=jl.Asperity(1e9, 1.17, 0.5, 0.3, yield_interference=2e-5), asperity_density=1e6,
    )  # fmt: skip
    finest = replace(law, closure_only=True, resolution="reference")
    record = jl.closure_test(finest.joint(), [5e6, 10e6, 7e6], steps=20)
    return law, record.F1, record.closure


def test_every_cycle_is_compared_with_the_law(cycles):
    law, stress, closure = cycles
    loops = unloading.explain_each(law, stress, closure, steps=40)
    assert [loop.top for loop in loops] == pytest.approx([5e6, 10e6, 7e6])
    for loop in loops:  # the same law: only the steps differ, and the trapezoids over them
        assert loop.friction == pytest.approx(loop.measured, abs=0.01)
        assert loop.law_closure == pytest.approx(loop.open_closure, abs=2e-7)
    assert loops[2].measured < 0.03 < loops[0].measured < loops[1].measured  # reloading is elastic
    assert unloading.explain(law, stress, closure, steps=40) == loops[0]
    text = unloading.summed_up(loops)
    assert "| 3 | 7 |" in text
    assert "cannot tell yielding from" in text


def test_cycles_turn_where_the_stress_does_and_not_where_it_scatters(cycles):
    _, stress, closure = cycles
    wave = stress + 0.01 * stress * (-1) ** np.arange(stress.size)
    up, _, down, _ = first_loading(wave, closure)
    assert (up.size, down.size) == (21, 21)
    with pytest.raises(ValueError, match="after point 20"):
        ClosureCurve(stress[:61], closure[:61])  # up to its largest stress, but not at first
    ClosureCurve(stress[:61], closure[:61], cycle=True)


def test_the_report_of_cycles_says_what_was_given_and_bounds_the_top(cycles):
    law, stress, closure = cycles
    rock = 1e-12
    fit = jl.fit_closure(
        stress, closure + rock * stress, law=law, cycle=True, compliance=rock, seating=0.0,
        free=("asperity_density", "yield_interference"),
    )  # fmt: skip
    assert "that was given is subtracted" in fit.report()
    assert f"| {1e6 * closure.max():.4g} |" in fit.report()  # the top, not the last row
    # shares of the largest stress: at a small one the band is as wide in Pa, not in per cent
    low, high = fit.band(np.array([0.3, 1.0]) * closure.max())
    assert 0.2 * (high - low)[1] < (high - low)[0] < 2 * (high - low)[1]
    without = jl.fit_closure(stress[:21], closure[:21], law=law)
    assert "No compliance of rock and machine was given" in without.report()


def test_compliance_is_subtracted_as_a_number_or_as_a_curve(grimsel):
    stress, closure = grimsel
    by_number = ClosureCurve(stress, closure, cycle=True, compliance=4e-12)
    load = np.linspace(0.0, 11e6, 5)
    by_curve = ClosureCurve(stress, closure, cycle=True, compliance=(load, 4e-12 * load))
    assert np.allclose(by_number.closure, closure - 4e-12 * stress, rtol=1e-12)
    assert np.allclose(by_curve.closure, by_number.closure, rtol=1e-9, atol=1e-15)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cycle": True, "part": 13}, "never falls below 80 %"),
        ({}, "give cycle=True"),
        ({"cycle": True, "compliance": 4e-11}, "nothing is left for the joint"),
        ({"cycle": True, "compliance": -1e-12}, "compliance = -1e-12 is out of bounds"),
        ({"cycle": True, "compliance": float("nan")}, "compliance = nan"),
        ({"cycle": True, "compliance": ([0.0, 5e6], [0.0, 2e-5])}, "reach the largest stress"),
    ],
)
def test_cycles_that_do_not_fit_are_refused(grimsel, options, message):
    options = dict(options)
    part = options.pop("part", None)
    stress, closure = (values[:part] for values in grimsel)
    with pytest.raises(ValueError, match=message):
        ClosureCurve(stress, closure, **options)
