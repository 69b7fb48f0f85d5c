"""Origin and caveats of laws: the table [about], repeated by every command; `jointlaw card`."""

import hashlib
import json
import tomllib

import numpy as np
import pytest
from scene_text import block, lines
from scipy.ndimage import gaussian_filter

import jointlaw as jl
from dem_demo.cli import main as dem_main
from jointlaw.cli.main import main
from jointlaw.parameters.about import About

CAVEAT = 'friction is "assumed" \\ not measured'


@pytest.fixture
def law_file(tmp_path):
    """A law with a caveat."""
    about = About({"title": "test"}, (CAVEAT,), {"mu": "assumed"}, {"scan 1.csv": "ab12"})
    path = tmp_path / "law.toml"
    text = jl.presets.load("westerly-rough").to_toml()
    path.write_text(f"{text}\n{about.to_toml()}", encoding="utf-8")
    return path


def about_of(path):
    return About.from_table(tomllib.loads(path.read_text(encoding="utf-8"))["about"], str(path))


@pytest.mark.parametrize(
    "about",
    [
        About(),
        About({"title": 'quotes "and" \\ backslashes, tabs\t and é\n'}),
        About(warnings=("one", "two")),
        About({"a": "b"}, ("w",), {"mu": "m", "x y.z": "n"}, {"my file.csv": "00ff"}),
        About(origin={"mu": "fitted"}),
    ],
)
def test_the_table_is_read_as_it_was_written(about):
    assert About.from_table(tomllib.loads(about.to_toml()).get("about", {}), "law") == about


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("warnings = 'one'", "law: about.warnings = 'one': must be a list of texts"),
        ("warnings = [1]", "about.warnings"),
        ("year = 1999", "law: about.year = 1999: must be a text"),
        ("origin = 'measured'", "law: about.origin = 'measured': must be a table"),
        ("origin = {mu = 3}", "law: about.origin.mu = 3: must be a text"),
    ],
)
def test_an_invalid_table_is_named(table, message):
    with pytest.raises(ValueError, match=message.replace("[", "\\[")):
        About.from_table(tomllib.loads(table), "law")


@pytest.mark.parametrize(
    "command",
    [
        ["shear", "LAW", "--to", "1um", "--normal-stress", "5MPa", "--steps", "5"],
        ["closure", "LAW", "--normal-stress", "5MPa", "--steps", "5"],
        ["export", "c", "LAW"],
        ["card", "LAW"],
    ],
)
def test_every_command_repeats_the_warnings(command, law_file, tmp_path, capsys):
    words = [str(law_file) if word == "LAW" else word for word in command]
    if command[0] != "card":
        words += ["--out", str(tmp_path / "out")]
    assert main(words) == 0
    out, err = capsys.readouterr()
    assert f"warning, {law_file}: {CAVEAT}" in err
    if command[0] in ("shear", "closure"):
        assert about_of(tmp_path / "out" / "law.toml") == about_of(law_file)
        summary = json.loads((tmp_path / "out" / "summary.json").read_text())
        assert summary["warnings"] == [CAVEAT]
    if command[0] == "card":
        assert f"- {CAVEAT}" in out


@pytest.mark.usefixtures("assumed_drawing_time")
def test_scenes_repeat_the_warnings_of_their_laws(law_file, tmp_path, capsys):
    scene = tmp_path / "scene.toml"
    scene.write_text(
        lines(gravity=[0.0, -9.81])
        + f"[laws.rock]\nfrom = {law_file.name!r}\n"
        + block("base", box=[4.0, 1.0], at=[0.0, -0.5], fixed=True)
        + block("top", box=[1.0, 1.0], at=[0.0, 0.5])
        + "[run]\nend = 0.001\n"
    )
    without = ["--no-pictures"]
    for command in (
        ["check", str(scene)],
        ["run", str(scene), *without, "--out", str(tmp_path / "out")],
    ):
        assert dem_main(command) == 0
        assert f"warning, {law_file.name}: {CAVEAT}" in capsys.readouterr().err
    state = tmp_path / "out"
    resume = ["resume", str(state), "--out", str(tmp_path / "more"), *without, "--until", "0.002"]
    assert dem_main(resume) == 0
    assert CAVEAT in capsys.readouterr().err


def test_assumed_contacts_are_a_warning(tmp_path, capsys):
    surface = tmp_path / "surface.toml"
    surface.write_text("asperity_density = 1e6\n[orientation]\na = 4.0\n")
    assert main(["card", str(surface), "--default-rock"]) == 0
    out, err = capsys.readouterr()
    assert "contacts are assumed" in err
    row = next(line for line in out.splitlines() if line.startswith("| asperity.mu "))
    assert row.endswith("| assumed: default rock |")


def test_a_fit_says_what_is_fitted_given_and_assumed(tmp_path, capsys):
    stress = np.array([0.0, 0.5, 1.0, 2.0, 4.0, 8.0])
    closure = 60 * stress / (stress + 2)
    data = tmp_path / "closure.csv"
    rows = "".join(f"{s},{c}\n" for s, c in zip(stress, closure, strict=True))
    data.write_text("stress_MPa,closure_um\n" + rows)
    out = tmp_path / "out"
    words = ["fit", str(data), "--free", "asperity_density", "--set", "mu=0.5", "--out", str(out)]
    assert main(words) == 0
    about = about_of(out / "law.toml")
    assert about.sha256 == {"closure.csv": hashlib.sha256(data.read_bytes()).hexdigest()}
    assert about.notes["command"].startswith("jointlaw fit ")
    low, high = json.loads((out / "summary.json").read_text())["interval_95_SI"]["asperity_density"]
    assert about.origin["asperity_density"] == f"fitted, 95 % interval {low:.4g} to {high:.4g}"
    assert about.origin["mu"] == "given (--set)"
    assert about.origin["K"] == "assumed: default rock"
    assert any("up to 8 MPa" in text for text in about.warnings)
    capsys.readouterr()
    assert main(["card", str(out / "law.toml")]) == 0
    card = capsys.readouterr().out
    law = jl.JointLaw.from_toml(out / "law.toml")
    assert f"| asperity.mu | 0.5 | 1 | {about.origin['mu']} |" in card
    density = f"| asperity_density | {law.asperity_density:.6g} | 1/m2 | fitted, 95 % interval"
    assert density in card
    assert about.sha256["closure.csv"] in card
    # properties: closure and secant stiffness at 1 MPa
    normal, shear = law.secant_stiffness(1e6)
    closure = 1e3 * float(law.closure(1e6))
    assert f"| 1 | {closure:.4g} | {normal / 1e9:.4g}, {shear / 1e9:.4g} |" in card
    assert "@article{misra1999," in card


def test_a_card_as_json(law_file, capsys):
    assert main(["card", str(law_file), "--json"]) == 0
    card = json.loads(capsys.readouterr().out)
    law = jl.presets.load("westerly-rough")
    assert card["parameters_SI"]["asperity.mu"] == law.asperity.mu
    assert card["warnings"] == [CAVEAT]
    assert card["sha256"] == {"scan 1.csv": "ab12"}


def test_a_scan_that_withholds_a_friction_angle_warns_every_later_command(tmp_path, capsys):
    """A surface of steep and flat halves, which no law of one orientation density represents."""
    rng = np.random.default_rng(7)
    z = gaussian_filter(rng.normal(size=(160, 160)), 3.0)
    z[:, 80:] *= 12.0
    np.savetxt(tmp_path / "scan.csv", 20 * z / z.std(), delimiter=",", fmt="%.9g")
    out = tmp_path / "out"
    scan = ["scan", str(tmp_path / "scan.csv"), "--spacing", "20um", "--height-unit", "um"]
    assert main([*scan, "--out", str(out)]) == 0
    assert "not estimated" in capsys.readouterr().out
    about = about_of(out / "surface.toml")
    assert any("do not use its friction angle" in text for text in about.warnings)
    assert about.origin["a"].startswith("measured on the scan, standard error")
    shear = ["shear", str(out / "surface.toml"), "--default-rock", "--to", "1um", "--steps", "3"]
    assert main([*shear, "--out", str(tmp_path / "shear")]) == 0
    err = capsys.readouterr().err
    assert "do not use its friction angle" in err
    assert "contacts are assumed" in err
