"""`jointlaw fit` and `jointlaw scan` on files as laboratories write them."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.cli.main import main
from jointlaw.surface.synthetic import synthetic_surface


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")


def write(path, stress, closure):
    path.parent.mkdir(exist_ok=True)
    table = np.column_stack([stress, closure])
    np.savetxt(path, table, delimiter=",", header="stress_Pa,closure_m", comments="")


@pytest.fixture
def cycle():
    """Loading from (0, 0) and unloading, made by the law itself."""
    law = jl.presets.load("biegel-smooth")
    record = jl.closure_test(law.joint(), 10e6, steps=12)
    return record.F1, record.closure


def test_a_cycle_that_begins_at_zero(tmp_path, cycle, capsys):
    write(tmp_path / "loop.csv", *cycle)
    assert main(["fit", "loop.csv", "--set", "alpha=3.8", "--out", "o"]) == 0
    out = capsys.readouterr().out
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    assert summary["version"] == 2
    assert summary["unloading"]["stress"] == pytest.approx(cycle[0][1])  # the first above zero
    assert "## Unloading" in out
    assert "(seating closure 0 um)" in out
    jl.JointLaw.from_toml(tmp_path / "o" / "law.toml")


def test_several_cycles_in_one_file(tmp_path, capsys):
    law = jl.presets.load("westerly-smooth")
    asperity = replace(law.asperity, yield_interference=1e-7)
    law = replace(law, asperity=asperity, closure_only=True)
    record = jl.closure_test(law.joint(), [5e6, 10e6], steps=12)
    write(tmp_path / "two.csv", record.F1, record.closure)
    write(tmp_path / "rock.csv", [0.0, 5e6, 11e6], [0.0, 5e-9, 1e-8])
    command = ["fit", "two.csv", "--set", "alpha=3.8", "--compliance", "rock.csv", "--out"]
    assert main([*command, "o", "--cycle"]) == 0
    out = capsys.readouterr().out
    assert "| 2 | 10 |" in out
    assert "compliance of rock and machine that was given is subtracted" in out
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    assert len(summary["cycles"]) == 2
    assert main([*command, "first"]) == 0  # the first loading alone is fitted
    assert "| 2 | 10 |" in capsys.readouterr().out


def test_law_gives_what_is_not_fitted(tmp_path, cycle):
    """All of it, the formation of contacts too, which is "individual" without a law."""
    law = jl.presets.load("westerly-smooth")
    assert law.heights.formation == "population"
    write(tmp_path / "loop.csv", *cycle)
    command = "fit loop.csv --set alpha=3.8 --law westerly-smooth --out"
    assert main([*command.split(), "o"]) == 0
    found = jl.JointLaw.from_toml(tmp_path / "o" / "law.toml")
    assert found.asperity == law.asperity
    assert found.heights.formation == "population"
    assert found.heights.overlap == law.heights.overlap
    assert main([*command.split(), "p", "--formation", "individual"]) == 0
    found = jl.JointLaw.from_toml(tmp_path / "p" / "law.toml")
    assert found.heights.formation == "individual"


def test_options_of_tests_that_are_not_given_are_refused(tmp_path, cycle, capsys):
    write(tmp_path / "loop.csv", *cycle)
    assert main(["fit", "loop.csv", "--normal-stress", "1MPa", "--out", "o"]) == 2
    assert "--normal-stress is about direct shear tests" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_an_unloading_branch_of_no_use_does_not_cost_the_fit(tmp_path, cycle, capsys):
    stress, closure = (x[:13] for x in cycle)
    held = np.full(3, stress[-1]), np.full(3, closure[-1])  # the machine rests at its peak
    write(tmp_path / "u.csv", np.append(stress, held[0]), np.append(closure, held[1]))
    assert main(["fit", "u.csv", "--set", "alpha=3.8", "--out", "o"]) == 0
    told = "stress does not rise and fall"
    assert told in capsys.readouterr().err
    assert told in (tmp_path / "o" / "report.md").read_text()
    assert (tmp_path / "o" / "law.toml").is_file()


def test_results_that_would_overwrite_each_other_are_refused_first(tmp_path, cycle, capsys):
    for folder in ("a", "b"):
        write(tmp_path / folder / "c.csv", *cycle)
    assert main(["fit", "a/c.csv", "b/c.csv", "--out", "o"]) == 2
    assert "a/c.csv and b/c.csv would both be written" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_a_file_in_another_encoding_is_named(tmp_path, capsys):
    (tmp_path / "old.csv").write_bytes(b"stress,closure_\xb5m\n1,2\n")
    assert main(["fit", "old.csv", "--out", "o"]) == 2
    assert "old.csv: is no CSV file in UTF-8" in capsys.readouterr().err


def test_a_scan_needs_only_the_contacts_to_be_a_law(tmp_path):
    orientation, heights = jl.Orientation(3.0), jl.GammaHeights(4.0, 10e-6)
    z = synthetic_surface(orientation, heights, rows=8, columns=8, spacing=20e-6)
    np.save(tmp_path / "z.npy", z)
    assert main(["scan", "z.npy", "--spacing", "20um", "--height-unit", "m", "--out", "o"]) == 0
    summary = json.loads((tmp_path / "o" / "summary.json").read_text())
    contacts = "\n[asperity]\nK = 1e9\nlam = 1.2\neta = 0.5\nmu = 0.6\n"
    law = jl.JointLaw.from_text((tmp_path / "o" / "surface.toml").read_text() + contacts)
    assert summary["version"] == 2
    assert summary["parameters_SI"]["a"] == law.orientation.a
    assert summary["parameters_SI"]["asperity_density"] == law.asperity_density


def test_without_matplotlib_all_but_the_picture_is_written(tmp_path, cycle, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    write(tmp_path / "c.csv", *(x[:13] for x in cycle))
    assert main(["fit", "c.csv", "--out", "o"]) == 0
    captured = capsys.readouterr()
    assert "no picture: pictures need matplotlib" in captured.err
    assert "wrote law.toml, report.md, summary.json to o" in captured.out
    assert not (tmp_path / "o" / "fit.png").exists()
