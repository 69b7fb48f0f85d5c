"""Saved states: whole, of one scene, resumed anywhere, and only as the method can carry it."""

from dataclasses import replace
from shutil import rmtree
from unittest.mock import Mock

import numpy as np
import pytest
from scene_text import PLAIN, ROCK
from scipy.sparse.linalg import ArpackNoConvergence

from dem_demo import Refused, Simulation, load, parse
from dem_demo.dynamics import timestep
from dem_demo.dynamics.blocks import Blocks
from dem_demo.output.record import Record, outcomes

TEXT = f"""
gravity = [3.0, -9.0]
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
velocity = [0.1, -0.05]
[[joint]]
between = ["two", "one"]
law = "../../escaped"
[run]
end = 0.02
record = 0.002
"""


def begun(steps, text=TEXT):
    """A simulation some steps after its start."""
    return advanced(Simulation(parse(text)), steps)


def advanced(sim, steps):
    for _ in range(steps):
        sim.step()
    return sim


DRIVE = """
[[drive]]
block = "one"
motion = "x"
file = "motion.csv"
[run]
"""


def test_files_are_found_beside_their_scene_and_kept_in_the_state(tmp_path, monkeypatch):
    """A record and a law, relative to the scene; a state goes on without them, from anywhere."""
    home = tmp_path / "home"
    home.mkdir()
    monkeypatch.chdir("/")
    (home / "motion.csv").write_text("time_s,acceleration_m/s2\n0.0,0.0\n0.1,1.0\n")
    parse(TEXT).laws["rock/rough"].to_toml(home / "mine.toml")
    text = TEXT.replace(ROCK, 'from = "mine.toml"\n').replace("[run]\n", DRIVE)
    (home / "scene.toml").write_text(text)
    sim = Simulation(load(home / "scene.toml"))
    assert sim.scene.laws["rock/rough"].heights is not None
    assert sim.scene.drives[0].times == (0.0, 0.1)
    sim.save(tmp_path / "state")
    rmtree(home)
    again = advanced(Simulation.load(tmp_path / "state"), 20)
    assert (again.blocks.motion == advanced(sim, 20).blocks.motion).all()


def test_a_scene_changed_in_memory_is_not_saved(tmp_path):
    scene = replace(parse(TEXT), gravity=(0.0, -1.0))
    with pytest.raises(ValueError, match=r"changed in memory.*write the change into the TOML text"):
        Simulation(scene).save(tmp_path)
    assert list(tmp_path.iterdir()) == []


CUT = f"""
[laws.bedding]
{PLAIN}[laws.cross]
{PLAIN.replace("0.3", "0.8")}[[rock]]
name = "r"
least_width = 0.1
outline = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]]
[[rock.set]]
dip = 0.0
spacing = 5.0
through = [0.0, 0.5]
law = "bedding"
[[rock.set]]
dip = 90.0
spacing = 5.0
through = [1.0, 0.0]
law = "cross"
[[rock.fixed]]
corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 0.4], [0.0, 0.4]]
[watch]
slip = [["r 3", "r 1"]]
shear = [["r 4", "r 3"]]
[run]
end = 0.1
"""


def test_a_watched_joint_has_the_law_of_the_faces_that_meet():
    """Blocks with a set on each side: edge 0 of both, their bottoms, would give "bedding" twice."""
    record = Record(Simulation(parse(CUT)))
    (slip,) = record.slips.values()
    assert slip["law"] == "bedding"
    assert slip["predicted_angle"] == pytest.approx(np.degrees(np.arctan(0.3)))
    assert list(record.laws.values()) == ["bedding", "cross"]


DAMAGE = ", yield_interference = 2e-4"


@pytest.mark.parametrize("damage", ["", pytest.param(DAMAGE, marks=pytest.mark.slow)])
def test_resume_is_bit_identical(tmp_path, damage):
    """Stop and go on from files, in the middle of impacts and renewed contacts."""
    text = TEXT.replace("mu = 0.4", f"mu = 0.4{damage}").replace("-0.05]", "-0.3]")
    begun(170, text).save(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    again, whole = advanced(Simulation.load(tmp_path), 230), begun(400, text)
    assert (again.blocks.motion == whole.blocks.motion).all()
    assert (again.joints.traction == whole.joints.traction).all()
    assert again.time == whole.time
    assert again.ledger.value == whole.ledger.value
    assert again.limit.least == whole.limit.least
    batch = again.joints.held[again.joints.names.index("rock/rough")].batch
    assert bool(damage) == (batch.plastic_work.max() > 0.0)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_damaged_file_or_another_version_is_refused(tmp_path):
    begun(3).save(tmp_path)
    file = tmp_path / "state.npz"
    whole, arrays = file.read_bytes(), dict(np.load(file))
    damaged = r"state\.npz is damaged .*run the scene again"
    lacking = {key: value for key, value in arrays.items() if key != "states-1"}
    for write, told in (
        (lambda: file.write_bytes(whole[: len(whole) // 2]), damaged),
        (lambda: file.write_bytes(b""), damaged),
        (lambda: file.write_bytes(whole[:2000] + bytes([whole[2000] ^ 1]) + whole[2001:]), damaged),
        (lambda: np.savez(file, **lacking), damaged),
        (lambda: np.savez(file, **{**arrays, "version": 3}), "version 3, this demo reads 8: go on"),
        (file.unlink, r"holds no saved state: state\.npz is missing"),
    ):
        write()
        with pytest.raises(ValueError, match=told):
            Simulation.load(tmp_path)


def test_a_state_that_is_refused_changes_nothing():
    """A joint that the state lacks would be virgin again, without a word; so would a bad step."""
    sim = begun(5)
    state, limit = sim.state(), sim.limit.now
    state["states-0"] = state["states-0"][:, :-1]
    with pytest.raises(ValueError, match="not those of the scene's laws and contacts"):
        Simulation(sim.scene, saved=state)
    for step in (0.0, np.inf, np.nan):
        with pytest.raises(ValueError, match=r"step = .* s: must be a finite number > 0"):
            Simulation(sim.scene, step, sim.state())
    with pytest.raises(Refused, match=r"must stay below 0\.98 of the limit"):
        Simulation(sim.scene, 1.01 * limit, sim.state())
    assert (advanced(sim, 1).blocks.motion == begun(6).blocks.motion).all()


def test_an_eigenvalue_that_does_not_converge_is_computed_exactly(monkeypatch):
    scene = load("slope")
    whole = Simulation(scene).limit.now
    never = Mock(side_effect=ArpackNoConvergence("", np.zeros(0), np.zeros((0, 0))))
    monkeypatch.setattr(timestep, "eigsh", never)
    assert Simulation(scene).limit.now == pytest.approx(whole, rel=1e-6)
    assert never.called


@pytest.mark.parametrize("size", [0.01, 1.0, 100.0])
def test_failure_is_counted_by_the_size_of_the_blocks(size):
    """A tenth of a block, in a model of centimetres as in one of a hundred metres."""
    scene = load("slope")
    blocks = tuple(replace(block, corners=size * block.corners) for block in scene.blocks)
    scene, rock = replace(scene, blocks=blocks), scene.rocks[0]
    start = Blocks(scene).motion
    end = start.copy()
    end[0, rock.free[:2]] += [0.2 * size, 0.05 * size]  # of blocks of about 1 m2 times size**2
    record = object.__new__(Record)
    record.scene, record.times, record.motion = scene, [0.0, 1.0], [start, end]
    assert [entry["failed"] for entry in outcomes(record)] == [1, 0]
