"""`python -m dem_demo ablate`: each ingredient goes in turn, and the rest stays as it was."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest

from dem_demo import Refused, Simulation, parse
from dem_demo.cli import main
from dem_demo.output.run import run
from dem_demo.studies.ablate import Row, _run, _without, ablate, table
from dem_demo.studies.ingredients import variants, working_stress

# A smooth joint, atan(0.4) + 90/20 = 26.3 degrees at most, on a slope of 22 degrees.
SLOPE = """
title = "Block on a slope"
gravity = [3.675, -9.096]
[laws.rock]
asperity_density = 1e4
critical_slip = 2e-3
orientation = { a = 20.0, b = 0.2, c = 0.2 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
[[block]]
name = "base"
box = [4.0, 0.5]
at = [0.5, -0.25]
fixed = true
[[block]]
name = "block"
box = [1.0, 0.3]
at = [0.0, 0.15]
[watch]
slip = [["block", "base"]]
shear = [["block", "base"]]
[run]
end = 0.05
record = 0.01
fraction = 0.4
"""
NAMES = {
    "no heights", "heights counted one by one", "linear asperities (eta = 0)",
    "no friction on asperities", "b = 0", "c = 0", "no large shear", "plain Coulomb",
    "no dashpots", "law_steps = 4", "not seated", "5 law points per edge", "half the time step",
    "twice the time step", "resolution reference", "one depth cell",
    "depth cells at its own stress",
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """What the command leaves."""
    out = tmp_path_factory.mktemp("ablation")
    (out / "slope.toml").write_text(SLOPE)
    assert main(["ablate", str(out / "slope.toml"), "--out", str(out)]) == 0
    return out


@pytest.fixture(scope="module")
def rows(folder):
    found = json.loads((folder / "summary.json").read_text())["runs"]
    return {row["name"]: Row(**row) for row in found}


def test_a_law_that_does_not_exist_without_a_parameter_is_a_row_that_says_why():
    """c = 0.5 needs b of -1 or less (Eq. 18)."""
    scene = parse(SLOPE.replace("b = 0.2, c = 0.2", "b = -1.0, c = 0.5"))
    variant = next(v for v in variants(scene, {}) if v.name == "b = 0")
    assert _without(variant, None, None, "1/1").note.startswith("cannot be built: orientation.c")


def test_each_ingredient_has_a_row(rows):
    assert set(rows) >= NAMES
    assert not any(row.note for row in rows.values())
    again = rows["whole scene again"].outcome
    assert again.pop("end, apart_mm", 0.0) == 0.0
    assert again == rows["whole scene"].outcome  # to the last bit: what differs below is the scene


def test_what_friction_and_resolution_do(rows):
    """Without asperity friction only 4.5 degrees of inclination hold the block on 22 degrees."""
    whole, smooth = rows["whole scene"].outcome, rows["no friction on asperities"].outcome
    held, slid = (o["largest displacement_m"] for o in (whole, smooth))
    fall = 0.5 * np.hypot(3.675, 9.096) * np.sin(np.radians(22.0 - 4.5)) * 0.05**2
    assert held < 2e-4
    assert fall < slid < 1.3 * fall  # it holds less until the contacts are wound up
    # A seated block has moved little, so few sliders do as well as many.
    assert abs(rows["resolution reference"].outcome["block, peak friction_deg"]
               - whole["block, peak friction_deg"]) < 0.1  # fmt: skip
    assert rows["half the time step"].steps == pytest.approx(2 * rows["whole scene"].steps, abs=2)


def test_matched_laws_close_as_far_at_the_working_stress():
    scene = parse(SLOPE)
    record, _ = run(Simulation(scene), None)
    stress = working_stress(record)
    pressed = stress["rock"].median
    assert pressed == pytest.approx(2600 * 0.3 * 9.096, rel=0.3)  # its ends share unequally
    law, matched = scene.laws["rock"], 0
    for variant in variants(scene, stress):
        other = variant.make().laws["rock"]
        if other != law and hasattr(other, "asperity") and other.asperity.K != law.asperity.K:
            matched += 1
        if "resolution" not in variant.name and variant.name != "plain Coulomb":
            assert other.closure(pressed) == pytest.approx(law.closure(pressed), rel=1e-9)
    assert matched >= 5


def test_table_and_csv_show_changes_against_the_whole(folder, rows):
    with (folder / "ablation.csv").open() as stream:
        read = {row["without"]: row for row in csv.DictReader(stream)}
    assert set(read) == set(rows)
    key = "largest displacement_m"
    for name, row in rows.items():
        change = row.outcome[key] - rows["whole scene"].outcome[key]
        assert float(read[name][f"change of {key}"]) == pytest.approx(change, abs=1e-15)
    times = [float(read[name]["time_ratio"]) for name in ("whole scene", "whole scene again")]
    assert min(times) == 1.0
    lines = (folder / "ablation.md").read_text().splitlines()
    assert len(lines) == 2 + len(rows)
    assert "block, slips at (deg)" in lines[0]


def test_a_variant_that_is_too_stiff_takes_half_the_step():
    scene = parse(SLOPE)
    limit = Simulation(scene).now.limit.now
    row, _ = _run(replace(scene, run=replace(scene.run, step=1.5 * limit)), "stiff", 0.01)
    assert row.note == "time step / 2"
    assert row.time_step == pytest.approx(0.75 * limit)


def test_a_time_step_that_is_refused_is_told_and_not_halved():
    """Twice a step near the limit: halved it would be the step of the scene, a row of zeros."""
    limit = Simulation(parse(SLOPE)).now.limit.now
    scene = parse(SLOPE.replace("fraction = 0.4", f"step = {0.8 * limit}"))
    record, _ = run(Simulation(scene), None, 0.004)
    (twice,) = (v for v in variants(scene, working_stress(record)) if "twice" in v.name)
    row = _without(twice, record, 0.004, "1/1")
    assert row.note.startswith("refused: time step")
    assert row.outcome == {}
    assert "| twice the time step (1) | - |" in table([_run(scene, "whole", 0.004)[0], row, row])


def test_what_cannot_run_is_a_row_with_its_reason():
    """The block starts deep in its base, which no time step mends."""
    scene = parse(SLOPE.replace("at = [0.0, 0.15]", "at = [0.0, 0.1]"))
    row, record = _run(scene, "deep", 0.01)
    assert record is None
    assert "refused: blocks" in row.note
    with pytest.raises(Refused, match="overlap by"):
        ablate(scene)
    good, _ = _run(parse(SLOPE), "whole scene", 0.004)
    text = table([good, row, good])
    assert "| deep (1) |" in text
    assert "(1) refused: blocks" in text
