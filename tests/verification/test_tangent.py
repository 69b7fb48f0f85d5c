"""Consistent tangent against central differences: a V-curve of slope 2, then rounding. The bound of
|C| and the critical time step that follows from it: in touch, open, after large shear."""

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import law
from c_host import random_law

import jointlaw as jl
from jointlaw.kernels.asperities import effective_closure
from jointlaw.kernels.stiffness import stiffness_bound

STEPS = np.geomspace(3e-3, 3e-7, 30)  # in closure ranges

# name: law, steps that lead to the state, the step whose tangent is checked
STATES = {
    "stick": ({"mu": 5.0}, [[0.5, 0.02, 0.01]], [0.21, 0.03, -0.02]),
    "slip": ({"mu": 0.3, "a": 8.0}, [[0.6, 0.0, 0.0], [0.0, 0.9, 0.3]], [-0.13, 0.5, 0.4]),
    "mixed": ({"mu": 0.4}, [[0.6, 0.0, 0.0], [0.05, 0.1, 0.04]], [0.11, 0.15, 0.06]),
    "unloading": ({"mu": 0.4}, [[0.9, 0.1, 0.0], [0.0, 0.15, 0.1]], [-0.15, -0.05, -0.04]),
    "partly separated": (
        {"mu": 0.4, "a": 1.2},
        [[0.4, 0.0, 0.0], [0.1, 0.8, 0.5]],
        [-0.31, 0.15, 0.19],
    ),
    "touching": ({"mu": 0.4, "a": 2.3}, [[-0.2, 0.3, 0.1]], [0.57, 0.25, 0.13]),
}
IS_IN_STATE = {
    "stick": lambda joint: joint.measures().slipping == 0.0,
    "slip": lambda joint: joint.measures().sliding > 1.0 - 1e-12,
    "mixed": lambda joint: 0.1 < joint.measures().slipping < 0.9,
    "unloading": lambda joint: joint.measures().slipping < 0.5,
    "partly separated": lambda joint: 0.0 < joint.measures().separated < 1.0,
    "touching": lambda joint: joint.measures().separated < 0.5,
}
COARSE = {"resolution": jl.Resolution(2, 4, 3)}  # a facet that yields has more kinks in a cell
OPTIONS = {
    "plain": {},
    "population": {"formation": "population"},
    "individual": {"formation": "individual"},
    "mating length": {"mating_length": 0.7},
    "short mating length, heights": {"mating_length": 0.15, "formation": "population"},
    "concave stiffness": {"eta": 0.2},
    "bond": {"bond": jl.Bond(1.0, 0.7, 0.05, 0.1, energy_I=0.1, energy_II=0.5)},
    "yielding": {"damage": {"yield_interference": 0.3}, **COARSE},
    "yielding with a mating length": {
        "damage": {"yield_interference": 0.2},
        "mating_length": 0.5,
        **COARSE,
    },
    "yielding and degradation": {
        **COARSE,
        "damage": {"yield_interference": 0.3},
        "mating_length": 0.5,
        "slope_wear": 0.5,
        "formation": "population",
    },
}


def v_curve(copies, d):
    """Relative error of the tangent at the step d for every difference step.

    `copies` are joints in the same state, 2 dim for every difference step.
    """
    dim = len(d)
    signs = [[1.0], [-1.0]]
    perturbation = (STEPS[:, None, None, None] * np.eye(dim)[:, None] * signs).reshape(-1, dim)
    F = copies.trial(d + perturbation, tangent=False)[0].reshape(len(STEPS), dim, 2, dim)
    difference = (F[:, :, 0] - F[:, :, 1]) / (2.0 * STEPS[:, None, None])
    exact = copies.trial(d[None], where=[0])[1][0]
    return np.abs(difference - exact.T).max(axis=(1, 2)) / np.abs(exact).max()


def descent_slope(errors):
    """Slope of the V-curve over the six steps above ten times rounding."""
    end = int(np.argmin(errors))
    while end > 5 and errors[end] < 2e-10:
        end -= 1
    part = slice(end - 5, end + 1)
    return np.polyfit(np.log(STEPS[part]), np.log(errors[part]), 1)[0]


IN_PLANE = "plain", "short mating length, heights", "yielding and degradation"


@pytest.mark.parametrize(
    ("option", "plane"), [*((o, None) for o in OPTIONS), *((o, 0.6) for o in IN_PLANE)]
)
@pytest.mark.parametrize("state", STATES)
def test_tangent_is_the_derivative_of_the_step(state, option, plane):
    parameters, path, d = STATES[state]
    one = law(**parameters, **OPTIONS[option], plane=plane)
    dim = 3 if plane is None else 2
    joint = one.joint()
    copies = one.joints(2 * dim * len(STEPS))
    for step in path:
        joint.update(step[:dim])
        copies.update(np.tile(step[:dim], (len(copies), 1)), tangent=False)
    d = np.array(d[:dim])
    curves = [v_curve(copies, (1.0 + 0.02 * k) * d) for k in range(3)]
    # second order wherever no slider changes branch within the difference: a wrong tangent is
    # wrong at all three steps, a kink spoils one
    best = min(curves, key=lambda curve: abs(descent_slope(curve) - 2.0))
    assert descent_slope(best) == pytest.approx(2.0, abs=0.1)
    assert best.min() < 1e-8  # eps^(2/3) of rounding is 4e-11; the promise is 1e-8
    joint.update(d)
    assert OPTIONS[option].keys() & {"damage", "mating_length"} or IS_IN_STATE[state](joint)


def test_shear_while_the_joint_closes_is_softer_than_shear_of_the_closed_joint():
    """The ratios of the two stiffnesses in docs/limits.md, at 1 to 20 MPa."""
    ranges = {"westerly-smooth": (0.53, 0.64), "westerly-rough": (0.50, 0.53),
              "biegel-smooth": (0.45, 0.53), "biegel-rough": (0.55, 0.58),
              "jing-replica": (0.15, 0.19), "nonlinear-a6": (0.67, 0.67),
              "linear-a6": (1.0, 1.0)}  # fmt: skip
    for name, (smallest, largest) in ranges.items():
        law = jl.presets.load(name)
        ratios = []
        for closure in law.closure(np.array([1e6, 5e6, 20e6])):
            joint = law.joint()
            while_closing = joint.update([closure, 0.0, 0.0])[1]
            after_closing = joint.trial([0.0, 1e-6 * closure, 0.0])[1]
            ratios.append(while_closing[1, 1] / after_closing[1, 1])
        assert min(ratios) == pytest.approx(smallest, abs=6e-3), name  # two digits
        assert max(ratios) == pytest.approx(largest, abs=6e-3), name


R = 1e-6  # closure range, m


@pytest.mark.parametrize("seed", [0, 1, 3, 4, 7, 8, 9, 10, 11, 12, 18, 19])
def test_the_tangent_stays_below_both_bounds(seed):
    rng = np.random.default_rng(seed)
    law = random_law(seed)
    joints = law.joints(20)
    shear_scale = rng.choice([1.0, 100.0])
    largest_ratio = 0.0
    max_closure = np.zeros(20)
    max_shear = np.zeros(20)
    for k in range(16):
        d = R * rng.normal(0.0, 0.3, (20, law.tables.dim))
        d[:, 1:] *= shear_scale
        if k % 3:
            d[:, 0] = R * rng.uniform(0.05, 1.0, 20) - joints.delta[:, 0]
        C = joints.update(d)[1]
        max_closure = np.maximum(max_closure, joints.delta[:, 0])
        max_shear = np.maximum(max_shear, np.linalg.norm(joints.delta[:, 1:], axis=1))
        bound = joints.max_stiffness()
        bound_of_path = law.max_stiffness(max_closure, max_shear)
        size = np.linalg.norm(C, 2, axis=(1, 2))
        assert np.all(size <= bound * (1.0 + 1e-12))  # equal for one facet without friction
        assert np.all(bound <= bound_of_path * (1.0 + 1e-12))
        ratios = size[bound > 0] / bound[bound > 0]
        largest_ratio = max(largest_ratio, np.max(ratios, initial=0.0))
    assert largest_ratio > 0.2  # the bound is not far too large


def test_the_bound_of_heights_of_one_group_has_no_additional_part(make_law):
    """Under first loading it is (1 + mu) times the stiffness of the springs: h1 = h2 = 0."""
    law = make_law()
    closure = law.closure_range * np.linspace(0.2, 1.0, 5)
    k = law.tables.asperities
    mu = law.asperity.mu
    springs = law.curve.force(closure)[1] * np.sum(k.area / k.c1)
    assert law.max_stiffness(closure) == pytest.approx((1.0 + mu) * springs, rel=1e-12)


@pytest.mark.parametrize("eta", [0.0, 0.5])
def test_heights_of_two_groups_are_bounded(eta):
    """A few asperities touch long before the others: |C| is far above the bound of one group."""
    heights = jl.Heights(((0.02, 0.0, 0.98), (0.0, 0.02 * R, R, 1.05 * R)), 0.02 * R)
    law = jl.JointLaw(
        orientation=jl.Orientation(10.0), asperity=jl.Asperity(2e8, 1.2, eta, 0.6),
        heights=heights, asperity_density=1e10, closure_range=2 * R,
        resolution=jl.Resolution(3, 6, 1), plane=0.0,
    )  # fmt: skip
    closure = (0.98 + 0.1 * np.geomspace(1e-6, 1.0, 60)) * R
    joints = law.joints(60)
    zeros = np.zeros(60)
    joints.update(np.stack([closure, zeros], axis=1))
    joints.update(np.stack([zeros, zeros + 2.4 * R], axis=1))
    C = joints.trial(np.tile([-1e-5 * R, -1e-4 * R], (60, 1)))[1]
    size = np.linalg.norm(C, 2, axis=(1, 2))
    assert (size / joints.max_stiffness()).max() <= 1.0
    k = law.tables.asperities
    bound_of_one_group = (1.0 + 0.6) * law.curve.force(closure)[1] * np.sum(k.area / k.c1)
    assert (size / bound_of_one_group).max() > 2.0


def test_a_short_mating_length_is_bounded():
    """Normal forces and friction limits rotate: |C| is far above the bound of constant slopes."""
    rng = np.random.default_rng(0)
    law = jl.JointLaw(
        orientation=jl.Orientation(1.0), asperity=jl.Asperity(1e7, 1.2, 0.0, 1.0),
        asperity_density=1e10, closure_range=R, mating_length=0.1 * R, plane=0.0,
    )  # fmt: skip
    joints = law.joints(60)
    constant_slopes = replace(law, mating_length=np.inf).tables.asperities
    largest_ratio = 0.0
    for _ in range(20):
        d = 0.1 * R * rng.normal(size=(60, 2))
        d[:, 0] = R * rng.uniform(0.05, 4.0, 60) - joints.delta[:, 0]
        size = np.linalg.norm(joints.update(d)[1], 2, axis=(1, 2))
        assert (size <= joints.max_stiffness()).all()
        y = effective_closure(law.tables.asperities, joints.delta.T, np.ones(60))
        ratio = np.max(size / stiffness_bound(constant_slopes, y))
        largest_ratio = max(largest_ratio, ratio)
    assert largest_ratio > 1.5


def test_an_unmated_joint_has_a_critical_time_step_at_its_negative_closure(make_law):
    law = make_law(mating_length=2e-5, plane=0.0)
    joints = law.joints(1, mated=False)
    for _ in range(60):
        F, _ = joints.update([[1e-8, 0.0]], tangent=False)
    closure, shear = joints.delta[0]
    assert closure < 0.0 < F[0, 0]
    step = law.critical_time_step(1.0, 1.0, closure, shear)
    assert step == pytest.approx(joints.critical_time_step(1.0, 1.0)[0], rel=0.3)
    assert step <= joints.critical_time_step(1.0, 1.0)[0]


def test_critical_time_steps_of_a_batch_are_for_the_state_of_each_joint():
    law = jl.presets.load("westerly-smooth")
    joints = law.joints(3)
    joints.update([[1e-6, 0.0, 0.0], [2e-6, 1e-6, 0.0], [-1e-6, 0.0, 0.0]])
    steps = joints.critical_time_step([2.0, 4.0, 1.0], 0.5)
    assert steps[0] == pytest.approx(law.critical_time_step(2.0, 0.5, 1e-6), rel=1e-14)
    assert steps[1] >= law.critical_time_step(4.0, 0.5, 2e-6, 1e-6)
    assert steps[2] == math.inf  # open
    stiffness = joints.max_stiffness()
    assert steps[:2] == pytest.approx(2 * np.sqrt([4.0, 8.0] / stiffness[:2]), rel=1e-14)


@pytest.mark.parametrize(
    "arguments", [(0, 1, 1e-6), (1, -1, 1e-6), (1, 1, np.nan), (1, 1, 1e-6, -1)]
)
def test_critical_time_step_refuses_arguments_out_of_bounds(arguments):
    law = jl.presets.load("linear-a3")
    with pytest.raises(ValueError, match=r"(mass|area|closure|shear) = "):
        law.critical_time_step(*arguments)
    with pytest.raises(ValueError, match=r"area has shape \(2, 3\): give a number or \(3,\)"):
        law.joints(3).critical_time_step(1.0, np.ones((2, 3)))
