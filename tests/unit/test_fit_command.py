"""`jointlaw fit` and `jointlaw scan`: what they write, and what they refuse before any work."""

import json
import sys

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import jointlaw as jl
from jointlaw.cli.main import main

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


@pytest.fixture
def cycle(tmp_path):
    """Loading from (0, 0) and unloading, made by the law itself, in a file."""
    record = jl.closure_test(jl.presets.load("biegel-smooth").joint(), 10e6, steps=12)
    record.to_csv(tmp_path / "loop.csv")
    return record


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def test_the_first_loading_is_fitted_and_the_rest_predicted(tmp_path, cycle, capsys):
    """From zero stress, so the seating closure is known."""
    assert main(["fit", "loop.csv", "--set", "alpha=3.8", "--up-to", "5MPa", "--out", "o"]) == 0
    out = capsys.readouterr().out
    summary = summary_of(tmp_path / "o")
    assert (summary["version"], summary["parameters_SI"]["seating"]) == (2, 0.0)
    above = np.count_nonzero(cycle.F1[:13] > 5e6)
    assert f"Held out: {above} points" in out
    assert f"off by {100 * summary['error_at_largest_stress']:+.1f} %" in out
    assert (tmp_path / "o" / "fit.png").read_bytes().startswith(b"\x89PNG")
    law = jl.JointLaw.from_toml(tmp_path / "o" / "law.toml")
    assert law.heights.beta == summary["parameters_SI"]["beta"]


def test_without_matplotlib_all_but_the_picture_is_written(tmp_path, cycle, capsys, monkeypatch):
    """With the law that gives all that is not fitted, the formation of contacts too."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    law = jl.presets.load("westerly-smooth")
    line = "fit loop.csv --set alpha=3.8 --law westerly-smooth --out o"
    assert main(line.split()) == 0
    captured = capsys.readouterr()
    assert "no picture: pictures need matplotlib" in captured.err
    assert "wrote law.toml, report.md, summary.json to o" in captured.out
    found = jl.JointLaw.from_toml(tmp_path / "o" / "law.toml")
    assert (found.asperity, found.heights.overlap) == (law.asperity, law.heights.overlap)
    assert found.heights.formation == law.heights.formation == "population"


def test_no_friction_angle_of_a_surface_that_the_law_does_not_describe(tmp_path, capsys):
    """Waves five times as long along the rows: at both sampling lengths."""
    z = 400e-6 * gaussian_filter(np.random.default_rng(0).standard_normal((400, 400)), (5, 25))
    np.save(tmp_path / "z.npy", z)
    assert main(["scan", "z.npy", "--spacing", "20um", "--height-unit", "m", "--out", "o"]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if "not told" in line]
    assert len(told) == 2
    assert "°" not in "".join(told)


def test_a_scan_needs_only_the_contacts_to_be_a_law(tmp_path, capsys):
    rng = np.random.default_rng(0)
    z = 400e-6 * gaussian_filter(rng.standard_normal((400, 400)), 5)
    np.save(tmp_path / "z.npy", 1e6 * z)
    assert main(["scan", "z.npy", "--spacing", "20um", "--height-unit", "um", "--out", "o"]) == 0
    lines = capsys.readouterr().out.splitlines()
    told = {length: line for length in ("0.08", "0.16") for line in lines if f"| {length} " in line}
    assert len(told) == 2
    summary = summary_of(tmp_path / "o")
    assert summary["version"] == 2
    assert summary["parameters_SI"] == pytest.approx(jl.from_surface(z, 20e-6).parameters)
    shear = "shear o/surface.toml --normal-stress 1MPa --to 80um --steps 100 --out p"
    assert main(shear.split()) == 2
    assert "add the table [asperity] with K" in capsys.readouterr().err
    assert main([*shear.split(), "--default-rock"]) == 0
    law = jl.JointLaw.from_toml(tmp_path / "p" / "law.toml")
    assert summary["parameters_SI"]["a"] == law.orientation.a
    assert summary["parameters_SI"]["asperity_density"] == law.asperity_density
    found = summary_of(tmp_path / "p")["result"]
    # the report's joint moves along the rows alone, in the same nodes: 0.1 degrees are rounding
    angle = float(told["0.08"].split("|")[3].strip("° "))
    assert found["peak_friction_angle_deg"] == pytest.approx(angle, abs=0.6)
