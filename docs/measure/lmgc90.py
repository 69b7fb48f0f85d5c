"""Blocks in space beside LMGC90 (contact dynamics): a block on an incline, and the cost of walls.

python docs/measure/lmgc90.py incline
python docs/measure/lmgc90.py walls

It needs `pip install compas_lmgc90` (Python 3.11). LMGC90 has rigid contacts with Coulomb friction
and an implicit step of 1 ms; the joints here have a stiffness, and their explicit step is bounded
by it. Both codes take the same blocks to the same model time, in turn, and each time is the
smallest of all turns. LMGC90 keeps one simulation in a process, so it has a process of its own.
"""

import multiprocessing
import os
import sys
import time
from pathlib import Path

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")
sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
import space
from common import print_table, run_command

from dem_demo.space import SpaceSimulation, parse

GRAVITY = 9.81
FRICTION = 0.6
DENSITY = 2600.0  # kg/m3
LMGC90_STEP = 1e-3  # s, as in its own examples of masonry
ANGLES = (30.96, 30.97, 31.5, 32.0, 35.0)  # degrees; atan(0.6) is 30.964
SLIDING_TIME = 0.5  # s
WALLS = [(5, 6), (17, 18), (32, 32)]  # bricks of the longest row, and rows
WALL_TIME = 0.02  # s


def run_lmgc90(solids, end: float) -> tuple[np.ndarray, float]:
    """Displacements (n, 3) in m of blocks between their first step and `end` (s), and the processor
    time (s) of a step. Block 0 is fixed."""
    from compas.datastructures import Mesh
    from compas_lmgc90.solver import Solver

    meshes = [Mesh.from_vertices_and_faces(vertices, faces) for vertices, faces in solids]
    solver = Solver(dt=LMGC90_STEP, density=DENSITY)
    solver.geometry_from_mesh(meshes)
    steps = round(end / LMGC90_STEP)
    solver.v_drvdof[0] = {axis: np.zeros(steps + 1) for axis in range(1, 7)}
    solver.supports = [True] + [False] * (len(meshes) - 1)
    solver.contact_law("IQS_CLB", FRICTION)
    solver.preprocess()
    solver.run(1)
    start = np.array([mesh.centroid() for mesh in solver.trimeshes])
    spent = time.process_time()
    for _ in range(steps - 2):
        solver.lmgc90.compute_one_step()
    spent = (time.process_time() - spent) / (steps - 2)
    solver.run(1)  # which moves the meshes
    end_places = np.array([mesh.centroid() for mesh in solver.trimeshes])
    solver.finalize()
    return end_places - start, spent


def in_own_process(solids, end: float) -> tuple[np.ndarray, float]:
    """`run_lmgc90` in a new process."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.apply(run_lmgc90, (solids, end))


def solids_of(sim: SpaceSimulation):
    """Vertices and faces of the blocks of a scene as drawn."""
    return [(s.vertices.tolist(), [[*f] for f in s.faces]) for s in sim.blocks.surfaces.solids]


def inclined_block(degrees: float) -> tuple[SpaceSimulation, np.ndarray]:
    """A block on an inclined base, gravity along -z, and the direction down the incline."""
    tilt = np.radians(degrees)
    turn = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    text = f"[laws.joint]\n{space.COULOMB}"
    for name, size, at in (("base", [6, 4, 0.5], [1, 0, -0.25]), ("block", [1, 1, 1], [0, 0, 0.5])):
        signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = ((0.5 * signs * size + at) @ turn.T).tolist()
        fixed = str(name == "base").lower()
        text += f'[[block]]\nname = "{name}"\ncorners = {corners}\nfixed = {fixed}\n'
    sim = SpaceSimulation(parse(f"{text}[run]\nend = {SLIDING_TIME}\n"))
    return sim, turn[:, 0]


def incline() -> None:
    """Print the path of a block on an incline beside the closed form and LMGC90."""
    rows = []
    for angle in ANGLES:
        sim, down = inclined_block(angle)
        solids = solids_of(sim)
        start = sim.blocks.motion[:3, 1].copy()
        while sim.time < SLIDING_TIME - 0.5 * sim.dt:
            sim.step()
        path = down @ (sim.blocks.motion[:3, 1] - start)
        displacement, _ = in_own_process(solids, SLIDING_TIME)
        tilt = np.radians(angle)
        half_acceleration = 0.5 * GRAVITY * max(np.sin(tilt) - FRICTION * np.cos(tilt), 0.0)
        expected = 1e3 * half_acceleration * sim.time**2
        after_first_step = 1e3 * half_acceleration * (SLIDING_TIME**2 - LMGC90_STEP**2)
        of_lmgc90 = 1e3 * down @ displacement[1]
        cells = [f"{1e3 * path:.4f}", f"{of_lmgc90:.4f}"]
        if expected:
            cells[0] += f" ({100 * (1e3 * path / expected - 1):+.2f} %)"
            cells[1] += f" ({100 * (of_lmgc90 / after_first_step - 1):+.2f} %)"
        rows.append([f"{angle}°", f"{expected:.4f}", *cells])
    print_table(["incline", "closed form, mm", "here, mm", "LMGC90, mm"], rows)


def two_digits(value: float) -> str:
    """A number with two significant digits, without an exponent."""
    return f"{float(f'{value:.2g}'):g}"


def walls(turns: int = 2) -> None:
    """Print the processor time of a model second of dry walls at rest beside LMGC90."""
    rows = []
    space.LARGEST = max(wide * high for wide, high in WALLS)  # all walls start at rest
    for wide, high in WALLS:
        sims = [space.wall(wide, high, space.LAWS[name]) for name in ("Coulomb", "`fast`")]
        solids = solids_of(sims[0])
        starts = [sim.blocks.motion[:3].copy() for sim in sims]
        spent = np.full(3, np.inf)
        for _ in range(turns):
            for i, sim in enumerate(sims):
                end = sim.time + WALL_TIME
                began, steps = time.process_time(), 0
                while sim.time < end:
                    sim.step()
                    steps += 1
                spent[i] = min(spent[i], (time.process_time() - began) / steps)
            displacement, of_step = in_own_process(solids, WALL_TIME)
            spent[2] = min(spent[2], of_step)
        displacements = [
            np.abs(sim.blocks.motion[:3] - start).max()
            for sim, start in zip(sims, starts, strict=True)
        ]
        displacements.append(np.abs(displacement).max())
        step = [*(sim.dt for sim in sims), LMGC90_STEP]
        names = ["Coulomb", "`fast`", "LMGC90"]
        for name, dt, of_step, distance in zip(names, step, spent, displacements, strict=True):
            rows.append(
                [
                    wide * high - high // 2,
                    name,
                    f"{1e6 * dt:.0f}",
                    two_digits(1e3 * of_step),
                    two_digits(of_step / dt),
                    f"{distance:.0e}",
                ]
            )
    head = ["bricks", "law", "step, µs", "ms a step", "CPU s a model second", "moved in 20 ms, m"]
    print_table(head, rows)


if __name__ == "__main__":
    run_command(__doc__, incline, walls)
