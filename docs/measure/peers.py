"""The law beside the Hertz-Mindlin contact of YADE, in one run on one core.

    python docs/measure/peers.py [--preset westerly-smooth] [--rounds 4]

Nanoseconds per joint (or contact) and step, the least of rounds in which all take turns.

- fewest sliders: the coarsest resolution that meets the tolerance on the standard paths, motion in
  one plane, traction alone, no ledger, a batch of 10 000; at 1 % also with the tangent.
  `at_tolerance` keeps the tolerance on other paths too and needs more sliders.
- Hertz-Mindlin: YADE's InteractionLoop with its Law2_ScGeom_MindlinPhys_Mindlin, geometry included,
  on one thread (`yade -n -x`).
"""

import argparse
import os
import time
from dataclasses import replace
from typing import Any

os.environ["JOINTLAW_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from tables import table
from yade import measure

import jointlaw as jl
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tolerance import coarsest
from jointlaw.support.progress import track

TOLERANCES = (0.01, 0.001)
HERTZ = "Hertz-Mindlin, YADE"
HEAD = ["what", "u, phi, depth", "sliders", "error", "ns", "time / Hertz-Mindlin"]
JOINTS = 10_000


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
    batch.update(first, tangent=tangent)
    count = [0]

    def once() -> float:
        count[0] += 1
        start = time.perf_counter()
        batch.update(steps[count[0] % 6], tangent=tangent)
        return (time.perf_counter() - start) / n

    return once


def compare(law: jl.JointLaw, rounds: int) -> list[list[Any]]:
    """Rows: what, its resolution, sliders, error, ns, and the time over that of YADE."""
    suite, space, about, cases = standard_suite(law), replace(law, plane=None), {}, {}
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
            error = float(suite.miss(made).largest.max())
            about[name] = [f"{r.u}, {r.phi}, {r.depth}", made.tables.sliders, f"{error:.2%}"]
            cases[name] = ours(made, JOINTS, tangent)
    best = dict.fromkeys([*cases, HERTZ], float("inf"))
    for _ in track(range(rounds), "rounds", rounds):
        best[HERTZ] = min(best[HERTZ], 1e-9 * measure(space, ["hertz"], runs=10)["hertz"]["loop"])
        for name, once in cases.items():
            best[name] = min(best[name], *(once() for _ in range(30)))
    return [
        [name, *about.get(name, ["", "", ""]), f"{1e9 * value:.0f}", f"{value / best[HERTZ]:.2f}"]
        for name, value in best.items()
    ]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--preset", default="westerly-smooth")
    parser.add_argument("--rounds", type=int, default=4)
    options = parser.parse_args()
    law = replace(jl.presets.load(options.preset), plane=0.0)
    print(table(HEAD, compare(law, options.rounds)))


if __name__ == "__main__":
    main()
