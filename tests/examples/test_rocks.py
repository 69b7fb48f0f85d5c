"""Rock masses: the scenes end as intended, the template runs, joints have the law of their set.
Studies of a scene: the law or Coulomb in its place, and `ablate`, where each ingredient goes."""

import csv
import itertools
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from scene_text import ROCK, block, coulomb, on_base
from scipy.integrate import trapezoid
from shapely import Point, Polygon

import jointlaw as jl
from dem_demo import SceneError, Simulation, load, parse, run
from dem_demo.cli import main
from dem_demo.contact import ContactManager
from dem_demo.dynamics.blocks import Blocks
from dem_demo.output.monitors import friction_angle, law_between
from dem_demo.output.record import RunRecord, outcomes
from dem_demo.scene import INTACT_ROCK, TEMPLATE
from dem_demo.studies.ablate import _run, ablate, variants
from dem_demo.studies.compare import compare, coulomb_of_same_strength
from dem_demo.studies.strength import alone, critical_tilt

TEXT = TEMPLATE.read_text()
PLAIN = f"\n[laws.plain]\n{coulomb(0.4, 4e8, 3e8)}"


@pytest.fixture
def check(tmp_path, capsys):
    """What the command `check` tells of a scene of this text."""

    def told(text):
        (tmp_path / "mine.toml").write_text(text)
        assert main(["check", str(tmp_path / "mine.toml")]) == 0
        return capsys.readouterr().out

    return told


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "until", "states", "failed"),
    [
        ("slope", 0.7, ["stable", "failed"], 20),
        ("slope-azimuth", 0.9, ["stable", "failed"], 15),
        ("arch", 0.4, ["stable", "failed"], 3),
        ("wet-slope", 0.6, ["failed"], 1),
        ("wet-slope-drained", 0.6, ["stable"], 0),
    ],
)
def test_short_scenes_end_as_intended(name, until, states, failed):
    """One rock stands beside one that fails; a slope slides for its water, and stands without.

    A rock that stands is seated to rounding: nanometres and 1e-9 m/s are far above what it does
    and far below the 1e-6 m/s that "stable" allows. Sliding with corners: 0.5 % of the energy.
    """
    scene = load(name)
    assert sum(not block.fixed for block in scene.blocks) <= 60
    _, summary = run(Simulation(scene), until=until)
    rocks = summary["rocks"]
    assert [rock["state"] for rock in rocks] == states
    stand = [rock for rock in rocks if rock["state"] == "stable"]
    assert all(max(rock["displacement_m"], rock["creep_m_per_s"]) < 1e-9 for rock in stand)
    assert sum(rock["failed_blocks"] for rock in rocks) >= failed
    assert summary["max_energy_error"] < 5e-3


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_failure_is_counted_by_the_size_of_the_blocks(size):
    """A tenth of a block, in a model of centimetres as in one of a hundred metres."""
    scene = load("slope")
    blocks = tuple(replace(block, corners=size * block.corners) for block in scene.blocks)
    scene, rock = replace(scene, blocks=blocks), scene.rocks[0]
    start = Blocks(scene).motion
    end = start.copy()
    end[0, rock.free[:2]] += [0.2 * size, 0.05 * size]  # of blocks of about 1 m2 times size**2
    record = object.__new__(RunRecord)
    record.scene, record.times, record.motion = scene, [0.0, 1.0], [start, end]
    record.initial = start
    assert [entry["failed_blocks"] for entry in outcomes(record)] == [1, 0]
    keys = "rock state blocks settlement_m displacement_m failed_blocks failure_displacement_m"
    assert [*outcomes(record)[0]] == [*keys.split(), "creep_m_per_s"]


@pytest.mark.slow
def test_dilation_is_what_holds_the_rough_slope():
    """Plain Coulomb bears a dip of its friction angle, rough joints one of theirs with dilation.

    That is the peak of direct shear at the normal stress of the joints: the mean at rest, each
    weighted by its force. Half a degree for blocks that the cutting leaves interlocked or loose,
    and for joints that are not at their peaks together.
    """
    own = alone(load("slope"), "rough", 2)
    facets = jl.CoulombLaw(1e8, 1e8, 0.4, plane=0.0)  # the friction of the asperities alone
    laws = {name: own.laws[name] if name == INTACT_ROCK else facets for name in own.laws}
    rough, plain = critical_tilt(own), critical_tilt(replace(own, laws=laws))
    sim = Simulation(own)
    stress, force = sim.joints.traction[:, 0], sim.joints.traction[:, 0] * sim.contacts.length
    pressed = (stress * force).sum() / force.sum()
    assert 36 + plain == pytest.approx(21.8, abs=0.5)
    assert 36 + rough == pytest.approx(friction_angle(own.laws["rough"], pressed), abs=0.5)


def test_a_scene_of_ones_own_from_the_template(tmp_path, capsys):
    """new, edit as docs/blocks.md says, check, run, resume."""
    file = tmp_path / "mine.toml"
    assert main(["new", str(file)]) == 0
    assert main(["new", str(file)]) == 2  # what is there stays there
    assert "exists" in capsys.readouterr().err
    text = file.read_text()
    for old, new in (
        ("dip = 36.0", "dip = 30.0"),
        ("seed = 1", "seed = 4"),
        ("persistence = 0.7", "persistence = 0.5"),
        ("end = 1.0", "end = 0.1"),
        ("[monitor]", "[[joint]]\naround = [-3.0, 7.0]\nlaw = 'plain'\n" + PLAIN + "\n[monitor]"),
    ):
        assert old in text
        text = text.replace(old, new, 1)
    file.write_text(text)
    assert main(["check", str(file)]) == 0
    assert "blocks that can move" in capsys.readouterr().out
    out = tmp_path / "out"
    assert main([str(file), "--out", str(out)]) == 0
    assert "slope: stable" in capsys.readouterr().out
    written = {path.name for path in out.iterdir()}
    assert written >= {"final.png", "motion.gif", "history.csv", "state"}
    assert json.loads((out / "summary.json").read_text())["max_energy_error"] < 1e-4
    with (out / "history.csv").open() as stream:
        *_, last = csv.DictReader(stream)
    assert (
        1e-5 < float(last["point 1: displacement_m"]) < 1e-2
    )  # the settlement of the block of the point, m
    words = ["resume", str(out / "state"), "--until", "0.12", "--no-pictures"]
    assert main([*words, "--out", str(tmp_path / "on")]) == 0


def test_a_law_with_cells_for_larger_stresses_is_told_what_to_write(check):
    usual = re.sub(r"closure_range = .*\n", "", TEXT)  # the closure at 20 MPa
    said = check(usual)
    assert "law 'joint': its joints carry 1e+05 Pa at most" in said
    (wanted,) = re.findall(r"In \[laws.joint\] write (closure_range = [^,]*),", said)
    one_cell = "resolution = { u = 4, phi = 6, depth = 1 }"
    cured = usual.replace("[laws.joint]", f"[laws.joint]\n{wanted}")
    for text in (TEXT, cured, re.sub("resolution = .*", one_cell, usual)):
        assert "closure_range" not in check(text)


def test_joints_have_the_law_of_their_set():
    """Edges of one set face each other with its law; edges of two sets with the scene's."""
    text = TEXT.replace('law = "joint"\n\n[[rock.fixed', 'law = "plain"\n\n[[rock.fixed') + PLAIN
    scene = parse(
        text.replace("[monitor]", "[[joint]]\naround = [-3.0, 7.0]\nlaw = 'plain'\n[monitor]")
    )
    block = [Polygon(one.corners).contains(Point(-3.0, 7.0)) for one in scene.blocks].index(True)
    manager = ContactManager(scene, Blocks(scene).motion)
    start, of = manager.outlines.first_corner, manager.outlines.block
    laws = {int(start[one] + edge): law for (one, edge), law in scene.edge_laws.items()}
    pairs = np.array([*itertools.combinations(sorted(laws), 2)])
    found = [[*scene.laws][law] for law in manager.laws_of(pairs)]
    for (one, other), law in zip(pairs.tolist(), found, strict=True):
        alike = laws[one] if laws[one] == laws[other] else "joint"
        assert law == ("plain" if block in (of[one], of[other]) else alike)
    assert {*laws.values()} == {*found} == {"joint", "plain"}
    assert alone(scene, scene.rocks[0].name).pairs == scene.pairs


def test_two_blocks_with_laws_of_their_own_are_told_and_moved_by_the_same():
    """The law of the first of them, in whichever order a monitor names the two."""
    scene = parse(
        "law = 'rest'\n"
        + block("low", box=[1.0, 1.0], at=[0.0, 0.5])
        + block("high", box=[1.0, 1.0], at=[0.0, 1.5])
        + "[[joint]]\naround = [0.0, 0.5]\nlaw = 'soft'\n"
        + "[[joint]]\naround = [0.0, 1.5]\nlaw = 'hard'\n"
        + "".join(PLAIN.replace("plain", name) for name in ("hard", "rest", "soft"))
        + "[run]\nend = 1.0\n"
    )
    sim = Simulation(scene)
    assert law_between(sim, 0, 1) == law_between(sim, 1, 0) == "soft"
    assert {sim.joints.law_names[law] for law in sim.joints.law} == {"soft"}


def test_coulomb_in_compare_has_the_strength_of_the_law():
    """Peak and residual friction of the law at the stress, and the work between the two."""
    law, stress = load("slope").laws["rough"], 5e4
    fair = coulomb_of_same_strength(law, stress)
    mu = law.asperity.mu
    assert np.degrees(np.arctan(fair.friction)) == pytest.approx(
        friction_angle(law, stress), abs=0.1
    )
    assert fair.residual_friction == pytest.approx(mu, rel=1e-3)
    record = jl.direct_shear(law.joint(), to=[0.2], normal=stress, steps=2000)
    work = trapezoid(np.maximum(record.shear_stress / stress - mu, 0.0), record.shear_2)
    above = fair.friction - mu
    before = 0.02 * above  # m: a bound of what the law has before its peak
    assert 0.5 * above * fair.weakening < work < 0.5 * above * fair.weakening + before
    rows = list(compare(load("shaken-slope"), [1], 0.02))
    assert [row["law"] for row in rows] == ["joint", "coulomb"]
    assert rows[1]["laws"]["joint"].friction > rows[1]["laws"]["joint"].residual_friction


BOND = "bond = {{ cohesion = 1e4, tension = 1e4, normal_stiffness = 1e10, shear_stiffness = {} }}\n"


def test_a_bond_that_breaks_before_friction_is_there_is_told(check):
    for stiffness, told in (("1e10", True), ("1e6", False)):
        said = check(on_base(ROCK + BOND.format(stiffness), [2.0, 1.0]))
        assert ("law 'rock': its bond breaks after 1e-06 m of shear" in said) == told


NOTCHED = """
[[rock]]
name = "beam"
outline = [[0, 0], [1, 0], [1, 2], [4, 2], [4, 3], [0, 3]]
min_width = 0.1
CUT[[rock.set]]
dip = 90.0
spacing = 50.0
through = [-10.0, 0.0]
[[rock.fixed]]
corners = [[-1, -1], [1.001, -1], [1.001, 4], [-1, 4]]
[run]
end = 0.1
"""


def test_a_cut_through_an_inward_corner_holds():
    """A cantilever 3 m long on the side of a pillar: intact rock bears it, a joint does not."""
    for cut, state in (("", "stable"), ('cut_law = "joint"\n', "displacing")):
        scene = parse(f"[laws.joint]\n{coulomb(0.1, 1e9, 1e9)}" + NOTCHED.replace("CUT", cut))
        assert any(
            "1 cuts at inward corners that are no joints" in line
            for line in scene.rocks[0].messages
        )
        _, summary = run(Simulation(scene))
        assert summary["rocks"][0]["state"] == state


# A smooth joint, atan(0.4) + 90/20 = 26.3 degrees at most, on a slope of 22 degrees.
LAW = ROCK.replace("a = 3.0", "a = 20.0, b = 0.2, c = 0.2")
SLOPE = (
    on_base(LAW, [1.0, 0.3], 22.0, end=0.05)
    + """\
record = 0.01
fraction = 0.4
[monitor]
slip = [["block", "base"]]
shear = [["block", "base"]]
"""
)
NAMES = {
    "no heights", "heights counted one by one", "linear asperities (eta = 0)",
    "no friction on asperities", "b = 0", "c = 0", "no large shear",
    "no dashpots", "law_steps = 4", "half the time step", "twice the time step",
    "resolution fine", "one depth cell",
}  # fmt: skip
SHORT = SLOPE.replace("end = 0.05", "end = 0.004")


@pytest.mark.slow
def test_each_ingredient_has_a_row_and_does_what_it_does(tmp_path):
    """Without asperity friction only 4.5 degrees of inclination hold the block on 22 degrees."""
    (tmp_path / "slope.toml").write_text(SLOPE)
    assert main(["ablate", "slope.toml", "--out", "."]) == 0
    with (tmp_path / "ablation.csv").open() as stream:
        rows = {row["variant"]: row for row in csv.DictReader(stream)}
    assert set(rows) >= NAMES
    assert not any(row["note"] for row in rows.values())
    moved = {name: float(row["largest displacement_m"]) for name, row in rows.items()}
    whole = moved["whole scene"]
    assert moved["whole scene again"] == whole  # to the last bit: what differs below is the scene
    fall = 0.5 * np.hypot(3.675, 9.096) * np.sin(np.radians(22.0 - 4.5)) * 0.05**2
    assert whole < 2e-4
    assert fall < moved["no friction on asperities"] < 1.3 * fall  # until contacts wind up
    # A seated block has moved little, so few sliders do as well as many.
    assert abs(float(rows["resolution fine"]["change of block, peak friction_deg"])) < 0.1
    steps = {name: int(row["steps"]) for name, row in rows.items()}
    assert steps["half the time step"] == pytest.approx(2 * steps["whole scene"], abs=2)
    for name, row in rows.items():
        change = float(row["change of largest displacement_m"])
        assert change == pytest.approx(moved[name] - whole, abs=1e-15)
    times = [float(rows[name]["time_ratio"]) for name in ("whole scene", "whole scene again")]
    assert min(times) == 1.0


def test_matched_laws_close_as_far_at_the_working_stress():
    scene = parse(SHORT)
    record, _ = run(Simulation(scene), None)
    values = np.concatenate([frame["normal_stress_Pa"] for frame in record.joints])
    pressed = np.median(values[values > 0])
    assert pressed == pytest.approx(2600 * 0.3 * 9.096, rel=0.3)  # its ends share unequally
    law, matched = scene.laws["rock"], 0
    for name, make in variants(scene, record):
        other = make().laws["rock"]
        matched += other.asperity.K != law.asperity.K
        if "resolution" not in name:
            assert other.closure(pressed) == pytest.approx(law.closure(pressed), rel=1e-9)
    assert matched >= 6


def test_what_cannot_be_built_or_run_is_a_row_with_its_reason_but_for_the_scene_itself():
    """c = 0.5 needs b of -1 or less (Eq. 18); twice a step near the limit is refused."""
    scene = parse(SHORT.replace("b = 0.2, c = 0.2", "b = -1.0, c = 0.5"))
    record, _ = run(Simulation(scene), None)
    row, none = _run("b = 0", dict(variants(scene, record))["b = 0"], None)
    assert row["note"].startswith("cannot be built: orientation.c")
    assert none is None
    long = replace(scene.run, step=1.8 * Simulation(scene).limit.current)
    row, none = _run("twice the time step", lambda: replace(scene, run=long), None)
    assert row["note"].startswith("stopped: time step")
    rock = parse(f"[laws.joint]\n{coulomb(0.1, 1e9, 1e9)}" + NOTCHED.replace("CUT", ""))
    row, _ = _run("a rock has columns of its own", lambda: rock, 1e-3)
    assert (row["beam, state"], row["beam, displacement_m"]) == (
        "stable",
        pytest.approx(0.0, abs=1e-9),
    )
    # a block that starts deep in its base, which no time step mends
    with pytest.raises(SceneError, match="overlap by"):
        ablate(parse(SLOPE.replace("0.15]", "0.1]")))
