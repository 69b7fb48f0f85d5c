"""The command line, scene files, saved states: what a user of the demo touches."""

import json
import re

import numpy as np
import pytest
from scene_text import PLAIN, ROCK

from dem_demo import Refused, SceneError, Simulation, parse, run
from dem_demo.cli import main
from dem_demo.scene import names

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
[run]
end = 0.12
record = 0.02
fraction = 0.15
"""


def test_run_writes_everything(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(SHORT)
    assert main([str(file), "--out", str(tmp_path / "out")]) == 0
    out = tmp_path / "out"
    for name in ("history.csv", "blocks.csv", "joints.csv", "history.npz", "summary.json",
                 "final.png", "motion.gif", "energy.png", "curves.png", "state"):  # fmt: skip
        assert (out / name).exists(), name
    summary = json.loads((out / "summary.json").read_text())
    assert summary["time_step_margin"] > 2
    assert summary["steps"] * summary["time_step_s"] == pytest.approx(0.12, rel=0.01)
    assert summary["slip"][0]["slip_angle"] is None
    assert 40 < summary["slip"][0]["predicted_angle"] < 50
    assert abs(summary["energy_error"]) < 5e-3
    header, first, *_ = (out / "history.csv").read_text().splitlines()
    assert header.startswith("time_s,kinetic_J,potential_J")
    assert len(first.split(",")) == len(header.split(","))
    with np.load(out / "history.npz") as data:
        assert data["motion"].shape[1:] == (6, 3)
        assert len(data["joint_values"]) == len(data["joint_frame"]) == len(data["joint_who"])


@pytest.mark.parametrize("name", names())
def test_scenes_are_valid(name, capsys):
    assert main(["check", name]) == 0
    assert "margin" in capsys.readouterr().out


DAMAGE = "yield_interference = 2e-4, mu_residual = 0.2, wear_slip = 5e-4"


@pytest.mark.parametrize("damage", ["", f", {DAMAGE}"])
def test_resume_is_bit_identical(tmp_path, damage):
    """Stop and go on from files, in the middle of impacts and renewed edge pairs."""
    scene = parse(SHORT.replace("mu = 0.4", f"mu = 0.4{damage}"))
    whole = Simulation(scene)
    for _ in range(400):
        whole.step()
    first = Simulation(scene)
    for _ in range(170):
        first.step()
    first.save(tmp_path / "state")
    again = Simulation.load(tmp_path / "state")
    for _ in range(230):
        again.step()
    assert again.time == whole.time
    assert (again.now.motion == whole.now.motion).all()
    assert (again.now.traction == whole.now.traction).all()
    assert again.now.ledger.value == whole.now.ledger.value
    batch = again.joints.pools["rock"].batch
    assert bool(damage) == (batch.plastic_work.max() > 0.0)
    assert bool(damage) == (batch.friction.min() < 0.4)


def test_resume_of_a_tilt_test_by_command(tmp_path):
    """The drives go on where they were, too."""
    for end, folder in ((0.1, "a"), (0.2, "whole")):
        words = ["tilt", "--until", str(end), "--no-pictures", "--out", str(tmp_path / folder)]
        assert main(words) == 0
    words = ["resume", str(tmp_path / "a/state"), "--until", "0.2", "--no-pictures"]
    assert main([*words, "--out", str(tmp_path / "b")]) == 0
    with (
        np.load(tmp_path / "b/state/state.npz") as b,
        np.load(tmp_path / "whole/state/state.npz") as whole,
    ):
        assert (b["motion"] == whole["motion"]).all()
        assert (b["ledger"] == whole["ledger"]).all()


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "one"', 'name = "one"\ndensty = 3', "densty is unknown; did you mean 'density'"),
        ("box = [1.0, 0.5]", "box = [1.0, -0.5]", "box = .* must be > 0"),
        ("end = 0.12", "end = 0.0", "end = 0.0: must be > 0"),
        ("fraction = 0.15", "fraction = 2.0", "fraction = 2.0: must be <= 0.95"),
        ("mu = 0.4", "mu = -0.4", "mu"),
        ("critical_slip = 2e-3", "closure_only = true", "closure_only = true: .* leave it out"),
        ("friction = 0.3", "friction = -0.3", "friction = -0.3: must be >= 0"),
        ('law = "plain"', 'law = "plane"', "law 'plane' is not among"),
        ('"two", "one"', '"two", "none"', "must name two blocks"),
        ("[0.2, 0.8], [-0.2, 0.8]", "[-0.2, 0.8], [0.2, 0.8]", "must be convex"),
        ("gravity = [3.0, -9.0]", "gravity = 9.81", "gravity = 9.81: must be a list"),
        ("[run]", "[run", "not valid TOML"),
        ('slip = [["one", "base"]]', 'slip = ["one"]', r"must be \[moving block, its base\]"),
    ],
)
def test_errors_name_key_value_bound_and_remedy(old, new, message):
    assert old in SHORT
    with pytest.raises(SceneError, match=message):
        parse(SHORT.replace(old, new, 1), "scene.toml")


def test_refusals_leave_a_state_that_goes_on_with_a_smaller_step(tmp_path):
    """A drop at a step that suits rest: the impact stiffens the joint beyond it."""
    text = SHORT.replace("velocity = [0.0, 0.1]", "velocity = [0.0, -0.5]").replace(
        'law = "plain"', 'law = "rock"'
    )
    text = text.replace("end = 0.12", "end = 0.05\nseat = true\nstep = 8e-4").replace(
        "record = 0.02", "record = 0.002"
    )
    with pytest.raises(Refused, match="smaller step"):
        run(Simulation(parse(text)), tmp_path, pictures=False)
    assert "smaller step" in (tmp_path / "refused/why.txt").read_text()
    sim = Simulation.load(tmp_path / "refused", step=5e-5)
    record, _ = run(sim, None)
    assert sim.time == pytest.approx(0.05, abs=1e-4)
    assert np.isfinite(record.motion[-1]).all()


DROP = """
[laws.rock]
asperity_density = 1e4
critical_slip = 2e-3
orientation = { a = 3.0 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
[[block]]
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
    said = capsys.readouterr().err
    assert re.search(why, said)
    assert str(out / "refused") in said
    assert re.search(why, (out / "refused/why.txt").read_text())
    words = ["resume", str(out / "refused"), "--step", "1e-4", "--no-pictures", "--out", str(more)]
    assert main(words) == 0
    summary = json.loads((more / "summary.json").read_text())
    assert summary["model_time_s"] == pytest.approx(0.05, abs=1e-4)
    assert summary["time_step_s"] == 1e-4


def test_overlap_and_speed_are_refused():
    deep = SHORT.replace("at = [0.0, 0.25]", "at = [0.0, 0.2]")
    with pytest.raises(Refused, match=r"overlap by 0.05 m.* must stay below"):
        Simulation(parse(deep))
    fast = Simulation(parse(SHORT.replace("velocity = [0.0, 0.1]", "velocity = [0.0, 90.0]")))
    with pytest.raises(Refused, match="in one step"):
        fast.step()


def test_history_survives_a_gap():
    """A joint that opens for less than the reach of the search is the same joint afterwards."""
    sim = Simulation(parse(SHORT.replace("velocity = [0.0, 0.1]", "velocity = [0.0, 0.3]")))
    held = {name: (pool.keys, pool.places.tolist()) for name, pool in sim.joints.pools.items()}
    opened = False
    for _ in range(600):
        sim.step()
        opened |= bool((sim.now.traction[sim.now.between(1, 2), 0] == 0).all())
    assert opened
    pools = sim.joints.pools.items()
    assert {name: (pool.keys, pool.places.tolist()) for name, pool in pools} == held
