"""Asperities that yield and wear; against the slow bed in shear: test_slow_bed.py."""

import dataclasses
import warnings

import numpy as np
import pytest
from builders import law

import jointlaw as jl
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.asperities import effective_closure


@pytest.mark.parametrize("interference", [1e-12, 0.05, 0.3])
@pytest.mark.parametrize(
    ("formation", "eta"), [(None, 0.0), ("population", 0.5), ("individual", 1)]
)
def test_closure_has_a_closed_form(formation, eta, interference):
    one = law(formation=formation, eta=eta, mu=0.0, resolution=jl.Resolution(2, 4, 3),
              damage={"yield_interference": interference})  # fmt: skip
    joint, k = one.joint(), one.tables.asperities

    def phi(y):
        return k.curve.force(np.asarray(y, float))[0]

    deep, last, highest = interference / k.c1, 0.0, 0.0
    for target in np.random.default_rng(0).uniform(-0.2, 1.2, 40):
        F, C = joint.update([target - last, 0.0, 0.0])
        last, highest = target, max(highest, target)
        flat = np.maximum(highest - deep, 0.0)
        stress = np.sum(k.area * k.c1 * np.where(target > flat, phi(target) - phi(flat), 0.0))
        scale = np.sum(k.area * k.c1) * phi(highest)
        # rounding of Phi, of which small differences are taken
        assert abs(F[0] - stress) <= 1e-12 * scale
        assert abs(joint.plastic_work - np.sum(k.area * k.c1 * deep * phi(flat))) <= 1e-12 * scale
        assert joint.plastic_work <= joint.dissipated_energy
        if target < highest:  # unloading and reloading are elastic
            slope = k.curve.force(np.array(target))[1]
            assert C[0, 0] == pytest.approx(
                np.sum(k.area * k.c1 * np.where(target > flat, slope, 0.0)), rel=1e-12, abs=1e-300
            )
    assert joint.stored_energy >= 0.0


def test_both_sides_of_an_asperity_are_flattened_where_slopes_fade():
    """Else slopes that wear would press springs that only the other side has lost."""
    whole = law(mating_length=2.0, damage={"yield_interference": 0.1}).tables
    d, k = np.array([[0.5], [0.8], [0.3]]), whole.asperities
    state = kernel.step(whole, np.zeros((whole.rows, 1)), d, False)[0]
    depth = kernel.parts(whole, state).depth[:, 0]
    turned = k.n * [[1.0], [-1.0], [-1.0]]
    opposite = np.argmax(turned.T @ k.n, axis=1)
    assert np.ptp(depth) > 0.1
    np.testing.assert_array_equal(depth, depth[opposite])


def test_a_joint_closed_beyond_its_highest_asperity_gives_a_warning():
    """99.99 % of the heights of this preset end at a closure of 17.1 mm."""
    stiff = jl.presets.load("jing-replica")
    asperity = dataclasses.replace(stiff.asperity, yield_interference=0.1 * stiff.closure_range)
    weak = dataclasses.replace(stiff, asperity=asperity)
    with pytest.warns(UserWarning, match="closure = 0.0176 m: 99.99 % .* law ends"):
        weak.joint(30e6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        weak.joint(10e6)
        stiff.joint(30e6)


def test_shear_without_friction_wears_no_slopes():
    joint = law(mu=0.0, mating_length=3.0, slope_wear=1e-3, plane=0.0).joint(0.3)
    joint.update([0.0, 0.5])
    joint.update([0.0, 0.5])
    assert joint.F[1] > 0.0  # it climbs
    assert joint.slopes == 1.0


def test_closing_and_opening_wear_no_slopes():
    """Facets rub where a joint closes; real joints keep their slopes without shear."""
    one = law(mu=0.4, mating_length=3.0, slope_wear=1e-3, plane=0.0)
    joint = one.joint()
    for way in 20 * (0.1, 0.1, -0.1, -0.1):
        joint.update([6.0 * way, 0.0])
    assert joint.dissipated_energy > 1e-3  # friction was lost
    assert joint.slopes == 1.0


def test_slopes_wear_by_the_work_of_shear():
    """slopes = s + (1 - s) exp(-work/slope_wear), of the step before; lift goes with them."""
    one = law(mu=0.4, mating_length=3.0, slope_wear=0.2, slope_residual=0.25, plane=0.0)
    joint = one.joint()
    joint.update([0.6, 0.0])
    for _ in range(80):
        before = kernel.parts(one.tables, joint.snapshot().values.T).work[0]
        joint.update([0.0, 0.05])
        assert joint.slopes == pytest.approx(0.25 + 0.75 * np.exp(-before / 0.2), rel=1e-12)
    now = kernel.parts(one.tables, joint.snapshot().values.T)
    y = effective_closure(one.tables.asperities, now.delta, now.slopes)[:, 0]
    climbed = 4.0 / np.hypot(1.0, 4.0 / 3.0)
    expected = 0.6 + joint.slopes * climbed * one.tables.asperities.m[1]
    assert joint.slopes < 0.9
    np.testing.assert_allclose(y, expected, rtol=1e-12)
