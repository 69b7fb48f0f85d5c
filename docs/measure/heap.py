"""A heap of irregular blocks that fall and come to rest: time, energy balance, memory.

    python docs/measure/heap.py FOLDER [--columns 625] [--rows 16] [--end 2.5]

writes the scene and its run into FOLDER and prints a line of what it took.
"""

import json
import resource
import time

import numpy as np
from tables import asked, folder

from dem_demo import Simulation, load, run

SIZE = 0.6  # m: distance of the centres at the start
ROCK = """[laws.rock]
asperity_density = 1e4
mating_length = 1.5e-2
resolution = {{ u = 3, phi = 4, depth = 1 }}
orientation = {{ a = {a} }}
asperity = {{ K = 9.5e6, lam = 1.2, eta = 0.5, mu = {mu} }}
heights = {{ alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }}
"""
SCENE = """title = "Heap of {n} blocks"
{law}[run]
end = {end}
seat = false
law_steps = 2
record = 0.1
corner_length = 0.05
"""


def scene(columns: int, rows: int, end: float) -> str:
    """Blocks of three to six corners in a loose grid, above a floor between two walls."""
    rng, law = np.random.default_rng(1), ROCK.format(a=3.0, mu=0.6)
    text = [SCENE.format(n=columns * rows, law=law, end=end)]
    wide, high = columns * SIZE, rows * SIZE
    for name, size, at in (
        ("floor", [wide + 4.0, 1.0], [0.5 * wide, -0.5]),
        ("left", [1.0, high + 2.0], [-0.5, 0.5 * high + 1.0]),
        ("right", [1.0, high + 2.0], [wide + 0.5, 0.5 * high + 1.0]),
    ):
        text.append(f'[[block]]\nname = "{name}"\nbox = {size}\nat = {at}\nfixed = true')
    for i in range(columns * rows):
        corners = int(rng.integers(3, 7))
        angles = 2 * np.pi * (np.arange(corners) + rng.uniform(0, 0.6, corners)) / corners
        way = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        at = SIZE * (np.array([i % columns, i // columns]) + 0.5)
        outline = (at + 0.48 * SIZE * rng.uniform(0.75, 1.0) * way).round(4).tolist()
        text.append(f'[[block]]\nname = "{i}"\ncorners = {outline}')
    return "\n".join(text)


def main() -> None:
    given = asked(__doc__, folder=folder, columns=625, rows=16, end=2.5)
    file = given.folder / "heap.toml"
    file.write_text(scene(given.columns, given.rows, given.end))
    started, cpu = time.perf_counter(), time.process_time()
    sim = Simulation(load(file))
    record, summary = run(sim, given.folder / "run")
    took, used = time.perf_counter() - started, time.process_time() - cpu
    speed = np.hypot(*record.motion[-1][3:5])
    print(json.dumps({
        "blocks": given.columns * given.rows, "contacts": sim.joints.n,
        "touching": int((sim.contacts.length > 0).sum()), "steps": summary["steps"],
        "time_step_s": summary["time_step_s"], "wall_s": round(took), "cpu_s": round(used),
        "us_per_contact_and_step": round(1e6 * used / summary["steps"] / sim.joints.n, 3),
        "energy_error": summary["largest_energy_error"],
        "median_speed_m/s": float(np.median(speed)), "fastest_m/s": float(speed.max()),
        "peak_memory_MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }, indent=1))  # fmt: skip


if __name__ == "__main__":
    main()
