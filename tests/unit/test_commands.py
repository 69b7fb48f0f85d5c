"""The commands, as a newcomer types them."""

import json
import re
import shlex
import subprocess
import sys
from importlib import resources

import numpy as np
import pytest

import jointlaw as jl
from jointlaw import hosts
from jointlaw.cli.export import START
from jointlaw.cli.main import COMMANDS, main
from jointlaw.hosts.c.export import identifier, require_name

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def run(line):
    """One command line, typed."""
    return main(shlex.split(line))


def asked(line, capsys):
    """What is printed where a user asks for it, as by --help."""
    with pytest.raises(SystemExit) as stop:
        run(line)
    assert stop.value.code == 0
    return capsys.readouterr().out


def example(command, capsys):
    """The example that --help gives, as arguments."""
    said = asked(f"{command} --help", capsys)
    return shlex.split(re.search(r"example:\n  jointlaw (.*)\n", said).group(1))


def test_shear_example_runs(tmp_path, capsys):
    assert main(example("shear", capsys)) == 0
    out = tmp_path / "out"
    names = {"law.toml", "summary.json", "shear.csv", "shear.png"}
    assert {path.name for path in out.iterdir()} == names
    # the contacts are kept: friction still rises at both turning points
    assert "no peak: largest friction angle" in capsys.readouterr().out
    table = np.genfromtxt(out / "shear.csv", delimiter=",", names=True)
    summary = json.loads((out / "summary.json").read_text(), parse_constant=pytest.fail)
    assert len(table) == summary["result"]["rows"] == 401
    assert table["shear_2_m"][[200, 400]] == pytest.approx([2e-6, -2e-6])
    assert summary["units"]["F1"] == "Pa"
    assert summary["settings_SI"]["reverse"] == pytest.approx([-2e-6])
    assert jl.JointLaw.from_toml(out / "law.toml") == jl.presets.load("biegel-rough")


def test_presets_are_listed_and_start_a_file(tmp_path, capsys):
    assert main(["presets"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == jl.presets.names()
    command, name, _, mine = example("presets", capsys)
    assert main([command, name]) == 0
    (tmp_path / mine).write_text(capsys.readouterr().out)
    assert main(["shear", mine, "--to", "1um", "--steps", "5", "--out", "o"]) == 0
    assert jl.JointLaw.from_toml(tmp_path / "o" / "law.toml") == jl.presets.load(name)


def test_every_command_has_an_example(capsys):
    commands = re.findall(r"^    (\w+) ", asked("--help", capsys), re.MULTILINE)
    assert commands == [command.name for command in COMMANDS]
    for typed in [*commands, *(f"export {host}" for host in START)]:
        assert example(typed, capsys)[: typed.count(" ") + 1] == typed.split()


def test_all_options_of_shear(tmp_path):
    assert run(
        "shear biegel-smooth --normal-stress 5MPa --to 0.5um --reverse -0.2um,0 --azimuth -30deg "
        "--normal-stiffness 5GPa/mm --resolution fast --steps 10 --out a/b"
    ) == 0  # fmt: skip
    table = np.genfromtxt(tmp_path / "a" / "b" / "shear.csv", delimiter=",", names=True)
    assert table["shear_3_m"][10] == pytest.approx(-0.25e-6)
    asked = 5e6 + 5e12 * (table["closure_m"][0] - table["closure_m"])
    np.testing.assert_allclose(table["F1_Pa"], asked, rtol=1e-8)
    written = jl.JointLaw.from_toml(tmp_path / "a" / "b" / "law.toml")
    assert written.resolution == jl.Resolution(3, 3, 2)  # "fast"


def test_options_of_closure(tmp_path):
    """Two cycles, in laboratory units."""
    line = "closure linear-a3 --normal-stress 1MPa,2MPa --steps 4 --units mm,MPa"
    assert run(f"{line} --format svg --out o") == 0
    lab = np.genfromtxt(tmp_path / "o" / "closure.csv", delimiter=",", names=True)
    assert lab["F1_MPa"][[4, 12]] == pytest.approx([1.0, 2.0], rel=1e-9)
    law = jl.presets.load("linear-a3")
    assert lab["closure_mm"][12] == pytest.approx(1e3 * law.closure(2e6), rel=1e-9)
    assert (tmp_path / "o" / "closure.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize("host", START)
def test_every_host_gets_its_files_and_is_told_what_to_type(host, tmp_path, capsys):
    assert run(f"export {host} linear-a3 --resolution fast --out o") == 0
    assert capsys.readouterr().out.endswith(f"\nrun: cd o && {START[host]}\n")
    kept = {path.name for path in (resources.files(hosts) / host).rglob("*") if path.is_file()}
    written = {path.name for path in (tmp_path / "o").iterdir()}
    typed = [word.removeprefix("./") for word in START[host].split()]
    assert {word for word in typed if word in kept} <= written
    assert written & kept
    assert any("linear_a3" in name for name in written) or "law.toml" in written
    for path in (tmp_path / "o").iterdir():
        text = path.read_bytes().decode(errors="ignore")
        assert not re.search(r"@\w+@", text)
        assert set(re.findall(r'^#include "(jointlaw.*)"', text, re.MULTILINE)) <= written


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("rough-2", "rough_2"),
        ("7 b.", "joint_7_b"),
        ("---", "joint"),
        ("jing-replica", "jing_replica"),
    ],
)
def test_a_name_of_tables_is_an_identifier_of_c(text, name):
    assert identifier(text) == name
    require_name(name)


def test_version(capsys):
    assert asked("--version", capsys).endswith(f"{jl.__version__}\n")


def test_as_a_module(tmp_path):
    """An exit status and no progress bar in a pipe; a refusal without a traceback."""
    command = shlex.split(f"{sys.executable} -m jointlaw shear biegel-smooth --to 1um --steps 5")
    for words, status, told in (("--out o", 0, ""), ("--out o", 2, "o holds another run")):
        done = subprocess.run([*command, *words.split()], capture_output=True, text=True)
        assert done.returncode == status
        assert told in done.stderr
        assert len(done.stderr.splitlines()) == bool(told)
    assert (tmp_path / "o" / "shear.png").is_file()
