"""Time steps of bodies with several joints: against eigenvalues, and in explicit steps."""

from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from dem_demo.dynamics.simulation import Simulation
from dem_demo.dynamics.timestep import TimeStepLimit
from dem_demo.scene import load

AREA = 0.5  # m2
STIFFNESS = 1e9  # Pa/m, of the linear joints of the runs
LAW = jl.CoulombLaw(STIFFNESS, STIFFNESS, friction=np.inf, tension=1e20, cohesion=1e60, plane=0.0)


def chain(n, parallel=1):
    """First and second bodies of n masses in a row on a base, with joints in parallel."""
    upper = np.repeat(np.arange(n), parallel)
    lower = np.where(upper == 0, n, upper - 1)
    return upper, lower


def exact_step(first, second, mass, k, points, centres, inertia):
    """2/omega of bodies in a plane whose joints have the stiffness k (joints,) in both directions.

    points, centres: positions (joints, 2) and (bodies, 2) in m. Independent of the bound: the
    eigenvalues of the assembled matrices.
    """
    bodies = len(mass)
    K = np.zeros((3 * bodies, 3 * bodies))
    for a, b, stiffness, point in zip(first, second, k, points, strict=True):
        B = np.zeros((2, 3 * bodies))
        for body, sign in ((a, 1.0), (b, -1.0)):
            x, y = point - centres[body]
            B[:, 3 * body : 3 * body + 3] += sign * np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
        K += stiffness * B.T @ B
    root = np.sqrt(np.stack([1 / mass, 1 / mass, 1 / inertia], axis=1).ravel())
    return 2.0 / np.sqrt(np.linalg.eigvalsh(root[:, None] * K * root).max())


@pytest.mark.parametrize("seed", range(40))
def test_it_is_never_longer_than_the_exact_step(seed):
    rng = np.random.default_rng(seed)
    bodies, joints = rng.integers(2, 12), rng.integers(1, 30)
    first = rng.integers(0, bodies, joints)
    second = (first + rng.integers(1, bodies, joints)) % bodies
    mass = 10.0 ** rng.uniform(-2.0, 3.0, bodies)
    mass[0] = np.inf
    inertia = mass * 10.0 ** rng.uniform(-2.0, 0.0, bodies)
    area = rng.uniform(0.1, 2.0, joints)
    stiffness = 10.0 ** rng.uniform(7.0, 10.0, joints)
    centres, points = rng.normal(size=(bodies, 2)), rng.normal(size=(joints, 2))
    arm = np.linalg.norm(points[:, None] - centres[np.stack([first, second], axis=1)], axis=2)
    exact = exact_step(first, second, mass, area * stiffness, points, centres, inertia)
    dt = jl.stable_time_step(first, second, mass, area, stiffness, inertia, arm)
    assert dt <= exact * (1.0 + 1e-12)
    assert dt >= 0.4 * exact  # of the same size
    without = jl.stable_time_step(first, second, mass, area, stiffness)
    fixed = jl.stable_time_step(first, second, mass, area, stiffness, np.full(bodies, np.inf), arm)
    assert dt < without == fixed


@pytest.mark.parametrize(("n", "parallel"), [(1, 1), (1, 4), (2, 1), (8, 1), (30, 1), (8, 4)])
def test_it_is_exact_in_a_row(n, parallel):
    """omega = 2 sqrt(k/m) cos(pi/(2 n + 1)) of n equal masses on a base."""
    first, second = chain(n, parallel)
    mass = np.append(np.full(n, 3.0), np.inf)
    dt = jl.stable_time_step(first, second, mass, AREA, STIFFNESS)
    omega = 2.0 * np.sqrt(parallel * AREA * STIFFNESS / 3.0) * np.cos(np.pi / (2 * n + 1))
    assert dt == pytest.approx(2.0 / omega, rel=2e-3)
    assert dt <= 2.0 / omega * (1.0 + 1e-12)


def largest_growth(n, parallel, fraction, steps=1500):
    """Largest velocity over the first one in explicit steps at this fraction of the stable step."""
    first, second = chain(n, parallel)
    mass = np.append(np.full(n, 3.0), np.inf)
    joints = LAW.joints(len(first))
    dt = fraction * jl.stable_time_step(first, second, mass, AREA, joints.max_stiffness())
    velocity = np.append(1e-6 * np.random.default_rng(0).normal(size=n), 0.0)
    start = largest = np.abs(velocity).max()
    force = np.zeros(n + 1)
    d = np.zeros((len(first), 2))
    for _ in range(steps):
        velocity = velocity + dt * force / mass
        largest = max(largest, np.abs(velocity).max())
        if largest > 1e6 * start:
            break
        d[:, 0] = dt * (velocity[second] - velocity[first])
        F, _ = joints.update(d, tangent=False)
        force = np.bincount(first, AREA * F[:, 0], n + 1) - np.bincount(
            second, AREA * F[:, 0], n + 1
        )
    return largest / start


@pytest.mark.parametrize(("n", "parallel"), [(1, 1), (1, 4), (2, 1), (8, 1), (50, 1), (8, 4)])
def test_steps_of_joints_in_series_and_in_parallel(n, parallel):
    assert largest_growth(n, parallel, 0.95) < 20.0
    assert largest_growth(n, parallel, 1.05) > 1e6


def test_a_wedged_block():
    """Between faces at 60 degrees: 0.95 of the step is stable, the step for one joint is not."""
    normals = np.array([[np.cos(a), np.sin(a)] for a in np.radians([-30.0, 210.0])])
    normals = np.repeat(normals, 2, axis=0)  # two joints on each face
    shears = np.stack([-normals[:, 1], normals[:, 0]], axis=1)

    def growth(dt, steps=1500):
        joints = LAW.joints(4)
        velocity = np.array([1e-6, 0.7e-6])
        largest = 0.0
        for _ in range(steps):
            d = dt * np.stack([normals @ velocity, shears @ velocity], axis=1)
            F, _ = joints.update(d, tangent=False)
            force = -AREA * (F[:, 0] @ normals + F[:, 1] @ shears)
            velocity = velocity + dt * force / 3.0
            largest = max(largest, np.abs(velocity).max())
            if largest > 1.0:
                break
        return largest / 1e-6

    stiffness = LAW.joints(4).max_stiffness()
    dt = jl.stable_time_step([0] * 4, [1] * 4, [3.0, np.inf], AREA, stiffness)
    one_joint = LAW.joints(1).critical_time_step(3.0, AREA)[0]
    assert growth(0.95 * dt) < 20.0
    assert growth(0.95 * one_joint) > 1e6


def test_bodies_that_nothing_resists():
    assert jl.stable_time_step([0], [1], [1.0, 2.0], 1.0, 0.0) == np.inf
    assert jl.stable_time_step([], [], [1.0], 1.0, 1e9) == np.inf
    assert jl.stable_time_step([0], [1], [np.inf, np.inf], 1.0, 1e9) == np.inf


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"first": [2]}, "first = .*indices of bodies, from 0 to 1"),
        ({"second": [0.5]}, "second = .*indices of bodies"),
        ({"second": [0]}, "two different bodies"),
        ({"first": [0, 1]}, "two different bodies"),
        ({"mass": [1.0, 0.0]}, "mass = .*must be > 0"),
        ({"mass": 1.0}, "one number for each body"),
        ({"area": -1.0}, "area = .*must be > 0"),
        ({"area": [1.0, 1.0]}, "area has shape"),
        ({"stiffness": -1.0}, "stiffness = .*must be >= 0"),
        ({"stiffness": np.nan}, "stiffness = .*not finite"),
        ({"inertia": [1.0, 1.0]}, "arm"),
        ({"arm": [[1.0, 1.0]]}, "arm is given without inertia"),
        ({"inertia": [1.0], "arm": [[1.0, 1.0]]}, r"inertia has shape \(1,\)"),
    ],
)
def test_invalid_arguments(changes, message):
    valid = {"first": [0], "second": [1], "mass": [1.0, 1.0], "area": 1.0, "stiffness": 1e9}
    with pytest.raises(ValueError, match=message):
        jl.stable_time_step(**(valid | changes))


@pytest.mark.parametrize("name", ["arch", "slope-azimuth"])
def test_the_step_of_blocks_is_a_little_longer(name):
    """Blocks compute the eigenvalues of the assembled stiffness; this bound of them is cheap.

    Without dashpots, which `stable_time_step` does not have: 0.87 to 0.91 of the exact limit.
    """
    sim = Simulation(load(name))
    undamped = replace(sim.scene.run, dashpot_normal=0.0, dashpot_shear=0.0)
    limit = TimeStepLimit()
    limit.update(replace(sim.scene, run=undamped), sim.blocks, sim.contacts, sim.joints)
    rows = sim.contacts
    with np.errstate(divide="ignore"):
        mass, _, inertia = 1.0 / sim.blocks.inverse_sqrt_inertia.T**2
    arm = np.linalg.norm(rows.kinematics[:, :, [2, 5]], axis=1)
    bodies = rows.block_a, rows.block_b
    stiffness = limit.checked_stiffness  # times area
    dt = jl.stable_time_step(*bodies, mass, 1.0, stiffness, inertia, arm)
    assert 0.87 * limit.current < dt < 0.91 * limit.current
