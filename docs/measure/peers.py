"""The law beside the Hertz-Mindlin contact of YADE, in one run on one core.

    python docs/measure/peers.py [--preset westerly-smooth] [--rounds 4]
    python docs/measure/peers.py --million     a million joints at the 1 % setting: memory, time

Nanoseconds per joint (or contact) and step, the least of rounds in which all take turns.

- fewest sliders: the coarsest resolution that meets the tolerance on the standard paths, motion in
  one plane, traction alone, no ledger, a batch of 10 000; at 1 % also with the tangent.
  `at_tolerance` keeps the tolerance on other paths too and needs more sliders.
- Hertz-Mindlin: YADE's InteractionLoop with its Law2_ScGeom_MindlinPhys_Mindlin, geometry included,
  on one thread (`yade -n -x`).
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ["JOINTLAW_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from tables import table

import jointlaw as jl
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tolerance import coarsest

TOLERANCES = (0.01, 0.001)
HERTZ = "Hertz-Mindlin, YADE"
HEAD = ["what", "u, phi, depth", "sliders", "error", "ns", "time / Hertz-Mindlin"]
JOINTS = 10_000

YADE = """
import sys
import numpy as np
contacts = {contacts}
N = round((contacts / 3) ** (1 / 3)) + 1
R = 0.5
O.materials.append(FrictMat(young=1e7, poisson=.3, frictionAngle=.5, density=2600))
rng = np.random.default_rng(1)
for k in range(N**3):
    x = (2 * R - 1e-3) * np.array([k % N, k // N % N, k // N**2])
    O.bodies.append(utils.sphere(x.tolist(), R))
    O.bodies[-1].state.vel = Vector3(*(1e-3 * rng.uniform(-1, 1, 3)).tolist())
O.engines = [ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb()], verletDist=.01),
             InteractionLoop([Ig2_Sphere_Sphere_ScGeom()], [Ip2_FrictMat_FrictMat_MindlinPhys()],
                             [Law2_ScGeom_MindlinPhys_Mindlin()]),
             NewtonIntegrator(damping=.2)]
O.dt = 1e-8
O.timingEnabled = True
for _ in range(3): O.step()
while sys.stdin.readline().strip() == "go":
    best = 1e18
    for _ in range(10):
        O.engines[2].execTime = 0
        O.step()
        best = min(best, O.engines[2].execTime / O.interactions.countReal())
    print("RESULT", best, flush=True)
"""


def steps_of(law: jl.JointLaw, n: int) -> tuple[np.ndarray, np.ndarray]:
    """A closure (n, 2), and steps (6, n, 2) that shake the joint around it: slip and separation."""
    rng = np.random.default_rng(0)
    first = np.stack([law.closure_range * rng.uniform(0.3, 0.8, n), np.zeros(n)], axis=1)
    steps = rng.normal(0.0, 0.1 * law.closure_range, (3, n, 2)) * [0.5, 1.0]
    return first, np.concatenate([steps, -steps])


def ours(law: jl.JointLaw, n: int, tangent: bool) -> Any:
    """A function that takes one timed step and returns its seconds per joint."""
    batch = law.joints(n, ledger=False)
    first, steps = steps_of(law, n)
    F, C = np.empty((n, 2)), np.empty((n, 2, 2)) if tangent else None
    batch.update(first, tangent=tangent, out=(F, C))
    count = [0]

    def once() -> float:
        count[0] += 1
        start = time.perf_counter()
        batch.update(steps[count[0] % 6], tangent=tangent, out=(F, C))
        return (time.perf_counter() - start) / n

    return once


class Yade:
    """YADE in a process of its own that takes ten steps whenever it is told to."""

    def __init__(self, folder: str, contacts: int = 20_000) -> None:
        program = shutil.which("yade")
        if program is None:
            raise SystemExit("YADE is not installed (Debian: apt-get install yade)")
        (Path(folder) / "scene.py").write_text(YADE.format(contacts=contacts))
        self.process = subprocess.Popen(
            [program, "-n", "-x", "-j1", "scene.py"], cwd=folder, text=True,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def once(self) -> float:
        """Least seconds per contact of ten steps of its InteractionLoop."""
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.write("go\n")
        self.process.stdin.flush()
        for line in self.process.stdout:
            if line.startswith("RESULT"):
                return float(line.split()[1]) * 1e-9
        raise SystemExit("YADE ended without a result")

    def close(self) -> None:
        """End it."""
        self.process.communicate("stop\n", timeout=60)


def compare(law: jl.JointLaw, rounds: int) -> list[list[Any]]:
    """Rows: what, its resolution, sliders, error, ns, and the time over that of YADE."""
    suite, about, cases = standard_suite(law), {}, {}
    for tolerance in TOLERANCES:
        least, _ = coarsest(law, tolerance)
        if least is None:
            raise SystemExit(f"no resolution meets {tolerance:.2g} on the standard paths")
        kinds = [("fewest sliders", least, False),
                 ("`at_tolerance`", law.at_tolerance(tolerance).resolution, False)]  # fmt: skip
        if tolerance == TOLERANCES[0]:
            kinds.insert(1, ("the same with tangent", least, True))
        for what, r, tangent in kinds:
            made, name = replace(law, resolution=r), f"{tolerance:.1%}, {what}"
            error = float(suite.errors(made)[0].max())
            about[name] = [f"{r.u}, {r.phi}, {r.depth}", made.tables.sliders, f"{error:.2%}"]
            cases[name] = ours(made, JOINTS, tangent)
    with tempfile.TemporaryDirectory() as folder:
        yade = Yade(folder)
        best = dict.fromkeys([*cases, HERTZ], float("inf"))
        for turn in range(rounds):
            best[HERTZ] = min(best[HERTZ], yade.once())
            for name, once in cases.items():
                best[name] = min(best[name], *(once() for _ in range(30)))
            print(f"round {turn + 1} of {rounds}", file=sys.stderr)
        yade.close()
    return [
        [name, *about.get(name, ["", "", ""]), f"{1e9 * value:.0f}", f"{value / best[HERTZ]:.2f}"]
        for name, value in best.items()
    ]


def million(law: jl.JointLaw, n: int = 1_000_000) -> str:
    """A million joints at 1 %: bytes, memory of the process, and the time of steps."""
    made = law.at_tolerance(0.01)
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    once = ours(made, n, False)
    best = min(once() for _ in range(7))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    state = made.joints(0).bytes_per_joint * n
    steps = 8 * n * 2 * 8  # six steps, the first and the result
    return (
        f"{n} joints at 1 % ({made.resolution!r}, {made.tables.sliders} sliders):\n"
        f"state {state / 1e6:.0f} MB, increments and tractions {steps / 1e6:.0f} MB,\n"
        f"process {peak / 1e6:.0f} MB, of which {base / 1e6:.0f} MB before the joints were made,\n"
        f"{best * 1e9:.0f} ns per joint, {best * 1e3 * n:.0f} ms per step"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--preset", default="westerly-smooth")
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--million", action="store_true", help="only a million joints at 1 %%")
    options = parser.parse_args()
    law = replace(jl.presets.load(options.preset), plane=0.0)
    print(million(law) if options.million else table(HEAD, compare(law, options.rounds)))


if __name__ == "__main__":
    main()
