"""Nanoseconds per joint and update with an ingredient, and without it: the least of several rounds
in which all cases take turns.

Motion in one plane but where 3-D is named, random steps around a closure of 1 um, one thread. F:
traction alone; FC: with tangent; +L: with the ledger.
"""

import argparse
import os
import time
from dataclasses import replace

import numpy as np
from tables import table

import jointlaw as jl
from jointlaw.support.progress import track

# column: tangent, ledger
COLUMNS = {"F": (False, False), "F+L": (False, True), "FC": (True, False), "FC+L": (True, True)}
STEPS = 4  # different increments, so that no branch is learnt by heart
SPACE = jl.JointLaw(
    orientation=jl.Orientation(3.0, 0.5, 0.0),
    asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3),
    # "individual" is convex at every eta
    heights=jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation="individual"),
    asperity_density=1e10,
    closure_range=2e-6,
)
PLANE = replace(SPACE, plane=0.0)


class Case:
    """One law, batch size and column; holds its least time."""

    def __init__(self, law, n=10_000, column="F"):
        self.law, self.n, self.column, self.best = law, n, column, np.inf
        self.tangent, self.ledger = COLUMNS[column]

    @property
    def bytes(self):
        """Memory of one joint."""
        return self.law.joints(0).bytes_per_joint

    def run(self, seconds):
        """Time single updates for a while, two at least."""
        os.environ |= {"JOINTLAW_KERNEL": "native", "JOINTLAW_THREADS": "1"}
        rng, n, dim = np.random.default_rng(0), self.n, self.law.dim
        d = rng.normal(0.0, 1e-7, (STEPS, n, dim)) * ([0.3] + [1.0] * (dim - 1))
        first = np.zeros((n, dim))
        first[:, 0] = rng.uniform(5e-7, 1.5e-6, n)
        calls, once = (self._joint if n == 1 else self._batch)(first, np.concatenate([d, -d]))
        once(0)  # compiles, or loads from the cache
        end, k = time.perf_counter() + seconds, 0
        while k < 2 or time.perf_counter() < end:
            start = time.perf_counter()
            once(k)
            self.best = min(self.best, (time.perf_counter() - start) / (calls * n))
            k += 1

    def _joint(self, first, d):
        """So many updates of one joint, and a function that takes them."""
        joint, steps = self.law.joint(), list(d[:, 0])
        joint.update(first[0])

        def once(k):
            for i in range(50):
                joint.update(steps[i % len(steps)], tangent=self.tangent)

        return 50, once

    def _batch(self, first, d):
        """The same of one update of a batch."""
        batch = self.law.joints(self.n, ledger=self.ledger)
        batch.update(first, tangent=False)

        def once(k):
            batch.update(d[k % len(d)], tangent=self.tangent)

        return 1, once


def savings(rounds, seconds):
    """Head and rows: one line for each ingredient that can be left out."""
    space, plane = Case(SPACE), Case(PLANE)
    closure = Case(replace(SPACE, closure_only=True))
    linear = replace(PLANE, asperity=replace(PLANE.asperity, eta=0.0))
    pairs = {
        "one `Joint` by Python, in a batch (tangent, ledger)": (
            Case(PLANE, n=1, column="FC+L"), Case(PLANE, column="FC+L"),
        ),
        "no tangent (3-D, with ledger)": (Case(SPACE, column="FC+L"), Case(SPACE, column="F+L")),
        "no tangent (one plane)": (Case(PLANE, column="FC"), plane),
        "no ledger (one plane)": (Case(PLANE, column="F+L"), plane),
        "motion in one plane, of 3-D": (space, plane),
        "closure only, of 3-D": (space, closure),
        "closure only, of one plane": (plane, closure),
        "no heights": (plane, Case(replace(PLANE, heights=None))),
        "no heights, linear asperities: one depth cell": (
            Case(linear), Case(replace(linear, heights=None)),
        ),
        "no large shear: `mating_length = inf`": (
            Case(replace(PLANE, mating_length=1e-3)), plane,
        ),
        "c = 0": (Case(replace(SPACE, orientation=jl.Orientation(3.0, 0.5, 0.1))), space),
    }  # fmt: skip
    cases = {id(one): one for pair in pairs.values() for one in pair}.values()
    for _ in track(range(rounds), "rounds", rounds):
        for case in cases:
            case.run(seconds)
    rows = [[name, f"{1e9 * whole.best:.0f}", f"{1e9 * reduced.best:.0f}",
             f"{reduced.best / whole.best:.2f}", whole.bytes, reduced.bytes]
            for name, (whole, reduced) in pairs.items()]  # fmt: skip
    return ["left out", "ns before", "ns after", "after / before", "bytes before", "after"], rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=6, help="over all cases (6)")
    parser.add_argument("--seconds", type=float, default=0.1, help="per case and round (0.1)")
    given = parser.parse_args()
    print(table(*savings(given.rounds, given.seconds)))
