"""Runs: their files, errors and interrupts, and the restart from a saved state."""

import itertools
import json
import re
from dataclasses import replace
from operator import attrgetter
from shutil import rmtree
from unittest.mock import Mock
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from matplotlib.collections import LineCollection
from scene_text import PLAIN, ROCK, block
from scipy.sparse.linalg import ArpackNoConvergence

from dem_demo import SceneError, Simulation, load, parse, run
from dem_demo.cli import TRIAL_STEPS, main
from dem_demo.dynamics import timestep
from dem_demo.output.pictures import Pictures
from dem_demo.output.record import RunRecord
from dem_demo.scene import shipped
from dem_demo.space import SpaceScene
from dem_demo.space import load as load_in_space

BASE = block("base", box=[4.0, 1.0], at=[0.5, -0.5], fixed=True)
ONE = block("one", box=[1.0, 0.5], at=[0.0, 0.25])
CORNERS = [[-0.3, 0.5], [0.3, 0.5], [0.2, 0.8], [-0.2, 0.8]]
SHORT = f"""
title = "A block on a slope"
gravity = [3.0, -9.0]
[laws.rock]
{ROCK}[laws.plain]
{PLAIN}{BASE}{ONE}{block("two", corners=CORNERS, velocity=[0.0, 0.1])}
[[joint]]
between = ["two", "one"]
law = "plain"
[monitor]
slip = [["one", "base"]]
shear = [["two", "one"]]
[run]
end = 0.12
record = 0.02
fraction = 0.15
"""


def test_run_writes_everything(tmp_path):
    done = tmp_path / "out"
    (tmp_path / "scene.toml").write_text(SHORT)
    assert main([str(tmp_path / "scene.toml"), "--out", str(done)]) == 0
    summary = json.loads((done / "summary.json").read_text())
    written = {path.name for path in done.iterdir()} - {"state", "summary.json"}
    assert set(summary["files"]) == written
    assert written == {"history.csv", "blocks.csv", "final.png", "motion.gif", "curves.png"}
    assert summary["time_step_margin"] > 2
    assert summary["steps"] * summary["time_step_s"] == pytest.approx(0.12, rel=0.01)
    assert summary["scene"] == "A block on a slope"
    slip = summary["slip"][0]
    assert (slip["block"], slip["base"], slip["law"]) == ("one", "base", "rock")
    assert slip["slip_angle"] is None
    assert 35 < slip["predicted_angle"] < 50
    assert abs(summary["energy_error"]) < 5e-3
    header, first, *_ = (done / "history.csv").read_text().splitlines()
    assert header.startswith("time_s,kinetic_J,potential_J")
    assert len(first.split(",")) == len(header.split(","))


def test_line_width_of_a_joint_is_proportional_to_its_normal_stress():
    record, _ = run(Simulation(parse(SHORT)), None, 0.02)
    pictures = Pictures(record)
    stresses = record.joints[-1]["normal_stress_Pa"]
    _, axes = pictures.figure()
    pictures.draw(axes, -1)
    lines = [artist for artist in axes.collections if isinstance(artist, LineCollection)]
    widths = np.concatenate([line.get_linewidths() for line in lines if len(line.get_segments())])
    expected = np.interp(stresses, [0.0, 1.2 * pictures.stress], [0.7, 3.1])
    assert sorted(widths) == pytest.approx(sorted(expected))
    assert expected.max() > 2.0


def test_vtk_files_have_the_numbers_of_the_record(tmp_path):
    sim = Simulation(parse(SHORT))
    record, _ = run(sim, tmp_path, 0.02, pictures=None, vtk=True)
    for kind in ("blocks", "joints"):
        files = ElementTree.parse(tmp_path / "vtk" / f"{kind}.pvd").iter("DataSet")
        times = {float(file.get("timestep")): file.get("file") for file in files}
        assert list(times) == record.times
        assert {*times.values()} <= {path.name for path in (tmp_path / "vtk").iterdir()}
    blocks, joints = (
        meshio.read(sorted(tmp_path.glob(f"vtk/{kind}_*.vtu"))[-1]) for kind in ("blocks", "joints")
    )
    for name in ("closure_m", "shear_m", "normal_stress_Pa", "shear_stress_Pa", "sliding"):
        np.testing.assert_array_equal(joints.cell_data[name][0], record.joints[-1][name])
    assert set(joints.cell_data["state"][0]) <= {0, 1, 2, 3}
    is_base_joint = (np.sort(record.joints[-1]["blocks"]) == [0, 1]).all(axis=1)
    x = record.joints[-1]["ends"][is_base_joint][:, :, 0]  # of the joint below a block of 1 m
    assert [x.min(), x.max(), np.ptp(x, axis=1).sum()] == pytest.approx([-0.5, 0.5, 1.0], abs=1e-3)
    number = np.concatenate(blocks.cell_data["block"]).astype(int)
    largest, vector = (
        np.concatenate(blocks.cell_data[name]) for name in ("stress_1_Pa", "along_stress_1_Pa")
    )
    assert np.hypot(*vector[:, :2].T) == pytest.approx(np.abs(largest), rel=1e-9, nan_ok=True)
    assert np.isnan(largest).tolist() == [block.fixed for block in sim.scene.blocks]
    speed = np.concatenate(blocks.cell_data["velocity_m/s"])[:, :2]
    np.testing.assert_array_equal(speed, record.motion[-1][3:5, number].T)


SHAKEN = f"""
[laws.plain]
{PLAIN}{block("left", box=[2.0, 1.0], at=[-1.0, -0.5], fixed=True)}
{block("right", box=[2.0, 1.0], at=[1.0, -0.5], fixed=True)}
{block("top", box=[1.0, 0.5], at=[-0.9, 0.25])}
[[drive]]
motion = "x"
file = "motion.csv"
[monitor]
points = [[-0.9, 0.4]]
joints = [[-0.6, 0.0]]
[run]
end = 0.3
record = 0.02
"""


def test_history_points_are_relative_to_driven_fixed_rock(tmp_path):
    """Newton's second law: after a ramp of 0.05 s the joint carries mass times 0.2 g, and the block
    moves with the rock, because its friction is 0.3.

    Tolerance 1e-3: vibrations from the ramp, which dashpots damp.
    """
    (tmp_path / "motion.csv").write_text("Time (s),Acc (g)\n0.0,0.0\n0.05,0.2\n0.3,0.2\n")
    (tmp_path / "scene.toml").write_text(SHAKEN)
    scene = load(tmp_path / "scene.toml")
    a = 0.2 * 9.80665  # m/s2
    record, _ = run(Simulation(scene), tmp_path / "out", pictures=None)
    last = record.readings[-1]
    mass = 2600 * 0.5  # kg/m2
    expected = {
        "joint 1: normal_Pa": pytest.approx(mass * 9.81, rel=1e-3),
        "base: vx_m/s": pytest.approx(a * (record.times[-1] - 0.025), rel=1e-2),
        "base: x_m": pytest.approx(a * 0.275**2 / 2, rel=1e-2),
        "point 1: x_m": pytest.approx(-0.9, abs=1e-5),  # 2.5 kPa on springs of 1 GPa/m
        "point 1: y_m": pytest.approx(0.4, abs=1e-4),
        "point 1: vx_m/s": pytest.approx(0.0, abs=1e-3 * last["base: vx_m/s"]),
    }
    assert {name: last[name] for name in expected} == expected
    assert abs(last["joint 1: shear_Pa"]) == pytest.approx(mass * a, rel=1e-3)
    assert record.distances.max() < 1e-5
    header, *_ = (tmp_path / "out" / "history.csv").read_text().splitlines()
    assert set(last) <= set(header.split(","))


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_scenes_are_valid(name, capsys):
    assert main(["check", name]) == 0
    printed = capsys.readouterr()
    if not isinstance(load_in_space(name), SpaceScene):  # which do not move yet
        assert "stability limit" in printed.out
        assert " for figures and animation" in printed.out
    assert "the scene is valid" in printed.out
    assert "warning" not in printed.err


def test_resuming_a_run_stopped_by_ctrl_c_is_bitwise_reproducible(tmp_path, capsys, monkeypatch):
    text = SHORT.replace("end = 0.12", "end = 0.02").replace("record = 0.02", "record = 0.002")
    (tmp_path / "scene.toml").write_text(text)
    words = ["scene.toml", "--no-pictures", "--out"]
    assert main([*words, "whole"]) == 0
    assert not list((tmp_path / "whole").glob("*.png"))
    step = Simulation.step
    count = itertools.count(1)

    def interrupted_step(self):
        step(self)
        if next(count) == TRIAL_STEPS + 37:  # TRIAL_STEPS are for the estimate of the time
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "step", interrupted_step)
        assert main([*words, "part"]) == 130
    message = capsys.readouterr().err.splitlines()[-1]
    assert message.startswith("dem_demo: interrupted; resume from ")
    summary = json.loads((tmp_path / "part" / "summary.json").read_text())
    assert summary["stopped"] == "interrupted"
    assert 0 < summary["steps"] <= 37  # to the last frame
    resume = message.split("python -m dem_demo ")[1].replace("NEW", "end").split()
    assert main([*resume, "--no-pictures"]) == 0
    whole, end = (np.load(tmp_path / name / "state" / "state.npz") for name in ("whole", "end"))
    np.testing.assert_equal(dict(end), dict(whole))


DROP = (
    f"[laws.rock]\n{ROCK}{BASE}"
    + """
[[block]]
name = "block"
box = [1.0, 0.5]
at = [0.0, HEIGHT]
velocity = [0.0, SPEED]
[run]
end = 0.05
settle = false
record = 0.002
skin = 0.05
max_overlap = 0.02
step = STEP
"""
)


@pytest.mark.parametrize(
    ("height", "speed", "step", "why"),
    [
        (0.251, -1.7, 7e-3, "overlap by .* must stay below 0.01 m"),  # 12 mm in the first step
        (0.26, -1.0, 6e-4, "time step 0.0006 s: .* has fallen"),  # short enough for the first touch
        (8.0, -19.6, 6.3e-4, "in one step: must stay below 0.0125 m"),  # and it falls ever faster
    ],
    ids=["overlap", "step", "speed"],
)
def test_failed_runs_are_resumed_with_a_smaller_step(tmp_path, capsys, height, speed, step, why):
    """Each kind of error stops a run; the command that resumes it reaches the end."""
    text = DROP.replace("HEIGHT", str(height)).replace("SPEED", str(speed))
    file = tmp_path / "scene.toml"
    out = tmp_path / "out"
    more = tmp_path / "more"
    file.write_text(text.replace("STEP", str(step)))
    assert main([str(file), "--no-pictures", "--out", str(out)]) == 2
    assert re.search(f"{why}.*{out / 'last_valid_state'}", capsys.readouterr().err)
    assert re.search(why, json.loads((out / "summary.json").read_text())["stopped"])
    assert main([str(file), "--out", str(out)]) == 2
    assert (
        "holds another run (summary.json, history.csv, last_valid_state)" in capsys.readouterr().err
    )
    words = ["resume", str(out), "--step", "1e-4", "--no-pictures", "--out", str(more)]
    assert main(words) == 0
    summary = json.loads((more / "summary.json").read_text())
    assert summary["model_time_s"] == pytest.approx(0.05, abs=1e-4)
    assert summary["time_step_s"] == 1e-4


def test_history_survives_a_gap():
    """A joint that opens by less than the range of contact detection keeps its history."""
    sim = Simulation(parse(SHORT.replace("velocity = [0.0, 0.1]", "velocity = [0.0, 0.3]")))
    face_pairs = sim.manager.face_pairs
    places = sim.joints.place.copy()
    has_opened = False
    for _ in range(600):
        sim.step()
        has_opened |= bool((sim.joints.traction[sim.manager.between(1, 2), 0] == 0).all())
    assert has_opened
    assert sim.manager.face_pairs is face_pairs  # the list of contacts never changed
    assert (sim.joints.place == places).all()


BOND = "bond = { normal_stiffness = 1e9, shear_stiffness = 1e9, tension = 1e4, cohesion = 1e5 }\n"


def test_contacts_that_form_in_a_run_have_no_bond():
    """Opened by a micrometre, joints of the start carry tension by their bond; new ones do not."""
    sim = Simulation(parse(f"[laws.rock]\n{ROCK}{BOND}{BASE}{ONE}[run]\nend = 0.1\n"))
    for has_started, stress in ((False, -1e3), (True, 0.0)):
        new = np.full(sim.joints.n, -1)
        sim.joints.rearrange(new, sim.manager.law, sim.manager.face_pairs, has_started)
        F, _, _ = sim.joints.trial(np.tile([-1e-6, 0.0], (sim.joints.n, 1)))
        assert F[:, 0] == pytest.approx(stress)


TEXT = f"""
gravity = [3.0, -9.0]
[laws."rock/rough"]
{ROCK}[laws."../../escaped"]
{PLAIN}{BASE}{ONE}{block("two", box=[0.5, 0.3], at=[0.0, 0.65], velocity=[0.1, -0.05])}
[[joint]]
between = ["two", "one"]
law = "../../escaped"
[run]
end = 0.02
record = 0.002
"""


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
    """A record and a law are found relative to the scene; a saved state contains them."""
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
    resumed = advanced(Simulation.load(tmp_path / "state"), 20)
    assert (resumed.blocks.motion == advanced(sim, 20).blocks.motion).all()


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
min_width = 0.1
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
[monitor]
slip = [["r 3", "r 1"]]
shear = [["r 4", "r 3"]]
[run]
end = 0.1
"""


def test_a_monitored_joint_has_the_law_of_the_facing_edges():
    """Blocks with a set on each side: the laws of edge 0, the bottom, would be "bedding" twice."""
    record = RunRecord(Simulation(parse(CUT)))
    (slip,) = record.slips.values()
    assert slip["law"] == "bedding"
    assert slip["predicted_angle"] == pytest.approx(np.degrees(np.arctan(0.3)))
    assert list(record.joint_laws.values()) == ["bedding", "cross"]


@pytest.mark.parametrize(
    "damage", ["", pytest.param(", yield_interference = 2e-4", marks=pytest.mark.slow)]
)
def test_resume_is_bit_identical(tmp_path, damage):
    """Save and resume amid impacts and rebuilds of the neighbour list."""
    text = TEXT.replace("mu = 0.4", f"mu = 0.4{damage}").replace("-0.05]", "-0.3]")
    advanced(Simulation(parse(text)), 170).save(tmp_path)
    (tmp_path / "notes.txt").write_text("mine")
    resumed = advanced(Simulation.load(tmp_path), 230)
    whole = advanced(Simulation(parse(text)), 400)
    for name in (
        "blocks.motion",
        "joints.traction",
        "time",
        "energy_balance.value",
        "limit.lowest",
    ):
        np.testing.assert_equal(*(attrgetter(name)(sim) for sim in (resumed, whole)))
    batch = resumed.joints.by_law[resumed.joints.law_names.index("rock/rough")].pool.batch
    assert bool(damage) == (batch.plastic_work.max() > 0.0)
    # displacements of the resumed run are relative to step 0 too
    np.testing.assert_array_equal(RunRecord(resumed).distances, RunRecord(whole).distances)
    assert RunRecord(resumed).distances.max() > 1e-3
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_a_damaged_file_or_another_version_is_refused(tmp_path):
    advanced(Simulation(parse(TEXT)), 3).save(tmp_path)
    file = tmp_path / "state.npz"
    whole = file.read_bytes()
    arrays = dict(np.load(file))
    damaged = r"state\.npz is damaged .*run the scene again"
    incomplete = {key: value for key, value in arrays.items() if key != "states-1"}
    for write, message in (
        (lambda: file.write_bytes(whole[: len(whole) // 2]), damaged),
        (lambda: file.write_bytes(b""), damaged),
        (lambda: file.write_bytes(whole[:2000] + bytes([whole[2000] ^ 1]) + whole[2001:]), damaged),
        (lambda: np.savez(file, **incomplete), damaged),
        (
            lambda: np.savez(file, **{**arrays, "version": 3}),
            "version 3, this demo reads",
        ),
        (file.unlink, r"holds no saved state: state\.npz is missing"),
    ):
        write()
        with pytest.raises(ValueError, match=message):
            Simulation.load(tmp_path)


def test_an_invalid_state_changes_nothing():
    """A joint that the state lacks would silently be virgin again."""
    sim = advanced(Simulation(parse(TEXT)), 5)
    state = sim.state()
    limit = sim.limit.current
    state["states-0"] = state["states-0"][:, :-1]
    with pytest.raises(ValueError, match="not those of the scene's laws and contacts"):
        Simulation(sim.scene, saved=state)
    for step in (0.0, np.inf, np.nan):
        with pytest.raises(ValueError, match=r"step = .* s: must be a finite number > 0"):
            Simulation(sim.scene, step, sim.state())
    with pytest.raises(SceneError, match=r"must stay below 0\.98 of the limit"):
        Simulation(sim.scene, 1.01 * limit, sim.state())
    whole = advanced(Simulation(parse(TEXT)), 6)
    assert (advanced(sim, 1).blocks.motion == whole.blocks.motion).all()


def test_an_eigenvalue_that_does_not_converge_is_computed_exactly(monkeypatch):
    scene = load("slope")
    whole = Simulation(scene).limit.current
    never = Mock(side_effect=ArpackNoConvergence("", np.zeros(0), np.zeros((0, 0))))
    monkeypatch.setattr(timestep, "eigsh", never)
    assert Simulation(scene).limit.current == pytest.approx(whole, rel=1e-6)
    assert never.called
