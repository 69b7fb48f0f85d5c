"""The bound of |C| and the explicit time step that follows from it: in touch, open, sheared far."""

import math
from dataclasses import replace

import numpy as np
import pytest
from c_host import random_law

import jointlaw as jl
from jointlaw.kernels.asperities import effective_closure
from jointlaw.kernels.stiffness import stiffness_of

R = 1e-6  # closure range, m


@pytest.mark.parametrize("seed", [0, 1, 3, 4, 7, 8, 9, 10, 11, 18])
def test_the_tangent_stays_below_both_bounds(seed):
    rng, law = np.random.default_rng(seed), random_law(seed)
    joints, far, closest = law.joints(20), rng.choice([1.0, 100.0]), 0.0
    closed, sheared = np.zeros(20), np.zeros(20)
    for k in range(16):
        d = R * rng.normal(0.0, 0.3, (20, law.tables.dim))
        d[:, 1:] *= far
        if k % 3:
            d[:, 0] = R * rng.uniform(0.05, 1.0, 20) - joints.delta[:, 0]
        C = joints.update(d)[1]
        closed = np.maximum(closed, joints.delta[:, 0])
        sheared = np.maximum(sheared, np.linalg.norm(joints.delta[:, 1:], axis=1))
        now, most = joints.max_stiffness(), law.max_stiffness(closed, sheared)
        size = np.linalg.norm(C, 2, axis=(1, 2))
        assert np.all(size <= now * (1.0 + 1e-12))  # equal for one facet without friction
        assert np.all(now <= most * (1.0 + 1e-12))
        closest = max(closest, np.max(size[now > 0] / now[now > 0], initial=0.0))
    assert closest > 0.2  # a bound, but not an empty one


@pytest.mark.parametrize("eta", [0.0, 0.5])
def test_heights_of_two_groups_are_bounded(eta):
    """Few asperities touch long before many do: |C| is far above the bound of other heights."""
    heights = jl.Heights(((0.02, 0.0, 0.98), (0.0, 0.02 * R, R, 1.05 * R)), 0.02 * R)
    law = jl.JointLaw(
        orientation=jl.Orientation(10.0), asperity=jl.Asperity(2e8, 1.2, eta, 0.6),
        heights=heights, asperity_density=1e10, closure_range=2 * R,
        resolution=jl.Resolution(3, 6, 1), plane=0.0,
    )  # fmt: skip
    closure = (0.98 + 0.1 * np.geomspace(1e-6, 1.0, 60)) * R
    joints, still = law.joints(60), np.zeros(60)
    joints.update(np.stack([closure, still], axis=1))
    joints.update(np.stack([still, still + 2.4 * R], axis=1))
    C = joints.trial(np.tile([-1e-5 * R, -1e-4 * R], (60, 1)))[1]
    k, share = law.tables.asperities, np.linalg.norm(C, 2, axis=(1, 2)) / joints.max_stiffness()
    assert share.max() <= 1.0
    others = (1.0 + 0.6) * law.curve.force(closure)[1] * np.sum(k.area / k.c1)
    assert (np.linalg.norm(C, 2, axis=(1, 2)) / others).max() > 2.0  # the bound of other heights


def test_slopes_that_fade_at_once_are_bounded():
    """Normal forces and friction limits turn: |C| is far above the bound of straight slopes."""
    rng = np.random.default_rng(0)
    law = jl.JointLaw(
        orientation=jl.Orientation(1.0), asperity=jl.Asperity(1e7, 1.2, 0.0, 1.0),
        asperity_density=1e10, closure_range=R, mating_length=0.1 * R, plane=0.0,
    )  # fmt: skip
    joints, straight, most = law.joints(60), replace(law, mating_length=np.inf).tables, 0.0
    for _ in range(20):
        d = 0.1 * R * rng.normal(size=(60, 2))
        d[:, 0] = R * rng.uniform(0.05, 4.0, 60) - joints.delta[:, 0]
        size = np.linalg.norm(joints.update(d)[1], 2, axis=(1, 2))
        assert (size <= joints.max_stiffness()).all()
        y = effective_closure(law.tables.asperities, joints.delta.T, np.ones(60))
        most = max(most, np.max(size / stiffness_of(straight.asperities, y)))
    assert most > 1.5


def test_an_unmated_joint_has_a_step_at_its_negative_closure(make_law):
    law = make_law(mating_length=2e-5, plane=0.0)
    joints = law.joints(1, mated=False)
    for _ in range(60):
        F, _ = joints.update([[1e-8, 0.0]], tangent=False)
    closure, shear = joints.delta[0]
    assert closure < 0.0 < F[0, 0]
    given = law.critical_time_step(1.0, 1.0, closure, shear)
    assert given == pytest.approx(joints.critical_time_step(1.0, 1.0)[0], rel=0.3)
    assert given <= joints.critical_time_step(1.0, 1.0)[0]


def test_the_step_of_a_batch_is_that_of_each_joint_as_it_is():
    law = jl.presets.load("westerly-smooth")
    joints = law.joints(3)
    joints.update([[1e-6, 0.0, 0.0], [2e-6, 1e-6, 0.0], [-1e-6, 0.0, 0.0]])
    steps = joints.critical_time_step([2.0, 4.0, 1.0], 0.5)
    assert steps[0] == pytest.approx(law.critical_time_step(2.0, 0.5, 1e-6), rel=1e-14)
    assert steps[1] >= law.critical_time_step(4.0, 0.5, 2e-6, 1e-6)
    assert steps[2] == math.inf  # open
    stiffness = joints.max_stiffness()
    assert steps[:2] == pytest.approx(2 * np.sqrt([4.0, 8.0] / stiffness[:2]), rel=1e-14)


@pytest.mark.parametrize("given", [(0, 1, 1e-6), (1, -1, 1e-6), (1, 1, np.nan), (1, 1, 1e-6, -1)])
def test_arguments_out_of_bounds(given):
    law = jl.presets.load("linear-a3")
    with pytest.raises(ValueError, match=r"(mass|area|closure|shear) = "):
        law.critical_time_step(*given)
    with pytest.raises(ValueError, match=r"area has shape \(2, 3\): give a number or \(3,\)"):
        law.joints(3).critical_time_step(1.0, np.ones((2, 3)))
