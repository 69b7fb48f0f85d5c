"""Input of the block demo: it is read as intended, and errors name the invalid value."""

import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from scene_text import PLAIN, ROCK

import jointlaw as jl
from dem_demo import load, parse
from dem_demo.output import monitors
from dem_demo.scene import TEMPLATE, Files, build, build_law, read_tables
from dem_demo.scene.keys import SCENE
from dem_demo.scene.read import SCENES
from dem_demo.studies.strength import alone
from jointlaw import PathError

TEXT = f"""
gravity = [0.0, -9.81]
[laws.rock]
{ROCK}[laws.plain]
{PLAIN}[[block]]
name = "base"
box = [4.0, 1.0]
at = [0.0, -0.5]
fixed = true
[[block]]
name = "top"
box = [1.0, 0.5]
at = [0.0, 0.25]
fixed_motions = ["turn"]
[[joint]]
between = ["top", "base"]
law = "rock"
[monitor]
slip = [["top", "base"]]
[[drive]]
block = "top"
motion = "x"
times = [0.0, 0.1]
values = [0.0, 1e-3]
[run]
end = 0.002
record = 0.001
step = 1e-4
law_steps = 2
"""
BOX = "box = [1.0, 0.5]\nat = [0.0, 0.25]"
LINES = "times = [0.0, 0.1]\nvalues = [0.0, 1e-3]"
ROCKS = TEMPLATE.read_text()
VARIANT = """
[variants.flat]
title = "Flat"
laws = { joint = { mating_length = 1e-3 } }
[[variants.flat.rock]]
seed = 7
set = [{ dip = 5.0 }]
"""
FLAT = f'variant = "flat"\n{ROCKS}{VARIANT}'
TWICE = '[[joint]]\nbetween = ["base", "top"]\nlaw = "plain"\n[monitor]'
WRONG = [
    ('name = "top"', 'name = "top"\ndensty = 3', "densty' is unknown; did you mean 'density'"),
    ("end = 0.002", "", "run.end' is missing"),
    ("end = 0.002", "end = 0.0", "run.end = 0.0 .* must be > 0"),
    ("end = 0.002", "end = 1" + 400 * "0", "end = .* not a number"),
    ("end = 0.002", 'end = "2"', "end = '2' is not a number"),
    ("step = 1e-4", "fraction = 2.0", "fraction = 2.0: must be from 1e-06 to 0.95"),
    ("law_steps = 2", "law_steps = 2.9", "law_steps = 2.9 .* whole number >= 1"),
    ("[run]", "[run", "at line 34"),
    ("[run]", '[in_situ]\nbottom = "fixed"\n[run]', "give either k0 or stress"),
    (
        'block = "top"\nmotion = "x"',
        'motion = "x"\nreverse = { block = "top", slip = 1.0, by = 1.0, duration = 1.0 }',
        "name one; .* without `reverse`",
    ),
    ("[laws.plain]", "[laws]\nx = 1\n[laws.plain]", "laws.x = 1: must be a table"),
    ("mu = 0.4", "mu = -0.4", "mu"),
    ("mating_length = 2e-3", "closure_only = true", "closure_only = true: .* leave it out"),
    (
        'kind = "coulomb"',
        'kind = "glue"',
        "kind = 'glue' is unknown; choose one of joint, coulomb",
    ),
    ("friction = 0.3", "friction = -0.3", "friction = -0.3 .* must be >= 0"),
    ("friction = 0.3", "friction = true", "friction = True is not a number"),
    (
        "normal_stiffness = 1000000000.0",
        "normal_stiffness = 5.0",
        "normal_stiffness = 5 Pa/m is outside .*1e.06 to 1e.15 Pa/m.: 1 GPa/m is 1e9",
    ),
    ("K = 9.5e6", "K = 9.5e16", "laws.rock: stiffness at 1 MPa = .* Pa/m is outside"),
    ('law = "rock"', 'law = "rocks"', "law = 'rocks' is unknown; did you mean 'rock'"),
    ("gravity = [0.0, -9.81]", "gravity = 9.81", "gravity = 9.81: must be two numbers"),
    ("box = [1.0, 0.5]", "box = [1.0, -0.5]", "or box. must be convex"),
    (BOX, "corners = [[0, 0], [0, 1], [1, 0]]", "counter-clockwise"),
    ("box = [1.0, 0.5]", 'corners = [["0", 0], [1, 0], [0, 1]]', "'0' is not a number"),
    ("box = [1.0, 0.5]", "spin = 1.0", "give `corners` alone, or `box` with"),
    (
        "box = [1.0, 0.5]",
        "corners = [[0, 0], [1, 0], [0, 1]]",
        "give `corners` alone, or `box`",
    ),
    ('name = "top"', 'name = "base"', "two blocks have the same name"),
    ('fixed_motions = ["turn"]', "fixed = true", "no block can move"),
    (
        'fixed_motions = ["turn"]',
        "fixed = true\nspin = 1.0",
        "a fixed block has no velocity or spin",
    ),
    (
        'fixed_motions = ["turn"]',
        'fixed_motions = ["x", "x"]',
        "fixed_motions = .* some of x, y, turn, each once",
    ),
    (
        'fixed_motions = ["turn"]',
        'fixed_motions = ["x"]',
        "a motion of a block is prescribed twice",
    ),
    ('slip = [["top", "base"]]', 'slip = [["top", "top"]]', "slip = .* must be 2 of base, top"),
    (
        'slip = [["top", "base"]]',
        "points = [[9.0, 0.0]]",
        "points = .*inside a block that can move",
    ),
    ('between = ["top", "base"]', 'between = [["top"], "base"]', "between = .* must be 2 of"),
    ("[monitor]", TWICE, r"joint\[1\]: another \[\[joint\]\] gives these blocks another law"),
    (
        'block = "top"',
        'block = "bse"',
        "drive.0..block = 'bse' is unknown; did you mean 'base'",
    ),
    (
        'block = "top"\nmotion = "x"',
        'motion = "turn"',
        "drive.0..block: name one; without it all",
    ),
    ("times = [0.0, 0.1]", "scale = 2.0\ntimes = [0.0, 0.1]", "scale, times, values do not go"),
    ("times = [0.0, 0.1]", "times = [0.1, 0.1]", "times: must increase, one for each"),
    ("values = [0.0, 1e-3]", "values = [0.0, nan]", "values = .* is not finite"),
    (LINES, "sine = { acceleration = 1.0, frequency = 5.0, cycles = 0 }", "cycles = 0 .* >= 1"),
    (ROCK, 'from = "no.toml"\n', r"'no\.toml' is neither a preset"),
]
WRONG_ROCKS = [
    ("dip = 36.0", "dip = 96.0", r"rock\[0\].set\[0\].dip = 96.0: must be from -90"),
    ("dip = 36.0", "dipp = 36.0", "dipp' is unknown"),
    ("spacing = 1.3", "spacing = 0.0", r"set\[0\].spacing = 0.0 .* must be > 0"),
    ("scatter = 0.2", "scatter = 1.0", r"scatter = 1.0: must be from 0 to 0.999"),
    ("persistence = 0.7", "persistance = 0.7", "did you mean 'persistence'"),
    ("seed = 1", "seed = 1.5", "seed = 1.5 .* whole number"),
    ("[4.0, 1.0], [1.5, 1.0]", "[-9.0, 9.0], [1.5, 1.0]", "outline: .* do not cross"),
    ('name = "slope"', 'name = "slope"\nlike = "hill"', "like = 'hill': no rock further up"),
    ('name = "slope"', 'name = "slope"\nlaws = { rough = "joint" }', "no set .* law 'rough'"),
    (
        "points = [[-2.0, 7.5]",
        "points = [[-2.0, 17.5]",
        r"points = \[-2.0, 17.5\]: must lie inside",
    ),
    ("[monitor]", "[[joint]]\naround = [50.0, 0.0]\nlaw = 'joint'\n[monitor]", "around = .*inside"),
    (
        'persistence = 0.7\nlaw = "joint"',
        'persistence = 0.7\nlaw = "j"',
        "law = 'j' is unknown",
    ),
    ('name = "slope"', 'name = "slope"\nmin_width = 1e3', "would be slivers: give a min_width"),
    (
        "[monitor]",
        "[monitor]\njoints = [[9.0, -9.0]]",
        r"joints = \[9.0, -9.0\]: must lie at a joint",
    ),
]


@pytest.mark.parametrize(
    ("text", "old", "new", "message"),
    [
        *((TEXT, *row) for row in WRONG),
        *((ROCKS, *row) for row in WRONG_ROCKS),
        (FLAT, '"flat"', '"flt"', "variant = 'flt' is unknown; did you mean 'flat'"),
        (FLAT, "seed = 7", "sead = 7", "sead' is unknown; did you mean 'seed'"),
    ],
)
def test_errors_name_the_invalid_value(text, old, new, message):
    assert old in text
    with pytest.raises(ValueError, match=message):
        parse(text.replace(old, new, 1), "scene.toml")


@pytest.mark.parametrize("table", ["joint", "block", "drive", "rock"])
def test_lists_of_tables_hold_tables(table):
    with pytest.raises(ValueError, match=rf"scene: .*{table}\[0\].* must be a table"):
        build({**tomllib.loads(TEXT), table: [1]})


def test_the_skin_of_a_run_sets_the_length_of_soft_contacts():
    scene = parse(TEXT.replace("[run]", "[run]\nskin = 0.012"), "scene.toml")
    assert scene.run.skin == 0.012
    assert scene.run.soft == pytest.approx(0.25 * 0.012)


def test_a_variant_changes_what_it_names():
    """Tables are overlaid key by key, lists of tables in order; all other keys stay."""
    scene = read_tables(ROCKS + VARIANT)
    flat = read_tables(FLAT)
    assert flat["title"] == "Flat"
    assert flat["laws"]["joint"] == {**scene["laws"]["joint"], "mating_length": 1e-3}
    (rock,) = flat["rock"]
    assert [joints["dip"] for joints in rock["set"]] == [5.0, -60.0]
    sets = [{**scene["rock"][0]["set"][0], "dip": 5.0}, scene["rock"][0]["set"][1]]
    assert rock == {**scene["rock"][0], "seed": 7, "set": sets}
    assert {key for key in scene if flat[key] != scene[key]} == {"title", "laws", "rock"}


def test_an_error_names_a_file_that_is_no_text(tmp_path):
    (tmp_path / "scene.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ValueError, match=r"scene\.toml is not UTF-8 text"):
        load(tmp_path / "scene.toml")


MOTION = "time_s,acceleration_m/s2\n0.0,1.0\n0.1,1.0\n0.2,-1.0\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            MOTION.replace("m/s2", "ft/s2"),
            "must be a line such as 'time_s,.*Acc .g.'",
        ),
        (MOTION.replace("0.1,1.0", "0.1,nan"), "line 3: '0.1,nan' must be two numbers"),
        (MOTION.replace("0.1,1.0", "0.1,1.0,2.0"), "line 3: .* must be two numbers"),
        (MOTION.replace("0.2,", "0.1,"), r"line 4: time 0\.1 s must be >= 0 and increase"),
        (MOTION.replace("acceleration_m/s2", "velocity_m/s"), "line 2: the first value must be 0"),
        (MOTION[:33], "must be a line .*, then numbers"),
        (MOTION.replace("time_s", "time_ms"), "must be a line"),
        (None, "cannot be read"),
    ],
)
def test_an_error_names_the_invalid_line_of_a_record(tmp_path, text, message):
    if text is not None:
        (tmp_path / "motion.csv").write_text(text)
    shaken = TEXT.replace(LINES, 'file = "motion.csv"\nscale = 2.0')
    with pytest.raises(ValueError, match=r"drive\[0\]\.file: motion\.csv.*" + message):
        parse(shaken, files=Files(tmp_path))


def driven(folder, record, keys=""):
    """Drive that moves a block along a record; keys: further lines of its table."""
    (folder / "motion.csv").write_text(record)
    text = TEXT.replace(LINES, f'file = "motion.csv"\n{keys}')
    return next(d for d in parse(text, files=Files(folder)).drives if len(d.times) > 1)


def test_a_motion_by_points_is_averaged_over_its_ramp():
    """1 mm in 0.1 s, averaged over the last 0.04 s, or by default over 0.1 s."""
    for keys, ramp in (("ramp = 0.04", 0.04), ("", 0.1)):
        *_, drive = parse(TEXT.replace(LINES, f"{LINES}\n{keys}")).drives
        assert drive(0.5 * ramp) == pytest.approx(1e-2 * 0.125 * ramp)
        assert drive(0.1 + ramp) == pytest.approx(1e-3)


@pytest.mark.parametrize(
    ("titles", "unit", "order"),
    [("Time (s),Acc (g)", 9.80665, 2), ('"t [s]","v [cm/s]"', 0.01, 1), ("time_s,a_m/s^2", 1.0, 2)],
)
def test_the_unit_decides_the_derivative_of_a_record(tmp_path, titles, unit, order):
    drive = driven(tmp_path, f"{titles}\n0.0,0.0\n0.1,2.0\n")
    assert (drive.order, drive.values) == (order, (0.0, 2.0 * unit))


@pytest.mark.parametrize("order", [1, 2])
def test_base_correction_ends_at_rest_and_removes_drift(tmp_path, order):
    """Drift, a line in acceleration or a parabola in velocity, does not change the result."""
    s = np.linspace(0.0, 2.0, 101)
    pulse = np.where(s < 1, np.sin(2 * np.pi * s) ** 3, 0.0) + 0.2 * s
    corrected = []
    for drift in (0.0, 0.3 * s ** (2 - order) - 0.4 * s ** (3 - order)):
        table = np.column_stack([1.0 + s, pulse + drift]).tolist()
        rows = [f"time_s,of_{'m/s' if order == 1 else 'm/s2'}", *(f"{t},{v}" for t, v in table)]
        drive = driven(tmp_path, "\n".join(rows), "baseline = true")
        assert [drive.path(3.0, nu=1), drive.path(3.0)] == pytest.approx([0.0, 0.0], abs=1e-13)
        corrected.append(drive.values)
    assert np.ptp(corrected[0]) > 0.5  # the pulse is kept
    np.testing.assert_allclose(*corrected, atol=1e-13)


TENTHS = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6]  # s
# the integral of the record, doubled by `scale`; and its own integral: 5 s**3/6 while the record
# rises, then a parabola, then a line
MOVED = [0.0, 0.0, 0.025, 0.1, 0.2, 0.3, 0.4]
ACCELERATED = [
    0.0,
    0.0,
    5e-3 / 6,
    0.04 / 6,
    0.04 / 6 + 0.015,
    0.04 / 6 + 0.04,
    0.04 / 6 + 0.07,
]
# a clamped cubic of one span is 3 s**2 - 2 s**3 of its rise: it begins and ends at rest
CUBIC = [0.0, 0.0, 1e-3 * 10 / 64, 5e-4, 1e-3, 1e-3]
RISE = "\n0.1,0.0\n0.3,0.5\n0.5,0.5\n"


@pytest.mark.parametrize(
    ("record", "scale", "times", "exact"),
    [
        (f"time_s, velocity_m/s{RISE}", 2.0, TENTHS, MOVED),
        (f"time_s, acceleration_m/s2{RISE}", 2.0, TENTHS, ACCELERATED),
        ("time_s,u_mm\n1,0\n3,2\n", 0.5, [0.0, 1.0, 1.5, 2.0, 3.0, 9.0], CUBIC),
    ],
)
def test_a_record_moves_its_block(tmp_path, record, scale, times, exact):
    """Closed forms for linear interpolation; after the record the velocity is constant."""
    drive = driven(tmp_path, record, f"scale = {scale}")
    np.testing.assert_allclose([drive(at) for at in times], exact, atol=1e-15)


def test_a_law_by_name_and_the_keys_that_replace_its_own():
    preset = jl.presets.load("westerly-rough")
    law = build_law({"from": "westerly-rough", "asperity": {"mu": 0.5}}, "law", Files())
    assert law == replace(preset, plane=0.0, asperity=replace(preset.asperity, mu=0.5))


def test_a_prediction_without_a_fixed_point_is_none(monkeypatch):
    """Friction angles that alternate have no fixed point; a law may also fail on its path."""
    scene = parse(TEXT)
    angles = iter(10_000 * [20.0, 40.0])
    monkeypatch.setattr(monitors, "friction_angle", lambda law, stress: next(angles))
    assert monitors.predict_slip(scene, "rock", 1, 1.0)["predicted_angle"] is None

    monkeypatch.setattr(jl, "direct_shear", Mock(side_effect=PathError("no further", None)))
    assert monitors.shear_curve(scene.laws["rock"], 1e4, np.array([0.0, 1e-3])) is None


def test_a_rock_alone_keeps_its_joints():
    """Joints that name its blocks are kept only with its own seed: another gives other blocks."""
    joint = '[[joint]]\nlaw = "rough"\nbetween = ["{}", "{}"]\n'
    pairs = [("rough 1", "rough 2"), ("smooth 1", "smooth 2"), ("wall", "rough 1")]
    wall = '[[block]]\nname = "wall"\nbox = [1.0, 1.0]\nat = [-50.0, 0.0]\n'
    text = (SCENES / "slope.toml").read_text()
    scene = parse(text + wall + "".join(joint.format(*pair) for pair in pairs))
    for seed, pairs in ((None, {(1, 2), (0, 1)}), (2, set())):
        assert {tuple(sorted(pair)) for pair in alone(scene, "rough", seed).pairs} == pairs


@pytest.mark.parametrize("first", range(4))
def test_a_rock_alone_keeps_its_excavation_stages(first):
    """With each first corner of the stage; its corners may lie outside the rock."""
    corners = np.roll([[9.0, -9.0], [13.0, -9.0], [13.0, 0.0], [9.0, 0.0]], first, axis=0)
    stage = f"[[excavate]]\nrelease_time = 0.1\ncorners = {corners.tolist()}\n"
    scene = parse((SCENES / "tunnel.toml").read_text() + stage)
    assert len(scene.stages) == len(alone(scene, "rock").stages) == 3


def test_one_line_names_a_missing_package(tmp_path):
    (tmp_path / "pymunk.py").write_text("raise ModuleNotFoundError('No module named pymunk')\n")
    path = os.pathsep.join([str(tmp_path), str(Path(__file__).parents[2])])
    finished = subprocess.run(
        [sys.executable, "-m", "dem_demo"], env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert finished.returncode != 0
    assert "pip install 'jointlaw[demo]'" in finished.stderr
    assert len(finished.stderr.splitlines()) == 1


PAGE = (Path(__file__).parents[2] / "docs" / "blocks.md").read_text(encoding="utf-8")
INLINE = ("drive.reverse", "drive.sine")  # tables within a line: their keys are in the row


def declared_keys(rules, path=""):
    """Table and name of every declared key: ("rock.set", "dip"), a table itself too."""
    for name, rule in rules.items():
        key = name.removesuffix("!")
        yield path, key
        table = rule[0] if isinstance(rule, list) else rule
        if isinstance(table, dict):
            yield from declared_keys(table, f"{path}.{key}" if path else key)


def documented_keys():
    """Names in backticks in the first two cells of the rows, by the table of the first cell."""
    rows = PAGE.partition("## The keys of a scene")[2].partition("\n## ")[0]
    documented = {}
    tables = []
    for row in re.findall(r"^\|(.+)\|$", rows, re.MULTILINE)[2:]:
        first, names, meaning = (cell.strip() for cell in row.split(" | ", 2))
        if first.strip("| "):
            tables = re.findall(r"\[+([a-zA-Z_.]+)\]+", first) or [""]
        for table in tables:
            documented.setdefault(table, set()).update(re.findall(r"`([a-z_0-9]+)", names))
            for key in re.findall(r"`([a-z_]+)`", names):
                inline = re.findall(r"`\{ ([a-z_, ]+) \}`", meaning)
                documented[f"{table}.{key}"] = {k for part in inline for k in part.split(", ")}
    return documented


def test_every_key_of_a_scene_is_on_its_page():
    documented = documented_keys()
    documented[""] |= {table.split(".")[0] for table in documented} | {"laws", "variants"}
    for table in list(documented):
        parent, _, name = table.rpartition(".")
        if parent in documented:
            documented[parent].add(name)
    declared = {*declared_keys(SCENE)}
    missing = {(table, key) for table, key in declared if key not in documented.get(table, ())}
    assert missing == set()
    assert {table for table, _ in declared} >= {"", "rock.set", "run", *INLINE}
    extra_keys = {"from", "pressure", "kind"}  # of a law, which has no rules here
    assert extra_keys <= documented["laws.NAME"]
    read_elsewhere = {("", "variant"), ("rock", "like")}  # by `read_tables`
    undeclared = {
        (table, key)
        for table in {table for table, _ in declared} - {"laws.NAME"}
        for key in documented[table]
        if table != "" and (table, key) not in declared | read_elsewhere
    }
    assert undeclared == set()
