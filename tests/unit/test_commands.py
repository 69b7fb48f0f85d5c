"""The commands, as a newcomer types them."""

import json
import re
import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.cli.main import main
from jointlaw.laboratory.record import UNITS

FILES = {"csv", "npz", "png"}


@pytest.fixture(autouse=True)
def _in_an_empty_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setenv("COLUMNS", "80")


def run(line):
    """One command line, typed."""
    return main(shlex.split(line))


def example(command, capsys):
    """The example that --help gives, as arguments."""
    with pytest.raises(SystemExit) as stop:
        main([command, "--help"])
    assert stop.value.code == 0
    line = re.search(r"example:\n  jointlaw (.*)\n", capsys.readouterr().out).group(1)
    return shlex.split(line)


def read(folder, name):
    table = np.genfromtxt(folder / f"{name}.csv", delimiter=",", names=True)
    assert table.dtype.names[:5] == ("closure_m", "shear_2_m", "shear_3_m", "F1_Pa", "F2_Pa")
    table.dtype.names = tuple(UNITS)
    summary = json.loads((folder / "summary.json").read_text(), parse_constant=pytest.fail)
    return table, summary


def test_shear_example_runs(tmp_path, capsys):
    arguments = example("shear", capsys)
    assert main(arguments) == 0
    out = tmp_path / "out"
    names = {"law.toml", "summary.json", *(f"shear.{kind}" for kind in FILES)}
    assert {path.name for path in out.iterdir()} == names
    printed = capsys.readouterr().out
    assert all(name in printed for name in names)
    assert "peak friction angle" in printed
    table, summary = read(out, "shear")
    assert len(table) == summary["result"]["rows"] == 401
    np.testing.assert_allclose(table["F1"], 10e6, rtol=1e-9)
    assert table["shear_2"][[200, 400]] == pytest.approx([2e-6, -2e-6])
    assert summary["settings"]["law"] == "biegel-rough"
    assert summary["units"]["F1"] == "Pa"
    assert jl.JointLaw.from_toml(out / "law.toml") == jl.presets.load("biegel-rough")
    assert (out / "shear.png").read_bytes().startswith(b"\x89PNG")


def test_closure_example_runs(tmp_path, capsys):
    assert main([*example("closure", capsys), "--format", "svg"]) == 0
    assert (tmp_path / "out" / "closure.svg").read_text().startswith("<?xml")
    table, summary = read(tmp_path / "out", "closure")
    assert table["F1"].max() == pytest.approx(20e6, rel=1e-9)
    assert table["F1"][-1] == pytest.approx(0.0, abs=0.02)
    assert summary["result"]["largest_normal_stress_Pa"] == pytest.approx(20e6, rel=1e-9)


def test_presets_example_is_a_file_to_start_from(tmp_path, capsys):
    arguments = example("presets", capsys)
    redirect = arguments.index(">")
    assert main(arguments[:redirect]) == 0
    (tmp_path / arguments[redirect + 1]).write_text(capsys.readouterr().out)
    assert (
        main(["shear", arguments[redirect + 1], "--to", "1um", "--steps", "5", "--out", "o"]) == 0
    )
    assert jl.JointLaw.from_toml(tmp_path / "o" / "law.toml") == jl.presets.load("biegel-rough")


def test_presets_are_listed(capsys):
    assert main(["presets"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == jl.presets.names()
    assert all(len(line.split()) > 4 for line in lines)


def test_a_command_that_is_gone_says_what_to_use(capsys):
    assert main(["replay", "jointlaw-replay-4711-1.npz"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "joint.restore(error.state)" in line


def test_every_command_has_an_example(capsys):
    with pytest.raises(SystemExit):
        main(["--help"])
    commands = re.findall(r"^    (\w+) ", capsys.readouterr().out, re.MULTILINE)
    assert {"shear", "closure", "presets"} <= set(commands)
    for command in commands:
        assert example(command, capsys)[0] == command


def test_all_options_of_shear(tmp_path):
    assert run(
        "shear biegel-smooth --normal-stress 5MPa --to 0.5um --reverse -0.2um,0 --azimuth -30deg "
        "--control stiffness --normal-stiffness 5GPa/mm --resolution fast --steps 10 --out a/b"
    ) == 0  # fmt: skip
    table, _ = read(tmp_path / "a" / "b", "shear")
    assert len(table) == 31
    assert table["shear_3"][10] == pytest.approx(-0.25e-6)
    assert table["shear_2"][30] == pytest.approx(0.0, abs=1e-18)
    asked = 5e6 + 5e12 * (table["closure"][0] - table["closure"])
    np.testing.assert_allclose(table["F1"], asked, rtol=1e-8)
    written = jl.JointLaw.from_toml(tmp_path / "a" / "b" / "law.toml")
    assert written.resolution == jl.Resolution(3, 3, 2)  # "fast"


def test_options_of_closure(tmp_path):
    assert run("closure linear-a3 --normal-stress 1MPa,2MPa --no-unload --steps 4 --out o") == 0
    table, _ = read(tmp_path / "o", "closure")
    assert table["F1"][[4, 8]] == pytest.approx([1e6, 2e6], rel=1e-9)


def test_a_resolution_by_name_is_that_of_the_law_that_yields(tmp_path):
    options = "--yield-interference 1nm --resolution fine --normal-stress 1MPa --steps 1 --out o"
    assert run(f"closure biegel-smooth {options}") == 0
    law = jl.JointLaw.from_toml(tmp_path / "o" / "law.toml")
    assert law.resolution == replace(law, resolution="fine").resolution == jl.Resolution(8, 9, 6)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ("shear granite --to 2um", "'granite' is neither a preset nor an existing TOML file: the"),
        ("shear westerly-ruogh --to 2um", "did you mean 'westerly-rough'?"),
        ("shear biegel-rough --to 2umm", "--to: '2umm' is not a quantity in m"),
        ("shear biegel-rough --to 2MPa", "--to: '2MPa' is not a quantity in m"),
        ("shear biegel-rough --to 1e400", "--to = inf"),
        ("shear biegel-rough --to 1um --reverse 1um,,2um", "--reverse: ''"),
        ("shear biegel-rough --to 1um --normal-stress 5", "--normal-stress = 5 has no unit"),
        ("shear biegel-rough --to 1um --normal-stress 5mm", "--normal-stress: '5mm'"),
        ("shear biegel-rough --to 1um --normal-stress -5MPa", "--normal-stress = -5MPa"),
        ("shear biegel-rough --to 1um --azimuth 30", "--azimuth = 30 has no unit: write for"),
        ("shear biegel-rough --to 1um --units mm,mm", "--units: '1mm' is not a quantity in Pa"),
        (
            "shear biegel-rough --to 1um --units mm",
            "--units = mm: write a length and a stress: mm,MPa",
        ),
        ("shear biegel-rough --to 1um --azimuth 3degrees", "--azimuth: '3degrees'"),
        ("shear biegel-rough --to 1um --normal-stiffness 5GPa/m", "go together"),
        ("shear biegel-rough --to 1um --control stiffness", "go together"),
        ("shear biegel-rough --to 1um --control stiffness --normal-stiffness 5GPa", "'5GPa'"),
        ("shear biegel-rough --to 1um --steps 0", "steps = 0"),
        ("closure biegel-rough --normal-stress 0", "--normal-stress = 0"),
        ("closure biegel-rough --normal-stress ten", "--normal-stress: 'ten'"),
    ],
)
def test_bad_quantities(tmp_path, capsys, arguments, told):
    status = main([*arguments.split(), "--resolution", "fast", "--out", "o"])
    assert status == 2
    error = capsys.readouterr().err
    assert error.startswith("jointlaw ")
    assert told in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "o").exists()


def test_a_bad_file_is_told_by_its_key(tmp_path, capsys):
    (tmp_path / "mine.toml").write_text(jl.presets.text("biegel-rough").replace("mu =", "nu ="))
    assert main(["shear", "mine.toml", "--to", "1um", "--out", "o"]) == 2
    assert "mine.toml: key 'asperity.nu' is unknown" in capsys.readouterr().err


def test_a_folder_that_is_a_file(tmp_path, capsys):
    (tmp_path / "o").write_text("")
    assert run("shear linear-a2 --to 1um --steps 2 --out o") == 2
    assert "exists" in capsys.readouterr().err


def test_a_test_that_stops_writes_what_it_has(tmp_path, capsys):
    assert run("shear linear-a2 --to 1um --reverse 1e301m --steps 5 --out o") == 1
    assert "direct shear stopped after 6 rows" in capsys.readouterr().err
    table, summary = read(tmp_path / "o", "shear")
    assert len(table) == summary["result"]["rows"] == 6


def test_results_in_millimetres_and_megapascals(tmp_path):
    """The same numbers as in SI units, and titles that say which."""
    assert run("shear linear-a2 --to 1um --steps 3 --out si") == 0
    assert run("shear linear-a2 --to 1um --steps 3 --units mm,MPa --out lab") == 0
    si, lab = (
        np.genfromtxt(tmp_path / name / "shear.csv", delimiter=",", names=True)
        for name in ("si", "lab")
    )
    assert lab.dtype.names[1:5] == ("shear_2_mm", "shear_3_mm", "F1_MPa", "F2_MPa")
    np.testing.assert_allclose(lab["shear_2_mm"], 1e3 * si["shear_2_m"], rtol=1e-11)
    np.testing.assert_allclose(lab["F2_MPa"], 1e-6 * si["F2_Pa"], rtol=1e-11)


def test_no_shear_at_all(tmp_path):
    assert run("shear linear-a2 --to 0 --steps 3 --out o") == 0
    read(tmp_path / "o", "shear")


def test_version(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["--version"])
    assert stop.value.code == 0
    assert jl.__version__ in capsys.readouterr().out
    citation = Path(__file__).parents[2] / "CITATION.cff"
    assert f"\nversion: {jl.__version__}\n" in citation.read_text()


def test_without_matplotlib_the_numbers_are_written(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert run("shear linear-a2 --to 1um --steps 3 --out o") == 0
    assert "pip install 'jointlaw[plot]'" in capsys.readouterr().err
    assert {p.name for p in (tmp_path / "o").iterdir()} == {
        "shear.csv", "shear.npz", "law.toml", "summary.json",
    }  # fmt: skip


def test_as_a_module(tmp_path):
    command = "-m jointlaw shear biegel-smooth --to 1um --reverse -1um --steps 5 --out o"
    right = subprocess.run([sys.executable, *command.split()], capture_output=True, text=True)
    assert right.returncode == 0
    assert right.stderr == ""  # no progress bar in a pipe
    assert (tmp_path / "o" / "shear.png").is_file()
    wrong = subprocess.run(
        [sys.executable, "-m", "jointlaw", "shear", "nothing", "--to", "1", "--out", "o"],
        capture_output=True, text=True,
    )  # fmt: skip
    assert wrong.returncode == 2
    assert "Traceback" not in wrong.stderr
