"""Cost and accuracy of scenes of blocks.

python docs/measure/blocks.py step-cost [--seconds 2]
python docs/measure/blocks.py seam-cost [--rounds 20]
python docs/measure/blocks.py heap FOLDER [--columns 625] [--rows 16] [--end 2.5]
python docs/measure/blocks.py shaken-slab
python docs/measure/blocks.py ablation-table
python docs/measure/blocks.py ablation SCENE
"""

import csv
import json
import os
import resource
import tempfile
import time
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from timeit import Timer

os.environ |= {"JOINTLAW_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # read when numpy is loaded

import numpy as np
import pymunk
from common import ROOT, print_table, run_command
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import RegularGridInterpolator
from scipy.optimize import brentq

import dem_demo
import jointlaw as jl
from dem_demo.cli import main as dem_demo_main
from dem_demo.scene.read import SCENES

TIMED_PARTS = 5
SEAM_STEPS = 48  # of a turn: three times the interval of checks
SEAM_NORMAL, SEAM_SHEAR = 5e9, 2e9  # Pa/m, of Coulomb's law
ROCK_LAW = """[laws.rock]
asperity_density = 1e4
mating_length = 1.5e-2
resolution = {{ u = 3, phi = 4, depth = 1 }}
orientation = {{ a = {a} }}
asperity = {{ K = 9.5e6, lam = 1.2, eta = 0.5, mu = {mu} }}
heights = {{ alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }}
"""
CUT_SLOPE = """title = "slope of {spacing} m"
{law}[[rock]]
name = "slope"
outline = [[-26.0, -2.0], [12.0, -2.0], [12.0, 0.0], [0.0, 0.0], [-9.0, 20.0], [-26.0, 20.0]]
seed = 3
set = [
  {{ dip = 30.0, spacing = {spacing}, law = "rock", scatter = 0.2, through = [-0.2, 0.6] }},
  {{ dip = -65.0, spacing = {across}, law = "rock", scatter = 0.3 }},
]
fixed = [{{ corners = [[-40, -5], [13, -5], [13, 0.2], [0.3, 0.31], [-34, 20.12], [-40, 20]] }}]
[run]
end = 1.0
settle = false
step = 1e-4
"""

HEAP_SPACING = 0.6  # m between the centres of blocks at the start
HEAP_SCENE = """title = "Heap of {n} blocks"
{law}[run]
end = {end}
settle = false
law_steps = 2
record = 0.1
corner_length = 0.05
"""

# of the scene `shake`
BASE_BLOCK = 0
SLAB_BLOCK = 1
SLAB_DIP = np.radians(20.0)
SHAKING_FREQUENCY = 4.0  # Hz
SLAB_AREAL_DENSITY = 2600 * 0.6  # kg/m2
GRAVITY = 9.81  # m/s2
SHAKEN_RESOLUTIONS = "balanced", "fine", "reference"
ACCELERATION_RATIOS = 0.5, 0.9, 1.2, 1.5, 2.0  # over the acceleration at which sliding starts
FULL_CYCLES = 10
AVERAGED_CYCLES = 5  # the last ones
SLAB_STRESSES = SLAB_AREAL_DENSITY * GRAVITY * np.cos(SLAB_DIP) * np.linspace(0.6, 1.4, 5)  # Pa

ABLATION_FOLDER = ROOT / "docs" / "data"
MACHINE_COLUMNS = "time_step_s", "cpu_s"  # of an ablation; docs/data leaves them out
ABLATION_END = {"stack": 0.5, "slope": 0.5, "slope-azimuth": 0.6, "arch": 0.4}  # s


def step_cost(seconds=2.0):
    """CPU time of a step of several scenes, and of the same blocks with pymunk's contact solver.

    One thread, the shortest of five parts of the run, from the start of each scene. The last two
    scenes are a slope 20 m high, cut into blocks of two sizes; they start as drawn, without
    equilibrium.
    """
    scenes = {name: dem_demo.load(name) for name in ("tilt", "stack", "slope", "slope-full")}
    for spacing, across in ((0.75, 0.85), (0.33, 0.39)):
        law = ROCK_LAW.format(a=2.5, mu=0.4)
        text = CUT_SLOPE.format(law=law, spacing=spacing, across=across)
        scenes[f"{spacing} m"] = dem_demo.parse(text)
    rows = []
    for name, scene in scenes.items():
        sim = dem_demo.Simulation(scene)
        space = pymunk_space(scene)
        for _ in range(20):
            sim.step()
            space.step(sim.dt)
        step_time = shortest_step_time(sim.step, seconds)
        pymunk_time = shortest_step_time(lambda s=space, dt=sim.dt: s.step(dt), seconds)
        moving_blocks = sum(not block.fixed for block in scene.blocks)
        contacts = sim.joints.n
        contact_time = step_time / max(contacts, 1)
        rows.append([name, moving_blocks, contacts, f"{1e3 * step_time:.3g}", scene.run.law_steps,
                     f"{1e6 * contact_time:.2g}", f"{1e3 * pymunk_time:.2g}"])  # fmt: skip
    print_table(["scene", "blocks that move", "contacts", "ms a step", "steps of the law",
                 "µs a contact and step", "pymunk's own solver, ms"], rows)  # fmt: skip


class WithoutSeams(dem_demo.Simulation):
    """A simulation in which joints end at the seams between coplanar blocks."""

    def _continue_across_seams(self, is_new):
        return np.zeros(0, int)


def seam_cost(rounds=12):
    """CPU time of a step with joints that continue across seams, and with joints that end there.

    One thread. Both runs of a scene take SEAM_STEPS steps in turn; the table has the median of the
    ratios of their times. The slope of step_cost with blocks 0.75 m wide slides as drawn: its
    contacts change in nearly every step. The scene slope-full rests in its larger part.
    """
    text = CUT_SLOPE.format(law=ROCK_LAW.format(a=2.5, mu=0.4), spacing=0.75, across=0.85)
    rough = dem_demo.parse(text)
    coulomb = jl.CoulombLaw(SEAM_NORMAL, SEAM_SHEAR, friction=0.8, plane=0.0)
    scenes = {
        "slope-full": dem_demo.load("slope-full"),
        "0.75 m": rough,
        "0.75 m, Coulomb": replace(rough, laws=dict.fromkeys(rough.laws, coulomb)),
    }
    rows = []
    for name, scene in scenes.items():
        sims = [kind(scene) for kind in (dem_demo.Simulation, WithoutSeams)]
        times = []
        for _ in range(rounds):
            times.append([])
            for sim in sims:
                start = time.process_time()
                for _ in range(SEAM_STEPS):
                    sim.step()
                times[-1].append(time.process_time() - start)
        with_seams, without = np.transpose(times)
        change = np.median(with_seams / without) - 1
        rows.append([name, sims[0].joints.n, f"{change:+.0%}"])
    print_table(["scene", "contacts", "time of a step by seams"], rows)


def shortest_step_time(step, seconds):
    """CPU time (s) of a step: the shortest mean of TIMED_PARTS parts of so many seconds."""
    timer = Timer(step, timer=time.process_time)
    steps = max(1, round(seconds / TIMED_PARTS / timer.timeit(1)))
    return min(timer.repeat(TIMED_PARTS, steps)) / steps


def pymunk_space(scene):
    """The blocks of a scene in pymunk, friction 0.8, at its default of 10 iterations."""
    space = pymunk.Space()
    space.gravity = tuple(scene.gravity)
    for block in scene.blocks:
        if block.moves:
            body = pymunk.Body(block.section.mass, block.section.moment)
        else:
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
        body.position = tuple(block.centroid)
        shape = pymunk.Poly(body, block.local.tolist())
        shape.friction = 0.8
        space.add(body, shape)
    return space


def heap(folder: Path, columns=625, rows=16, end=2.5):
    """A heap of irregular blocks that fall and come to rest: time, energy balance, memory.

    Writes the scene and the files of its run into FOLDER.
    """
    file = folder / "heap.toml"
    file.write_text(heap_scene(columns, rows, end))
    wall_start = time.perf_counter()
    cpu_start = time.process_time()
    sim = dem_demo.Simulation(dem_demo.load(file))
    record, summary = dem_demo.run(sim, folder / "run")
    cpu_seconds = time.process_time() - cpu_start
    wall_seconds = time.perf_counter() - wall_start
    speed = np.hypot(*record.motion[-1][3:5])
    print(json.dumps({
        "blocks": columns * rows, "contacts": sim.joints.n,
        "touching": int((sim.contacts.length > 0).sum()), "steps": summary["steps"],
        "time_step_s": summary["time_step_s"], "wall_s": round(wall_seconds),
        "cpu_s": round(cpu_seconds),
        "us_per_contact_and_step": round(1e6 * cpu_seconds / summary["steps"] / sim.joints.n, 3),
        "energy_error": summary["max_energy_error"],
        "median_speed_m/s": float(np.median(speed)), "fastest_m/s": float(speed.max()),
        "peak_memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }, indent=1))  # fmt: skip


def heap_scene(columns, rows, end):
    """A scene: blocks of three to six corners in a grid with gaps, above a floor, between walls."""
    rng = np.random.default_rng(1)
    law = ROCK_LAW.format(a=3.0, mu=0.6)
    text = [HEAP_SCENE.format(n=columns * rows, law=law, end=end)]
    width = columns * HEAP_SPACING
    height = rows * HEAP_SPACING
    for name, size, centre in (
        ("floor", [width + 4.0, 1.0], [0.5 * width, -0.5]),
        ("left", [1.0, height + 2.0], [-0.5, 0.5 * height + 1.0]),
        ("right", [1.0, height + 2.0], [width + 0.5, 0.5 * height + 1.0]),
    ):
        text.append(f'[[block]]\nname = "{name}"\nbox = {size}\nat = {centre}\nfixed = true')
    for i in range(columns * rows):
        corners = int(rng.integers(3, 7))
        angles = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.6, corners)) / corners
        directions = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        centre = HEAP_SPACING * (np.array([i % columns, i // columns]) + 0.5)
        radii = 0.48 * HEAP_SPACING * rng.uniform(0.75, 1.0)
        outline = (centre + radii * directions).round(4).tolist()
        text.append(f'[[block]]\nname = "{i}"\ncorners = {outline}')
    return "\n".join(text)


def shaken_slab():
    """The scene `shake` compared with Newmark's sliding block: slip in mm per cycle.

    The base of the scene is shaken by sines of several sizes: the largest acceleration over the
    acceleration at which Newmark's block starts to slide. The block (Newmark 1965) is rigid and has
    the friction of the law at the present normal stress after the present slip; before the peak,
    the peak friction. Slips are means over the last five of ten full cycles.
    """
    friction = slip_friction(shaken_scene(1.0, "reference").laws["joint"])
    sliding_acceleration = brentq(
        lambda a: newmark_acceleration(-a, 0.0, friction).item(), 0.0, 0.4 * GRAVITY
    )
    rows = []
    for ratio in ACCELERATION_RATIOS:
        scenes = [shaken_scene(ratio * sliding_acceleration, name) for name in SHAKEN_RESOLUTIONS]
        slips = [*map(slab_slip, scenes), newmark_slip(scenes[0], friction)]
        rows.append([f"{ratio:g}", *(slip_per_cycle(*slip) for slip in slips)])
    print_table(["size", *SHAKEN_RESOLUTIONS, "Newmark"], rows)


def shaken_scene(acceleration, resolution):
    """The scene `shake` with a sine of this amplitude (m/s2) and a resolution of its law."""
    text = (SCENES / "shake.toml").read_text(encoding="utf-8")
    changed = text.replace("acceleration = 5.0", f"acceleration = {float(acceleration)}")
    if changed == text:
        raise ValueError("shake.toml no longer contains acceleration = 5.0")
    scene = dem_demo.parse(changed)
    law = replace(scene.laws["joint"], resolution=resolution)
    return replace(scene, laws={"joint": law})


def slip_friction(law):
    """Friction coefficient of a law: an interpolator over normal stress (Pa) and slip (m)."""
    slips = np.linspace(0.0, 10.0, 401) * law.mating_length
    curves = []
    for stress in SLAB_STRESSES:
        record = jl.direct_shear(law.joint(), to=[slips[-1]], normal=stress, steps=400)
        ratio = record.F2[-401:] / record.F1[-401:]
        curves.append(np.maximum.accumulate(ratio[::-1])[::-1])
    return RegularGridInterpolator((SLAB_STRESSES, slips), np.array(curves))


def newmark_acceleration(base_acceleration, slip, friction):
    """Acceleration (m/s2) of Newmark's block down the joint while it slides."""
    normal_acceleration = GRAVITY * np.cos(SLAB_DIP) + base_acceleration * np.sin(SLAB_DIP)
    largest_slip = friction.grid[1][-1]
    points = np.broadcast_arrays(
        SLAB_AREAL_DENSITY * normal_acceleration, np.minimum(slip, largest_slip)
    )
    coefficient = friction(np.stack(points, -1))
    driving_acceleration = GRAVITY * np.sin(SLAB_DIP) - base_acceleration * np.cos(SLAB_DIP)
    return driving_acceleration - coefficient * normal_acceleration


def newmark_slip(scene, friction):
    """Times (s) and slip (m) of Newmark's block, which never slides up the joint."""
    drive = next(drive for drive in scene.drives if drive.order)
    times = np.arange(0.0, drive.times[-1], 1e-5)
    base_acceleration = drive.path(times, nu=2)
    slip = np.zeros_like(times)
    change = np.inf
    while change > 1e-9:  # friction decreases with slip: iterate until the slip is consistent
        acceleration = newmark_acceleration(base_acceleration, slip, friction)
        gained = cumulative_trapezoid(acceleration, times, initial=0.0)
        velocity = gained - np.minimum.accumulate(gained)  # gained since the block last stuck
        previous_slip = slip
        slip = cumulative_trapezoid(velocity, times, initial=0.0)
        change = np.max(np.abs(slip - previous_slip))
    return times, slip


def slab_slip(scene):
    """Times (s) and slip (m) of the slab, at every step while the base is shaken."""
    sim = dem_demo.Simulation(scene)
    rows = []
    while sim.time < (FULL_CYCLES + 1) / SHAKING_FREQUENCY:
        sim.step()
        rows.append([sim.time, sim.shear_displacement(SLAB_BLOCK, BASE_BLOCK)])
    return np.transpose(rows)


def slip_per_cycle(times, slip):
    """Mean slip (mm) in the last of the full cycles."""
    ends = np.array([FULL_CYCLES + 1 - AVERAGED_CYCLES, FULL_CYCLES + 1]) / SHAKING_FREQUENCY
    return f"{1e3 * np.diff(np.interp(ends, times, slip))[0] / AVERAGED_CYCLES:.3g}"


def ablation_table():
    """Changes of the results when an ingredient is left out, over all scenes in docs/data.

    A change of an angle is in degrees, a change of the work of friction relative to the whole
    scene; "other results" counts rocks that end in another state and slabs that never slip; times
    are relative to the whole scene.
    """
    changes = defaultdict(lambda: defaultdict(list))
    for path in sorted(ABLATION_FOLDER.glob("ablation-*.csv")):
        whole, *variants = read_csv(path)
        for row in variants[:-1]:  # the last is the whole scene, repeated
            add_changes(changes[row["variant"]], row, whole)
    rows = [[name, *change_cells(values)] for name, values in changes.items()]
    print_table(["change", "scenes", "slip or peak angle (deg)", "work of friction",
                 "distance of the ends (mm)", "other results", "time"], rows)  # fmt: skip


def ablation(scene: str):
    """Run SCENE without each of its ingredients in turn; writes docs/data/ablation-SCENE.csv.

    Numbers are rounded to four digits.
    """
    with tempfile.TemporaryDirectory() as folder:
        until = ("--until", str(ABLATION_END[scene])) if scene in ABLATION_END else ()
        dem_demo_main(["ablate", scene, *until, "--out", folder])
        rows = read_csv(Path(folder) / "ablation.csv")
    rounded = [
        {key: four_digits(cell) for key, cell in row.items() if key not in MACHINE_COLUMNS}
        for row in rows
    ]
    path = ABLATION_FOLDER / f"ablation-{scene}.csv"
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, rounded[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rounded)


def read_csv(path):
    """Rows of a CSV file as dictionaries."""
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def four_digits(cell):
    """A cell rounded to four digits, if it is a number with a point."""
    try:
        return f"{float(cell):.4g}" if "." in cell else cell
    except ValueError:
        return cell


def add_changes(changes, row, whole):
    """Add the changes of one scene without an ingredient to the lists by kind of result."""
    is_refused = row["time_ratio"] == "nan"
    changes["refused"].append(is_refused)
    if is_refused:
        return
    changes["time"].append(float(row["time_ratio"]))
    for key, value in row.items():
        change = row.get(f"change of {key}")
        if key.endswith("_deg") and change:
            changes["angle"].append(abs(float(change)))
        elif key.endswith(", state") or (key.endswith("_deg") and change is not None):
            changes["other results"].append(value != whole[key])
        elif key == "friction_kJ":
            changes["friction"].append(abs(float(change) / float(whole[key])))
        elif key == "distance of the ends_mm":
            changes["distance"].append(float(value))


def change_cells(changes):
    """Cells of an ingredient: the largest changes over all scenes, or their range."""
    refused = sum(changes["refused"])
    scenes = str(len(changes["refused"]))
    return [f"{scenes}, refused in {refused}" if refused else scenes,
            f"{max(changes['angle']):.2f}" if changes["angle"] else "-",
            f"{max(changes['friction']):.0%}" if changes["friction"] else "-",
            range_text(changes["distance"], "{:.2g}"),
            sum(changes["other results"]) if changes["other results"] else "-",
            range_text(changes["time"], "{:.2f}")]  # fmt: skip


def range_text(values, form):
    """Smallest and largest value, or the one value."""
    ends = (min(values), max(values)) if values else ()
    words = [form.format(value) if value < 100 else f"{value:.0f}" for value in ends]
    return " to ".join(dict.fromkeys(words)) or "-"


if __name__ == "__main__":
    run_command(__doc__, step_cost, seam_cost, heap, shaken_slab, ablation_table, ablation)
