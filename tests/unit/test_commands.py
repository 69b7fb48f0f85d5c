"""The commands as a newcomer types them, and the quantities that they accept."""

import json
import math
import re
import shlex
import subprocess
import sys
from importlib import resources

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

import jointlaw as jl
from jointlaw import hosts
from jointlaw.cli.main import COMMANDS, main
from jointlaw.hosts import HOSTS
from jointlaw.hosts.c.export import identifier, require_name
from jointlaw.support import units

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")


def run(line):
    """Run one command line; returns the exit status."""
    return main(shlex.split(line))


def printed_on_exit(line, capsys):
    """Output of a command line that ends argparse with status 0, such as --help."""
    with pytest.raises(SystemExit) as stop:
        run(line)
    assert stop.value.code == 0
    return capsys.readouterr().out


def example(command, capsys):
    """Arguments of the example in the help of a command."""
    text = printed_on_exit(f"{command} --help", capsys)
    return shlex.split(re.search(r"example:\n  jointlaw (.*)\n", text).group(1))


def test_shear_example_runs(tmp_path, capsys):
    assert main(example("shear", capsys)) == 0
    out = tmp_path / "out"
    names = {"law.toml", "summary.json", "shear.csv", "shear.png"}
    assert {path.name for path in out.iterdir()} == names
    # the contacts are kept: friction still rises at both turning points
    assert "largest friction angle (no peak): " in capsys.readouterr().out
    table = np.genfromtxt(out / "shear.csv", delimiter=",", names=True)
    summary = json.loads((out / "summary.json").read_text(), parse_constant=pytest.fail)
    assert len(table) == summary["result"]["rows"] == 401
    assert table["shear_2_m"][[200, 400]] == pytest.approx([2e-6, -2e-6])
    assert summary["units"]["F1"] == "Pa"
    assert summary["settings_SI"]["reverse"] == pytest.approx([-2e-6])
    assert jl.JointLaw.from_toml(out / "law.toml") == jl.presets.load("biegel-rough")


@pytest.mark.parametrize(
    ("line", "status"),
    [("jointlaw card linear-a3", 141), ("jointlaw --help", 0), ("dem_demo check shear-box", 141)],
)
def test_a_reader_that_ends_early_gives_no_error(line, status):
    """As by `| head -1`: nothing on the standard error stream, the status of SIGPIPE."""
    command = [sys.executable, "-m", *line.split()]
    # without a buffer each line is written at once, also of a short text
    process = subprocess.Popen(
        [command[0], "-u", *command[1:]], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    process.stdout.close()
    assert process.stderr.read() == b""
    assert process.wait() == status  # 0: of a text that argparse prints


def test_presets_are_listed_and_start_a_file(tmp_path, capsys):
    assert main(["presets"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == jl.presets.names()
    command, name, _, file = example("presets", capsys)
    assert main([command, name]) == 0
    (tmp_path / file).write_text(capsys.readouterr().out)
    assert main(["shear", file, "--to", "1um", "--steps", "5", "--out", "o"]) == 0
    assert jl.JointLaw.from_toml(tmp_path / "o" / "law.toml") == jl.presets.load(name)


def test_every_command_has_an_example_and_there_is_a_version(capsys):
    commands = re.findall(r"^    (\w+) ", printed_on_exit("--help", capsys), re.MULTILINE)
    assert commands == [command.name for command in COMMANDS]
    for name in [*commands, *(f"export {host}" for host in HOSTS)]:
        assert example(name, capsys)[: name.count(" ") + 1] == name.split()
    assert printed_on_exit("--version", capsys).endswith(f"{jl.__version__}\n")


def test_all_options_of_shear(tmp_path):
    assert run(
        "shear biegel-smooth --normal-stress 5MPa --to 0.5um --reverse -0.2um,0 --azimuth -30deg "
        "--normal-stiffness 5GPa/mm --resolution fast --steps 10 --out a/b"
    ) == 0  # fmt: skip
    table = np.genfromtxt(tmp_path / "a" / "b" / "shear.csv", delimiter=",", names=True)
    assert table["shear_3_m"][10] == pytest.approx(-0.25e-6)
    normal_stress = 5e6 + 5e12 * (table["closure_m"][0] - table["closure_m"])
    np.testing.assert_allclose(table["F1_Pa"], normal_stress, rtol=1e-8)
    written = jl.JointLaw.from_toml(tmp_path / "a" / "b" / "law.toml")
    assert written.resolution == jl.Resolution(3, 3, 2)  # "fast"


def test_options_of_closure(tmp_path):
    """Two cycles, in laboratory units."""
    line = "closure linear-a3 --normal-stress 1MPa,2MPa --steps 4 --units mm,MPa"
    assert run(f"{line} --format svg --out o") == 0
    table = np.genfromtxt(tmp_path / "o" / "closure.csv", delimiter=",", names=True)
    assert table["F1_MPa"][[4, 12]] == pytest.approx([1.0, 2.0], rel=1e-9)
    law = jl.presets.load("linear-a3")
    assert table["closure_mm"][12] == pytest.approx(1e3 * law.closure(2e6), rel=1e-9)
    assert (tmp_path / "o" / "closure.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize("host", HOSTS)
def test_export_writes_the_files_of_a_host_and_prints_the_next_command(host, tmp_path, capsys):
    assert run(f"export {host} linear-a3 --resolution fast --out o") == 0
    assert capsys.readouterr().out.endswith(f"\nrun: cd o && {HOSTS[host].run_command}\n")
    sources = {path.name for path in (resources.files(hosts) / host).rglob("*") if path.is_file()}
    written = {path.name for path in (tmp_path / "o").iterdir()}
    words = [word.removeprefix("./") for word in HOSTS[host].run_command.split()]
    assert {word for word in words if word in sources} <= written
    assert written & sources
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
        ("double", "joint_double"),
        ("jointlaw-1", "joint_jointlaw_1"),
        ("jing-replica", "jing_replica"),
    ],
)
def test_a_name_of_tables_is_an_identifier_of_c(text, name):
    assert identifier(text) == name
    require_name(name)


def test_without_a_command_the_help_is_printed(capsys):
    """The same for a command whose hosts are commands of their own."""
    for words in ([], ["export"]):
        assert main(words) == 0
        printed = capsys.readouterr().out
        assert printed == printed_on_exit(shlex.join([*words, "--help"]), capsys)


@pytest.mark.parametrize(
    "line",
    [
        "shear linear-a3 --to 1um --steps 5",
        "closure linear-a3 --steps 3",
        "field --jrc 10 --jcs 100MPa --length 0.1m --normal-stress 1MPa --normal-stiffness 30GPa/m",
        "fit loop.csv --set alpha=3.8",
    ],
)
@pytest.mark.usefixtures("cycle")
def test_json_prints_the_summary(line, tmp_path, capsys):
    """Standard output is the summary alone, as the file holds it."""
    assert run(f"{line} --json --out o") == 0
    assert json.loads(capsys.readouterr().out) == summary_of(tmp_path / "o")


def test_json_of_presets(capsys):
    assert run("presets --json") == 0
    listed = json.loads(capsys.readouterr().out)
    assert listed == {name: jl.presets.about(name) for name in jl.presets.names()}


def test_as_a_module(tmp_path):
    """An exit status and no progress bar in a pipe; a refusal without a traceback."""
    command = shlex.split(f"{sys.executable} -m jointlaw shear biegel-smooth --to 1um --steps 5")
    for status, message in ((0, ""), (2, "o holds another run")):
        process = subprocess.run([*command, "--out", "o"], capture_output=True, text=True)
        assert process.returncode == status
        assert message in process.stderr
        assert len(process.stderr.splitlines()) == bool(message)
    assert (tmp_path / "o" / "shear.png").is_file()


@pytest.fixture
def cycle(tmp_path):
    """Loading from (0, 0) and unloading, made by the law itself, in a file."""
    record = jl.closure_test(jl.presets.load("biegel-smooth").joint(), 10e6, steps=12)
    record.to_csv(tmp_path / "loop.csv")
    return record


def summary_of(folder):
    return json.loads((folder / "summary.json").read_text())


def test_the_first_loading_is_fitted_and_the_rest_predicted(tmp_path, cycle, capsys):
    """The test begins at zero stress, so the closure at preload is known."""
    assert main(["fit", "loop.csv", "--set", "alpha=3.8", "--up-to", "5MPa", "--out", "o"]) == 0
    out = capsys.readouterr().out
    summary = summary_of(tmp_path / "o")
    assert (summary["version"], summary["parameters_SI"]["preload_closure"]) == (2, 0.0)
    above = np.count_nonzero(cycle.F1[:13] > 5e6)
    assert f"Held out: {above} points" in out
    error = 100 * summary["error_at_largest_stress"]
    assert f"Error of the predicted stress: {error:+.1f} % at the largest" in out
    assert (tmp_path / "o" / "fit.png").read_bytes().startswith(b"\x89PNG")
    law = jl.JointLaw.from_toml(tmp_path / "o" / "law.toml")
    assert law.heights.beta == summary["parameters_SI"]["beta"]


def test_without_matplotlib_all_but_the_picture_is_written(tmp_path, cycle, capsys, monkeypatch):
    """The option --law sets all fixed parameters, the formation of contacts too."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    law = jl.presets.load("westerly-smooth")
    line = "fit loop.csv --set alpha=3.8 --law westerly-smooth --out o"
    assert main(line.split()) == 0
    captured = capsys.readouterr()
    assert "no picture: pictures need matplotlib" in captured.err
    assert "wrote points.csv, law.toml, report.md, summary.json to o" in captured.out
    fitted = jl.JointLaw.from_toml(tmp_path / "o" / "law.toml")
    assert (fitted.asperity, fitted.heights.overlap) == (law.asperity, law.heights.overlap)
    assert fitted.heights.formation == law.heights.formation == "population"


def test_no_friction_angle_of_a_surface_that_the_law_does_not_represent(tmp_path, capsys):
    """Waves five times as long along the rows: no angle at either sampling length."""
    z = 400e-6 * gaussian_filter(np.random.default_rng(0).standard_normal((400, 400)), (5, 25))
    np.save(tmp_path / "z.npy", z)
    assert main(["scan", "z.npy", "--spacing", "20um", "--height-unit", "m", "--out", "o"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if "not estimated" in line]
    assert len(lines) == 2
    assert "°" not in "".join(lines)


def test_a_scan_needs_only_the_contacts_to_be_a_law(tmp_path, capsys):
    rng = np.random.default_rng(0)
    z = 400e-6 * gaussian_filter(rng.standard_normal((400, 400)), 5)
    np.save(tmp_path / "z.npy", 1e6 * z)
    assert main(["scan", "z.npy", "--spacing", "20um", "--height-unit", "um", "--out", "o"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = {length: line for length in ("0.08", "0.16") for line in lines if f"| {length} " in line}
    assert len(rows) == 2
    summary = summary_of(tmp_path / "o")
    assert summary["version"] == 2
    fit = jl.from_surface(z, 20e-6)
    errors = {name: estimate.standard_error for name, estimate in fit.estimates.items()}
    assert summary["parameters_SI"] == pytest.approx(fit.parameters)
    assert summary["standard_error_SI"] == pytest.approx(errors)
    assert summary["sampling_length_m"] == pytest.approx(fit.asperities.size)
    assert summary["not_identifiable"] == fit.not_identifiable
    shear = "shear o/surface.toml --normal-stress 1MPa --to 80um --steps 100 --out p"
    assert main(shear.split()) == 2
    assert "add the table [asperity] with K" in capsys.readouterr().err
    assert main([*shear.split(), "--default-rock"]) == 0
    law = jl.JointLaw.from_toml(tmp_path / "p" / "law.toml")
    assert summary["parameters_SI"]["a"] == law.orientation.a
    assert summary["parameters_SI"]["asperity_density"] == law.asperity_density
    result = summary_of(tmp_path / "p")["result"]
    # the report's joint moves along the rows alone, in the same nodes: 0.1 degrees are rounding
    angle = float(rows["0.08"].split("|")[3].strip("° "))
    assert result["peak_friction_angle_deg"] == pytest.approx(angle, abs=0.6)


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        (" 1.5 GPa ", "Pa", 1.5e9),
        ("10e6", "Pa", 10e6),  # a bare number is SI
        ("2N/mm2", "Pa", 2e6),
        ("3kN/m²", "Pa", 3e3),
        ("4bar", "Pa", 4e5),
        ("5mbar", "Pa", 500.0),
        ("1N/mm2", "Pa", 1e6),
        ("1MN/m2", "Pa", 1e6),
        ("6N/mm^2", "Pa", 6e6),
        ("7kN/m**2", "Pa", 7e3),
        ("100cm²", "m2", 1e-2),
        ("100cm^2", "m2", 1e-2),
        ("-2um", "m", -2e-6),
        ("2µm", "m", 2e-6),
        ("2μm", "m", 2e-6),
        (".5cm", "m", 5e-3),
        ("+7nm", "m", 7e-9),
        ("1e-6m", "m", 1e-6),
        ("5MPa/mm", "Pa/m", 5e9),
        ("30deg", "rad", math.pi / 6),
        ("30°", "rad", math.pi / 6),
        ("0.5rad", "rad", 0.5),
    ],
)
def test_quantities(text, unit, value):
    assert units.parse(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("", "Pa"),
        ("10 mpa", "Pa"),
        ("10um", "Pa"),
        ("10MPa10", "Pa"),
        ("1,5MPa", "Pa"),
        ("nan", "Pa"),
        ("0x10", "m"),
        ("--2um", "m"),
        ("5GPa", "Pa/m"),
        ("5Pa/", "Pa/m"),
        ("30mrad", "rad"),
        *(("x", unit) for unit in units.COMMON),
    ],
)
def test_invalid_quantities(text, unit):
    with pytest.raises(ValueError, match=f"is not a quantity in {unit}; write") as error:
        units.parse(text, unit)
    assert repr(text) in str(error.value)
    assert units.parse(str(error.value).rsplit(" ", 1)[-1], unit) > 0  # its example


def test_options_need_a_unit():
    assert units.parse_option("0", "Pa") == 0.0
    assert units.parse_option("5MPa", "Pa", positive=True) == 5e6
    assert units.parse_option("100cm2", "m2") == pytest.approx(1e-2)  # the unit ends in a digit
    assert units.parse_option("2 N/mm2", "Pa") == pytest.approx(2e6)
    for text, message in (("5", "write for example 5MPa"), ("0", "> 0 Pa"), ("1e400Pa", "finite")):
        with pytest.raises(ValueError, match=message):
            units.parse_option(text, "Pa", positive=True)
