"""Cost per contact and step in the particle codes LAMMPS and YADE, compared with their own laws.

    python docs/measure/hosts.py lammps FOLDER [--rounds 2] [--steps 40] [--settle 40] [--repeat 2]
    python docs/measure/hosts.py lammps-scale FOLDER [--small]
    python docs/measure/hosts.py yade [--contacts 20000] [--runs 60] [--preset jing-replica]

The program of LAMMPS is the one in the environment of this Python, or in $ENV.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from common import print_table, run_command

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
from jointlaw.hosts.lammps.export import export_lammps
from jointlaw.hosts.yade.export import export_yade
from jointlaw.parameters.resolution import NAMED_RESOLUTIONS

ENVIRONMENT = Path(os.environ.get("ENV", sys.prefix))
RESOLUTIONS = "fast", "balanced", "fine"
MINDLIN = "granular, mindlin"
RECORD_SIZE = 12  # numbers of a joint beside its state: EXTRA_SIZE in jointlawplugin.cpp
FLOAT_FOLDER = "floats"  # in FOLDER, with the plug-in that stores slider forces as float
COULOMB = jl.CoulombLaw(normal_stiffness=1.0e9, shear_stiffness=0.83e9, friction=0.4)
SCALE_STEPS = 20  # steps that settle, and steps that are timed; half as many after a restart
CLUSTER_CONTACTS = 1e8
CLUSTER_PROCESSES = 1024
# position, velocity, spin of a ghost atom, and its force and torque back
NUMBERS_PER_GHOST = 15

PACK_SCRIPT = """units si
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
TIMING_SCRIPT = """units si
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
LAMMPS_STYLES = {
    "gran/hertz/history": ("off", "pair_style gran/hertz/history 1e8 NULL 50.0 NULL 0.4 0\n"
                           "pair_coeff * *"),
    MINDLIN: ("off", "pair_style granular\npair_coeff * * hertz/material 1e9 0.5 0.3 "
              "tangential mindlin NULL 1.0 0.4 damping viscoelastic"),
}  # fmt: skip

SCALE_HEADER = "units si\natom_style sphere\nboundary p p p\ncomm_modify vel yes\nnewton on\n"
SCALE_STYLE = """plugin load ./jointlawplugin.so
pair_style jointlaw opening 5e-4
pair_coeff * * rock.jlaw
neighbor 0.0005 bin
"""
SHEAR_FLOW = """
fix 1 all nve/sphere
fix v all viscous 0.02
fix flow all deform 1 xy erate 50 remap v
compute each all contact/atom
compute count all reduce sum c_each
compute joint all pair jointlaw
thermo_style custom step c_count c_joint[1] pe c_joint[2] press
thermo_modify format float %.15g norm no
timestep 2e-7
"""
SETTLE_SCRIPT = (
    SCALE_HEADER
    + "read_data pack.data\n"
    + SCALE_STYLE.replace("5e-4\n", "5e-4 damping 0.5\n")
    + """
change_box all x scale 1.03 y scale 1.03 z scale 1.03 remap
timestep 1e-6
fix 1 all nve/limit 1e-5
fix v all viscous 1.0
run 500
velocity all set 0 0 0
write_data settled.data nocoeff
"""
)
SCALE_SCRIPT = (
    SCALE_HEADER
    + "read_data settled.data\nreplicate {}\nchange_box all triclinic\n"
    + SCALE_STYLE
    + SHEAR_FLOW
    + f"run {SCALE_STEPS}\nrun {SCALE_STEPS}\ninfo out log memory\n"
)
SAVE_COMMANDS = f"write_restart saved\nrun {SCALE_STEPS // 2}\n"
RESTART_SCRIPT = (
    SCALE_HEADER + "read_restart saved\n" + SCALE_STYLE + SHEAR_FLOW + f"run {SCALE_STEPS // 2}\n"
)

YADE_COLUMNS = {
    "step": "whole step",
    "ratio": "step / Cundall-Strack",
    "adapter": "time that the adapter adds",
    "access": "part of it to read and write YADE's objects",
    "law": "part of it in our law",
}
YADE_SCENE = """
import json, sys, time
sys.path.insert(0, ".")
import numpy as np
from collections import deque
from yade_joint import Joints, LiveLaw, TableLaw, iter_made_real
contacts = {contacts}
runs = {runs}
OWN_LAWS = "cundall", "hertz"
N = round((contacts / 3) ** (1 / 3)) + 1
R = 0.5

def build(law):
    O.reset()
    O.materials.append(FrictMat(young=1e7, poisson=.3, frictionAngle=.5, density=2600))
    spacing = 2 * R - {overlap}
    rng = np.random.default_rng(1)
    for k in range(N**3):
        x = spacing * np.array([k % N, k // N % N, k // N**2])
        O.bodies.append(utils.sphere(x.tolist(), R))
        O.bodies[-1].state.vel = Vector3(*(1e-3 * rng.uniform(-1, 1, 3)).tolist())
        O.bodies[-1].state.angVel = Vector3(*(1e-3 * rng.uniform(-1, 1, 3)).tolist())
    if law == "hertz":
        physics = Ip2_FrictMat_FrictMat_MindlinPhys()
        contact_law = Law2_ScGeom_MindlinPhys_Mindlin()
    else:
        physics = Ip2_FrictMat_FrictMat_FrictPhys()
        contact_law = Law2_ScGeom_FrictPhys_CundallStrack()
    if law not in OWN_LAWS:
        contact_law.neverErase = True
    O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=.01),
                 InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [physics], [contact_law]),
                 NewtonIntegrator(damping=.2)]
    O.dt = 1e-8

def timed(function, add):
    # the function, which adds its processor time (ns) by add(time)
    def timed_function(*arguments):
        start = time.thread_time()
        result = function(*arguments)
        add(1e9 * (time.thread_time() - start))
        return result
    return timed_function

def shortest_time(function, prepare=lambda: None):
    shortest = []
    call = timed(function, shortest.append)
    for _ in range(runs):
        prepare()
        call()
    return min(shortest)

def access(joints, zeros):
    # read interactions and bodies, and add forces, by the calls of the adapter
    list(map(iter_made_real, joints.interactions))
    O.interactions.countReal()
    joints._read_bodies()
    deque(map(O.forces.addF, joints.bodies, zeros), maxlen=0)
    deque(map(O.forces.addT, joints.bodies, zeros), maxlen=0)

results = {{}}
for law in {kinds}:
    build(law)
    if law not in OWN_LAWS:
        if law == "table":
            joints = Joints(TableLaw("joint.txt"))
        else:
            joints = Joints(LiveLaw(law + ".toml"))
        joints.attach()
    for _ in range(3):
        O.step()
    n = O.interactions.countReal()
    results[law] = dict(contacts=n, bodies=len(O.bodies), step=shortest_time(O.step) / n)
    if law not in OWN_LAWS:
        adapter = []
        inner = []
        joints.step = timed(joints.step, adapter.append)
        joints.law.step = timed(joints.law.step, inner.append)
        for _ in range(runs):
            O.step()
        assert len(joints) == n and np.isfinite(joints.F).all() and joints.F[0].min() > 0
        zeros = [[0.0] * 3] * len(joints.bodies)
        alone = shortest_time(lambda: access(joints, zeros), prepare=O.step)
        results[law].update(adapter=min(adapter) / n, law=min(inner) / n, access=alone / n)
print("RESULT " + json.dumps(results), flush=True)
"""


def lammps(folder: Path, rounds=2, steps=40, settle=40, repeat=2):
    """ns per contact and step of pair_style jointlaw in a packing, and of LAMMPS' own styles.

    Packs 2744 spheres, repeats the box (2: 21 952 spheres), and times the pair styles one after
    another in every round; the shortest time of all rounds counts. Processor time of one process,
    as LAMMPS counts it. Float storage: a plug-in built with -DJOINTLAW_FLOAT_SLIDERS.
    """
    prepare_packing(folder)
    build_plugin(folder / FLOAT_FOLDER, "-DJOINTLAW_FLOAT_SLIDERS")
    fast, balanced, fine = (lammps_law(resolution) for resolution in RESOLUTIONS)
    laws = {
        "jointlaw, Coulomb": (COULOMB, "", False),
        "jointlaw, fast": (fast, "", False),
        "jointlaw, fast, float storage": (fast, "", True),
        "jointlaw, balanced": (balanced, "", False),
        "jointlaw, balanced, float storage": (balanced, "", True),
        "jointlaw, balanced, with damping": (balanced, "damping 0.5", False),
        "jointlaw, balanced, with yielding, degradation and bond":
            (with_all_parts(balanced), "", False),
        "jointlaw, fine": (fine, "", False),
        "jointlaw, fine, float storage": (fine, "", True),
    }  # fmt: skip
    styles = dict(LAMMPS_STYLES)
    sizes = {}
    for index, (name, (law, keywords, stores_floats)) in enumerate(laws.items()):
        file = f"law-{index}.jlaw"
        (folder / file).write_text(table_text(law))
        commands = [
            f"plugin load ./{FLOAT_FOLDER if stores_floats else '.'}/jointlawplugin.so",
            f"pair_style jointlaw opening 5e-4 {keywords}",
            f"pair_coeff * * {file}",
        ]
        styles[name] = "on", "\n".join(commands)
        state_size = law.tables.slider_packing.packed_rows if stores_floats else law.state_size
        sizes[name] = 8 * (state_size + RECORD_SIZE)
    runs = defaultdict(list)
    for _ in range(rounds):
        for name, (newton, style) in styles.items():
            script = TIMING_SCRIPT.format(
                newton=newton, style=style, steps=steps, settle=settle, repeat=repeat
            )
            log = run_lammps(folder, script)
            contacts = last_number(r"^ +\d+ +(\S+) +\S+ *$", log) / 2
            scale = 1e9 / steps / contacts
            runs[name].append([*(scale * time for time in run_times(log, 1)), contacts])
    shortest = {name: np.min(results, axis=0) for name, results in runs.items()}
    mindlin_pair, mindlin_step, _ = shortest[MINDLIN]
    rows = []
    for name, (pair, step, contacts) in shortest.items():
        rows.append([name, f"{contacts:.0f}", f"{pair:.0f}", f"{pair / mindlin_pair:.2f}",
                     f"{step:.0f}", f"{step / mindlin_step:.2f}", sizes.get(name, "")])  # fmt: skip
    print_table(["pair style, resolution", "contacts", "pair style, ns per contact and step",
                 "pair style / mindlin", "whole step, ns", "step / mindlin",
                 "bytes per contact"], rows)  # fmt: skip


def with_all_parts(law):
    """The law with plastic asperities, degradation of slopes by work, and a bond."""
    asperity = replace(law.asperity, yield_interference=2e-4)
    bond = jl.Bond(normal_stiffness=5e8, shear_stiffness=5e8, tension=1e4, cohesion=1e4)
    return replace(law, asperity=asperity, slope_wear=50.0, slope_residual=0.2, bond=bond)


def lammps_law(resolution):
    """Asperities of a tenth of a millimetre, as stiff in the packing as LAMMPS' own styles."""
    return jl.JointLaw(
        orientation=jl.Orientation(4.0),
        asperity=jl.Asperity(K=9.5e6, lam=1.2, eta=0.5, mu=0.4),
        heights=jl.GammaHeights(alpha=3.82, beta=1.15e-4, overlap=3e-4),
        asperity_density=1e6,
        resolution=resolution,
        mating_length=2e-4,
    )


def prepare_packing(folder):
    """Build the plug-in, export the law at "balanced", and pack the spheres."""
    build_plugin(folder)
    run_lammps(folder, PACK_SCRIPT)


def build_plugin(folder, flags=""):
    """Export the law at "balanced" to a folder, and build the plug-in there."""
    export_lammps(lammps_law("balanced"), folder, "rock")
    environment = {**os.environ, "ENV": str(ENVIRONMENT), "CXXFLAGS": flags}
    subprocess.run(["./build.sh"], cwd=folder, env=environment, check=True,
                   stdout=subprocess.DEVNULL)  # fmt: skip


def run_lammps(folder, script, processors=1):
    """Run a script in a folder; returns its log."""
    (folder / "in.bench").write_text(script)
    program = next(ENVIRONMENT.glob("lib/python3*/site-packages/lammps/lmp"))
    command = [program, "-in", "in.bench", "-log", "log.bench", "-screen", "none"]
    if processors > 1:
        command = [ENVIRONMENT / "bin/mpirun", "-np", str(processors), *command]
    environment = os.environ | {
        "OMP_NUM_THREADS": "1",
        "LD_LIBRARY_PATH": str(ENVIRONMENT / "lib"),
    }
    subprocess.run(command, cwd=folder, env=environment, check=True, stdin=subprocess.DEVNULL)
    return (folder / "log.bench").read_text()


def last_number(pattern, log):
    """The last number that a pattern matches in a log."""
    return float(re.findall(pattern, log, re.MULTILINE)[-1])


def run_times(log, processors):
    """Seconds of the pair style and of the whole last run.

    On one processor processor time, which excludes the time that other programs took.
    """
    usage = last_number(r"^(\S+)% CPU use", log) / 100 if processors == 1 else 1.0
    pair_time = last_number(r"^Pair +\| \S+ +\| (\S+)", log)
    run_time = last_number(r"^Loop time of (\S+)", log)
    return usage * pair_time, usage * run_time


class ScaleRun(NamedTuple):
    """Figures of one run of `lammps_scale`; sizes in MB."""

    spheres: float
    processes: int
    contacts: float
    pair_ns: float  # per contact and step
    step_ms: float
    memory: float  # of a process
    bytes_per_contact: float
    sent: float  # in a step, by a process
    restart_size: float | None = None
    restart_difference: str = ""  # on one and two processes, relative

    def row(self):
        """Cells of the table, with the significant digits that the figures have."""
        cells = []
        for value in self:
            if value is None or isinstance(value, str):
                cells.append(value or "")
            else:
                cells.append(f"{value:.0f}" if value >= 100 else f"{value:.2g}")
        return cells


def lammps_scale(folder: Path, small=False):
    """pair_style jointlaw with 1e5 and 1e6 spheres: time, memory, restart on 1 and 2 processes.

    --small: 22 000 spheres only, for a trial. The packing of `lammps`, settled with the law,
    repeated, in a periodic box that is sheared at a rate of 50 1/s. Times are LAMMPS' own count of
    the pair style; with two processes they are valid only on an idle machine. The last row is
    computed from the row before it, for 1e8 contacts on 1024 processes. A process sends position,
    velocity and spin of its ghost atoms in each step, and their force and torque back: 15 numbers
    each. Needs 12 GB of memory and 4 GB of disk; ten minutes.
    """
    prepare_packing(folder)
    run_lammps(folder, SETTLE_SCRIPT)
    runs = []
    for repeat in ["2 2 2"] if small else ["3 3 4", "7 7 8"]:
        runs += [measure_scale(folder, repeat, processes) for processes in (1, 2)]
    runs.append(extrapolate_to_cluster(runs[-1]))
    print_table(["spheres", "processes", "contacts", "pair style, ns per contact and step",
                 "whole step, ms", "MB a process", "bytes per contact", "sent a step, MB a process",
                 "restart file, MB", "after restart on 1 and 2"],
                [run.row() for run in runs])  # fmt: skip


def measure_scale(folder, repeat, processes):
    """Run the packing repeated so often; with two processes save and restart it, too."""
    saves = processes == 2
    script = SCALE_SCRIPT.format(repeat) + (SAVE_COMMANDS if saves else "")
    log = run_lammps(folder, script, processes)
    timed_part = "Loop time of" + log.split("Loop time of")[2]
    pair_time, run_time = run_times(timed_part, processes)
    contacts = last_thermo_row(log)[2]
    memory = last_number(r"resident set size: +(\S+)", log)
    ghosts = last_number(r"^Nghost: +(\S+)", timed_part)
    run = ScaleRun(
        spheres=last_number(r"^ +(\d+) atoms$", log),
        processes=processes,
        contacts=contacts,
        pair_ns=1e9 * processes * pair_time / SCALE_STEPS / contacts,
        step_ms=1e3 * run_time / SCALE_STEPS,
        memory=memory,
        bytes_per_contact=1e6 * processes * memory / contacts,
        sent=ghosts * NUMBERS_PER_GHOST * 8 / 1e6,
    )
    if not saves:
        return run
    saved = folder / "saved"
    restart_size = saved.stat().st_size / 1e6
    expected = last_thermo_row(log)[1:]
    differences = []
    for restart_processes in (1, 2):
        restarted = last_thermo_row(run_lammps(folder, RESTART_SCRIPT, restart_processes))[1:]
        pairs = zip(restarted, expected, strict=True)
        differences.append(f"{max(abs(a / b - 1) for a, b in pairs):.0e}")
    saved.unlink()
    return run._replace(restart_size=restart_size, restart_difference=", ".join(differences))


def last_thermo_row(log):
    """Numbers of the last line of thermo output."""
    tables = re.findall(r"^ +Step .*\n((?: +\d.*\n)+)", log, re.MULTILINE)
    return [float(word) for word in tables[-1].splitlines()[-1].split()]


def extrapolate_to_cluster(run):
    """A run with more contacts on more processes, if each is as fast as a process here."""
    load = CLUSTER_CONTACTS / CLUSTER_PROCESSES / (run.contacts / run.processes)  # of a process
    growth = CLUSTER_CONTACTS / run.contacts
    return run._replace(
        spheres=run.spheres * growth,
        processes=CLUSTER_PROCESSES,
        contacts=CLUSTER_CONTACTS,
        step_ms=run.step_ms * load,
        memory=run.memory * load,
        sent=run.sent * load ** (2 / 3),  # ghosts are on the surface of a process's part
        restart_size=run.restart_size * growth,
        restart_difference="computed",
    )


def yade(contacts=3000, runs=100, preset="jing-replica"):
    """Cost per contact and step in YADE: its own laws, a joint table, and the joint law itself.

    Processor time of one thread; shortest times of several steps. *time that the adapter adds* is
    the time of the joint's adapter with torque. Its part *to read and write YADE's objects* is the
    time of the same reads and additions of forces alone, which no adapter in Python avoids.
    """
    law = jl.presets.load(preset)
    names = {"cundall": "Cundall-Strack", "hertz": "Hertz-Mindlin", "table": "table mode"}
    for resolution in RESOLUTIONS:
        size = 8 * replace(law, resolution=resolution).state_size
        names[resolution] = f"live mode, {resolution} in space: {size} bytes of state"
    times = yade_times(law, list(names), contacts, runs)
    rows = []
    for kind, name in names.items():
        ratio = times[kind]["step"] / times["cundall"]["step"]
        cells = times[kind] | {"ratio": ratio}
        formats = {"ratio": ".1f"}
        rows.append([name, *(format(cells[column], formats.get(column, ".0f")) if column in cells
                             else "" for column in YADE_COLUMNS)])  # fmt: skip
    print_table(["", *YADE_COLUMNS.values()], rows)
    first = times["cundall"]
    print(f"{first['bodies']} spheres, {first['contacts']} contacts")


def yade_times(law, kinds, contacts, runs):
    """By kind of contact: the number of contacts, and nanoseconds per contact and step.

    Raises SystemExit where YADE is not installed or its scene fails.
    """
    program = shutil.which("yade")
    if program is None:
        raise SystemExit("YADE is not installed (Debian: apt-get install yade)")
    with tempfile.TemporaryDirectory() as folder:
        export_yade(law, folder)
        for resolution in set(kinds) & set(NAMED_RESOLUTIONS):
            replace(law, resolution=resolution).to_toml(Path(folder) / f"{resolution}.toml")
        overlap = 0.2 * law.closure_range
        scene = YADE_SCENE.format(contacts=contacts, runs=runs, kinds=kinds, overlap=overlap)
        (Path(folder) / "scene.py").write_text(scene)
        environment = os.environ | {
            "OMP_NUM_THREADS": "1",
            "JOINTLAW_THREADS": "1",
            "PYTHONPATH": str(Path(jl.__file__).parents[1]),
        }
        process = subprocess.run([program, "-n", "-x", "scene.py"], cwd=folder, env=environment,
                                 text=True, capture_output=True,
                                 stdin=subprocess.DEVNULL)  # fmt: skip
    for line in process.stdout.splitlines():
        if line.startswith("RESULT "):
            return json.loads(line.removeprefix("RESULT "))
    raise SystemExit(process.stdout + process.stderr)


if __name__ == "__main__":
    run_command(__doc__, lammps, lammps_scale, yade)
