"""Common mistakes with units, signs and columns: a one-line error message, no file is written."""

import shlex
from pathlib import Path
from unittest.mock import Mock

import pytest
from scene_text import PLAIN, ROCK

import dem_demo.cli
import jointlaw as jl
from jointlaw.cli.main import main as jointlaw_main

SHEAR, CLOSURE = "us [mm],tau [MPa]\n", "sigma_n [MPa],closure [um]\n"
ROWS = "0,0\n0.1,0.9\n0.2,1.3\n0.4,1.4\n"
LOADING = "0.2,0\n0.5,12\n1,25\n2,40\n4,55\n8,70\n"
SCENE = f"""
gravity = [0.0, -9.81]
density = 2600.0
[laws.rock]
plane = 0.0
{ROCK}[laws.plain]
{PLAIN}[[block]]
name = "base"
box = [4.0, 1.0]
at = [0.0, -0.5]
fixed = true
[[block]]
name = "top"
box = [1.0, 0.5]
at = [0.0, 0.25]
[run]
end = 0.002
record = 0.001
step = 1e-4
"""
FILES = {
    "good.csv": SHEAR + ROWS,
    "no-unit.csv": "us [mm],tau\n" + ROWS,
    "sign.csv": SHEAR + "0,0\n0.1,-0.9\n0.2,-1.3\n0.4,-1.4\n",
    "tension.csv": "us [mm],tau [MPa],sn [MPa]\n0,0,-1\n0.1,0.9,-1\n0.2,1.3,-1\n0.4,1.4,-1\n",
    "closure.csv": CLOSURE + LOADING,
    "metres.csv": CLOSURE.replace("um", "m") + LOADING,
    "pascals.csv": CLOSURE.replace("MPa", "Pa") + LOADING,
    "opening.csv": CLOSURE + LOADING.replace(",", ",-"),
    "law-plane.toml": "plane = 0.0\n" + jl.presets.text("linear-a3"),
    "law-closure.toml": "closure_only = true\n" + jl.presets.text("linear-a3"),
    "scene.toml": SCENE,
    "endless.toml": SCENE.replace("end = 0.002", "end = 1e308"),
    "long.toml": SCENE.replace("end = 0.002", "end = 1e6"),
    "law.toml": ROCK,
    "law-mu-35.toml": jl.presets.text("biegel-rough").replace("mu = 0.3", "mu = 35"),
    "mu-35.toml": SCENE.replace("mu = 0.4", "mu = 35"),
    "friction-30.toml": SCENE.replace("friction = 0.3", "friction = 30"),
    "density.toml": SCENE.replace("2600.0", "2.6"),
    "plane-90.toml": SCENE.replace("plane = 0.0", "plane = 90"),
    "done/summary.json": '{"files": ["shear.csv"]}',
    "done/shear.csv": "of an earlier run",
    "done/notes.txt": "mine",
}


@pytest.fixture(autouse=True)
def _files(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("jointlaw fit --shear no-unit.csv --out out", "column 'tau' gives no unit"),
        ("jointlaw fit --shear sign.csv --normal-stress 1MPa --out out", '"tau:-1MPa"'),
        ("jointlaw fit --shear good.csv --out out", "which column is the normal stress"),
        ("jointlaw fit --shear good.csv --normal-stress 3kPa --out out", "are both in the units"),
        (
            "jointlaw fit --shear good.csv --normal-stress 1MPa --fit 1MPa --out out",
            "--fit names 1 of 1",
        ),
        (
            "jointlaw fit nope --out out",
            "'nope': neither a file nor a data set (grimsel",
        ),
        ("jointlaw sheer biegel-rough --to 2um --out out", "did you mean 'shear'?"),
        ("jointlaw fit --shear tension.csv --out out", '--normal-column "sn:-1MPa"'),
        ("jointlaw fit --shear closure.csv --out out", "which column is the shear displacement"),
        ("jointlaw fit metres.csv --out out", "closure = 70 m is outside the range of rock joints"),
        ("jointlaw fit pascals.csv --out out", "stress = 8 Pa is outside the range of rock joints"),
        ("jointlaw fit opening.csv --out out", '--closure-column "closure:-1um"'),
        ("jointlaw fit --out out", "0 closure files: give one"),
        ("jointlaw shear biegel-rough --to 2 --out out", "--to: 2 has no unit"),
        (
            "jointlaw shear biegel-rough --to 2um --normal-stress 5Pa --out out",
            "--normal-stress: normal stress = 5 Pa is outside the range of rock joints",
        ),
        (
            "jointlaw closure biegel-rough --normal-stress 5MPa,5000GPa --out out",
            "--normal-stress: normal stress = 5e+12 Pa is outside the range of rock joints",
        ),
        ("jointlaw shear law-mu-35.toml --to 2um --out out", "tan(35 degrees) = 0.7"),
        ("jointlaw shear biegel-rough --to 2um --out done", "done holds another run"),
        ("dem_demo check mu-35.toml", "mu-35.toml: laws.rock.asperity.mu = 35 is outside"),
        (
            "dem_demo check friction-30.toml",
            "friction-30.toml: laws.plain.friction = 30 is outside",
        ),
        ("dem_demo check density.toml", "2.6 g/cm3 is 2600 kg/m3"),
        ("dem_demo check plane-90.toml", "90 degrees is 1.571 rad"),
        ("jointlaw shear westerly-ruogh --to 2um --out out", "did you mean 'westerly-rough'?"),
        ("jointlaw shear biegel-rough --to 2MPa --out out", "--to: '2MPa' is not a quantity in m"),
        ("jointlaw shear biegel-rough --to 1um --reverse 1um,,2um --out out", "--reverse: ''"),
        ("jointlaw shear biegel-rough --to 1um --units mm", "--units: invalid choice: 'mm'"),
        ("jointlaw shear biegel-rough --to 1um --steps 0 --out out", "steps = 0"),
        ("jointlaw shear biegel-rough", "the following arguments are required: --to"),
        ("jointlaw shear biegel-rough --to 1um --out", "--out: expected one argument"),
        ("jointlaw export c biegel-rough --out /proc/x", "no folder can be made at /proc/x"),
        ("jointlaw export c biegel-rough --shear-limit 5um --out out", "arguments: --shear-limit"),
        ("jointlaw export lammps law-plane.toml --out out", "law.plane = 0: motion in LAMMPS"),
        (
            "jointlaw export yade law-closure.toml --out out",
            "law.closure_only = True: motion in YADE",
        ),
        (
            "jointlaw export fem law-closure.toml --out out",
            "law.closure_only = True, but finite elements need shear",
        ),
        (
            "jointlaw export fem biegel-rough --seating 0 --out out",
            "A joint without stress has no stiffness",
        ),
        ("jointlaw fit good.csv --normal-stress 1MPa --out out", "is about direct shear tests"),
        ("jointlaw fit --shear good.csv --cycle --out out", "--cycle is about a closure test"),
        ("jointlaw fit good.csv good.csv --out out", "2 closure files: give one"),
        ("jointlaw fit good.csv --compliance rock.csv --out out", "'rock.csv' is not a quantity"),
        ("jointlaw fit closure.csv --cycle --up-to 1MPa --out out", "leave --up-to out"),
        ("jointlaw fit closure.csv --law nothing --out out", "'nothing' is neither a preset"),
        (
            "jointlaw fit closure.csv --set alpha=high --out out",
            "write a name and a number",
        ),
        ("jointlaw scan z.nc --spacing 20um --height-unit m --out out", "for example numpy.save"),
        ("dem_demo scene.toml --until=inf --out out", "until = inf s: inf steps"),
        ("dem_demo check endless.toml", "until = 1e+308 s: "),
        ("dem_demo check long.toml", "until = 1e+06 s: "),
        ("dem_demo check law.toml", "law.toml is the parameter file of a law, no scene"),
        ("dem_demo compare scene.toml", "has no [[rock]] to compare"),
        ("dem_demo nobodys --out out", "no command or scene 'nobodys': give one of run, new"),
    ],
)
def test_error_message_has_one_line_and_names_the_remedy(capsys, command, message):
    program, *words = shlex.split(command)
    assert {"jointlaw": jointlaw_main, "dem_demo": dem_demo.cli.main}[program](words) == 2
    (error,) = capsys.readouterr().err.splitlines()
    assert error.startswith(program)
    assert message in error
    assert not Path("out").exists()
    assert Path("done/shear.csv").read_text() == "of an earlier run"


@pytest.mark.parametrize(
    ("command", "function"),
    [
        ("fit grimsel_vd1_closure --out out", "fit.fit_curves"),
        ("shear linear-a2 --to 1um --out out", "laboratory.direct_shear"),
    ],
)
def test_ctrl_c_ends_a_command_with_one_line(command, function, capsys, monkeypatch):
    monkeypatch.setattr(f"jointlaw.cli.{function}", Mock(side_effect=KeyboardInterrupt))
    assert jointlaw_main(command.split()) == 130
    assert capsys.readouterr().err == (
        f"jointlaw {command.split()[0]}: interrupted; no further files are written\n"
    )
    assert not Path("out").exists()


def test_force_replaces_all_files_of_the_earlier_run():
    """Files of the earlier run are removed, files of the user stay."""
    assert jointlaw_main(shlex.split("closure linear-a3 --steps 3 --force --out done")) == 0
    assert Path("done/closure.csv").is_file()
    assert not Path("done/shear.csv").exists()
    assert Path("done/notes.txt").read_text() == "mine"
