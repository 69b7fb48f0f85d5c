"""Tilt test, shear box and shaken scenes, against the law alone and Newmark's block (1965)."""

from dataclasses import replace

import numpy as np
import pytest
from running import steps, until
from scipy.integrate import cumulative_trapezoid

import jointlaw as jl
from dem_demo import Simulation, load, parse
from dem_demo.output.monitors import base_angle, start_slip_monitors, update_slip_monitors
from dem_demo.output.record import RunRecord
from dem_demo.output.run import SLIP_CHECK_INTERVAL
from dem_demo.scene.blocks import rotation
from dem_demo.scene.read import SCENES

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
fixed_motions = ["x", "y"]
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
[monitor]
slip = [["top", "base"]]
[run]
end = 0.7
"""


def block(gravity=0.0, drawn=0.0, driven=0.0, gap=0.0, weight=9.81):
    """A block on a base: gravity and base rotated, and the base driven by a rotation (degrees)."""
    down = rotation(np.radians(gravity)) @ [0.0, -weight]
    normal = rotation(np.radians(drawn)) @ [0.0, 1.0]
    values = {"gravity": down.tolist(), "drawn": drawn, "driven": driven}
    values |= {"base": (-0.5 * normal).tolist(), "top": ((0.25 + gap) * normal).tolist()}
    return parse(BLOCK.format(**values) + ("step = 1e-4\n" if gap or not weight else ""))


@pytest.mark.parametrize(
    ("case", "angle"),
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
def test_angle_of_the_base_is_relative_to_gravity(case, angle):
    assert base_angle(Simulation(block(**case)), 1, 0) == pytest.approx(angle, abs=1e-6)


def test_a_drive_reverses_once_its_block_has_slipped():
    """The base rotates from 25 towards 32 degrees against gravity. From 26.6 degrees on, 1.6 of the
    drive's 7 degrees, the block slides, and the drive reverses."""
    reverse = 'reverse = { block = "top", slip = 1e-3, by = -3.0, duration = 0.06 }\n[monitor]'
    text = block(gravity=-25.0, driven=7.0).text.replace("[monitor]", reverse)
    sim = Simulation(parse(text))
    rotations = until(sim, 0.6, lambda: np.degrees(sim.blocks.motion[2, 0]))
    assert 1.6 < max(rotations) < 6.5
    assert rotations[-1] < max(rotations) - 1.5  # after the reversal


@pytest.mark.slow
def test_slip_at_the_peak_friction_of_the_law():
    """Tables that tilt at 0.05 degrees per second. The two contacts under a slab bear 60 and 40 %
    of its load, an error below 0.2 degrees."""
    sim = Simulation(load("tilt"))
    slips_by_pair = start_slip_monitors(sim)
    slips = list(slips_by_pair.values())
    while any(slip["slip_angle"] is None for slip in slips) and sim.time < sim.scene.run.end:
        steps(sim, SLIP_CHECK_INTERVAL)
        update_slip_monitors(slips_by_pair, sim)
        if all(slip["slip_angle"] is None for slip in slips):
            assert abs(sim.energy_balance.error) < 1e-4
    # the slab that slips accelerates, at the end to a mating length in a step
    assert abs(sim.energy_balance.error) < 5e-3
    for slip in slips:
        assert slip["slip_angle"] == pytest.approx(slip["predicted_angle"], abs=0.2)
    assert slips[0]["slip_angle"] - slips[1]["slip_angle"] > 3.0  # the azimuths differ


STRESS = 100e3


def test_a_shear_box_against_direct_shear():
    """Shear stress and closure over the shear path, with its reversal: within 1 % of the largest
    shear stress and of the range of the closure. Load and weight act on a constant area, so the
    inertia of the dilating half is the only disturbance."""
    sim = Simulation(load("shear-box"))

    def row():
        closure, shear = sim.joints.delta.mean(axis=0)
        return [shear, *sim.joints.traction.mean(axis=0), closure]

    u, sigma, tau, closure = np.array([row(), *until(sim, sim.scene.run.end, row)]).T
    turns = [u.max(), u.min(), u[-1]]
    law = sim.scene.laws["replica"]
    test = jl.direct_shear(law.joint(), to=turns, normal=STRESS, steps=800)
    path, test_path = (np.cumsum(np.abs(np.diff(x, prepend=0.0))) for x in (u, test.shear_2))
    test_stress = np.interp(path, test_path, test.F2)
    test_closure = np.interp(path, test_path, test.closure)
    assert np.abs(tau - test_stress).max() < 0.01 * np.abs(test.F2).max()
    assert np.abs(closure - test_closure).max() < 0.01 * np.ptp(test.closure)
    assert sigma == pytest.approx(STRESS, rel=5e-3)
    assert abs(sim.energy_balance.error) < 1e-4


FREQUENCY = 4.0  # 1/s
CYCLES = 5
MU = 0.6
G = 9.81  # m/s2


def newmark(scene, dip, end):
    """Times (s) up to the end, and the slip (m) of Newmark's block on the driven base by
    quadrature: it is rigid and never slides up."""
    (drive,) = (drive for drive in scene.drives if drive.order)
    t = np.arange(0.0, end, 1e-5)
    acceleration = drive.path(np.minimum(t, drive.times[-1]), nu=2) * (t < drive.times[-1])
    normal = G * np.cos(dip) + acceleration * np.sin(dip)
    slip_acceleration = G * np.sin(dip) - acceleration * np.cos(dip) - MU * normal
    velocity = cumulative_trapezoid(slip_acceleration, t, initial=0.0)
    velocity -= np.minimum.accumulate(velocity)  # since it stuck last
    return t, cumulative_trapezoid(velocity, t, initial=0.0)


def slip_per_cycle(t, slip):
    """Mean slip (m) in the last two full cycles."""
    ends = np.array([CYCLES - 1, CYCLES + 1]) / FREQUENCY
    return float(np.diff(np.interp(ends, t, slip))[0] / 2)


@pytest.mark.slow
def test_coulomb_friction_slides_as_newmarks_block():
    """Springs of 2e8 Pa/m recover less than 1e-4 m, the same in every cycle."""
    text = (SCENES / "shake.toml").read_text(encoding="utf-8")
    text = text.replace("acceleration = 5.0", "acceleration = 3.0")
    scene = parse(text.replace("cycles = 10", f"cycles = {CYCLES}"))
    scene = replace(scene, laws={"joint": jl.CoulombLaw(2e8, 1.6e8, MU, plane=0.0)})
    end = (CYCLES + 1) / FREQUENCY
    sim = Simulation(scene)
    rows = until(sim, end, lambda: (sim.time, sim.shear_displacement(1, 0)))
    expected = slip_per_cycle(*newmark(scene, np.radians(20.0), end))
    assert slip_per_cycle(*np.transpose(rows)) == pytest.approx(expected, rel=2e-3)


@pytest.mark.slow
def test_a_slope_of_blocks_slides_as_newmarks_block():
    """Mean slip of nine blocks in two beds, down the slope. The beds also slip on each other, which
    Newmark's block does not: a tolerance of 15 %."""
    scene = load("shaken-slope-plain")
    dip = np.radians(25.0)
    sim = Simulation(scene)
    record = RunRecord(sim)
    until(sim, scene.run.end)
    record.add_frame(sim)
    displacement = (record.displacements(-1) - record.displacements(0))[scene.rocks[0].free]
    slip = (displacement @ [np.cos(dip), -np.sin(dip)]).mean()
    expected = newmark(scene, dip, sim.time)[1][-1]
    assert expected > 0.05
    assert slip == pytest.approx(expected, rel=0.15)
