"""Every option of both command lines is felt: with it, a command prints or writes something else.

The options are those of the tables of commands; each has a probe: a command line, and the same one
with another value of the option. An option without a probe fails the test of its command. Long work
(fits, strength reduction, comparisons) is replaced by a report of its arguments.
"""

import itertools
import re
import shlex
from dataclasses import is_dataclass
from functools import cache
from unittest.mock import Mock

import numpy as np
import pytest
from scene_text import PLAIN, on_base
from scipy.ndimage import gaussian_filter

import dem_demo.cli
import jointlaw as jl
import jointlaw.cli.field
import jointlaw.cli.fit
import jointlaw.cli.main
import jointlaw.cli.scan
from dem_demo.output.pictures import Pictures
from jointlaw.cli.command import Group
from jointlaw.hosts import HOSTS
from jointlaw.surface.fit import SurfaceFit
from jointlaw.tables.joint_table import JointTable

pytestmark = pytest.mark.usefixtures("in_an_empty_folder")
SHEAR = "--to 1um --steps 3"
SCAN = "scan scan.csv --spacing 20um --height-unit um"
FACES = SCAN + " --upper upper.csv"
FIELD = {
    "jrc": ("10", "11"),
    "jcs": ("100MPa", "90MPa"),
    "length": ("0.1m", "0.2m"),
    "normal-stress": ("1MPa", "2MPa"),
    "normal-stiffness": ("30GPa/m", "40GPa/m"),
}
FIELD_LINE = "field " + " ".join(f"--{name} {value}" for name, (value, _) in FIELD.items())
# without its law: the values of the line are reported
FIELD_REPORT = FIELD_LINE + " --out report"
FILE_FIT = "fit table.csv"
REAL_FIT = "fit table.csv --free asperity_density"
FLOW_FIT = "fit table.csv --cycle --flow flow.csv"
PRESSURES = (
    "fit table.csv --cycle --flow pressure.csv --flow-rate 5ml/min --outlet-pressure 100kPa "
    "--flow-length 10cm --flow-width 5cm"
)
RADIAL = (
    "fit table.csv --cycle --flow pressure.csv --flow-rate 5ml/min --outlet-pressure 100kPa "
    "--flow-radii 4mm,60mm"
)
SHEAR_FIT = "fit --shear shear.csv"
FORCE_CLOSURE = "fit load.csv --closure-area 100cm2"
FORCE_FIT = "fit --shear forces.csv --normal-stress 1MPa --area 100cm2"

# Options of a command, each with a line without it and a line with it or with another value
PROBES = {
    "browser": {},
    "presets": {
        "name": ("presets", "presets linear-a3"),
        "--json": ("presets", "presets --json"),
    },
    "card": {
        "law": ("card linear-a3", "card biegel-rough"),
        "--default-rock": ("card surface.toml", "card surface.toml --default-rock"),
        "--resolution": ("card linear-a3", "--resolution fast"),
        "--json": ("card linear-a3", "--json"),
    },
    "shear": {
        "--normal-stress": ("shear linear-a3 " + SHEAR, "--normal-stress 5MPa"),
        "--to": ("shear linear-a3 --steps 3 --to 1um", "shear linear-a3 --steps 3 --to 2um"),
        "--reverse": ("shear linear-a3 " + SHEAR, "--reverse 0"),
        "--azimuth": ("shear biegel-rough " + SHEAR, "--azimuth 30deg"),
        "--normal-stiffness": ("shear linear-a3 " + SHEAR, "--normal-stiffness 5GPa/mm"),
        "--steps": ("shear linear-a3 --to 1um --steps 3", "shear linear-a3 --to 1um --steps 4"),
        "--units": ("shear linear-a3 " + SHEAR, "--units mm,MPa"),
    },
    "closure": {
        "--normal-stress": ("closure linear-a3 --steps 3", "--normal-stress 5MPa"),
        "--steps": ("closure linear-a3 --steps 3", "closure linear-a3 --steps 4"),
        "--units": ("closure linear-a3 --steps 3", "--units mm,MPa"),
    },
    "fit": {
        "data": (FILE_FIT, "fit grimsel_vd1_closure"),
        "--stress-column": (FILE_FIT, "--stress-column other:MPa"),
        "--closure-area": (FORCE_CLOSURE, FORCE_CLOSURE.replace("100cm2", "200cm2")),
        "--closure-column": (FILE_FIT, "--closure-column second:mm"),
        "--up-to": (FILE_FIT, "--up-to 3MPa"),
        "--cycle": (FILE_FIT, "--cycle"),
        "--compliance": (FILE_FIT, "--compliance 1um/10MPa"),
        "--noise": (FILE_FIT, "--noise 0.02"),
        "--shear": (SHEAR_FIT, "fit --shear other.csv"),
        "--peaks": (SHEAR_FIT, "--peaks peaks.csv"),
        "--normal-stress": (FORCE_FIT, FORCE_FIT.replace("1MPa", "2MPa")),
        "--shear-column": (SHEAR_FIT, "--shear-column second:mm"),
        "--shear-stress-column": (SHEAR_FIT, "--shear-stress-column third:MPa"),
        "--normal-column": (SHEAR_FIT, "--normal-column other:MPa"),
        "--opening-column": (SHEAR_FIT, "--opening-column second:mm"),
        "--area": (FORCE_FIT, FORCE_FIT.replace("100cm2", "200cm2")),
        "--side": (FORCE_FIT, "--side 10cm"),
        "--fit": ("fit --shear shear.csv other.csv third.csv", "--fit 1MPa,2MPa"),
        "--decimal": ("fit ambiguous.csv", "--decimal comma"),
        "--outliers": ("fit outlier.csv", "--outliers skip"),
        "--one-specimen": (SHEAR_FIT, "--one-specimen"),
        "--flow": (FLOW_FIT, FLOW_FIT.replace("flow.csv", "flow2.csv")),
        "--flow-column": (FLOW_FIT, "--flow-column other:mm"),
        "--flow-up-to": (FLOW_FIT, "--flow-up-to 3MPa"),
        "--flow-rate": (PRESSURES, PRESSURES.replace("5ml", "6ml")),
        "--outlet-pressure": (PRESSURES, PRESSURES.replace("100kPa", "90kPa")),
        "--flow-length": (PRESSURES, PRESSURES.replace("10cm", "11cm")),
        "--flow-width": (PRESSURES, PRESSURES.replace("5cm", "6cm")),
        "--flow-radii": (RADIAL, RADIAL.replace("4mm", "5mm")),
        "--viscosity": (PRESSURES, "--viscosity 2mPas"),
        "--set": (FILE_FIT, "--set alpha=3.8"),
        "--free": (FILE_FIT, "--free beta"),
        "--law": (FILE_FIT, "--law westerly-smooth"),
    },
    "scan": {
        "file": (SCAN, SCAN.replace("scan.csv", "scan2.csv")),
        "--spacing": (SCAN, SCAN.replace("20um", "30um")),
        "--height-unit": (SCAN, SCAN.replace("unit um", "unit nm")),
        "--decimal": (SCAN.replace("scan.csv", "comma.csv"), "--decimal comma"),
        "--sampling-length": (SCAN, "--sampling-length 100um"),
        "--upper": (FACES, FACES.replace("upper.csv", "upper2.csv")),
        "--mirror": (FACES, "--mirror columns"),
    },
    "field": {
        **{
            f"--{name}": (FIELD_REPORT, FIELD_REPORT.replace(f"{name} {value}", f"{name} {other}"))
            for name, (value, other) in FIELD.items()
        },
        "--basic-friction": (FIELD_REPORT, "--basic-friction 35deg"),
        "--degradation": (FIELD_REPORT, "--degradation stress"),
    },
    **{f"export {host}": {} for host in HOSTS},
}
PROBES["export yade"]["--shear-limit"] = ("export yade linear-a3", "--shear-limit 2um")
PROBES["export fem"]["--seating"] = ("export fem linear-a3", "--seating 20kPa")
LINES = {  # of commands whose shared options are probed
    "browser": "browser",
    "shear": f"shear linear-a3 {SHEAR}",
    "closure": "closure linear-a3 --steps 3",
    "fit": REAL_FIT,
    "scan": SCAN,
    "field": FIELD_LINE,
    **{f"export {host}": f"export {host} linear-a3" for host in HOSTS},
}
SCENE = on_base(PLAIN, [1.0, 0.5], end=0.004) + "record = 0.002\n"
ROCK = """\
[[rock]]
name = "rock"
outline = [[5.0, 0.0], [6.0, 0.0], [6.0, 1.0], [5.0, 1.0]]
set = []
"""
DEM_PROBES = {
    "run": {
        "scene": ("run scene.toml --no-pictures", "run other.toml --no-pictures"),
        "--until": ("run scene.toml --no-pictures", "--until 0.002"),
        "--no-pictures": ("run scene.toml", "--no-pictures"),
        "--format": ("run scene.toml", "--format svg"),
        "--vtk": ("run scene.toml --no-pictures", "--vtk"),
        "--json": ("run scene.toml --no-pictures", "--json"),
    },
    "resume": {
        "state": ("resume scene-state --no-pictures", "resume other-state --no-pictures"),
        "--step": ("resume scene-state --until 0.006 --no-pictures", "--step 1e-4"),
        "--until": ("resume scene-state --no-pictures", "--until 0.006"),
        "--no-pictures": ("resume scene-state", "--no-pictures"),
        "--format": ("resume scene-state", "--format svg"),
        "--vtk": ("resume scene-state --no-pictures", "--vtk"),
        "--json": ("resume scene-state --no-pictures", "--json"),
    },
    "new": {"file": ("new one.toml", "new two.toml")},
    "check": {"scene": ("check scene.toml", "check other.toml")},
    "strength-reduction": {
        "scene": ("strength-reduction scene.toml", "strength-reduction other.toml"),
        "--until": ("strength-reduction scene.toml", "--until 0.5"),
        "--format": ("strength-reduction scene.toml", "--format svg"),
        "--json": ("strength-reduction scene.toml", "--json"),
    },
    "compare": {
        "scene": ("compare rock.toml", "compare rock2.toml"),
        "--seeds": ("compare rock.toml", "--seeds 4"),
        "--until": ("compare rock.toml", "--until 0.5"),
    },
    "ablate": {
        "scene": ("ablate scene.toml", "ablate other.toml"),
        "--until": ("ablate scene.toml", "--until 0.5"),
    },
}
DEM_LINES = {
    "run": "run scene.toml --no-pictures",
    "resume": "resume scene-state --no-pictures",
    "strength-reduction": "strength-reduction scene.toml",
    "ablate": "ablate scene.toml",
}
# Files of which only the names are compared
BINARIES = (".zip", ".png", ".svg", ".pdf", ".gif", ".npz", ".npy", ".so", ".vtu")
# of a run, which differ from run to run, and the command line that a report repeats
TIMES = (
    r'"wall_time_s": [^,}]*|estimated .*|"date": .*|"command": .*|jointlaw [\d.]+, 20.*'
    r"|    jointlaw .*|(?m:^(command|date) = .*)"
)
REFUSALS = ("called with", "the fitted a = ")  # of work that is replaced; of heights in nm
FROM_FIELD = cache(jointlaw.cli.field.from_field)
SHEAR_PAST_PEAK = cache(jointlaw.cli.field.shear_past_peak)
PRESENT = {}  # outcomes of lines without an option
REPEATED = set()  # commands of which a line has run twice, with the same outcome


def commands():
    """All commands of `jointlaw`, subcommands too: {name: names of options}."""
    for command in jointlaw.cli.main.COMMANDS:
        for prefix, one in [("", command), *((f"{command.name} ", c) for c in command.subcommands)]:
            groups = [o.options if isinstance(o, Group) else (o,) for o in one.options]
            if one is command and command.subcommands:
                assert not groups
                continue
            yield prefix + one.name, [names[-1] for group in groups for names, _ in group]


def shared(line):
    """Probes of options that several commands have, for a line without any of them."""
    law = line.split()[-1] if line.startswith("export") else "linear-a3"
    with_file = line.replace(law, "surface.toml")
    return {
        "law": (line, line.replace(law, "linear-a6")),
        "--default-rock": (with_file, "--default-rock"),
        "--resolution": (line, "--resolution fast"),
        "--json": (line, "--json"),
        "--format": (line, "--format svg"),
        "--out": (f"{line} --out o", f"{line} --out p"),
        "--force": (f"{line} --out full", "--force"),
    }


def with_out(name, pair):
    """A pair of lines of a command, with a folder for the results if it writes into one."""
    line, alternative = pair
    if name in LINES or name in DEM_LINES:
        line, alternative = (
            one if re.search("--out( |$)|^--", one) else f"{one} --out o" for one in pair
        )
    return line, alternative


def probes(name, options, own, lines):
    """A pair of lines for each option of a command."""
    result = own.get(name, {})
    line = lines.get(name)
    for option in options:
        if option in result:
            yield option, with_out(name, result[option])
        else:
            pair = shared(line).get(option) if line else None
            yield option, with_out(name, pair) if pair else None


CASES = [
    pytest.param(jointlaw.cli.main.main, pair, id=f"jointlaw {name} {option}")
    for name, options in commands()
    for option, pair in probes(name, options, PROBES, LINES)
] + [
    pytest.param(dem_demo.cli.main, pair, id=f"dem_demo {command.name} {option}")
    for command in dem_demo.cli.COMMANDS
    for option, pair in probes(
        command.name, [names[-1] for names, _ in command.options], DEM_PROBES, DEM_LINES
    )
]


def flat(value):
    """A value as text, with all elements of arrays."""
    if is_dataclass(value) and not isinstance(value, type):
        value = vars(value)
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key}: {flat(one)}" for key, one in value.items()) + "}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(flat, value))}]"
    return repr(value.tolist() if isinstance(value, np.ndarray) else value)


# A fit without results, for commands that go on with a flow test
NO_FIT = Mock(parameters={}, free=[], identifiable=[], series_names=[], shape_differs=[])
NO_FIT.report.return_value = ""
NO_FIT.comparisons.return_value = []
NO_FIT.law.asperity_density = 1.0
NO_FIT.problem.shears = []
NO_FIT.problem.closure.stress = [1.0]
NO_FIT.not_identifiable = {}
NO_FIT.has_trade_off = False
NO_FIT.law.to_toml.return_value = ""


def report(*arguments, **keywords):
    """In place of a long computation: its arguments as an error."""
    raise ValueError(f"called with {flat(arguments)} {flat(keywords)}")


def report_scene(scene, *arguments):
    """The same for a scene and other arguments."""
    report(scene.title, *arguments)


def angle_of_slopes(joint, *arguments, **keywords):
    """In place of a shear test of a scanned surface: an angle that depends on its slopes."""
    return Mock(peak_friction_angle=90.0 / joint.law.orientation.a)


def row_of(scene, *arguments):
    """In place of a strength reduction: one row that names the arguments."""
    yield {"rock": f"{scene.title} {flat(arguments[:3])}"}


def rows(*columns):
    return "".join(",".join(f"{x:.6g}" for x in row) + "\n" for row in zip(*columns, strict=True))


RAMP = np.linspace(0.1, 1.0, 12)
SIZE = gaussian_filter(np.random.default_rng(0).normal(size=(120, 120)), 4) * 400
# alike if it is reversed along columns, so that both ways to turn it over give a composite surface
UPPER_FACE = -0.3 * (SIZE + SIZE[::-1, ::-1])
SHEAR_TITLES = "shear_mm,shear_stress_MPa,normal_stress_MPa,opening_mm,second,other,third\n"


def shear_rows(normal):
    """A shear test: displacement, stress, normal stress, opening, and other columns."""
    strength = normal * START**0.3
    constant = normal + 0 * START
    return rows(2 * START, strength, constant, 0.1 * START, START, 0.9 * constant, 0.8 * strength)


START = RAMP - RAMP[0]
LOADING = np.stack([5 * RAMP**2, 0.01 * RAMP, 4 * RAMP**2, 0.02 * RAMP], axis=1)
UNLOADING = LOADING[-2::-1] * [1.0, 0.5, 1.0, 0.5] + [0.0, 0.005, 0.0, 0.01]
CLOSURE_TEST = np.concatenate([LOADING, UNLOADING])
HEIGHTS = 5 + 0.5 * SIZE / SIZE.std()
AMBIGUOUS = [[f"{height:.3f}".replace(".", ",") for height in row] for row in HEIGHTS]
FILE_TEXTS = {
    "table.csv": "stress_MPa,closure_mm,other,second\n" + rows(*CLOSURE_TEST.T),
    "shear.csv": SHEAR_TITLES + shear_rows(1.0),
    "other.csv": SHEAR_TITLES + shear_rows(2.0),
    "third.csv": SHEAR_TITLES + shear_rows(3.0),
    "load.csv": "load_kN,closure_mm\n" + rows(10 * CLOSURE_TEST[:, 0], CLOSURE_TEST[:, 1]),
    "forces.csv": "shear_mm,shear_force_kN\n" + rows(2 * START, 9 * START**0.3),
    "flow.csv": "stress_MPa,aperture_mm,other\n"
    + rows(5 * RAMP**2, 0.05 - 0.02 * RAMP, 0.06 - 0.02 * RAMP),
    "flow2.csv": "stress_MPa,aperture_mm\n" + rows(5 * RAMP**2, 0.06 - 0.02 * RAMP),
    "pressure.csv": "stress_MPa,pressure_kPa\n" + rows(5 * RAMP**2, 120 + 20 * RAMP),
    "peaks.csv": "normal_stress_MPa,peak_shear_stress_MPa,peak_displacement_mm,"
    "residual_shear_stress_MPa,residual_displacement_mm\n1,0.9,0.5,0.7,3\n2,1.7,0.6,1.4,3\n",
    "ambiguous.csv": "stress_kPa;closure_um\n" + "".join(f"{n},201;{n},100\n" for n in range(1, 8)),
    "outlier.csv": "stress_MPa,closure_mm\n"
    + rows(5 * RAMP**2, np.where(np.arange(12) == 6, 0.9, 0.01 * RAMP)),
    "scan.csv": rows(*SIZE),
    "scan2.csv": rows(*(1.5 * SIZE)),
    "upper.csv": rows(*(UPPER_FACE[:, ::-1])),
    "upper2.csv": rows(*(1.2 * UPPER_FACE[:, ::-1])),
    "comma.csv": "".join(";".join(row) + "\n" for row in AMBIGUOUS),
    "surface.toml": "asperity_density = 1e10\nclosure_range = 1e-6\n[orientation]\na = 3.0\n",
    "scene.toml": SCENE,
    "rock.toml": SCENE + ROCK,
    "rock2.toml": 'title = "other"\n' + SCENE + ROCK,
    "other.toml": 'title = "other"\n' + SCENE,
}


@pytest.fixture(scope="module")
def states(tmp_path_factory):
    """Saved states of two scenes, as bytes by the names of their folders."""
    result = {}
    for name in ("scene", "other"):
        sim = dem_demo.Simulation(dem_demo.parse(FILE_TEXTS[f"{name}.toml"]))
        for _ in range(5):
            sim.step()
        folder = tmp_path_factory.mktemp(name)
        sim.save(folder)
        result[f"{name}-state"] = (folder / "state.npz").read_bytes()
    return result


@pytest.fixture(scope="module")
def real_fit():
    """The fit of the line `REAL_FIT`."""
    stress, closure, *_ = np.transpose(LOADING)
    curve = jl.ClosureCurve(1e6 * stress, 1e-3 * closure)
    return jl.fit_curves([curve], free=["asperity_density"])


@pytest.fixture
def outcome(tmp_path, monkeypatch, capsys, states, real_fit):
    """outcome(main, line): exit status, what is printed, and what is written, in a new folder."""
    monkeypatch.setattr("webbrowser.open", lambda address: None)
    empty = lambda self, path, **options: path.write_bytes(b"")  # noqa: E731
    # only the names of pictures are compared
    for kind in (jl.TestRecord, SurfaceFit, type(real_fit)):
        monkeypatch.setattr(kind, "plot", empty)
    for picture in ("final", "animation"):
        monkeypatch.setattr(Pictures, picture, empty)
    monkeypatch.setattr(Pictures, "estimate_time", lambda self, frames: 60.0)
    monkeypatch.setattr(jointlaw.cli.fit, "fit_flow", report)
    monkeypatch.setattr(jointlaw.cli.field, "shear_past_peak", SHEAR_PAST_PEAK)
    monkeypatch.setattr(jointlaw.cli.scan, "direct_shear", angle_of_slopes)
    monkeypatch.setattr(JointTable, "report", lambda self, law: {})
    monkeypatch.setattr(dem_demo.cli.ablate, "ablate", report_scene)
    monkeypatch.setattr(dem_demo.cli.compare, "compare", report_scene)
    monkeypatch.setattr(dem_demo.cli.strength, "strength_reduction", row_of)
    numbers = itertools.count()

    def measure(main, line):
        folder = tmp_path / f"{next(numbers)}"
        for name in ("full", *states):
            (folder / name).mkdir(parents=True)
        for name, text in FILE_TEXTS.items():
            (folder / name).write_text(text)
        for name, state in states.items():
            (folder / name / "state.npz").write_bytes(state)
        (folder / "full" / "summary.json").write_text("{}")
        before = {*folder.rglob("*")}
        monkeypatch.chdir(folder)
        fit = report
        if line.startswith(REAL_FIT):
            fit = lambda *arguments, **keywords: real_fit  # noqa: E731
        elif "--flow " in line:
            fit = lambda *arguments, **keywords: NO_FIT  # noqa: E731
        monkeypatch.setattr(jointlaw.cli.fit, "fit_curves", fit)
        law_of_field = report if "--out report" in line else FROM_FIELD
        monkeypatch.setattr(jointlaw.cli.field, "from_field", law_of_field)
        status = main(shlex.split(line))
        written = {}
        for path in sorted({*folder.rglob("*")} - before):
            is_text = path.is_file() and path.suffix not in BINARIES
            text = path.read_text() if is_text else ""
            written[path.relative_to(folder).as_posix()] = re.sub(TIMES, "", text)
        printed = capsys.readouterr()
        out = re.sub(TIMES, "", printed.out).replace(str(folder), "")
        return status, out, printed.err, written

    return measure


@pytest.mark.parametrize(("main", "pair"), CASES)
def test_every_option_is_felt(main, pair, outcome):
    assert pair, "give the option a probe"
    line, alternative = pair
    if alternative.startswith("--"):
        alternative = f"{line} {alternative}"
    if line not in PRESENT:
        PRESENT[line] = outcome(main, line)
        command = " ".join(line.split()[: 2 if line.startswith("export") else 1])
        if command not in REPEATED:  # nothing else makes a difference
            REPEATED.add(command)
            assert outcome(main, line) == PRESENT[line]
    present = PRESENT[line]
    felt = outcome(main, alternative)
    assert felt[0] == 0 or any(text in felt[2] for text in REFUSALS), felt[2]
    assert felt != present
