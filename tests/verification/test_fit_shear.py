"""Shear curves alone, and together with closure."""

from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw import ClosureCurve, ShearCurve
from jointlaw.parameters.resolution import SLIP as FINE

SHEAR = np.linspace(0, 3e-5, 12)


@pytest.fixture(scope="module")
def law():
    return jl.JointLaw(
        orientation=jl.Orientation(3.0, 0.3),
        asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.5),
        heights=jl.GammaHeights(3.0, 2e-5, 0.0, "individual"),
        asperity_density=1e6,
        resolution=FINE,  # that of fits: measured curves are made with the same nodes
    )


@pytest.fixture(scope="module")
def strength(law):
    return ShearCurve(SHEAR, np.ones(12), 5e6).predict(replace(law, plane=0.0))


@pytest.mark.slow
def test_exact_data_of_the_finest_nodes_give_the_truth(law):
    """A millimetre at 3 MPa, 26 closure ranges, where few nodes would shift mu by 0.03."""
    heights = jl.GammaHeights(3.7, 1e-5, 0.0, "individual")
    start = replace(law, heights=heights, closure_range=4e-5, resolution="balanced")
    truth = replace(start, orientation=jl.Orientation(4.0, 0.3), resolution="reference", plane=0.0)
    shear = np.linspace(0.0, 1e-3, 21)
    exact = ShearCurve(shear, np.ones(21), 3e6).predict(truth)
    start = replace(start, asperity=replace(law.asperity, mu=0.6))
    fit = jl.fit_curves([ShearCurve(shear, exact, 3e6)], law=start, free=("mu", "a"))
    assert fit.parameters["mu"] == pytest.approx(0.5, abs=0.005)
    assert fit.parameters["a"] == pytest.approx(4.0, abs=0.05)


def test_shear_fixes_what_closure_cannot(law, strength):
    stress = np.geomspace(0.2e6, 10e6, 10)
    y = law.closure(stress)
    closure = ClosureCurve(stress, y - y[0], noise=0.01)
    shear = ShearCurve(SHEAR, strength, 5e6, noise=0.01)
    start = replace(law, orientation=jl.Orientation(2.8, 0.3))
    free = ("asperity_density", "mu", "a")
    fit = jl.fit_curves([closure, shear], law=start, free=free)
    assert {"mu", "a", "asperity_density"} <= set(fit.identifiable)
    assert [fit.parameters["mu"], fit.parameters["a"]] == pytest.approx([0.5, 3.0], rel=1e-2)
    alone = jl.fit_curves([closure], law=law, free=free)
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
        stress = ShearCurve(way, np.ones(16), normal).predict(made, 400)
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


def test_strengths_of_a_bond_need_a_bond(law, strength):
    with pytest.raises(ValueError, match="cohesion is that of a bond: give a law with a bond"):
        jl.fit_curves([ShearCurve(SHEAR, strength, 5e6)], law=law, free=("cohesion", "mu"))
