"""The tilt test and the shear box of blocks: as the law alone says."""

import numpy as np
import pytest
from running import until

import jointlaw as jl
from dem_demo import Simulation, load, parse
from dem_demo.output.monitors import base_angle, look, watched_slips
from dem_demo.output.run import LOOKS
from dem_demo.scene.blocks import turn

BLOCK = """
gravity = {gravity}
[laws.plain]
kind = "coulomb"
normal_stiffness = 1e9
shear_stiffness = 1e9
friction = 0.5
[[block]]
name = "base"
box = [4.0, 1.0]
at = {base}
angle = {drawn}
held = ["x", "y"]
[[block]]
name = "top"
box = [1.0, 0.5]
at = {top}
angle = {drawn}
[[drive]]
block = "base"
motion = "turn"
times = [0.0, 0.5]
values = [0.0, {driven}]
[watch]
slip = [["top", "base"]]
[run]
end = 0.7
"""


def waiting(watch):
    """Is there a slip still to come?"""
    return any(slip["slip_angle"] is None for slip in watch.values())


def block(gravity=0.0, drawn=0.0, driven=0.0, gap=0.0, weight=9.81):
    """A block on a base: gravity turned, the base drawn at an angle, and driven on (degrees)."""
    down = turn(np.radians(gravity)) @ [0.0, -weight]
    out = turn(np.radians(drawn)) @ [0.0, 1.0]
    words = {"gravity": down.tolist(), "drawn": drawn, "driven": driven}
    words |= {"base": (-0.5 * out).tolist(), "top": ((0.25 + gap) * out).tolist()}
    return parse(BLOCK.format(**words) + ("step = 1e-4\n" if gap or not weight else ""))


@pytest.mark.parametrize(
    ("given", "angle"),
    [
        ({"gravity": 20.0}, 20.0),
        ({"gravity": -20.0}, 20.0),
        ({"drawn": 15.0}, 15.0),
        ({"drawn": -15.0, "gravity": 10.0}, 25.0),
        ({"drawn": 15.0, "gravity": 15.0}, 0.0),
        ({"drawn": 180.0, "gravity": 165.0}, 15.0),
        ({"drawn": 90.0, "gravity": 65.0}, 25.0),
        ({"drawn": 15.0, "gap": 2.0}, 15.0),  # before they touch
        ({"drawn": 15.0, "weight": 0.0}, 0.0),
    ],
)
def test_angle_of_the_base_is_that_against_gravity(given, angle):
    assert base_angle(Simulation(block(**given)), 1, 0) == pytest.approx(angle, abs=1e-6)


@pytest.fixture(scope="module")
def slips():
    """Measured and predicted slips of both slabs; the tables tilt at 0.05 degrees per second."""
    scene = load("tilt")
    sim = Simulation(scene)
    watch, errors = watched_slips(sim), []
    while waiting(watch) and sim.time < scene.run.end:
        for _ in range(LOOKS):
            sim.step()
        look(watch, sim)
        if all(slip["slip_angle"] is None for slip in watch.values()):
            errors.append(abs(sim.ledger.error))
    assert max(errors) < 1e-4
    # The slab that has slipped runs away, at the end by as much as the mating length in a step.
    assert abs(sim.ledger.error) < 5e-3
    return list(watch.values())


@pytest.mark.slow
def test_slip_at_the_peak_friction_of_the_law(slips):
    """Two law points under a slab carry 60 and 40 % of its load: less than 0.2 degrees."""
    for slip in slips:
        assert slip["slip_angle"] == pytest.approx(slip["predicted_angle"], abs=0.2)
    assert slips[0]["slip_angle"] - slips[1]["slip_angle"] > 3.0  # the azimuths differ


STRESS = 100e3


@pytest.fixture(scope="module")
def box():
    """Shear displacement, normal and shear stress, closure in every step of the scene."""
    scene = load("shear-box")
    sim = Simulation(scene)

    def row():
        closure, shear = sim.joints.delta.mean(axis=0)
        return [shear, *sim.joints.traction.mean(axis=0), closure]

    return scene, sim, np.array([row(), *until(sim, scene.run.end, row)]).T


def test_stress_and_dilation_against_direct_shear(box):
    """Within 1 % of the largest shear stress and of the range of the closure, at equal stress."""
    scene, _, (u, _, tau, closure) = box
    first, second = int(u.argmax()), int(u.argmin())
    law = scene.laws["replica"]
    turns = [u[first], u[second], u[-1]]
    test = jl.direct_shear(law.joint(), to=turns, normal=STRESS, steps=800)
    at = np.abs(test.shear_2[:, None] - np.array(turns)).argmin(axis=0)
    legs = [(0, first, 0, at[0]), (first, second, at[0], at[1]), (second, len(u) - 1, at[1], None)]
    for start, stop, low, high in legs:
        part = slice(low, None if high is None else high + 1)
        way = np.sign(u[stop] - u[start])
        order = np.argsort(way * test.shear_2[part])
        x = way * test.shear_2[part][order]
        mine = way * u[start : stop + 1]
        stress = np.interp(mine, x, test.F2[part][order])
        depth = np.interp(mine, x, test.closure[part][order])
        assert np.abs(tau[start : stop + 1] - stress).max() < 0.01 * np.abs(test.F2).max()
        assert np.abs(closure[start : stop + 1] - depth).max() < 0.01 * np.ptp(test.closure)


def test_normal_stress_stays_and_energy_balances(box):
    """Load and weight on a constant area: inertia of the rising half is the only disturbance."""
    _, sim, (_, sigma, _, _) = box
    assert sigma == pytest.approx(STRESS, rel=5e-3)
    assert abs(sim.ledger.error) < 1e-4
