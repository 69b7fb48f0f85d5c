"""What a step of a scene of blocks costs, and of the same blocks with pymunk's own contact solver.

python docs/measure/blocks.py [--seconds 2]

CPU time on one thread, the least of five parts of the run, from the start of each scene. The two
last scenes are a slope 20 m high, cut ever finer; they start as drawn, without equilibrium.
"""

import os
import time
from timeit import Timer

os.environ |= {"JOINTLAW_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}  # read when numpy is loaded

import pymunk
from heap import ROCK
from tables import asked, table

from dem_demo import Simulation, load, parse

PARTS = 5
HEAD = ["scene", "blocks that move", "contacts", "ms a step", "steps of the law",
        "µs a contact and step", "pymunk's own solver, ms"]  # fmt: skip
SLOPE = """title = "slope of {spacing} m"
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
seat = false
step = 1e-4
"""


def least(step, seconds: float) -> float:
    """Least CPU time (s) of a step, over parts of a run."""
    timer = Timer(step, timer=time.process_time)
    steps = max(1, round(seconds / PARTS / timer.timeit(1)))
    return min(timer.repeat(PARTS, steps)) / steps


def with_own_solver(scene) -> pymunk.Space:
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


def main(seconds: float) -> None:
    scenes, rows = {name: load(name) for name in ("tilt", "stack", "slope", "slope-full")}, []
    for spacing, across in ((0.75, 0.85), (0.33, 0.39)):
        scenes[f"{spacing} m"] = parse(
            SLOPE.format(law=ROCK.format(a=2.5, mu=0.4), spacing=spacing, across=across)
        )
    for name, scene in scenes.items():
        sim, space = Simulation(scene), with_own_solver(scene)
        for _ in range(20):
            sim.step()
            space.step(sim.dt)
        cost, own = least(sim.step, seconds), least(lambda s=space, d=sim.dt: s.step(d), seconds)
        moves, n = sum(not block.fixed for block in scene.blocks), sim.joints.n
        each, parts = 1e6 * cost / max(n, 1), scene.run.law_steps
        rows.append([name, moves, n, f"{1e3 * cost:.3g}", parts, f"{each:.2g}", f"{1e3 * own:.2g}"])
    print(table(HEAD, rows))


if __name__ == "__main__":
    main(asked(__doc__, seconds=2.0).seconds)
