"""The tangent against central differences: a V-curve of slope 2, then rounding. The bound of |C|
and the explicit time step that follows from it: in touch, open, sheared far."""

import math
from dataclasses import replace

import numpy as np
import pytest
from builders import law
from c_host import random_law

import jointlaw as jl
from jointlaw.kernels.asperities import effective_closure
from jointlaw.kernels.stiffness import stiffness_of

STEPS = np.geomspace(3e-3, 3e-7, 30)  # in closure ranges

# name: law, steps that lead to the state, the step whose tangent is checked
STATES = {
    "stick": ({"mu": 5.0}, [[0.5, 0.02, 0.01]], [0.21, 0.03, -0.02]),
    "slip": ({"mu": 0.3, "a": 8.0}, [[0.6, 0.0, 0.0], [0.0, 0.9, 0.3]], [-0.13, 0.5, 0.4]),
    "mixed": ({"mu": 0.4}, [[0.6, 0.0, 0.0], [0.05, 0.1, 0.04]], [0.11, 0.15, 0.06]),
    "unloading": ({"mu": 0.4}, [[0.9, 0.1, 0.0], [0.0, 0.15, 0.1]], [-0.15, -0.05, -0.04]),
    "parted": ({"mu": 0.4, "a": 1.2}, [[0.4, 0.0, 0.0], [0.1, 0.8, 0.5]], [-0.31, 0.15, 0.19]),
    "touching": ({"mu": 0.4, "a": 2.3}, [[-0.2, 0.3, 0.1]], [0.57, 0.25, 0.13]),
}
IS = {
    "stick": lambda joint: joint.measures().slipping == 0.0,
    "slip": lambda joint: joint.measures().sliding > 1.0 - 1e-12,
    "mixed": lambda joint: 0.1 < joint.measures().slipping < 0.9,
    "unloading": lambda joint: joint.measures().slipping < 0.5,
    "parted": lambda joint: 0.0 < joint.measures().separated < 1.0,
    "touching": lambda joint: joint.measures().separated < 0.5,
}
FEW = {"resolution": jl.Resolution(2, 4, 3)}  # a facet that yields has more kinks in a cell
OPTIONS = {
    "plain": {},
    "population": {"formation": "population"},
    "individual": {"formation": "individual"},
    "fading": {"mating_length": 0.7},
    "fading soon, heights": {"mating_length": 0.15, "formation": "population"},
    "concave stiffness": {"eta": 0.2},
    "bond": {"bond": jl.Bond(1.0, 0.7, 0.05, 0.1, energy_I=0.1, energy_II=0.5)},
    "yielding": {"damage": {"yield_interference": 0.3}, **FEW},
    "yielding of both sides": {"damage": {"yield_interference": 0.2}, "mating_length": 0.5, **FEW},
    "yielding and wear": {
        **FEW,
        "damage": {"yield_interference": 0.3},
        "mating_length": 0.5,
        "slope_wear": 0.5,
        "formation": "population",
    },
}


def v_curve(copies, d):
    """Relative error of the tangent at the step d for every difference step.

    `copies` hold one and the same state, 2 dim for every difference step.
    """
    dim = len(d)
    nudge = (STEPS[:, None, None, None] * np.eye(dim)[:, None] * [[1.0], [-1.0]]).reshape(-1, dim)
    F = copies.trial(d + nudge, tangent=False)[0].reshape(len(STEPS), dim, 2, dim)
    difference = (F[:, :, 0] - F[:, :, 1]) / (2.0 * STEPS[:, None, None])
    exact = copies.trial(d[None], where=[0])[1][0]
    return np.abs(difference - exact.T).max(axis=(1, 2)) / np.abs(exact).max()


def descent_slope(errors):
    """Slope of the V-curve over the six steps above ten times rounding."""
    last = int(np.argmin(errors))
    while last > 5 and errors[last] < 2e-10:
        last -= 1
    part = slice(last - 5, last + 1)
    return np.polyfit(np.log(STEPS[part]), np.log(errors[part]), 1)[0]


IN_PLANE = "plain", "fading soon, heights", "yielding and wear"


@pytest.mark.parametrize(
    ("option", "plane"), [*((o, None) for o in OPTIONS), *((o, 0.6) for o in IN_PLANE)]
)
@pytest.mark.parametrize("state", STATES)
def test_tangent(state, option, plane):
    parameters, path, d = STATES[state]
    one = law(**parameters, **OPTIONS[option], plane=plane)
    dim = 3 if plane is None else 2
    joint, copies = one.joint(), one.joints(2 * dim * len(STEPS))
    for step in path:
        joint.update(step[:dim])
        copies.update(np.tile(step[:dim], (len(copies), 1)), tangent=False)
    d = np.array(d[:dim])
    curves = [v_curve(copies, (1.0 + 0.02 * k) * d) for k in range(3)]
    # second order wherever no slider changes branch within the difference: a wrong tangent is
    # wrong at all three steps, a kink spoils one
    slope, least = min(
        ((descent_slope(curve), curve.min()) for curve in curves), key=lambda v: abs(v[0] - 2.0)
    )
    assert slope == pytest.approx(2.0, abs=0.1)
    assert least < 1e-8  # eps^(2/3) of rounding is 4e-11; the promise is 1e-8
    joint.update(d)
    assert OPTIONS[option].keys() & {"damage", "mating_length"} or IS[state](joint)


def test_shear_while_the_joint_closes_is_softer_than_shear_of_the_closed_joint():
    """The ratios that docs/limits.md gives, at 1 to 20 MPa."""
    stated = {"westerly-smooth": (0.53, 0.64), "westerly-rough": (0.50, 0.53),
              "biegel-smooth": (0.45, 0.53), "biegel-rough": (0.55, 0.58),
              "jing-replica": (0.15, 0.19), "nonlinear-a6": (0.67, 0.67),
              "linear-a6": (1.0, 1.0)}  # fmt: skip
    for name, (least, most) in stated.items():
        law, ratio = jl.presets.load(name), []
        for closure in law.closure(np.array([1e6, 5e6, 20e6])):
            joint = law.joint()
            closing = joint.update([closure, 0.0, 0.0])[1]
            closed = joint.trial([0.0, 1e-6 * closure, 0.0])[1]
            ratio.append(closing[1, 1] / closed[1, 1])
        assert min(ratio) == pytest.approx(least, abs=6e-3), name  # two digits
        assert max(ratio) == pytest.approx(most, abs=6e-3), name


R = 1e-6  # closure range, m


@pytest.mark.parametrize("seed", [0, 1, 3, 4, 7, 8, 9, 10, 11, 12, 18, 19])
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


def test_the_bound_of_heights_of_one_group_has_no_further_part(make_law):
    """On the virgin curve it is (1 + mu) times the stiffness of the springs: h1 = h2 = 0."""
    law = make_law()
    closure = law.closure_range * np.linspace(0.2, 1.0, 5)
    k, mu = law.tables.asperities, law.asperity.mu
    springs = law.curve.force(closure)[1] * np.sum(k.area / k.c1)
    assert law.max_stiffness(closure) == pytest.approx((1.0 + mu) * springs, rel=1e-12)


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
