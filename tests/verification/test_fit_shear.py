"""Shear curves alone, and together with closure."""

from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw import ClosureCurve, ShearCurve

SHEAR = np.linspace(0, 3e-5, 12)
CONVERGED = jl.Resolution(20, 14, 48)  # of what is measured: 200 steps, stress within 0.1 %
STEPS = 200


@pytest.fixture(scope="module")
def law():
    return jl.JointLaw(
        orientation=jl.Orientation(3.0, 0.3),
        asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.5),
        heights=jl.GammaHeights(3.0, 2e-5, 0.0, "individual"),
        asperity_density=1e6,
    )


def measured(law, shear, normal=5e6):
    """Shear stress and opening of a test, by a law whose steps and cells are fine enough."""
    clean = ShearCurve(shear, np.ones(shear.size), normal)
    return clean.predict(replace(law, plane=0.0, resolution=CONVERGED), STEPS)


@pytest.mark.slow
def test_exact_data_of_the_finest_nodes_give_the_truth(law):
    """A millimetre at 3 MPa, 26 closure ranges, where few nodes would shift mu by 0.03."""
    heights = jl.GammaHeights(3.7, 1e-5, 0.0, "individual")
    start = replace(law, heights=heights, closure_range=4e-5, resolution="balanced")
    truth, shear = replace(start, orientation=jl.Orientation(4.0, 0.3)), np.linspace(0.0, 1e-3, 21)
    exact, _ = measured(truth, shear, 3e6)
    start = replace(start, asperity=replace(law.asperity, mu=0.6))
    fit = jl.fit_curves([ShearCurve(shear, exact, 3e6)], law=start, free=("mu", "a"))
    assert fit.parameters["mu"] == pytest.approx(0.5, abs=0.005)
    assert fit.parameters["a"] == pytest.approx(4.0, abs=0.05)


@pytest.mark.slow
def test_the_opening_tells_friction_from_slopes(law):
    """Without it both are named as not fixed, and fits as good open by what was not measured."""
    stress, opening = measured(law, SHEAR)
    asperity = replace(law.asperity, mu=0.6)
    start = replace(law, orientation=jl.Orientation(2.6, 0.3), asperity=asperity)
    both, free = ShearCurve(SHEAR, stress, 5e6, opening=opening), ("mu", "a", "asperity_density")
    fit = jl.fit_curves([both], law=start, free=free)
    assert set(fit.identifiable) == set(free)
    assert [fit.parameters["mu"], fit.parameters["a"]] == pytest.approx([0.5, 3.0], rel=0.01)
    known = np.subtract(*fit.interval("mu")[::-1])
    alone = jl.fit_curves([replace(both, opening=None)], law=start, free=free)
    assert {"mu", "a"} <= set(alone.not_identifiable)
    (least, flat), (most, steep) = alone.openings
    assert least < np.ptp(opening) < most
    assert flat < steep
    assert "fits that these data allow open by" in alone.report()
    assert np.subtract(*alone.interval("mu")[::-1]) > 5 * known
    # friction that is known from elsewhere leaves the slopes to the shear stress
    held = jl.fit_curves([replace(both, opening=None)], law=law, free=("a",))
    assert held.identifiable == ("a",)


def test_a_joint_that_only_closes_in_shear_is_told_no_dilation_angle(law):
    flat = replace(law, mating_length=6e-6, plane=0.0)
    shear = np.linspace(0.0, 1e-5, 8)
    stress, opening = ShearCurve(shear, np.ones(8), 5e6).predict(flat)
    assert (np.diff(opening) < 0).all()
    fit = jl.fit_curves([ShearCurve(shear, stress, 5e6)], law=flat, free=("mu", "a"))
    assert fit.traded
    assert "No opening was measured" in fit.report()
    assert "nan" not in fit.report()


@pytest.mark.slow
def test_a_test_under_constant_stiffness_is_fitted_by_its_own_normal_stress(law):
    """The normal stress grows from 2 to 4 MPa with the dilation; its mean would be wrong."""
    law = replace(law, plane=0.0, resolution=CONVERGED)
    record = jl.direct_shear(law.joint(), 3e-4, 2e6, stiffness=5e10, steps=200)
    assert record.F1[-1] > 1.5 * record.F1[0]
    rows = slice(None, None, 20)
    curve = ShearCurve(record.shear[rows], record.shear_stress[rows], record.F1[rows])
    stress, opening = curve.predict(law, STEPS)
    assert stress == pytest.approx(record.shear_stress[rows], abs=5e-3 * stress.max())
    assert opening == pytest.approx((record.closure[0] - record.closure)[rows], abs=1e-7)
    fit = jl.fit_curves([curve], law=replace(law, orientation=jl.Orientation(2.6, 0.3)), free="a")
    assert fit.parameters["a"] == pytest.approx(3.0, rel=0.01)


def test_a_long_record_keeps_its_peak_turns_and_ends():
    shear = np.concatenate([np.linspace(0, 1e-3, 501), np.linspace(1e-3, 0, 500)[1:]])
    stress = np.where(np.arange(1000) < 501, 1e6, -1e6)
    stress[[0, 237]] = 0.0, 2e6
    kept = ShearCurve(shear, stress, 1e6, opening=shear**2).thinned(60)
    assert kept.shear.size <= 63
    assert kept.shear_stress.max() == 2e6
    assert kept.shear.max() == 1e-3
    assert kept.shear[-1] == kept.opening[0] == 0.0
    assert "of 1000 rows are fitted" in kept.notes[0]


def test_scatter_of_the_displacement_is_no_reversal():
    """A gauge that flickers by 0.2 % has no turns but its ends."""
    flicker = SHEAR + 6e-8 * np.tile([0, 1, -1], 4)
    many = np.sort(np.concatenate([flicker, flicker - 1e-7]))
    many[1::2], many[::2] = many[::2].copy(), many[1::2].copy()
    curve = ShearCurve(many, np.ones(24), 5e6)
    assert curve.turns == [0, 23]


@pytest.mark.slow
def test_closure_alone_tells_neither_friction_nor_slopes(law):
    stress = np.geomspace(0.2e6, 10e6, 10)
    y = law.closure(stress)
    closure = ClosureCurve(stress, y - y[0], noise=0.01)
    alone = jl.fit_curves([closure], law=law, free=("asperity_density", "mu", "a"))
    assert {"mu", "a"} <= set(alone.not_identifiable)
    with pytest.raises(ValueError, match="2 closure curves of 2: give one at most"):
        jl.fit_curves([closure, closure])


@pytest.mark.slow
def test_cohesion_shows_in_shear_and_tension_where_the_joint_opens(law):
    """A bond whose energies are four times the elastic ones, 1 % of noise at 16 points a test."""
    way, rng = np.linspace(0.0, 1.5e-3, 16), np.random.default_rng(0)

    def bonded(a, cohesion, tension):
        bond = jl.Bond(1e10, 5e9, tension, cohesion, 2e-10 * tension**2, 4e-10 * cohesion**2)
        return replace(law, orientation=jl.Orientation(a), mating_length=8e-4, bond=bond)

    def sheared(a, normal):
        made = replace(bonded(a, 1.5e6, 8e5), plane=0.0)
        stress, _ = ShearCurve(way, np.ones(16), normal).predict(made, 400)
        return ShearCurve(way, stress + 0.01 * stress.max() * rng.standard_normal(16), normal)

    curves = [sheared(20.0, 1e6 * normal) for normal in (1, 3, 5)]
    start = bonded(20.0, 3e6, 8e5)
    start = replace(start, asperity=replace(law.asperity, mu=0.6))
    fit = jl.fit_curves(curves, law=start, free=("cohesion", "mu"))
    for name, value in (("cohesion", 1.5e6), ("mu", 0.5)):
        assert name in fit.identifiable
        assert fit.parameters[name] == pytest.approx(value, rel=0.03)
        low, high = fit.interval(name)
        assert low <= value <= high
    found = fit.law.bond
    assert found.energy_II == pytest.approx(4e-10 * found.cohesion**2)
    # the flat joint does not open, a rough one at a low stress does
    closed = jl.fit_curves(curves[1:], law=fit.law, free=("tension",))
    assert "Hold tension: give what you know" in closed.report()
    rough = bonded(4.0, 1.5e6, 4e5)
    opened = jl.fit_curves([sheared(4.0, 2e5)], law=rough, free=("tension",))
    low, high = opened.interval("tension")
    assert low <= 8e5 <= high < 1.2 * low
    # a bond so brittle breaks between two points, whatever its cohesion
    brittle = replace(fit.law, bond=replace(found, energy_II=None))
    fit = jl.fit_curves(curves[:1], law=brittle, free=("cohesion",))
    assert "0 points of a test lie where the bond softens" in fit.not_identifiable["cohesion"]
    assert fit.shape_differs == (True,)


def test_strengths_of_a_bond_need_a_bond(law):
    with pytest.raises(ValueError, match="cohesion is that of a bond: give a law with a bond"):
        jl.fit_curves([ShearCurve(SHEAR, SHEAR, 5e6)], law=law, free=("cohesion", "mu"))
