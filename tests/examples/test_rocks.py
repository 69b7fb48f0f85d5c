"""Rock masses: outcomes of scenes, the template, laws of joints; `compare` and `ablate`."""

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

pytestmark = pytest.mark.usefixtures("assumed_drawing_time")
TEXT = TEMPLATE.read_text()
PLAIN = f"\n[laws.plain]\n{coulomb(0.4, 4e8, 3e8)}"


@pytest.fixture
def check(tmp_path, capsys):
    """A function that returns the output of the command `check` for the text of a scene."""

    def run_check(text):
        (tmp_path / "mine.toml").write_text(text)
        assert main(["check", str(tmp_path / "mine.toml")]) == 0
        return capsys.readouterr().out

    return run_check


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
    """One rock is stable beside one that fails; a slope slides by its water pressure only.

    A stable rock is settled to rounding errors: nanometres and 1e-9 m/s are far above its motion,
    and far below the creep of 1e-6 m/s that "stable" allows. Sliding with corners: an energy error
    of 0.5 %.
    """
    scene = load(name)
    assert sum(not block.fixed for block in scene.blocks) <= 60
    _, summary = run(Simulation(scene), until=until)
    rocks = summary["rocks"]
    assert [rock["state"] for rock in rocks] == states
    stable = [rock for rock in rocks if rock["state"] == "stable"]
    assert all(max(rock["displacement_m"], rock["creep_m_per_s"]) < 1e-9 for rock in stable)
    assert sum(rock["failed_blocks"] for rock in rocks) >= failed
    assert summary["max_energy_error"] < 5e-3


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_failure_displacement_is_proportional_to_block_size(size):
    """A tenth of a block, in models of centimetres and of a hundred metres."""
    scene = load("slope")
    blocks = tuple(replace(block, corners=size * block.corners) for block in scene.blocks)
    rock = scene.rocks[0]
    scene = replace(scene, blocks=blocks)
    start = Blocks(scene).motion
    end = start.copy()
    end[0, rock.free[:2]] += [0.2 * size, 0.05 * size]  # of blocks of about 1 m2 times size**2
    record = object.__new__(RunRecord)
    record.scene = scene
    record.times = [0.0, 1.0]
    record.motion = [start, end]
    record.initial = start
    assert [entry["failed_blocks"] for entry in outcomes(record)] == [1, 0]
    keys = "rock state blocks settlement_m displacement_m failed_blocks failure_displacement_m"
    assert [*outcomes(record)[0]] == [*keys.split(), "creep_m_per_s"]


@pytest.mark.slow
def test_dilation_stabilises_the_rough_slope():
    """With Coulomb's law the critical dip is the friction angle, with rough joints the peak
    friction angle of direct shear, dilation included, at the mean normal stress of the joints at
    rest, weighted by force.

    Tolerance of half a degree: some blocks are locked or free by the cutting, and joints do not
    reach their peaks together.
    """
    rock = alone(load("slope"), "rough", 2)
    facets = jl.CoulombLaw(1e8, 1e8, 0.4, plane=0.0)  # the friction of the asperities alone
    laws = {name: law if name == INTACT_ROCK else facets for name, law in rock.laws.items()}
    rough_tilt = critical_tilt(rock)
    coulomb_tilt = critical_tilt(replace(rock, laws=laws))
    sim = Simulation(rock)
    stress = sim.joints.traction[:, 0]
    force = stress * sim.contacts.length
    mean_stress = (stress * force).sum() / force.sum()
    peak_angle = friction_angle(rock.laws["rough"], mean_stress)
    assert 36 + coulomb_tilt == pytest.approx(21.8, abs=0.5)
    assert 36 + rough_tilt == pytest.approx(peak_angle, abs=0.5)


def test_a_scene_made_from_the_template(tmp_path, capsys):
    """Commands new, check, run and resume, with the edits of docs/blocks.md."""
    file = tmp_path / "mine.toml"
    assert main(["new", str(file)]) == 0
    assert main(["new", str(file)]) == 2  # an existing file is kept
    assert "exists" in capsys.readouterr().err
    text = file.read_text()
    for old, new in (
        ("dip = 36.0", "dip = 30.0"),
        ("seed = 1", "seed = 4"),
        ("persistence = 0.7", "persistence = 0.5"),
        ("end = 1.0", "end = 0.1"),
        ("record = 0.02 ", "record = 0.05 "),
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
    assert 1e-5 < float(last["point 1: displacement_m"]) < 1e-2  # settlement of its block
    words = ["resume", str(out / "state"), "--until", "0.12", "--no-pictures"]
    assert main([*words, "--out", str(tmp_path / "on")]) == 0


def test_check_recommends_a_closure_range(check):
    default_range = re.sub(r"closure_range = .*\n", "", TEXT)  # the closure at 20 MPa
    printed = check(default_range)
    assert "law 'joint': its joints carry 1e+05 Pa at most" in printed
    (recommended,) = re.findall(r"In \[laws.joint\] write (closure_range = [^,]*),", printed)
    one_cell = "resolution = { u = 4, phi = 6, depth = 1 }"
    corrected = default_range.replace("[laws.joint]", f"[laws.joint]\n{recommended}")
    for text in (TEXT, corrected, re.sub("resolution = .*", one_cell, default_range)):
        assert "closure_range" not in check(text)


def test_joints_have_the_law_of_their_set():
    """A joint between edges of one set has its law, between edges of two sets the scene's law."""
    text = TEXT.replace('law = "joint"\n\n[[rock.fixed', 'law = "plain"\n\n[[rock.fixed') + PLAIN
    scene = parse(
        text.replace("[monitor]", "[[joint]]\naround = [-3.0, 7.0]\nlaw = 'plain'\n[monitor]")
    )
    contains = [Polygon(block.corners).contains(Point(-3.0, 7.0)) for block in scene.blocks]
    plain_block = contains.index(True)
    manager = ContactManager(scene, Blocks(scene).motion)
    first_edge = manager.outlines.first_corner
    block_of_edge = manager.outlines.block
    laws = {int(first_edge[b] + edge): law for (b, edge), law in scene.edge_laws.items()}
    pairs = np.array([*itertools.combinations(sorted(laws), 2)])
    laws_of_pairs = [[*scene.laws][law] for law in manager.laws_of(pairs)]
    for (i, j), law in zip(pairs.tolist(), laws_of_pairs, strict=True):
        law_of_set = laws[i] if laws[i] == laws[j] else "joint"
        is_plain = plain_block in (block_of_edge[i], block_of_edge[j])
        assert law == ("plain" if is_plain else law_of_set)
    assert {*laws.values()} == {*laws_of_pairs} == {"joint", "plain"}
    assert alone(scene, scene.rocks[0].name).pairs == scene.pairs


def test_monitors_and_contacts_of_two_blocks_with_own_laws_agree():
    """Both use the law of the first block, for both orders of the blocks."""
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
    law = load("slope").laws["rough"]
    stress = 5e4  # Pa
    equivalent = coulomb_of_same_strength(law, stress)
    mu = law.asperity.mu
    peak_angle = np.degrees(np.arctan(equivalent.friction))
    assert peak_angle == pytest.approx(friction_angle(law, stress), abs=0.1)
    assert equivalent.residual_friction == pytest.approx(mu, rel=1e-3)
    record = jl.direct_shear(law.joint(), to=[0.2], normal=stress, steps=2000)
    work = trapezoid(np.maximum(record.shear_stress / stress - mu, 0.0), record.shear_2)
    drop = equivalent.friction - mu
    coulomb_work = 0.5 * drop * equivalent.weakening
    work_before_peak = 0.02 * drop  # m: a bound for the joint law
    assert coulomb_work < work < coulomb_work + work_before_peak
    rows = list(compare(load("shaken-slope"), [1], 0.02))
    assert [row["law"] for row in rows] == ["joint", "coulomb"]
    assert rows[1]["laws"]["joint"].friction > rows[1]["laws"]["joint"].residual_friction


BOND = "bond = {{ cohesion = 1e4, tension = 1e4, normal_stiffness = 1e10, shear_stiffness = {} }}\n"


def test_check_warns_of_a_bond_that_breaks_before_friction_is_mobilised(check):
    for stiffness, has_warning in (("1e10", True), ("1e6", False)):
        printed = check(on_base(ROCK + BOND.format(stiffness), [2.0, 1.0]))
        assert ("law 'rock': its bond breaks after 1e-06 m of shear" in printed) == has_warning


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


def test_a_cut_through_an_inward_corner_is_intact_rock():
    """A cantilever 3 m long on the side of a pillar: stable with intact rock, not with a joint."""
    for cut, state in (("", "stable"), ('cut_law = "joint"\n', "displacing")):
        scene = parse(f"[laws.joint]\n{coulomb(0.1, 1e9, 1e9)}" + NOTCHED.replace("CUT", cut))
        messages = scene.rocks[0].messages
        assert any("cuts at inward corners that are no joints: 1," in line for line in messages)
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
def test_each_ingredient_has_a_row_with_its_effect(tmp_path):
    """Without asperity friction only the inclination of 4.5 degrees resists on 22 degrees."""
    (tmp_path / "slope.toml").write_text(SLOPE)
    assert main(["ablate", "slope.toml", "--out", "."]) == 0
    with (tmp_path / "ablation.csv").open() as stream:
        rows = {row["variant"]: row for row in csv.DictReader(stream)}
    assert set(rows) >= NAMES
    assert not any(row["note"] for row in rows.values())
    displacements = {name: float(row["largest displacement_m"]) for name, row in rows.items()}
    whole = displacements["whole scene"]
    assert displacements["whole scene again"] == whole  # bitwise reproducible
    fall = 0.5 * np.hypot(3.675, 9.096) * np.sin(np.radians(22.0 - 4.5)) * 0.05**2
    assert whole < 2e-4
    assert fall < displacements["no friction on asperities"] < 1.3 * fall  # until contacts wind up
    # The displacement of a settled block is small: few sliders are as accurate as many.
    assert abs(float(rows["resolution fine"]["change of block, peak friction_deg"])) < 0.1
    steps = {name: int(row["steps"]) for name, row in rows.items()}
    assert steps["half the time step"] == pytest.approx(2 * steps["whole scene"], abs=2)
    for name, row in rows.items():
        change = float(row["change of largest displacement_m"])
        assert change == pytest.approx(displacements[name] - whole, abs=1e-15)
    times = [float(rows[name]["time_ratio"]) for name in ("whole scene", "whole scene again")]
    assert min(times) == 1.0


def test_variants_have_the_same_closure_at_the_median_stress():
    scene = parse(SHORT)
    record, _ = run(Simulation(scene), None)
    stresses = np.concatenate([frame["normal_stress_Pa"] for frame in record.joints])
    stress = np.median(stresses[stresses > 0])
    assert stress == pytest.approx(2600 * 0.3 * 9.096, rel=0.3)  # unequal at its two ends
    law = scene.laws["rock"]
    changed_stiffnesses = 0
    for name, build_variant in variants(scene, record):
        variant = build_variant().laws["rock"]
        changed_stiffnesses += variant.asperity.K != law.asperity.K
        if "resolution" not in name:
            assert variant.closure(stress) == pytest.approx(law.closure(stress), rel=1e-9)
    assert changed_stiffnesses >= 6


def test_a_variant_with_an_error_is_a_row_and_the_whole_scene_raises():
    """c = 0.5 needs b of -1 or less (Eq. 18); twice a step near the limit is too long."""
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
    assert row["beam, state"] == "stable"
    assert row["beam, displacement_m"] == pytest.approx(0.0, abs=1e-9)
    # a block that overlaps its base at the start: no time step helps
    with pytest.raises(SceneError, match="overlap by"):
        ablate(parse(SLOPE.replace("0.15]", "0.1]")))
