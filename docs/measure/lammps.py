"""ns per contact and step of pair_style jointlaw in a packing, beside LAMMPS' own styles.

    python docs/measure/lammps.py FOLDER [--rounds 2] [--steps 60] [--settle 60] [--repeat 2]

Packs 2744 spheres, repeats the box (2: 21 952 spheres), and times the pair styles one after
another in every round; the least of all rounds counts. Times of one processor are those that it
used, by LAMMPS' own count; those of two mean something only while no other work is done.
LAMMPS is that of this Python's environment, or of $ENV.
"""

import os
import re
import subprocess
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from tables import asked, folder, table

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
from jointlaw.hosts.lammps.export import export_lammps

ENV = Path(os.environ.get("ENV", sys.prefix))
PACK = """units si
atom_style sphere
boundary p p p
comm_modify vel yes
newton on
lattice sc 0.0135
region box block 0 14 0 14 0 14
create_box 1 box
create_atoms 1 box
set type 1 diameter 0.01 density 2600
displace_atoms all random 0.0015 0.0015 0.0015 4711
velocity all ramp vx -0.3 0.3 y 0 0.2 sum yes units box
pair_style gran/hertz/history 1e7 NULL 50.0 NULL 0.4 0
pair_coeff * *
neighbor 0.002 bin
timestep 2e-5
fix 1 all nve/sphere
fix v all viscous 1e-4
variable L equal (2744*4/3*PI*0.005^3/0.645)^(1/3)
fix d all deform 1 x final 0 $L y final 0 $L z final 0 $L remap x units box
run 2000
unfix d
run 1000
write_data pack.data nocoeff
"""
MEASURE = """units si
atom_style sphere
boundary p p p
comm_modify vel yes
newton {newton}
read_data pack.data
replicate {repeat} {repeat} {repeat}
{style}
neighbor 0.0005 bin
timestep 1e-6
fix 1 all nve/sphere
fix v all viscous 0.02
compute each all contact/atom
compute count all reduce sum c_each
thermo_style custom step c_count press
run {settle}
run {steps}
"""
OWN = {
    "gran/hertz/history": ("off", "pair_style gran/hertz/history 1e8 NULL 50.0 NULL 0.4 0\n"
                           "pair_coeff * *"),
    "granular, mindlin": ("off", "pair_style granular\npair_coeff * * hertz/material 1e9 0.5 0.3 "
                          "tangential mindlin NULL 1.0 0.4 damping viscoelastic"),
}  # fmt: skip
COULOMB = jl.CoulombLaw(normal_stiffness=1.0e9, shear_stiffness=0.83e9, friction=0.4)
HEAD = ["pair style, resolution", "contacts", "pair style, ns per contact and step",
        "the same / mindlin", "whole step, ns", "2 processors: pair style, ns",
        "speed-up of the step", "bytes per contact"]  # fmt: skip


def rock(resolution):
    """Asperities of a tenth of a millimetre, as stiff in the packing as the styles beside it."""
    return jl.JointLaw(
        orientation=jl.Orientation(4.0),
        asperity=jl.Asperity(K=9.5e6, lam=1.2, eta=0.5, mu=0.4),
        heights=jl.GammaHeights(alpha=3.82, beta=1.15e-4, overlap=3e-4),
        asperity_density=1e6,
        resolution=resolution,
        mating_length=2e-4,
    )


def lammps(where, script, processors=1):
    """Run a script; its log."""
    (where / "in.bench").write_text(script)
    program = next(ENV.glob("lib/python3*/site-packages/lammps/lmp"))
    command = [program, "-in", "in.bench", "-log", "log.bench", "-screen", "none"]
    if processors > 1:
        command = [ENV / "bin/mpirun", "-np", str(processors), *command]
    env = {**os.environ, "OMP_NUM_THREADS": "1", "LD_LIBRARY_PATH": str(ENV / "lib")}
    subprocess.run(command, cwd=where, env=env, check=True, stdin=subprocess.DEVNULL)
    return (where / "log.bench").read_text()


def number(pattern, log):
    """The last number that is found."""
    return float(re.findall(pattern, log, re.M)[-1])


def times(log, processors):
    """Seconds of the pair style and of the whole run; of one processor those that it used, so that
    what other work took from it is left out."""
    used = number(r"^(\S+)% CPU use", log) / 100 if processors == 1 else 1.0
    pair, loop = r"^Pair +\| \S+ +\| (\S+)", r"^Loop time of (\S+)"
    return used * number(pair, log), used * number(loop, log)


def prepare(where):
    """Make the plug-in, the table of the law at "balanced" and the packing in a folder."""
    export_lammps(rock("balanced"), where, "rock")
    env = {**os.environ, "ENV": str(ENV)}
    subprocess.run(["./build.sh"], cwd=where, env=env, check=True, stdout=subprocess.DEVNULL)
    lammps(where, PACK)


def main():
    options = asked(__doc__, folder=folder, rounds=2, steps=60, settle=60, repeat=2)
    where = options.folder
    prepare(where)
    styles, sizes = dict(OWN), {}
    laws = {f"jointlaw, {r}": rock(r) for r in ("fast", "balanced", "fine")}
    laws["jointlaw, Coulomb"] = COULOMB
    for number_of_law, (name, law) in enumerate(laws.items()):
        file = f"law-{number_of_law}.jlaw"
        (where / file).write_text(table_text(law))
        styles[name] = ("on", "plugin load ./jointlawplugin.so\npair_style jointlaw opening 5e-4\n"
                        f"pair_coeff * * {file}")  # fmt: skip
        sizes[name] = 8 * (law.state_size + 8)
    runs = defaultdict(list)
    for _ in range(options.rounds):
        for name, (newton, style) in styles.items():
            text = MEASURE.format(newton=newton, style=style, **vars(options))
            for processors in (1, 2):
                log = lammps(where, text, processors)
                count = number(r"^ +\d+ +(\S+) +\S+ *$", log) / 2
                each = (1e9 / options.steps / count * used for used in times(log, processors))
                runs[name, processors].append([*each, count])
    best, rows = {case: np.min(some, axis=0) for case, some in runs.items()}, []
    for name in styles:
        (pair, loop, count), (pair2, loop2, _) = best[name, 1], best[name, 2]
        over = pair / best["granular, mindlin", 1][0]
        rows.append([name, f"{count:.0f}", f"{pair:.0f}", f"{over:.2f}", f"{loop:.0f}",
                     f"{pair2:.0f}", f"{loop / loop2:.2f}", sizes.get(name, "")])  # fmt: skip
    print(table(HEAD, rows))


if __name__ == "__main__":
    main()
