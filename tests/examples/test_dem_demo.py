"""The command line: a run and its files, runs that are refused or stopped, and go on."""

import itertools
import json
import re
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from scene_text import PLAIN, ROCK

from dem_demo import Simulation, load, parse, run
from dem_demo.cli import TRIED, main
from dem_demo.scene import shipped

SHORT = f"""
title = "A block on a slope"
gravity = [3.0, -9.0]
[laws.rock]
{ROCK}[laws.plain]
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
corners = [[-0.3, 0.5], [0.3, 0.5], [0.2, 0.8], [-0.2, 0.8]]
velocity = [0.0, 0.1]
[[joint]]
between = ["two", "one"]
law = "plain"
[watch]
slip = [["one", "base"]]
shear = [["two", "one"]]
[run]
end = 0.12
record = 0.02
fraction = 0.15
"""


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    """The folder of a run with everything."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "scene.toml").write_text(SHORT)
    assert main([str(folder / "scene.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out"


def test_run_writes_everything(done):
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


def test_vtk_files_hold_what_the_record_holds(tmp_path):
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
    mine = (np.sort(record.joints[-1]["who"]) == [0, 1]).all(axis=1)
    x = record.joints[-1]["ends"][mine][:, :, 0]  # of the joint below a block of 1 m
    assert [x.min(), x.max(), np.ptp(x, axis=1).sum()] == pytest.approx([-0.5, 0.5, 1.0], abs=1e-3)
    number = np.concatenate(blocks.cell_data["block"]).astype(int)
    largest, vector = (
        np.concatenate(blocks.cell_data[name]) for name in ("stress_1_Pa", "along_stress_1_Pa")
    )
    assert np.hypot(*vector[:, :2].T) == pytest.approx(np.abs(largest), rel=1e-9)
    speed = np.concatenate(blocks.cell_data["velocity_m/s"])[:, :2]
    np.testing.assert_array_equal(speed, record.motion[-1][3:5, number].T)


SHAKEN = f"""
[laws.plain]
{PLAIN}[[block]]
name = "left"
box = [2.0, 1.0]
at = [-1.0, -0.5]
fixed = true
[[block]]
name = "right"
box = [2.0, 1.0]
at = [1.0, -0.5]
fixed = true
[[block]]
name = "top"
box = [1.0, 0.5]
at = [-0.9, 0.25]
[[drive]]
motion = "x"
file = "motion.csv"
[watch]
pins = [[-0.9, 0.4]]
joints = [[-0.6, 0.0]]
[run]
end = 0.3
record = 0.02
"""


def test_fixed_rock_is_driven_and_a_block_on_it_told_relative_to_it(tmp_path):
    """Newton: after a ramp of 0.05 s the joint bears mass times 0.2 g, and the block rides along.

    1e-3: vibrations from the ramp, which dashpots damp; friction 0.3 holds it.
    """
    (tmp_path / "motion.csv").write_text("Time (s),Acc (g)\n0.0,0.0\n0.05,0.2\n0.3,0.2\n")
    (tmp_path / "scene.toml").write_text(SHAKEN)
    scene, a = load(tmp_path / "scene.toml"), 0.2 * 9.80665
    record, _ = run(Simulation(scene), tmp_path / "out", pictures=None)
    last, weight = record.monitored[-1], 2600 * 0.5  # kg/m2
    known = {
        "joint 1: normal_Pa": pytest.approx(weight * 9.81, rel=1e-3),
        "base: vx_m/s": pytest.approx(a * (record.times[-1] - 0.025), rel=1e-2),
        "base: x_m": pytest.approx(a * 0.275**2 / 2, rel=1e-2),
        "pin 1: x_m": pytest.approx(-0.9, abs=1e-5),  # 2.5 kPa on springs of 1 GPa/m
        "pin 1: y_m": pytest.approx(0.4, abs=1e-4),
        "pin 1: vx_m/s": pytest.approx(0.0, abs=1e-3 * last["base: vx_m/s"]),
    }
    assert {name: last[name] for name in known} == known
    assert abs(last["joint 1: shear_Pa"]) == pytest.approx(weight * a, rel=1e-3)
    assert record.moved.max() < 1e-5
    header, *_ = (tmp_path / "out" / "history.csv").read_text().splitlines()
    assert set(last) <= set(header.split(","))
    with pytest.raises(ValueError, match=r"joints = \[9.0, 9.0\]: must lie at a joint of a block"):
        parse(SHAKEN.replace("[-0.6, 0.0]", "[9.0, 9.0]"), files=scene.files)


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_scenes_are_valid(name, capsys):
    assert main(["check", name]) == 0
    said = capsys.readouterr()
    assert "margin" in said.out
    assert "without pictures, by its first steps" in said.out
    assert "warning" not in said.err


def test_a_run_stopped_by_ctrl_c_goes_on_bit_for_bit(tmp_path, capsys, monkeypatch):
    text = SHORT.replace("end = 0.12", "end = 0.02").replace("record = 0.02", "record = 0.002")
    (tmp_path / "scene.toml").write_text(text)
    words = ["scene.toml", "--no-pictures", "--out"]
    assert main([*words, "whole"]) == 0
    assert not list((tmp_path / "whole").glob("*.png"))
    step, count = Simulation.step, itertools.count(1)

    def pressed(self):
        step(self)
        if next(count) == TRIED + 37:  # the first ones tell how long the run will take
            raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(Simulation, "step", pressed)
        assert main([*words, "part"]) == 130
    told = capsys.readouterr().err.splitlines()[-1]
    assert told.startswith("dem_demo: interrupted; go on from ")
    summary = json.loads((tmp_path / "part" / "summary.json").read_text())
    assert summary["stopped"] == "interrupted"
    assert 0 < summary["steps"] <= 37  # to the last frame
    resume = told.split("python -m dem_demo ")[1].replace("NEW", "end").split()
    assert main([*resume, "--no-pictures"]) == 0
    whole, end = (np.load(tmp_path / name / "state" / "state.npz") for name in ("whole", "end"))
    for name in whole.files:
        np.testing.assert_array_equal(whole[name], end[name], err_msg=name)


DROP = f"""
[laws.rock]
{ROCK}[[block]]
name = "base"
box = [4.0, 1.0]
at = [0.0, -0.5]
fixed = true
[[block]]
name = "block"
box = [1.0, 0.5]
at = [0.0, HEIGHT]
velocity = [0.0, SPEED]
[run]
end = 0.05
seat = false
record = 0.002
skin = 0.05
max_overlap = 0.02
step = STEP
"""


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
    """By command, for each kind of failure: refused, then resumed to the end of the scene."""
    text = DROP.replace("HEIGHT", str(height)).replace("SPEED", str(speed))
    file, out, more = tmp_path / "scene.toml", tmp_path / "out", tmp_path / "more"
    file.write_text(text.replace("STEP", str(step)))
    assert main([str(file), "--no-pictures", "--out", str(out)]) == 2
    assert re.search(f"{why}.*{out / 'refused'}", capsys.readouterr().err)
    assert re.search(why, json.loads((out / "summary.json").read_text())["stopped"])
    assert main([str(file), "--out", str(out)]) == 2
    assert "holds another run (summary.json, history.csv, refused)" in capsys.readouterr().err
    words = ["resume", str(out / "refused"), "--step", "1e-4", "--no-pictures", "--out", str(more)]
    assert main(words) == 0
    summary = json.loads((more / "summary.json").read_text())
    assert summary["model_time_s"] == pytest.approx(0.05, abs=1e-4)
    assert summary["time_step_s"] == 1e-4


def test_history_survives_a_gap():
    """A joint that opens for less than the reach of the search is the same joint afterwards."""
    sim = Simulation(parse(SHORT.replace("velocity = [0.0, 0.1]", "velocity = [0.0, 0.3]")))
    keys, places = sim.tracker.keys, sim.joints.place.copy()
    opened = False
    for _ in range(600):
        sim.step()
        opened |= bool((sim.joints.traction[sim.tracker.between(1, 2), 0] == 0).all())
    assert opened
    assert sim.tracker.keys is keys  # the list of contacts never changed
    assert (sim.joints.place == places).all()
