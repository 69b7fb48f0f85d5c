"""Blocks at the start. Rock under a stress is in balance and does not move, and its joints bear it;
who cannot be held is named, and all others are in balance, around a cavern too. Then rock is taken
away in stages: what it bore goes bit by bit, and the rest answers.

A block whose edges all bear a stress with div S = weight is in balance, and each joint bears S on
its direction.
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
DEPTH = 100.0  # m, of the origin: stresses that hardly change from end to end of a joint
WEIGHT = 2600 * 9.81
HELD = 'left = "fixed"\nright = "fixed"\nbottom = "fixed"\ntop = "fixed"\n'
ROCK_CUT = """
[[rock]]
name = "rock"
outline = [[0, 0], [10, 0], [10, 10], [0, 10]]
set = [{ dip = 35, spacing = 1.5, scatter = 0.3, law = "j" },
       { dip = -60, spacing = 1.7, scatter = 0.3, law = "j" }]
"""


def cut(stress, sides, law="plain", more=""):
    return parse(f"[laws.j]\n{LAWS[law]}{RUN}{more}{ROCK_CUT}[in_situ]\n{stress}\n{sides}")


def moved(sim, time=0.02):
    """Farthest (m) that a block is from its drawing at the start of a run or after a time (s)."""
    drawn = np.array([block.centroid for block in sim.scene.blocks]).T
    far = [np.hypot(*(sim.blocks.motion[:2] - drawn)).max()]
    until(sim, time)
    return max(*far, np.hypot(*(sim.blocks.motion[:2] - drawn)).max())


def wrong(sim, stress):
    """What the joints' tractions are wrong by, as shares of those of a stress (2, 2)."""
    c = sim.contacts
    on = [1, 1j] @ stress @ [c.normal.real, c.normal.imag] * c.normal.conj()
    share = np.abs(sim.joints.traction @ [1, 1j] - on) / np.abs(on)
    return share[c.length > 0.02]


@pytest.mark.parametrize("k0", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("angle", [0, 30])
def test_bricks_do_not_move(angle, k0):
    """5 x 5 bricks in a running bond, turned by an angle (degrees), in a ring of fixed ones: 1e-9 m
    at a depth of 15 m. What is left grows with the square of the stress: a joint's energy changes
    with its length, as one block slides off another."""
    text = f"[laws.j]\n{PLAIN}{RUN}[in_situ]\nk0 = {k0}\nsurface = [[0, 20.0]]\n"
    for row, column in np.ndindex(7, 7):
        left = column + 0.5 * (row % 2)
        box = np.array([[left, row], [left + 1, row], [left + 1, row + 1], [left, row + 1]])
        corners, fixed = box @ rotation(np.radians(angle)).T, not (0 < row < 6 and 0 < column < 6)
        text += block(f"{row} {column}", corners=corners, fixed=fixed)
    sim = Simulation(parse(text))
    assert not sim.unstable.any()
    assert moved(sim) < 1e-9
    weights = np.abs(sim.energy_balance.forces[0]).max() / np.abs(sim.blocks.gravity).max()
    assert weights < 1e-8


@pytest.mark.parametrize("k0", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("law", ["plain", "rough"])
def test_rock_cut_by_two_sets_bears_the_stress_and_stays(law, k0):
    sim = Simulation(cut(f"k0 = {k0}\nsurface = [[0, {10 * DEPTH}]]", HELD, law))
    assert not sim.unstable.any()
    stress = np.diag([k0, 1.0]) * WEIGHT * (10 * DEPTH - 5)
    assert np.quantile(wrong(sim, stress), 0.95) < 0.01
    assert moved(sim) < 1e-5


def test_a_given_stress_turns_with_the_joints():
    """Without weight, loaded from three sides: (sxx, syy, sxy) on each joint."""
    sides = HELD.replace("fixed", "loaded").replace('bottom = "loaded"', 'bottom = "fixed"')
    scene = cut("stress = [4e6, 2e6, 0.5e6]", sides)
    sim = Simulation(parse("gravity = [0.0, 0.0]\n" + scene.text))
    stress = np.array([[4e6, 0.5e6], [0.5e6, 2e6]])
    assert np.quantile(wrong(sim, stress), 0.95) < 1e-3
    assert moved(sim) < 1e-5


@pytest.mark.parametrize("sides", ["rollers", "loaded"])
def test_the_floor_bears_the_weight_and_the_load_above(sides):
    """On rollers and between loads no side takes part of the weight, at any K0."""
    given = f'left = "{sides}"\nright = "{sides}"\nbottom = "fixed"\ntop = "loaded"'
    sim = Simulation(cut(f"k0 = 1.5\nsurface = [[0, {DEPTH}]]", given))
    assert not sim.unstable.any()
    fixed = np.array([block.fixed for block in sim.scene.blocks])
    load = -WEIGHT * (DEPTH - 10) * 10
    assert sim.blocks.loads[~fixed, 1].sum() == pytest.approx(load, rel=1e-4)
    stress, shear = sim.joints.traction.T
    stored = sim.joints.stored_energy * sim.scene.thickness  # what a change of length costs
    area, motion = sim.energy_balance.area, sim.blocks.motion
    carried = sim.contacts.assemble(motion, area * stress, -area * shear, stored)[fixed, 1].sum()
    above = (sim.blocks.gravity + sim.blocks.loads)[~fixed, 1].sum()
    assert carried == pytest.approx(above, rel=1e-4)


def test_water_takes_its_part_of_the_stress():
    """Between held sides, with K0 = 1: the joints bear what is left of a total stress of 90 m of
    rock by water to 85 m."""
    water = "[water]\ntable = [[0, 85]]\n"
    scene = cut(f"k0 = 1.0\nsurface = [[0, {DEPTH}]]", HELD, more=water)
    sim = Simulation(scene)
    drawn = sim.contacts.position.imag
    left = WEIGHT * (DEPTH - drawn) - 9810 * (85 - drawn)
    c = sim.contacts
    share = np.abs(sim.joints.traction[:, 0] / left - 1)[c.length > 0.02]
    assert np.quantile(share, 0.95) < 0.01
    assert moved(sim) < 1e-7


def test_a_joint_keeps_its_closure_of_before_while_it_opens():
    """Two blocks let go from 0.5 MPa: their joint opens by stress over stiffness, 0.05 mm, before
    it bears nothing, and what it stored becomes their speed, but for the dashpots."""
    text = f"gravity = [0.0, 0.0]\n[laws.j]\n{PLAIN}[run]\nend = 0.1\nsettle = false\n"
    text += "[in_situ]\nstress = [0.0, 5e5, 0.0]\n"
    for i in range(2):
        text += block(f"{i}", box=[1.0, 1.0], at=[0.0, i])
    sim = Simulation(parse(text))
    assert sim.energy_balance.value["stored"] == pytest.approx(5e5**2 / 2e10, rel=1e-9)
    seen = until(sim, 4e-3, lambda: (sim.contacts.closure, sim.joints.traction[:, 0]))
    for depth, stress in seen:
        assert stress == pytest.approx(1e10 * np.maximum(depth + 5e-5, 0.0), abs=1e-3)
    assert min(depth.min() for depth, _ in seen) < -1e-4
    assert sim.energy_balance.value["stored"] == 0.0
    assert sim.energy_balance.value["kinetic"] > 0.8 * 5e5**2 / 2e10
    assert abs(sim.energy_balance.error) < 5e-3  # as in an impact: a joint opens within a step


BOXES = [block(f"{i}", box=[1, 1], at=[0, i - 1.0], fixed=i == 0) for i in range(4)]
TOWER = f"[laws.j]\n{coulomb()}{''.join(BOXES)}[run]\nend = 1.0\n"
UNDER = "[[excavate]]\ncorners = [[-1, -0.4], [1, -0.4], [0, 0.5]]\nrelease_time = {over}\n{at}\n"


def tower(over, at=""):
    return parse(TOWER + UNDER.format(over=over, at=at))


def test_a_block_falls_as_its_support_goes():
    """Two blocks on one that is taken away: after t the force on them is t/T of their weight, so
    they have fallen by g t^3/(6 T), and at T by g T^2/6."""
    over = 0.1
    sim = Simulation(tower(over))
    start = sim.blocks.motion[1].copy()
    for time in (0.5 * over, over):
        until(sim, time)
        fallen = start - sim.blocks.motion[1]
        assert fallen[2:] == pytest.approx(9.81 * sim.time**3 / (6 * over), rel=0.02)
        assert abs(sim.energy_balance.error) < 1e-3
    assert sim.stage_start_times == 0.0
    assert sim.blocks.is_removed.tolist() == [False, True, False, False]
    assert abs(fallen[1]) < 1e-15
    assert sim.manager.between(2, 3).any()
    assert not sim.manager.between(1, 2).any()


def test_a_stage_waits_for_its_time_or_for_rest():
    """A block dropped by 1 mm first comes to rest; a time of its own is kept."""
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


def test_a_resumed_excavation_goes_on_bit_for_bit():
    one = Simulation(tower(0.1))
    until(one, 0.05)
    other = Simulation(one.scene, saved=one.state())
    for sim in (one, other):
        until(sim, 0.12)
    assert np.array_equal(one.blocks.motion, other.blocks.motion)
    assert np.array_equal(one.energy_balance.energy, other.energy_balance.energy)
    assert other.blocks.is_mobile[:, 0].tolist() == [False, False, True, True]


def test_rock_is_cut_along_what_is_taken_away():
    """The blocks of the stages cover their corners, in one rock or in two."""
    scene = load("tunnel")
    areas = [sum(scene.blocks[i].section.area for i in stage["blocks"]) for stage in scene.stages]
    assert areas == pytest.approx([6 * 2 + (6 + 4.2) / 2 * 1.6 + 4.2 / 2 * 0.8, 18.0], rel=0.02)
    assert sum(block.section.area for block in scene.blocks) == pytest.approx(24 * 20, rel=0.01)
    left = scene.excavated
    assert sorted(left.removed) == sorted([i for stage in scene.stages for i in stage["blocks"]])
    assert not left.stages


@pytest.mark.slow
def test_the_blocks_of_a_tunnel_that_are_named_loose_are_those_that_fall():
    scene = load("tunnel")
    sim, named = Simulation(scene), Simulation(scene.excavated).unstable
    assert not sim.unstable.any()
    drawn = sim.blocks.motion[:2].copy()
    until(sim, 1.0)
    moved = np.hypot(*(sim.blocks.motion[:2] - drawn)) * ~sim.blocks.is_removed
    assert named.any()
    assert (moved[named] > 0.02).all()
    assert (moved[~named] < 2e-3).all()


GIVE = "give either k0 or stress"


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda: cut("", ""), GIVE),
        (lambda: cut("stress = [1e6, 2e6]", ""), GIVE),
        (lambda: cut("k0 = 1.0\nstress = [1e6, 1e6, 0.0]", ""), GIVE),
        (lambda: cut('left = "fixed"', ""), GIVE),
        (
            lambda: parse(TOWER + 2 * UNDER.format(over=0.1, at="")),
            r"excavate\[1\].corners: no block is left there",
        ),
    ],
)
def test_wrong_stresses_and_excavations_are_refused(make, told):
    with pytest.raises(ValueError, match=told):
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


def unbalanced(sim):
    """Unbalanced forces (n,) at step 0, as shares of the weights."""
    force = np.hypot(*(sim.energy_balance.forces[0] * sim.blocks.is_free)[:, :2].T)
    return force / np.hypot(*sim.blocks.gravity[:, :2].T).clip(1e-300)


def test_a_loose_block_leaves_the_one_that_it_touches_in_balance():
    sim = Simulation(parse(BLOCK))
    assert sim.unstable.tolist() == [False, False, True]  # the one that is stuck to its face
    lacking = unbalanced(sim)
    assert lacking[1] < 1e-9
    assert lacking[2] == pytest.approx(1.0, abs=0.01)  # nothing holds it
    again = Simulation(sim.scene, saved=sim.state())
    assert (again.unstable == sim.unstable).all()


def test_a_weakened_block_in_water_starts_in_balance():
    text = on_base(coulomb(0.7), [3.0, 1.5], load=[2e4, 0.0])
    sim = Simulation(
        replace(parse(text + "[water]\ntable = [[-9, 0.5], [9, 0.6]]\n"), reduction=1.3)
    )
    assert sim.blocks.loads[1, 1] > 1e4  # N, uplift
    assert unbalanced(sim)[1] < 1e-9


def test_a_block_that_slides_lacks_what_friction_does_not_hold():
    """At 40 degrees: sin - cos tan 35, of its weight."""
    steep = np.radians(40.0)
    sim = Simulation(replace(parse(BLOCK), gravity=tuple(dipping(40.0))))
    lacking = np.sin(steep) - np.cos(steep) * np.tan(np.radians(35.0))
    assert sim.unstable.tolist() == [False, True, True]
    assert unbalanced(sim)[1] == pytest.approx(lacking, rel=0.03)


def test_the_run_names_loose_blocks_and_says_how_each_block_moved(tmp_path, capsys):
    (tmp_path / "scene.toml").write_text(BLOCK)
    out = tmp_path / "out"
    assert main([str(tmp_path / "scene.toml"), "--out", str(out), "--no-pictures"]) == 0
    said = capsys.readouterr().out
    assert "1 blocks cannot be held" in said
    assert "stuck to its face (1.73, 0.70)" in said
    assert "blocks: " in said  # a verdict without a [[rock]]
    summary = json.loads((out / "summary.json").read_text())
    assert summary["started_in_equilibrium"] is False
    assert [block["block"] for block in summary["loose"]] == ["stuck to its face"]
    rows = list(csv.DictReader((out / "blocks.csv").read_text().splitlines()))
    assert [row["block"] for row in rows] == ["base", "block", "stuck to its face"]
    assert [row["loose_at_start"] for row in rows] == ["0", "0", "1"]
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
    assert [block["block"] for block in row["loose"]] == ["stuck to its face"]
    assert row["factor_of_safety"] is None
    assert row["factor_without"] == pytest.approx(
        np.tan(np.radians(35)) / np.tan(np.radians(25)), rel=0.01
    )
    assert [block["block"] for block in row["first"]] == ["block"]
    assert (out / row["picture"]).exists()
    said = capsys.readouterr().out
    assert said.index("cannot be held") < said.index("factor of safety without")


HALF = np.arctan(1.25 / 2.0)  # rad: of the wedge at its apex, 32 degrees


@pytest.mark.slow
def test_a_roof_wedge_falls_where_its_joints_are_smoother_than_it_is_steep():
    """A force N on a side pushes a wedge of half angle A down by N (sin A - tan phi cos A): where
    phi is below A it falls, and the sooner the higher the horizontal stress. Above A each side
    bears N (tan phi cos A - sin A): more than half the weight, with 200 kPa over 2 m of height.
    (Brady and Brown 2004, 9.5.)

    The wedge that hangs is in balance to rounding; the other falls no slower than a loose block.
    """
    fallen, time = {}, 0.2
    for name, law in (("cavern", "rough"), ("cavern-smooth", "smooth")):
        scene = load(name)
        phi = np.radians(friction_angle(scene.laws[law], 2e5))
        sim = Simulation(scene)
        n = [block.name for block in scene.blocks].index("wedge")
        assert (unbalanced(sim) < 1e-6)[~sim.unstable].all()
        start = sim.blocks.motion[1, n]
        thrust = 2e5 * 2.0 / np.cos(phi - HALF)  # N, on a side, by the horizontal stress
        bears = 2 * thrust * np.sin(phi - HALF) + sim.blocks.gravity[n, 1]
        until(sim, time)
        fallen[name] = bears, start - sim.blocks.motion[1, n]
    (left, hangs), (lacking, falls) = fallen.values()
    assert left > 0 > lacking
    assert abs(hangs) < 1e-8
    assert falls > 0.95 * 0.5 * 9.81 * time**2
