"""Shear curves alone, and together with closure."""

from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.calibration.measured import ClosureCurve, ShearCurve
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
def test_friction_and_inclination_are_covered_by_their_intervals(law, strength):
    """Both are fixed by one shear test: 8 draws x 2, of which 95 % should hold the truth."""
    start = replace(law, orientation=jl.Orientation(2.6, 0.3))
    start = replace(start, asperity=replace(law.asperity, mu=0.6))
    rng, hits = np.random.default_rng(0), 0
    for _ in range(8):
        measured = strength + 0.01 * strength.max() * rng.standard_normal(SHEAR.size)
        fit = jl.fit_curves([ShearCurve(SHEAR, measured, 5e6)], law=start, free=("mu", "a"))
        assert set(fit.identifiable) == {"mu", "a"}
        for name, value in (("mu", 0.5), ("a", 3.0)):
            low, high = fit.interval(name)
            hits += low <= value <= high
    assert hits >= 13  # fewer has a probability of 0.7 % when the intervals are right


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
