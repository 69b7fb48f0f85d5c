"""`python -m dem_demo ablate`: each ingredient goes in turn, and the rest stays as it was."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scene_text import ROCK, on_base

from dem_demo import Refused, Simulation, parse
from dem_demo.cli import main
from dem_demo.output.run import run
from dem_demo.studies.ablate import _run, ablate, variants

# A smooth joint, atan(0.4) + 90/20 = 26.3 degrees at most, on a slope of 22 degrees.
LAW = ROCK.replace("a = 3.0", "a = 20.0, b = 0.2, c = 0.2")
SLOPE = (
    on_base(LAW, [1.0, 0.3], 22.0, end=0.05)
    + """\
record = 0.01
fraction = 0.4
[watch]
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
        rows = {row["without"]: row for row in csv.DictReader(stream)}
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


def test_what_cannot_be_built_or_run_is_a_row_with_its_reason():
    """c = 0.5 needs b of -1 or less (Eq. 18); twice a step near the limit is refused."""
    scene = parse(SHORT.replace("b = 0.2, c = 0.2", "b = -1.0, c = 0.5"))
    record, _ = run(Simulation(scene), None)
    row, none = _run("b = 0", dict(variants(scene, record))["b = 0"], None)
    assert row["note"].startswith("cannot be built: orientation.c")
    assert none is None
    long = replace(scene.run, step=1.8 * Simulation(scene).limit.now)
    row, none = _run("twice the time step", lambda: replace(scene, run=long), None)
    assert row["note"].startswith("refused: time step")


def test_a_scene_that_cannot_run_is_not_ablated():
    """The block starts deep in its base, which no time step mends."""
    with pytest.raises(Refused, match="overlap by"):
        ablate(parse(SLOPE.replace("0.15]", "0.1]")))
