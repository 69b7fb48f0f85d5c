"""Failure of blocks against limit analysis, and against strengths calculated by hand."""

import itertools
from dataclasses import replace

import numpy as np
import pytest
from running import until
from scene_text import ROCK, block, coulomb, dipping, on_base
from scipy.optimize import bisect, linprog
from scipy.sparse import diags, hstack

from dem_demo import Simulation, load, parse
from dem_demo.contact import ContactManager
from dem_demo.dynamics.blocks import Blocks
from dem_demo.dynamics.timestep import closure_and_shear_rates
from dem_demo.output.run import run_to_failure
from dem_demo.studies.strength import LOG_FACTOR, factor_of_safety, settled, weakened

FACTOR_TOLERANCE = LOG_FACTOR.tolerance  # relative, of a factor of safety

SLOPE = """
[[rock]]
name = "slope"
outline = [[-22, -2], [12, -2], [12, 0], [0, 0], [-9, 12], [-22, 12]]
seed = {seed}
[[rock.set]]
dip = 30.0
spacing = {spacing}
scatter = 0.2
through = [-0.2, 0.6]
[[rock.set]]
dip = {dip}
spacing = {across}
scatter = 0.3
persistence = {persistence}
[[rock.fixed]]
corners = [[-40, -5], [13, -5], [13, 0.2], [0.3, 0.31], [-34, 20.12], [-40, 20]]
[run]
end = 1.0
"""


def upper_factor(scene, low=0.25, high=4.0, tolerance=1e-3):
    """Upper bound of the factor of safety of Coulomb joints without cohesion, by bisection.

    A scene is stable only if compressive joint forces within the friction cones balance every
    block. Their existence is a linear program, whatever the stiffnesses of the joints. The largest
    factor at which such forces exist is thus an upper bound. Joints that dilate by their friction
    angle (associated flow) reach it; joints without dilation may fail before, as their forces
    follow from displacements.
    """
    blocks = Blocks(scene)
    manager = ContactManager(scene, blocks.motion)
    manager.rebuild(blocks.motion, blocks.neighbour_pairs())
    contacts = manager.contacts
    bearing = np.flatnonzero(contacts.length > 0)
    k = len(contacts.length)
    rates = -closure_and_shear_rates(blocks, contacts)
    directions = rates[np.concatenate([bearing, k + bearing])].T  # of normal and shear forces
    friction = np.array([law.friction for law in scene.laws.values()])[manager.law[bearing]]
    n = len(bearing)
    normal = directions[:, :n]
    shear = directions[:, n:]
    load = ((blocks.gravity + blocks.loads) * blocks.inverse_sqrt_inertia)[blocks.is_free]
    scale = np.abs(load).max()

    def stability(factor):
        # a joint force is a non-negative sum of forces along the normal and the edges of the cone
        across = normal @ diags(factor / friction)
        balance = hstack([normal, across + shear, across - shear]).tocsr()
        solution = linprog(np.zeros(3 * n), A_eq=balance, b_eq=-load / scale, bounds=(0, None))
        return 1.0 if solution.status == 0 else -1.0

    return bisect(stability, low, high, xtol=tolerance)


def slope(**keys):
    scene = parse(f"[laws.rock]\n{coulomb(0.7002, 5e9, 2e9)}" + SLOPE.format(**keys))
    assert len(scene.rocks[0].free) >= 100
    return scene


def rotation_ratio(scene):
    """Radius times rotation over displacement: median of the blocks that move far."""
    record, _ = run_to_failure(settled(scene), 0.3)
    moves_far = record.distances > 0.5 * record.distances.max()
    radius = np.array([block.reach for block in scene.blocks])
    rotation = np.abs(record.motion[-1][2] - record.motion[0][2]) * radius
    return np.median(rotation[moves_far] / record.distances[moves_far])


@pytest.mark.slow
def test_a_sliding_slope_has_the_factor_of_limit_analysis():
    """Steep cross joints with rock bridges: beds slide at tan(35 degrees)/tan(30 degrees)."""
    scene = slope(spacing=0.45, dip=-75.0, across=1.3, persistence=0.8, seed=2)
    upper = upper_factor(scene)
    factor = factor_of_safety(scene)
    assert upper == pytest.approx(0.7002 / np.tan(np.radians(30)), rel=2e-3)
    assert factor == pytest.approx(upper, rel=0.02)
    assert factor < upper * (1 + FACTOR_TOLERANCE)
    assert rotation_ratio(weakened(scene, 1.05 * factor)) < 0.01


@pytest.mark.slow
def test_a_toppling_slope_has_a_lower_factor_than_limit_analysis():
    """Columns across the beds topple before the mass slides. Limit analysis finds the most
    favourable forces; the forces of joints without dilation follow from their displacements."""
    scene = slope(spacing=0.7, dip=-60.0, across=1.0, persistence=1.0, seed=1)
    upper = upper_factor(scene)
    factor = factor_of_safety(scene)
    assert upper < 0.9 * 0.7002 / np.tan(np.radians(30))
    assert 0.85 * upper < factor < 0.98 * upper
    assert rotation_ratio(weakened(scene, 1.05 * factor)) > 0.05


def test_limit_analysis_of_one_block_agrees_with_a_hand_calculation():
    """A block of 3 m by 1.5 m on a plane of 25 degrees; a narrow one topples at any friction."""
    text = on_base(coulomb(0.7002), [3.0, 1.5], 25.0)
    by_hand = 0.7002 / np.tan(np.radians(25.0))
    assert upper_factor(parse(text)) == pytest.approx(by_hand, rel=2e-3)
    with pytest.raises(ValueError, match="different signs"):  # no friction holds it
        upper_factor(parse(text.replace("box = [3.0, 1.5]", "box = [0.6, 1.5]")))


@pytest.mark.parametrize(
    ("height", "phi", "mode"),
    [
        (10.0, 40.1, "stable"),  # phi above the dip, and 10/10 above tan(40 degrees) = 0.839
        (5.0, 24.0, "slides"),  # width over height above tan(24 degrees) = 0.445
        (20.0, 24.0, "slides"),  # 0.5: a sticking block would topple, but it slides first
        (25.0, 24.0, "topples"),  # 0.4
        (40.0, 24.0, "topples"),  # 0.25
    ],
)
def test_a_block_on_a_slope_is_stable_slides_or_topples(height, phi, mode):
    """3DEC's sliding block: 10 m wide, on a slope of 40 degrees, joint of 10 MPa/m."""
    friction = np.tan(np.radians(phi))
    down, on = dipping(40.0)
    text = on_base(coulomb(friction, 1e7, 1e7), [10.0, height], 40.0, [80.0, 20.0], end=1.5)
    sim = Simulation(parse(text + "dashpot_normal = 1.0\ncorner_length = 4.0\n"))
    x, _, angle = sim.blocks.motion[:3, 1].copy()
    until(sim, sim.scene.run.end)
    slip = sim.blocks.motion[0, 1] - x
    rotation = np.degrees(sim.blocks.motion[2, 1] - angle)
    if mode == "stable":
        assert abs(slip) < 1e-6
        assert abs(rotation) < 1e-6
    elif mode == "slides":  # as a point mass; it rocks as the joint closes under its toe
        acceleration = down + friction * on
        assert slip == pytest.approx(0.5 * acceleration * sim.time**2, rel=0.1)
        assert abs(rotation) < 1.0
    else:
        assert rotation < -5.0


WEDGE = """
[[block]]
name = "left"
corners = [[-6.0, 0.0], [-1.5, 0.0], [0.0, {height}], [-6.0, {height}]]
fixed_motions = ["y", "turn"]
load = [{push}, 0.0]
[[block]]
name = "right"
corners = [[1.5, 0.0], [6.0, 0.0], [6.0, {height}], [0.0, {height}]]
fixed_motions = ["y", "turn"]
load = [-{push}, 0.0]
[[block]]
name = "wedge"
corners = [[-1.5, 0.0], [1.5, 0.0], [0.0, {height}]]
[run]
end = 0.2
"""


@pytest.mark.parametrize(
    ("half_angle", "phi", "push"),
    [
        (20, 35, 1e5),
        (10, 45, 3e5),  # the walls stand against each other as columns do
        pytest.param(30, 35, 4e5, marks=pytest.mark.slow),
        pytest.param(30, 45, 2e5, marks=pytest.mark.slow),
        pytest.param(40, 45, 1e6, marks=pytest.mark.slow),
        pytest.param(25, 30, 3e5, marks=pytest.mark.slow),
    ],
)
def test_a_roof_wedge_drawn_with_its_apex(half_angle, phi, push):
    """Three blocks meet in a point, where no wall bears load: both walls press on the wedge."""
    angle = np.radians(half_angle)
    mu = np.tan(np.radians(phi))
    height = 1.5 / np.tan(angle)
    half_weight = 0.5 * 2600.0 * 9.81 * 1.5 * height  # N
    law = f"[laws.j]\n{coulomb(mu)}"
    scene = parse(law + WEDGE.format(height=height, push=push))
    normal = push * np.cos(angle) - half_weight * np.sin(angle)
    shear = push * np.sin(angle) + half_weight * np.cos(angle)
    assert factor_of_safety(scene) == pytest.approx(mu * normal / shear, rel=FACTOR_TOLERANCE)


@pytest.mark.parametrize("energy", ["", "energy_I = 200.0, energy_II = 200.0, "])
@pytest.mark.parametrize("times", [1.05, 2.0, 4.0, 10.0])
def test_a_block_hangs_from_a_bond(times, energy):
    """Displaced by W/kn, with its bond intact; the asperities are a hundred times softer."""
    weight = 2600 * 9.81
    strength = f"tension = {times * weight}, cohesion = {times * weight}, {energy}"
    law = f"{ROCK}bond = {{ {strength}normal_stiffness = 1e9, shear_stiffness = 5e8 }}\n"
    roof = block("roof", box=[4.0, 1.0], at=[0.0, 1.0], fixed=True)
    text = f"[laws.j]\n{law}{roof}{block('b', box=[1.0, 1.0])}[run]\nend = 1.0\n"
    sim = Simulation(parse(text))
    assert not sim.unstable.any()
    assert not sim.joints.damage.any()
    assert sim.blocks.motion[1, 1] == pytest.approx(-weight / 1e9, rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("brittle", [False, True], ids=["lasting", "brittle"])
@pytest.mark.parametrize(
    ("dip", "phi", "cohesion"),
    [(35, 30, 10e3), (45, 35, 20e3), (60, 30, 40e3), (60, 0, 40e3)],
)
def test_a_block_stabilised_by_cohesion(dip, phi, cohesion, brittle):
    """Lasting cohesion adds to friction: (c A + W cos tan phi)/(W sin). Where cohesion is lost
    after the peak, the block is stable while its upper end is below the peak, or while the lower
    end and the residual strength of the upper end bear it, whichever is larger. The moment of the
    weight presses the block onto its lower end."""
    mu = np.tan(np.radians(phi))
    down, on = dipping(dip)
    residual = {"residual_cohesion": 0.0} if brittle else {}
    law = coulomb(mu, cohesion=cohesion, tension=cohesion, **residual)
    # Pa, means over the base
    normal = -2600.0 * 1.5 * on
    shear = 2600.0 * 1.5 * down
    upper, lower = normal - shear * np.array([0.5, -0.5])  # 2 (1.5 m / 2) over 3 m
    expected = (cohesion + mu * normal) / shear
    if brittle:
        peak = (cohesion + mu * upper) / shear
        expected = max(peak, 0.5 * (cohesion + mu * lower + mu * upper) / shear)
    assert factor_of_safety(parse(on_base(law, [3.0, 1.5], dip))) == pytest.approx(
        expected, rel=0.01
    )


@pytest.mark.slow
def test_slope_with_rock_bridges_fails_step_by_step_as_its_strength_falls():
    """The shipped scene, weakened slowly in a run: the bridges break one after the other.

    It is stable a little below its factor of safety, which follows from equilibria of virgin
    joints, and fails a little above.
    """
    scene = load("bridges")
    assert Simulation(load("bridges-weathered")).unstable.any()
    factor = factor_of_safety(scene)
    run = replace(scene.run, fraction=0.5, law_steps=1, dashpot_normal=0.3, dashpot_shear=0.3)
    sim = Simulation(replace(weakened(scene, 1.15 * factor), reduction=1.0, run=run))
    start = sim.blocks.motion[:2].copy()
    displacement = []
    broken = [(sim.joints.damage == 1.0).sum()]
    for low, high in itertools.pairwise([1.0, 0.5 + 0.5 * factor, 0.96 * factor, 1.15 * factor]):
        for reduction in np.append(np.linspace(low, high, 1000), np.full(3000, high)):
            sim.joints.reduction[1] = reduction  # of the shear strength
            sim.step()
        displacement.append(np.abs(sim.blocks.motion[:2] - start).max())
        broken.append((sim.joints.damage == 1.0).sum())
    assert displacement[1] < 2e-3 < 1e-2 < displacement[2]
    assert (np.diff(broken) > 0).all()
