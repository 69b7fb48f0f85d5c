"""What yielding and wear cost: time of an update over that of the plain law, in one run.

    python benchmarks/damage.py              balanced, motion in one plane, no tangent; a minute
    python benchmarks/damage.py --rounds 200

A thousand joints walk at random around half of the closure range. The least time of each single
step over all rounds is taken, then their sum: whatever else runs on the machine drops out. With
a yield interference of 1000 ranges no facet is ever pressed flat; of 0.05 most are, all the time.
"""

from __future__ import annotations

import argparse
import os
import time

import numpy as np

import jointlaw as jl

JOINTS, BEFORE, STEPS = 1024, 20, 16
WEAR = {"mu_residual": 0.2, "wear_slip": 2e-6}
CASES = {
    "plain": {},
    "plain again": {},
    "yields at 1000 ranges": {"yield_interference": 2e-3},
    "yields at 0.3 ranges": {"yield_interference": 6e-7},
    "yields at 0.05 ranges": {"yield_interference": 1e-7},
    "wears": WEAR,
    "yields at 0.3, and wears": {"yield_interference": 6e-7, **WEAR},
}


def law(damage: dict[str, float], resolution: str) -> jl.JointLaw:
    """Smooth Westerly granite, of which asperities yield or wear."""
    return jl.JointLaw(
        orientation=jl.Orientation(3.0, 0.5, 0.0),
        asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3, **damage),
        heights=jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6),
        asperity_density=1e10,
        closure_range=2e-6,
        resolution=resolution,
        plane=0.0,
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--resolution", default="balanced")
    args = parser.parse_args()
    os.environ |= {"JOINTLAW_KERNEL": "numba", "JOINTLAW_THREADS": "1"}
    d = np.random.default_rng(0).normal(0.0, 6e-8, (BEFORE + STEPS, JOINTS, 2))
    d[0, :, 0] = 1e-6
    out = np.empty((JOINTS, 2)), None
    batches, best = {}, {}
    for name, damage in CASES.items():
        for ledger in (False, True):
            batch = law(damage, args.resolution).joints(JOINTS, ledger=ledger)
            for step in d[:BEFORE]:
                batch.update(step, tangent=False, out=out)
            batches[name, ledger] = batch, batch.snapshot()
            best[name, ledger] = np.full(STEPS, np.inf)
    for _ in range(args.rounds):
        for case, (batch, start) in batches.items():
            batch.restore(start)
            for i, step in enumerate(d[BEFORE:]):
                began = time.perf_counter()
                batch.update(step, tangent=False, out=out)
                best[case][i] = min(best[case][i], time.perf_counter() - began)
    print("ns per joint and update, and over the plain law: without the ledger, with it")
    for name in CASES:
        cells = []
        for ledger in (False, True):
            took, plain = best[name, ledger].sum(), best["plain", ledger].sum()
            cells.append(f"{took / STEPS / JOINTS * 1e9:6.1f} {took / plain:5.2f}")
        print(f"{name:26s} {cells[0]}   {cells[1]}")


if __name__ == "__main__":
    main()
