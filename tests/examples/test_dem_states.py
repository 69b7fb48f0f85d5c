"""Saved states of the block demo: of one scene, whole, resumed only as the method can carry it."""

import struct
import tomllib
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scene_text import PLAIN, ROCK

from dem_demo import Refused, Simulation, parse, run
from dem_demo.cli import main
from dem_demo.scene import build

SPECIMEN = Path(__file__).parent / "specimens" / "state"
TEXT = f"""
[laws."rock/rough"]
{ROCK}[laws."../../escaped"]
{PLAIN}[[block]]
name = "base"
box = [4.0, 1.0]
at = [0.5, -0.5]
fixed = true
[[block]]
name = "one"
box = [1.0, 0.5]
at = [0.0, 0.25]
[[block]]
name = "two"
box = [0.5, 0.3]
at = [0.0, 0.65]
[[joint]]
between = ["two", "one"]
law = "../../escaped"
[run]
end = 0.01
record = 0.002
"""

MOVING = "gravity = [3.0, -9.0]" + TEXT.replace(
    "at = [0.0, 0.65]", "at = [0.0, 0.65]\nvelocity = [0.1, 0.1]"
)


def begun(text=TEXT, steps=5):
    """A simulation some steps after its start."""
    sim = Simulation(parse(text))
    for _ in range(steps):
        sim.step()
    return sim


@pytest.fixture
def saved(tmp_path):
    """The folder of a saved state."""
    begun().save(tmp_path / "in" / "state")
    return tmp_path / "in" / "state"


def test_any_name_of_a_law_can_be_saved(saved, tmp_path):
    """The name is no file name: everything is in the folder, and goes on bit for bit."""
    assert [file.relative_to(tmp_path) for file in tmp_path.rglob("*.npz")] == [
        file.relative_to(tmp_path) for file in saved.glob("*.npz")
    ]
    again, whole = Simulation.load(saved), begun(steps=25)
    for _ in range(20):
        again.step()
    assert (again.now.motion == whole.now.motion).all()
    assert again.now.ledger.value == whole.now.ledger.value


def changed_in_memory():
    """Scenes that are not those of their text."""
    scene = parse(TEXT)
    return [
        replace(scene, gravity=(0.0, -1.0)),
        replace(scene, run=replace(scene.run, dashpot_normal=0.0)),
        replace(scene, text=""),
        replace(scene, laws=dict.fromkeys(scene.laws, scene.laws["rock/rough"])),
    ]


@pytest.mark.parametrize("scene", changed_in_memory(), ids=["gravity", "run", "no text", "laws"])
def test_a_scene_that_its_text_does_not_give_is_not_saved(scene, tmp_path):
    sim = Simulation(scene)
    with pytest.raises(ValueError, match=r"changed in memory.*write the change into the TOML text"):
        sim.save(tmp_path / "state")
    with pytest.raises(ValueError, match="changed in memory"):  # before the work, not after it
        run(sim, tmp_path / "out")
    assert (sim.now.n, list(tmp_path.iterdir())) == (0, [])


def test_a_scene_that_its_text_gives_is_saved_however_it_was_made(tmp_path):
    scene = parse(TEXT)
    made = replace(build(tomllib.loads(TEXT)), text=TEXT, title="another")
    assert made.laws.keys() == scene.laws.keys()
    Simulation(made).save(tmp_path)
    assert Simulation.load(tmp_path).now.n == 0


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("mu = 0.4", "mu = 0.5"),
        ("friction = 0.3", "friction = 0.4"),
        ("at = [0.0, 0.65]", "at = [0.01, 0.65]"),
        ('between = ["two", "one"]', 'between = ["one", "base"]'),
        ("[run]", "[run]\ndashpot_normal = 0.1"),
        ("[laws.", 'gravity = [0.0, -9.0]\nlaw = "rock/rough"\n[laws.'),
        ("[run]", '[[drive]]\nblock = "two"\nmotion = "x"\ntimes = [0.0]\nvalues = [0.0]\n[run]'),
    ],
)
def test_an_edited_scene_is_not_that_of_the_state(old, new, saved):
    file = saved / "scene.toml"
    file.write_text(TEXT.replace(old, new, 1))
    with pytest.raises(ValueError, match="not the scene of this state: only end, record"):
        Simulation.load(saved)


def test_when_to_end_and_to_record_may_change(saved):
    more = "end = 0.02\nfraction = 0.2\n"
    text = TEXT.replace("end = 0.01", more).replace("record = 0.002", "record = 0.003")
    (saved / "scene.toml").write_text('title = "longer"\n' + text)
    assert Simulation.load(saved).scene.run.end == 0.02


def test_a_damaged_file_is_named(saved):
    """Cut short, empty, one byte turned anywhere: never read as if it were whole."""
    file = saved / "state.npz"
    whole, rng = file.read_bytes(), np.random.default_rng(2)
    spoilt = [whole[: len(whole) // 2], b"", b"{}"]
    with zipfile.ZipFile(file) as members:
        for member in members.infolist():  # a byte of its data: the header has no sum
            head = member.header_offset
            start = head + 30 + sum(struct.unpack("<HH", whole[head + 26 : head + 30]))
            at = start + int(rng.integers(member.compress_size))
            spoilt.append(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
    for damage in spoilt:
        file.write_bytes(damage)
        with pytest.raises(ValueError, match=r"state\.npz is damaged .*run the scene again"):
            Simulation.load(saved)
    file.unlink()
    with pytest.raises(ValueError, match=r"holds no saved state \(state\.npz is missing\)"):
        Simulation.load(saved)


def changed(saved, **arrays):
    """Write a state anew with other arrays."""
    with np.load(saved / "state.npz") as data:
        np.savez(saved / "state.npz", **{**data, **arrays})


@pytest.mark.parametrize("version", [1, 99])
def test_a_state_of_another_version_is_refused(version, saved):
    changed(saved, version=version)
    with pytest.raises(ValueError, match=f"version {version}, this demo reads 3: go on with"):
        Simulation.load(saved)


def test_a_state_of_another_discretisation_is_refused(saved):
    with np.load(saved / "state.npz") as data:
        mark = str(data["fingerprint-0"])
    changed(saved, **{"fingerprint-0": "0:" + mark.rpartition(":")[2]})
    with pytest.raises(ValueError, match="discretisation 0, this jointlaw has"):
        Simulation.load(saved)


def test_a_stored_state_goes_on():
    """`specimens/state` is what version 3 wrote of MOVING after 25 steps: it goes on as the scene.

    To a nanometre of the blocks' 0.1 m/s: other machines round differently.
    """
    sim, whole = Simulation.load(SPECIMEN), begun(MOVING, 25)
    assert sim.now.n == 25
    for _ in range(50):
        sim.step()
        whole.step()
    assert sim.now.motion == pytest.approx(whole.now.motion, abs=1e-9)
    assert sim.now.ledger.value["friction"] > 0.05  # J: the history of the joints counts


def test_joints_must_be_those_of_the_law_points():
    """A joint that the state lacks would be virgin again, without a word."""
    sim = begun()
    for spoil in (
        lambda points: points.pop(),
        lambda points: points.append(((9, 9, 9, 9), 9)),
    ):
        state = sim.state()
        spoil(state.joints["rock/rough"][0])
        with pytest.raises(ValueError, match="not those of the scene's laws and law points"):
            sim.restore(state)
    state = sim.state()
    del state.joints["rock/rough"]
    with pytest.raises(ValueError, match="not those of the scene's laws"):
        sim.restore(state)


def test_a_save_that_fails_keeps_the_state_that_was_there(saved, monkeypatch):
    before = {file.name: file.read_bytes() for file in saved.iterdir()}

    def full(*_args, **_arrays):
        raise OSError("no space left on device")

    sim = begun(steps=9)
    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(OSError, match="no space"):
        sim.save(saved)
    assert {file.name: file.read_bytes() for file in saved.iterdir()} == before


def test_what_else_is_in_the_folder_stays(saved):
    (saved / "notes.txt").write_text("mine")
    begun(steps=7).save(saved)
    assert (saved / "notes.txt").read_text() == "mine"
    assert Simulation.load(saved).now.n == 7


@pytest.mark.parametrize("step", [0.0, -1e-4, np.inf, np.nan])
def test_a_step_is_a_finite_number_above_zero(step, saved, capsys):
    with pytest.raises(ValueError, match=r"step = .* s: must be a finite number > 0"):
        Simulation(parse(TEXT), step)
    sim = begun()
    state, motion = sim.state(), sim.now.motion.copy()
    with pytest.raises(ValueError, match=r"step = .* s: must be a finite number > 0"):
        sim.restore(state, step)
    assert (sim.now.motion == motion).all()
    out = saved.parent / "out"
    assert main(["resume", str(saved), f"--step={step}", "--out", str(out)]) == 2
    assert "must be a finite number > 0" in capsys.readouterr().err
    assert not out.exists()


def test_a_step_beyond_the_limit_is_refused_at_once(saved):
    limit = Simulation.load(saved).now.limit.now
    with pytest.raises(Refused, match=r"must stay below 0\.98 of the limit"):
        Simulation.load(saved, step=1.01 * limit)
    sim = Simulation.load(saved, step=0.5 * limit)
    sim.step()
    assert sim.now.dt == 0.5 * limit


@pytest.mark.parametrize("until", ["inf", "nan", "-5", "1e308"])
def test_until_is_a_time_that_can_be_reached(until, saved, capsys):
    out = saved.parent / "out"
    assert main(["resume", str(saved), f"--until={until}", "--out", str(out)]) == 2
    assert "must be" in capsys.readouterr().err
    assert not out.exists()


def test_an_end_out_of_reach_is_refused(tmp_path, capsys):
    file = tmp_path / "scene.toml"
    file.write_text(TEXT.replace("end = 0.01", "end = 1e308"))
    assert main(["check", str(file)]) == 2
    assert "end = 1e+308 s: " in capsys.readouterr().err


def test_a_record_longer_than_the_run_takes_its_ends():
    record, _ = run(begun(TEXT.replace("record = 0.002", "record = 1e308"), steps=0))
    assert len(record.times) == 2
