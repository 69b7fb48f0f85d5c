"""Slopes that fade with the distance from mate, slopes that wear, asperities that yield; against
the slow bed: test_slow_bed.py."""

import dataclasses
import warnings
from dataclasses import replace

import numpy as np
import pytest
from builders import law

import jointlaw as jl
from jointlaw.kernels import reference as kernel
from jointlaw.kernels.asperities import effective_closure

PRESETS = "westerly-rough", "jing-replica"
FINE = jl.Resolution(12, 12, 12)


def sheared(name, lengths, stress, way, **more):
    """Law and record of a shear test to `way` mating lengths, each of `lengths` closure ranges."""
    law = jl.presets.load(name)
    D = lengths * law.closure_range
    law = replace(law, mating_length=D, plane=0.0, resolution=FINE, **more)
    steps = np.concatenate([np.geomspace(1e-3, 1.0, 60), np.linspace(1.05, way, 60)]) * D
    return law, shear_along(law.joint(), steps, stress)


def shear_along(joint, places, stress):
    """Shear (k,), ratio F2/F1 (k,) and closure (k,) of a joint that is sheared to these places."""
    rows = []
    for place in places:
        record = jl.direct_shear(joint, [place - joint.delta[1]], normal=stress, steps=1)
        rows.append((place, record.F2[-1] / record.F1[-1], joint.delta[0]))
    return np.array(rows).T


@pytest.mark.slow
@pytest.mark.parametrize("stress", [0.1e6, 1e6, 3e6, 30e6])
@pytest.mark.parametrize("name", PRESETS)
def test_friction_is_that_of_the_asperities_and_the_dilation(name, stress):
    """At and after the peak; springs still fill at it, the more the higher the stress."""
    for lengths in (12.0, 100.0):
        law, (way, ratio, closure) = sheared(name, lengths, stress, 10.0)
        friction, D = np.degrees(np.arctan(ratio)), law.mating_length
        dilation = np.degrees(np.arctan(-np.gradient(closure, way)))
        away = np.abs(friction - np.degrees(np.arctan(law.asperity.mu)) - dilation)
        top = int(np.argmax(friction))
        later = way > way[top] + D
        assert away[top:-1].max() < (4.2 if stress > 3e6 else 3.3)
        if stress <= 3e6:
            assert away[later][:-1].max() < 1.2


@pytest.mark.slow
@pytest.mark.parametrize("mated", [True, False])
@pytest.mark.parametrize("stress", [0.1e6, 1e6, 30e6])
@pytest.mark.parametrize("name", PRESETS)
def test_far_from_mate_only_the_friction_of_the_asperities_is_left(name, stress, mated):
    law = replace(jl.presets.load(name), resolution="fine")
    law = replace(law, mating_length=12.0 * law.closure_range)
    way = 100.0 * law.mating_length if mated else 3.0 * law.closure_range
    for turn in np.arange(8) * np.pi / 4:
        joint = law.joint(mated=mated)
        e = np.array([np.cos(turn), np.sin(turn)])
        jl.direct_shear(joint, [way], normal=stress, azimuth=turn, steps=40)
        angle = np.degrees(np.arctan2(joint.F[1:] @ e, joint.F[0]))
        assert angle == pytest.approx(np.degrees(np.arctan(law.asperity.mu)), abs=0.3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stress", "left"), [(0.1e6, 0.01), (1e6, 0.01), (3e6, 0.01), (30e6, 0.04)]
)
@pytest.mark.parametrize("name", PRESETS)
def test_back_at_its_origin_the_joint_is_mated(name, stress, left):
    law = jl.presets.load(name)
    law = replace(law, mating_length=12 * law.closure_range, plane=0.0, resolution=FINE)
    joint, D = law.joint(), law.mating_length
    there = np.concatenate([[0.0], np.geomspace(1e-2, 10.0, 60)]) * D
    _, _, closure = shear_along(joint, [*there, *there[::-1]], stress)
    lift = closure[0] - closure
    assert abs(lift[-1]) < (0.04 if stress > 3e6 else 0.01) * lift.max()


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
    with pytest.warns(UserWarning, match="100.00 % of the asperities touch"):
        stiff.joint(4e9)
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
