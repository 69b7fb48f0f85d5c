"""What a user gives the block demo: named if it is nonsense, and no run is thrown away for it."""

import json
import os
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scene_text import PLAIN, ROCK

import jointlaw as jl
from dem_demo import SceneError, coulomb_law, load, parse
from dem_demo.cli import main
from dem_demo.output import law_alone
from dem_demo.scene import Drive, build
from dem_demo.scene.drives import Reversal
from dem_demo.scene.read import SCENES
from dem_demo.studies import ablate, compare
from dem_demo.studies.ablate import _without
from dem_demo.studies.ingredients import Variant
from jointlaw.laboratory.experiments import PathError

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
held = ["turn"]
[[joint]]
between = ["top", "base"]
law = "rock"
[watch]
slip = [["top", "base"]]
shear = [["top", "base"]]
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


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[laws.plain]", "[laws]\nx = 1\n[laws.plain]", r"scene\.laws\.x = 1: must be a table"),
        ("orientation = { a = 3.0 }", "orientation = 1", "orientation"),
        ("friction = 0.3", "friction = true", "friction = True: must be a number"),
        ('held = ["turn"]', 'held = [["x"]]', r"held = \[\['x'\]\]: must be some of x, y, turn"),
        ('held = ["turn"]', 'held = ["x", "x"]', "held = .*must be some of x, y, turn, each once"),
        ('held = ["turn"]', 'held = ["z"]', "held = .*must be some of x, y, turn"),
        ('slip = [["top", "base"]]', 'slip = [[["top"], "base"]]', r"slip.*\[moving block, its"),
        ('slip = [["top", "base"]]', 'slip = [["top", "top"]]', r"slip.*\[moving block, its base"),
        ('between = ["top", "base"]', 'between = [["top"], "base"]', "between.*must name two bloc"),
        ('between = ["top", "base"]', 'between = ["top", "top"]', "between.*must name two blocks"),
        (
            "[watch]",
            '[[joint]]\nbetween = ["base", "top"]\nlaw = "plain"\n[watch]',
            r"joint\[1\]\.law = 'plain': another \[\[joint\]\] gives these blocks another law",
        ),
        ("law_steps = 2", "law_steps = 2.9", "law_steps = 2.9: must be a whole number"),
        ("values = [0.0, 1e-3]", "values = [0.0, nan]", "values = .*: must be finite numbers"),
        ("times = [0.0, 0.1]", "times = [0.0, nan]", "times = .*: must be finite numbers"),
        ("values = [0.0, 1e-3]", "values = [[0.0, 1e-3]]", "values = .*: must be finite numbers"),
        ("times = [0.0, 0.1]", 'times = ["a"]', "times = .*: must be finite numbers"),
        ("at = [0.0, 0.25]", "at = [false, 0.25]", "at = .*: must be two numbers"),
        ("box = [4.0, 1.0]", "corners = [[true, 0], [1, 0], [0, 1]]", "corners must be a list of"),
        ("box = [4.0, 1.0]", 'corners = [["0", 0], [1, 0], [0, 1]]', "corners must be a list of"),
        ("end = 0.002", "end = 1" + 400 * "0", "end = inf: must be finite"),
    ],
)
def test_nonsense_is_named(old, new, message):
    assert old in TEXT
    with pytest.raises(SceneError, match=message):
        parse(TEXT.replace(old, new, 1))


def shaken(by):
    """The scene with another motion of its drive."""
    return TEXT.replace("times = [0.0, 0.1]\nvalues = [0.0, 1e-3]", by)


MOTION = "time_s,acceleration_m/s2\n0.0,1.0\n0.1,1.0\n0.2,-1.0\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (MOTION.replace("m/s2", "g"), r"line 1: must be 'time_s,velocity_m/s' or 'time_s,accel"),
        ("", "line 1: must be"),
        (MOTION.replace("0.1,1.0", "0.1;1.0"), "line 3: '0.1;1.0' must be two numbers"),
        (MOTION.replace("0.1,1.0", "0.1,1.0,2.0"), "line 3: .* must be two numbers"),
        (MOTION.replace("0.1,1.0", "0.1,nan"), "line 3: '0.1,nan' must be two numbers"),
        (MOTION.replace("0.1,1.0", ""), "line 3: '' must be two numbers"),
        (MOTION.replace("0.2,", "0.1,"), r"line 4: time 0\.1 s must be >= 0 and increase"),
        (MOTION.replace("0.0,", "-1,"), "line 2: time -1 s must be >= 0"),
        (MOTION.replace("acceleration_m/s2", "velocity_m/s"), "line 2: velocity 1 m/s must be 0"),
        (MOTION[:33], "must have two rows of numbers or more"),
        (None, "cannot be read"),
    ],
)
def test_a_bad_record_is_refused_by_its_line(tmp_path, text, message):
    file = tmp_path / "motion.csv"
    if text is not None:
        file.write_text(text)
    with pytest.raises(SceneError, match=r"drive\[0\]\.file: .*motion\.csv.*" + message):
        parse(shaken(f'file = "{file}"\nscale = 2.0'))


@pytest.mark.parametrize("title", ["acceleration_m/s2", "velocity_m/s"])
def test_a_record_moves_its_block(tmp_path, title):
    """Straight lines between accelerations, or velocities, by hand; then at constant velocity."""
    file = tmp_path / "motion.csv"
    file.write_text(f"time_s, {title}\n0.1,0.0\n0.3,0.5\n0.5,0.5\n")
    (drive,) = (d for d in parse(shaken(f'file = "{file}"\nscale = 2.0')).drives if d.order)
    once = np.array([0.0, 0.0, 0.025, 0.1, 0.2, 0.3, 0.4])  # doubled by `scale`
    t = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6])
    found = [drive(at) for at in t]
    if title.startswith("velocity"):
        np.testing.assert_allclose(found, once, atol=1e-15)
        return
    # integrals of `once`: 5 s**3/6 while it rises, then a parabola, then a line
    twice = [0.0, 0.0, 5e-3 / 6, 0.04 / 6, 0.04 / 6 + 0.01 + 0.005, 0.04 / 6 + 0.02 + 0.02]
    np.testing.assert_allclose(found, [*twice, twice[-1] + 0.03], atol=1e-15)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_drive_goes_back_the_way_it_came(sign):
    back = Reversal(block=0, slid=0.1, by=3.0, rate=2.0)
    drive = Drive(1, 0, (0.0, 1.0), (0.0, sign * 2.0), back=back)
    assert drive(0.5, 0.5) == pytest.approx(sign)
    assert drive(1.5, 0.5) == pytest.approx(sign * (1.0 - 2.0))
    assert drive(9.0, 0.5) == pytest.approx(sign * (1.0 - 3.0))
    falls = replace(drive, times=(0.0, 1.0, 2.0), values=(0.0, sign * 2.0, 0.0))
    assert falls(2.0, 1.5) == pytest.approx(sign * (1.0 + 1.0))


def test_a_moving_block_is_watched_on_one_base():
    third = '[[block]]\nname = "third"\nbox = [1.0, 1.0]\nat = [9.0, 9.0]\n[[joint]]'
    text = TEXT.replace("[[joint]]", third).replace('shear = [["top", "base"]]',
                                                    'shear = [["top", "third"]]')  # fmt: skip
    with pytest.raises(SceneError, match="watch one block on two bases"):
        parse(text)


def test_joints_by_block_names_stay_with_their_rock():
    data = tomllib.loads((SCENES / "slope.toml").read_text())
    data.pop("variants")
    name = data["rock"][0]["name"]
    mine = {"between": [f"{name} 1", f"{name} 2"], "law": next(iter(data["laws"]))}
    other = {"between": ["x 1", "x 2"], "law": next(iter(data["laws"]))}
    data["block"] = [{"name": "wall"}]
    beside = {"between": ["wall", f"{name} 1"], "law": next(iter(data["laws"]))}
    data["joint"] = [mine, other, beside]
    assert compare.alone(data, name)["joint"] == [mine, beside]


def test_joints_by_block_names_are_of_the_seed_of_the_file():
    text = (SCENES / "slope.toml").read_text().split("[variants")[0]
    name, law = "rough", "rough"
    near = f'[[joint]]\nbetween = ["{name} 1", "{name} 2"]\nlaw = "{law}"\n'
    cases = compare._cases(f"{text}\n{near}", [1, 2])
    kept = {(case["seed"], data["rock"][0]["name"]): len(data["joint"]) for case, data in cases}
    assert kept[1, name] == kept[2, name] + 1


def test_a_critical_tilt_takes_no_tilt(capsys):
    assert main(["compare", "slope", "--critical", "--tilt", "3"]) == 2
    assert "leave out --until and --tilt" in capsys.readouterr().err


def test_a_sine_rises_and_falls_and_ends_at_rest():
    text = shaken("sine = { acceleration = 3.0, frequency = 5.0, cycles = 4 }")
    (drive,) = (d for d in parse(text).drives if d.order)
    assert drive.times[-1] == pytest.approx(6 / 5)
    assert max(drive.values) == pytest.approx(3.0)
    assert drive.path(drive.times[-1], nu=1) == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(SceneError, match=r"sine\.cycles = 0.*must be >= 1"):
        parse(text.replace("cycles = 4", "cycles = 0"))
    with pytest.raises(SceneError, match="shakes along x or y"):
        parse(text.replace('motion = "x"', 'motion = "turn"'))
    with pytest.raises(SceneError, match="times is unknown"):
        parse(text.replace("sine =", "times = [0.0, 1.0]\nsine ="))


@pytest.mark.parametrize("table", ["joint", "block", "drive", "rock"])
def test_lists_of_tables_hold_tables(table):
    with pytest.raises(SceneError, match=rf"scene\.{table}\[0\] = 1: must be a table"):
        build({**tomllib.loads(TEXT), table: [1]})


def test_a_file_that_is_no_text_is_named(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(SceneError, match=r"scene\.toml is not UTF-8 text"):
        load(file)


@pytest.mark.parametrize(
    ("old", "new"),
    [("at = [0.0, 0.25]", "at = [0.0, 0.3]"), ("gravity = [0.0, -9.81]", "gravity = [0.0, 0.0]")],
    ids=["in the air", "without gravity"],
)
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_a_run_without_a_prediction_is_kept(old, new, tmp_path, capsys):
    file, out = tmp_path / "scene.toml", tmp_path / "out"
    file.write_text(TEXT.replace(old, new))
    assert main([str(file), "--out", str(out)]) == 0
    assert "top: no slip (the law alone says nothing)" in capsys.readouterr().out
    slip = json.loads((out / "summary.json").read_text())["slip"][0]
    assert slip["predicted_angle"] is slip["normal_stress"] is None
    assert (out / "state").is_dir()
    for name in ("curves.png", "final.png", "history.csv"):
        assert (out / name).is_file()


def test_a_law_that_fails_on_its_path_predicts_nothing(monkeypatch):
    scene, none = parse(TEXT), {"predicted_angle": None, "normal_stress": None}
    assert law_alone.slip_angle(scene, 1, 0, 1.0)["predicted_angle"] > 20

    def fails(*_args, **_keys):
        raise PathError("no further", None)

    monkeypatch.setattr(jl, "direct_shear", fails)
    assert law_alone.slip_angle(scene, 1, 0, 1.0) == none
    assert law_alone.shear_curve(scene.laws["rock"], 1e4, np.array([0.0, 1e-3])) is None
    row = _without(
        Variant("plain", lambda: law_alone.friction_angle(scene.laws["rock"], 1e4)), *3 * [None]
    )
    assert row.note == "cannot be built: no further"


def test_an_angle_that_is_not_found_is_given_up(monkeypatch):
    """Two angles in turn, for ever: no fixed point to predict."""
    angles = iter(10 * [20.0, 40.0] + 10_000 * [20.0, 40.0])
    monkeypatch.setattr(law_alone, "friction_angle", lambda law, stress: next(angles))
    assert law_alone.slip_angle(parse(TEXT), 1, 0, 1.0)["predicted_angle"] is None


@pytest.mark.parametrize("verb", ["compare", "ablate"])
def test_a_place_for_the_results_is_made_before_the_work(verb, tmp_path, monkeypatch, capsys):
    """One that cannot be is refused before anything runs, not after."""
    ran = []
    where = {"compare": compare, "ablate": ablate}[verb]
    monkeypatch.setattr(where, verb, lambda *_: ran.append(1) or [])
    (tmp_path / "file").touch()
    assert main([verb, "slope", "--out", str(tmp_path / "file" / "below" / "x.json")]) == 2
    assert not ran
    if verb == "compare":
        out = tmp_path / "no" / "such" / "x.json"
        assert main([verb, "slope", "--out", str(out)]) == 0
        assert json.loads(out.read_text())["rows"] == []


def test_a_missing_package_is_told_in_one_line(tmp_path):
    (tmp_path / "pymunk.py").write_text("raise ModuleNotFoundError('No module named pymunk')\n")
    here = Path(__file__).parents[2]
    path = os.pathsep.join([str(tmp_path), str(here)])
    done = subprocess.run(
        [sys.executable, "-m", "dem_demo"], env={**os.environ, "PYTHONPATH": path}, cwd=tmp_path,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode != 0
    assert "No module named pymunk" in done.stderr
    assert "pip install 'jointlaw[demo]'" in done.stderr
    assert len(done.stderr.splitlines()) == 1


def test_plain_coulomb_is_what_its_numbers_say():
    """Springs kn and ks, a cap of friction times normal stress: by hand, to rounding."""
    kn, ks, mu = 1e9, 8e8, 0.3
    joints = coulomb_law(kn, ks, mu).joints(1)
    sums = np.cumsum([[2e-5, 0.0], [0.0, 4e-6], [0.0, 4e-5], [-1e-5, 0.0], [-2e-5, 0.0]], axis=0)
    shear = [0.0, ks * 4e-6, mu * kn * 2e-5, mu * kn * 1e-5, 0.0]
    for i, (closure, slid) in enumerate(sums):
        F, _ = joints.update([[closure, slid]] - joints.delta, tangent=False)
        assert F[0] == pytest.approx([kn * max(closure, 0.0), shear[i]], rel=1e-12, abs=1e-9)
    never = coulomb_law(kn, ks, np.inf).joints(1)
    F, _ = never.update([[1e-9, 1.0]], tangent=False)
    assert F[0, 1] == pytest.approx(ks, rel=1e-12)


def test_a_law_by_name_and_the_keys_that_replace_its_own(tmp_path, monkeypatch):
    given = jl.presets.load("westerly-rough")
    text = TEXT.replace(ROCK, 'from = "westerly-rough"\nasperity = { mu = 0.5 }\n')
    assert text != TEXT
    law = next(iter(parse(text).laws.values()))
    assert law == replace(given, plane=0.0, asperity=replace(given.asperity, mu=0.5))

    monkeypatch.chdir(tmp_path)
    given.to_toml("mine.toml")
    from_file = text.replace('"westerly-rough"', '"mine.toml"')
    assert next(iter(parse(from_file).laws.values())) == law
    with pytest.raises(SceneError, match=r"laws\.\w+\.from: 'no\.toml' is neither a preset"):
        parse(text.replace('"westerly-rough"', '"no.toml"'))
