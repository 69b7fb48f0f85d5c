"""Time per step and law point of the block DEM: walls of 10, 100 and 400 blocks.

    python benchmarks/blocks.py [--law joint|coulomb] [--steps 300] [--json FILE]

A wall in running bond rests on a floor, seated at its gravity closure and nudged so that joints
work. The law's share is the time inside the batches of joints. CPU time, so that other work on the
machine counts little.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from dem_demo import Simulation, parse

LAWS = {
    "coulomb": """
kind = "coulomb"
normal_stiffness = 1e9
shear_stiffness = 8e8
friction = 0.6
""",
    "joint": """
asperity_density = 1e4
critical_slip = 2e-3
orientation = { a = 3.0, b = 0.0, c = 0.0 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }
""",
}


def wall(rows: int, columns: int, law: str) -> str:
    """Scene text: bricks of 1.0 by 0.5 m, every second course shifted by half a brick."""
    text = [f"[laws.all]{LAWS[law]}"]
    text.append(
        f'[[block]]\nname = "floor"\nbox = [{columns + 2.0}, 0.5]\n'
        f"at = [{columns / 2}, -0.25]\nfixed = true\n"
    )
    for j in range(rows):
        for i in range(columns):
            x, y = i + 0.5 + 0.5 * (j % 2), 0.25 + 0.5 * j
            text.append(f'[[block]]\nname = "{j}-{i}"\nbox = [1.0, 0.5]\nat = [{x}, {y}]\n')
    text.append("[run]\nend = 1.0\nfraction = 0.3\n")
    return "\n".join(text)


class Stopwatch:
    """Adds up the CPU time spent in some methods of an object."""

    def __init__(self, target, names) -> None:
        self.spent = 0.0
        for name in names:
            setattr(target, name, self._timed(getattr(target, name)))

    def _timed(self, method):
        def timed(*args, **kwargs):
            start = time.process_time()
            try:
                return method(*args, **kwargs)
            finally:
                self.spent += time.process_time() - start

        return timed


def measure(rows: int, columns: int, law: str, steps: int) -> dict[str, float]:
    """Microseconds per step and law point, and the law's part of it."""
    sim = Simulation(parse(wall(rows, columns, law)))
    nudge = np.random.default_rng(1).normal(0.0, 1e-3, sim.now.motion[3:].shape)
    sim.now.motion[3:] += nudge * sim.system.mobile.T
    sim.world.place(sim.now.motion)
    for _ in range(20):
        sim.step()
    watch = Stopwatch(sim.joints, ["update", "read"])
    start = time.process_time()
    for _ in range(steps):
        sim.step()
    spent = time.process_time() - start
    points = int((sim.now.traction[:, 0] > 0).sum())  # those in reach but open are not counted
    return {
        "blocks": rows * columns,
        "law_points": points,
        "in_reach": sim.joints.n,
        "step_us": 1e6 * spent / steps,
        "point_us": 1e6 * spent / steps / points,
        "law_point_us": 1e6 * watch.spent / steps / points,
        "rest_point_us": 1e6 * (spent - watch.spent) / steps / points,
    }


def main() -> None:
    """Print a table and JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--law", choices=sorted(LAWS), default="joint")
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--json", type=Path)
    given = parser.parse_args()
    results = [measure(*size, given.law, given.steps) for size in ((2, 5), (10, 10), (20, 20))]
    print(f"{'blocks':>7} {'points':>7} {'us/step':>9} {'us/point':>9} {'law':>7} {'rest':>7}")
    for r in results:
        print(
            f"{r['blocks']:7d} {r['law_points']:7d} {r['step_us']:9.0f} {r['point_us']:9.2f} "
            f"{r['law_point_us']:7.2f} {r['rest_point_us']:7.2f}"
        )
    text = json.dumps({"law": given.law, "results": results}, indent=2)
    print(text)
    if given.json:
        given.json.write_text(text + "\n")


if __name__ == "__main__":
    main()
