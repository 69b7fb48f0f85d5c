"""Blocks in space: factor of safety by rough direction, and costs of cutting, statics and motion.

python docs/measure/space.py rough-direction
python docs/measure/space.py cost
python docs/measure/space.py step-cost
"""

import os
import time
import tracemalloc

os.environ |= {"JOINTLAW_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # read when numpy is loaded

import numpy as np
from common import print_table, run_command

from dem_demo.scene import read_tables
from dem_demo.scene.read import read_source
from dem_demo.space import SpaceSimulation, Statics, load, parse
from dem_demo.space.contacts import Surfaces, find_contacts
from dem_demo.space.cutting import PlaneSet, cut_rock
from dem_demo.space.read import build
from dem_demo.space.solids import box
from dem_demo.space.strength import factor_of_safety

ANGLES = range(0, 91, 15)  # degrees from the line of intersection
SETS = [
    PlaneSet(35.0, 160.0, 1.0, "joint", scatter=0.3),
    PlaneSet(70.0, 60.0, 1.1, "joint", scatter=0.3),
    PlaneSet(75.0, 300.0, 1.1, "joint", scatter=0.3),
]


def wedge_factor(anisotropy: float, angle: float) -> float | None:
    """Factor of safety of the scene wedge with another c, its rough direction turned (degrees)."""
    text, where, files = read_source("wedge")
    data = read_tables(text, where)
    data["laws"]["joint"]["orientation"]["c"] = anisotropy
    for number, sign in ((0, 1.0), (1, -1.0)):  # symmetric about the line
        data["rock"][0]["set"][number]["rough"] += sign * angle
    return factor_of_safety(Statics(build(data, where, files)), tolerance=0.002)


def rough_direction() -> None:
    """Print the factor of safety of a wedge by its rough direction."""
    rows = [
        [f"{angle}°", *(f"{wedge_factor(c, float(angle)):.3f}" for c in (0.0, 0.3))]
        for angle in ANGLES
    ]
    print_table(["rough direction from the line", "c = 0", "c = 0.3"], rows)


def cost() -> None:
    """Print CPU times on one thread, and the memory of a contact point."""
    rows = []

    def timed(what, work):
        start = time.process_time()
        result = work()
        rows.append([what, f"{time.process_time() - start:.2g} s"])
        return result

    rock = box([10.0, 10.0, 10.0])
    solids = timed("cutting a rock into blocks", lambda: cut_rock(rock, SETS, 1, 0.2).solids)
    rows[0][0] = f"cutting a rock into {len(solids)} blocks"
    surfaces = timed("setting up their surfaces", lambda: Surfaces(solids, np.ones(len(solids))))
    reach = np.full(len(solids), 2e-3)
    points = timed("finding their contacts", lambda: find_contacts(surfaces, reach, 0.1))
    rows.append(["contact points of them", str(len(points.area))])
    scene = timed("reading and cutting `slope-3d`", lambda: load("slope-3d"))
    tracemalloc.start()
    statics = Statics(scene)
    memory = tracemalloc.get_traced_memory()[0] / len(statics.points.area)
    tracemalloc.stop()
    rows.append(["memory of its geometry, a contact point", f"{memory / 1e3:.2g} kB"])
    free = int(statics.is_free.sum())
    timed(f"equilibrium of its {free} free blocks", statics.solve)
    timed("its factor of safety", lambda: factor_of_safety(statics))
    print_table(["", "CPU time, one thread"], rows)


COULOMB = """\
kind = "coulomb"
normal_stiffness = 2e9
shear_stiffness = 1e9
friction = 0.6
"""
ROUGH = """\
asperity_density = 1e4
closure_range = 2e-4
mating_length = 2e-3
orientation = { a = 3.0, b = -1.0, c = 0.3 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
"""
LAWS = {
    "Coulomb": COULOMB,
    "`fast`": ROUGH + 'resolution = "fast"\n',
    "`balanced`": ROUGH + 'resolution = "balanced"\n',
}
WALLS = [(5, 6), (17, 18), (32, 32), (100, 101)]  # bricks of the longest row, and rows
LARGEST = 1100  # bricks of a wall that starts at rest, and of one of rough joints
WARM_UP = 20  # steps
BURSTS = 5  # of which the fastest counts


def wall(wide: int, high: int, law: str) -> SpaceSimulation:
    """A dry wall of bricks in half-brick bond, at rest up to `LARGEST` bricks; larger ones have not
    settled yet under their weight."""
    base = f"box = [{0.6 * wide + 2}, 2.0, 0.5]\nat = [{0.3 * wide}, 0.0, -0.25]\nfixed = true\n"
    parts = [f'rough = 0.0\n[laws.joint]\n{law}[[block]]\nname = "ground"\n{base}']
    for row in range(high):
        for i in range(wide - row % 2):
            at = [0.6 * i + 0.3 + 0.3 * (row % 2), 0.0, 0.3 * row + 0.15]
            parts.append(f'[[block]]\nname = "{row} {i}"\nbox = [0.6, 0.3, 0.3]\nat = {at}\n')
    settle = str(wide * high - high // 2 <= LARGEST).lower()
    return SpaceSimulation(parse("".join(parts) + f"[run]\nend = 1.0\nsettle = {settle}\n"))


def step_cost() -> None:
    """Print the CPU time of a step of walls, and of one of its contact points."""
    rows = []
    for wide, high in WALLS:
        bricks = wide * high - high // 2
        of_step, of_point = [], []
        for law in LAWS.values():
            if bricks > LARGEST and law is not COULOMB:
                of_step.append("")
                of_point.append("")
                continue
            sim = wall(wide, high, law)
            steps = max(4, 4000 // bricks)
            for _ in range(WARM_UP):
                sim.step()
            spent = np.inf
            for _ in range(BURSTS):
                start = time.process_time()
                for _ in range(steps):
                    sim.step()
                spent = min(spent, (time.process_time() - start) / steps)
            of_step.append(f"{1e3 * spent:.2g}")
            of_point.append(f"{1e6 * spent / sim.joints.n:.2g}")
        rows.append([bricks, sim.joints.n, *of_step, *of_point])
    head = [*(f"{name}, ms a step" for name in LAWS), *(f"{name}, µs a point" for name in LAWS)]
    print_table(["bricks", "contact points", *head], rows)


if __name__ == "__main__":
    run_command(__doc__, rough_direction, cost, step_cost)
