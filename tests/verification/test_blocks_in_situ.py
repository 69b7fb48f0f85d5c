"""Initial state of blocks, and excavation. Rock under in-situ stress is in equilibrium, and its
joints bear the stress; unstable blocks are reported, and the others are in equilibrium, also around
a cavern. Excavation removes blocks in stages and releases their forces gradually.

A block whose edges all bear a stress S with div S = weight is in equilibrium, and each joint bears
S on its direction.
"""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from running import until
from scene_text import ROCK, block, coulomb, dipping, on_base

from dem_demo import Simulation, load
from dem_demo.cli import main
from dem_demo.output.monitors import friction_angle
from dem_demo.scene import parse, rotation

PLAIN = coulomb(0.8)
LAWS = {"plain": PLAIN, "rough": ROCK}
RUN = "[run]\nend = 1.0\n"
DEPTH = 100.0  # m, of the origin: stresses are almost constant along a joint
WEIGHT = 2600 * 9.81  # N/m3
FIXED_SIDES = 'left = "fixed"\nright = "fixed"\nbottom = "fixed"\ntop = "fixed"\n'
ROCK_CUT = """
[[rock]]
name = "rock"
outline = [[0, 0], [10, 0], [10, 10], [0, 10]]
set = [{ dip = 35, spacing = 1.5, scatter = 0.3, law = "j" },
       { dip = -60, spacing = 1.7, scatter = 0.3, law = "j" }]
"""


def cut(stress, sides, law="plain", more=""):
    return parse(f"[laws.j]\n{LAWS[law]}{RUN}{more}{ROCK_CUT}[in_situ]\n{stress}\n{sides}")


def largest_displacement(sim, time=0.02):
    """Largest displacement (m) of a block since the drawing, at step 0 and at a time (s)."""
    drawn = np.array([block.centroid for block in sim.scene.blocks]).T
    at_start = np.hypot(*(sim.blocks.motion[:2] - drawn)).max()
    until(sim, time)
    return max(at_start, np.hypot(*(sim.blocks.motion[:2] - drawn)).max())


def traction_errors(sim, stress):
    """Relative errors of tractions of joints against a stress tensor (2, 2)."""
    c = sim.contacts
    expected = [1, 1j] @ stress @ [c.normal.real, c.normal.imag] * c.normal.conj()
    error = np.abs(sim.joints.traction @ [1, 1j] - expected) / np.abs(expected)
    return error[c.length > 0.02]


@pytest.mark.parametrize("k0", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("angle", [0, 30])
def test_bricks_do_not_move(angle, k0):
    """5 x 5 bricks in a running bond, rotated by an angle (degrees), in a ring of fixed bricks:
    1e-9 m at a depth of 15 m. The displacement grows with the square of the stress: the energy of a
    joint changes with its length, as one block slides off another."""
    text = f"[laws.j]\n{PLAIN}{RUN}[in_situ]\nk0 = {k0}\nsurface = [[0, 20.0]]\n"
    for row, column in np.ndindex(7, 7):
        x = column + 0.5 * (row % 2)
        box = np.array([[x, row], [x + 1, row], [x + 1, row + 1], [x, row + 1]])
        corners = box @ rotation(np.radians(angle)).T
        is_inside = 0 < row < 6 and 0 < column < 6
        text += block(f"{row} {column}", corners=corners, fixed=not is_inside)
    sim = Simulation(parse(text))
    assert not sim.unstable.any()
    assert largest_displacement(sim) < 1e-9
    largest_force = np.abs(sim.energy_balance.forces[0]).max()
    assert largest_force / np.abs(sim.blocks.gravity).max() < 1e-8


@pytest.mark.parametrize("k0", [0.5, pytest.param(1.0, marks=pytest.mark.slow), 2.0])
@pytest.mark.parametrize("law", ["plain", "rough"])
def test_rock_cut_by_two_sets_bears_the_stress_and_stays(law, k0):
    sim = Simulation(cut(f"k0 = {k0}\nsurface = [[0, {10 * DEPTH}]]", FIXED_SIDES, law))
    assert not sim.unstable.any()
    stress = np.diag([k0, 1.0]) * WEIGHT * (10 * DEPTH - 5)
    assert np.quantile(traction_errors(sim, stress), 0.95) < 0.01
    assert largest_displacement(sim) < 1e-5


def test_traction_follows_from_stress_and_direction_of_the_joints():
    """Without weight, loaded from three sides: (sxx, syy, sxy) on each joint."""
    sides = FIXED_SIDES.replace("fixed", "loaded").replace('bottom = "loaded"', 'bottom = "fixed"')
    scene = cut("stress = [4e6, 2e6, 0.5e6]", sides)
    sim = Simulation(parse("gravity = [0.0, 0.0]\n" + scene.text))
    stress = np.array([[4e6, 0.5e6], [0.5e6, 2e6]])
    assert np.quantile(traction_errors(sim, stress), 0.95) < 1e-3
    assert largest_displacement(sim) < 1e-5


@pytest.mark.parametrize("sides", ["rollers", "loaded"])
def test_the_floor_bears_the_weight_and_the_load_above(sides):
    """On rollers, and under loads, the sides bear no part of the weight, at any K0."""
    edges = f'left = "{sides}"\nright = "{sides}"\nbottom = "fixed"\ntop = "loaded"'
    sim = Simulation(cut(f"k0 = 1.5\nsurface = [[0, {DEPTH}]]", edges))
    assert not sim.unstable.any()
    fixed = np.array([block.fixed for block in sim.scene.blocks])
    load = -WEIGHT * (DEPTH - 10) * 10
    assert sim.blocks.loads[~fixed, 1].sum() == pytest.approx(load, rel=1e-4)
    joint_forces = sim.contacts.assemble_forces(
        len(fixed),
        sim.contacts.area[:, None] * sim.joints.traction,
        sim.joints.stored_energy,
    )
    carried = joint_forces[fixed, 1].sum()
    above = (sim.blocks.gravity + sim.blocks.loads)[~fixed, 1].sum()
    assert carried == pytest.approx(above, rel=1e-4)


def test_joints_bear_the_effective_stress():
    """Between fixed sides, with K0 = 1: total stress of rock less the pressure of water up to a
    height of 85 m."""
    water = "[water]\ntable = [[0, 85]]\n"
    scene = cut(f"k0 = 1.0\nsurface = [[0, {DEPTH}]]", FIXED_SIDES, more=water)
    sim = Simulation(scene)
    drawn = sim.contacts.position.imag
    effective = WEIGHT * (DEPTH - drawn) - 9810 * (85 - drawn)
    c = sim.contacts
    error = np.abs(sim.joints.traction[:, 0] / effective - 1)[c.length > 0.02]
    assert np.quantile(error, 0.95) < 0.01
    assert largest_displacement(sim) < 1e-7


def test_a_joint_unloads_over_its_in_situ_closure():
    """Two blocks released from 0.5 MPa: their joint opens by stress over stiffness, 0.05 mm, until
    its stress is zero. Its stored energy becomes kinetic energy, except for the dashpots."""
    text = f"gravity = [0.0, 0.0]\n[laws.j]\n{PLAIN}[run]\nend = 0.1\nsettle = false\n"
    text += "[in_situ]\nstress = [0.0, 5e5, 0.0]\n"
    for i in range(2):
        text += block(f"{i}", box=[1.0, 1.0], at=[0.0, i])
    sim = Simulation(parse(text))
    assert sim.energy_balance.value["stored"] == pytest.approx(5e5**2 / 2e10, rel=1e-9)
    history = until(sim, 4e-3, lambda: (sim.contacts.closure, sim.joints.traction[:, 0]))
    for depth, stress in history:
        assert stress == pytest.approx(1e10 * np.maximum(depth + 5e-5, 0.0), abs=1e-3)
    assert min(depth.min() for depth, _ in history) < -1e-4
    assert sim.energy_balance.value["stored"] == 0.0
    assert sim.energy_balance.value["kinetic"] > 0.8 * 5e5**2 / 2e10
    assert abs(sim.energy_balance.error) < 5e-3  # as in an impact: a joint opens within a step


BOXES = [block(f"{i}", box=[1, 1], at=[0, i - 1.0], fixed=i == 0) for i in range(4)]
TOWER = f"[laws.j]\n{coulomb()}{''.join(BOXES)}[run]\nend = 1.0\n"
EXCAVATION = (
    "[[excavate]]\ncorners = [[-1, -0.4], [1, -0.4], [0, 0.5]]\nrelease_time = {release}\n{at}\n"
)


def tower(release, at=""):
    return parse(TOWER + EXCAVATION.format(release=release, at=at))


def test_blocks_fall_as_their_support_is_released():
    """Two blocks on a block that is removed: at time t the unbalanced force is t/T of their weight,
    so they have fallen by g t^3/(6 T), and by g T^2/6 at T."""
    release = 0.1
    sim = Simulation(tower(release))
    start = sim.blocks.motion[1].copy()
    for time in (0.5 * release, release):
        until(sim, time)
        fallen = start - sim.blocks.motion[1]
        assert fallen[2:] == pytest.approx(9.81 * sim.time**3 / (6 * release), rel=0.02)
        assert abs(sim.energy_balance.error) < 1e-3
    assert sim.stage_start_times == 0.0
    assert sim.blocks.is_removed.tolist() == [False, True, False, False]
    assert abs(fallen[1]) < 1e-15
    assert sim.manager.between(2, 3).any()
    assert not sim.manager.between(1, 2).any()


def test_a_stage_begins_at_its_time_or_at_rest():
    """Without a start time it waits until a block that falls by 1 mm has come to rest."""
    text = tower(0.01, "start = 0.02").text
    sim = Simulation(parse(text))
    until(sim, 0.03)
    assert sim.stage_start_times == pytest.approx(0.02, abs=2e-3)
    rest = text.replace("start = 0.02", "").replace("at = [0, 2.0]", "at = [0, 2.001]")
    sim = Simulation(parse(rest.replace("[run]", "[run]\nsettle = false\n")))
    until(sim, 0.02)
    assert np.isinf(sim.stage_start_times)
    until(sim, 1.0)
    assert np.isfinite(sim.stage_start_times)


def test_a_resumed_excavation_is_bitwise_reproducible():
    first = Simulation(tower(0.1))
    until(first, 0.05)
    resumed = Simulation(first.scene, saved=first.state())
    for sim in (first, resumed):
        until(sim, 0.12)
    assert np.array_equal(first.blocks.motion, resumed.blocks.motion)
    assert np.array_equal(first.energy_balance.energy, resumed.energy_balance.energy)
    assert resumed.blocks.is_mobile[:, 0].tolist() == [False, False, True, True]


def test_rock_is_cut_along_the_excavation():
    """The blocks of each stage fill its outline, in one rock mass or in two."""
    scene = load("tunnel")
    areas = [sum(scene.blocks[i].section.area for i in stage["blocks"]) for stage in scene.stages]
    assert areas == pytest.approx([6 * 2 + (6 + 4.2) / 2 * 1.6 + 4.2 / 2 * 0.8, 18.0], rel=0.02)
    assert sum(block.section.area for block in scene.blocks) == pytest.approx(24 * 20, rel=0.01)
    excavated = scene.excavated
    assert sorted(excavated.removed) == sorted(
        [i for stage in scene.stages for i in stage["blocks"]]
    )
    assert not excavated.stages


@pytest.mark.slow
def test_the_unstable_blocks_of_a_tunnel_fall_and_no_others():
    scene = load("tunnel")
    sim = Simulation(scene)
    unstable = Simulation(scene.excavated).unstable
    assert not sim.unstable.any()
    drawn = sim.blocks.motion[:2].copy()
    until(sim, 1.0)
    displacement = np.hypot(*(sim.blocks.motion[:2] - drawn)) * ~sim.blocks.is_removed
    assert unstable.any()
    assert (displacement[unstable] > 0.02).all()
    assert (displacement[~unstable] < 2e-3).all()


NEITHER = "give either k0 or stress"


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: cut("", ""), NEITHER),
        (lambda: cut("stress = [1e6, 2e6]", ""), NEITHER),
        (lambda: cut("k0 = 1.0\nstress = [1e6, 1e6, 0.0]", ""), NEITHER),
        (lambda: cut('left = "fixed"', ""), NEITHER),
        (
            lambda: parse(TOWER + 2 * EXCAVATION.format(release=0.1, at="")),
            r"excavate\[1\].corners: no block is left there",
        ),
    ],
)
def test_wrong_stresses_and_excavations_are_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()


BLOCK = (
    on_base(coulomb(np.tan(np.radians(35.0))), [3.0, 1.5], 25.0, end=0.02)
    + """\
record = 0.01
[[block]]
name = "stuck to its face"
corners = [[1.5, 0.2], [2.0, 0.4], [2.0, 1.0], [1.5, 1.2]]
"""
)


def unbalanced_ratio(sim):
    """Unbalanced forces (n,) at step 0 relative to the weights."""
    force = np.hypot(*(sim.energy_balance.forces[0] * sim.blocks.is_free)[:, :2].T)
    return force / np.hypot(*sim.blocks.gravity[:, :2].T).clip(1e-300)


def test_a_block_is_in_equilibrium_beside_an_unstable_one():
    sim = Simulation(parse(BLOCK))
    assert sim.unstable.tolist() == [False, False, True]  # the block beside the face
    ratio = unbalanced_ratio(sim)
    assert ratio[1] < 1e-9
    assert ratio[2] == pytest.approx(1.0, abs=0.01)  # falls freely
    restored = Simulation(sim.scene, saved=sim.state())
    assert (restored.unstable == sim.unstable).all()


def test_a_weakened_block_in_water_starts_in_equilibrium():
    text = on_base(coulomb(0.7), [3.0, 1.5], load=[2e4, 0.0])
    sim = Simulation(
        replace(parse(text + "[water]\ntable = [[-9, 0.5], [9, 0.6]]\n"), reduction=1.3)
    )
    assert sim.blocks.loads[1, 1] > 1e4  # N, uplift
    assert unbalanced_ratio(sim)[1] < 1e-9


def test_the_unbalanced_force_of_a_sliding_block_is_weight_less_friction():
    """At 40 degrees: sin - cos tan 35, relative to its weight."""
    dip = np.radians(40.0)
    sim = Simulation(replace(parse(BLOCK), gravity=tuple(dipping(40.0))))
    expected = np.sin(dip) - np.cos(dip) * np.tan(np.radians(35.0))
    assert sim.unstable.tolist() == [False, True, True]
    assert unbalanced_ratio(sim)[1] == pytest.approx(expected, rel=0.03)


def test_the_run_names_loose_blocks_and_says_how_each_block_moved(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(BLOCK)
    out = tmp_path / "out"
    assert main([str(tmp_path / "scene.toml"), "--out", str(out), "--no-pictures"]) == 0
    printed = capsys.readouterr().out
    assert "1 block has no static equilibrium" in printed
    assert "stuck to its face (1.73, 0.70)" in printed
    assert "blocks: " in printed  # a verdict without a [[rock]]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["started_in_equilibrium"] is False
    assert [block["block"] for block in summary["unstable"]] == ["stuck to its face"]
    rows = list(csv.DictReader((out / "blocks.csv").read_text().splitlines()))
    assert [row["block"] for row in rows] == ["base", "block", "stuck to its face"]
    assert [row["unstable_at_start"] for row in rows] == ["0", "0", "1"]
    fell = float(rows[2]["displacement_m"])
    assert fell == pytest.approx(0.5 * 9.81 * 0.02**2, rel=0.1)
    assert float(rows[2]["speed_m/s"]) == pytest.approx(9.81 * 0.02, rel=0.1)
    assert float(rows[1]["displacement_m"]) < 1e-6


def test_strength_reduction_with_and_without_loose_blocks(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(BLOCK)
    out = tmp_path / "out"
    words = [str(tmp_path / "scene.toml"), "--out", str(out), "--until", "0.3"]
    assert main(["strength-reduction", *words]) == 0
    (row,) = json.loads((out / "strength.json").read_text())["rows"]
    assert [block["block"] for block in row["unstable"]] == ["stuck to its face"]
    assert row["factor_of_safety"] is None
    assert row["factor_without_excluded"] == pytest.approx(
        np.tan(np.radians(35)) / np.tan(np.radians(25)), rel=0.01
    )
    assert [block["block"] for block in row["initiating_blocks"]] == ["block"]
    assert (out / row["picture"]).exists()
    printed = capsys.readouterr().out
    assert printed.index("blocks are unstable") < printed.index("factor of safety without")


HALF_ANGLE = np.arctan(1.25 / 2.0)  # rad: of the wedge at its apex, 32 degrees


@pytest.mark.slow
def test_a_roof_wedge_falls_where_its_friction_angle_is_below_its_half_angle():
    """A force N on a side pushes a wedge of half angle A down by N (sin A - tan phi cos A): where
    phi is below A it falls, and the faster the higher the horizontal stress. Above A each side
    bears N (tan phi cos A - sin A): more than half the weight, with 200 kPa over 2 m of height.
    (Brady and Brown 2004, 9.5.)

    The stable wedge is in equilibrium to rounding; the other falls at least as fast as freely.
    """
    time = 0.2
    results = {}
    for name, law in (("cavern", "rough"), ("cavern-smooth", "smooth")):
        scene = load(name)
        phi = np.radians(friction_angle(scene.laws[law], 2e5))
        sim = Simulation(scene)
        n = [block.name for block in scene.blocks].index("wedge")
        assert (unbalanced_ratio(sim) < 1e-6)[~sim.unstable].all()
        start = sim.blocks.motion[1, n]
        thrust = 2e5 * 2.0 / np.cos(phi - HALF_ANGLE)  # N, on a side, by the horizontal stress
        reserve = 2 * thrust * np.sin(phi - HALF_ANGLE) + sim.blocks.gravity[n, 1]
        until(sim, time)
        results[name] = reserve, start - sim.blocks.motion[1, n]
    (rough_reserve, rough_fall), (smooth_reserve, smooth_fall) = results.values()
    assert rough_reserve > 0 > smooth_reserve
    assert abs(rough_fall) < 1e-8
    assert smooth_fall > 0.95 * 0.5 * 9.81 * time**2
