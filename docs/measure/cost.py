"""Nanoseconds per joint and update, the least of several rounds in which all cases take turns.

    python docs/measure/cost.py            by resolution and size of the batch
    python docs/measure/cost.py savings    with an ingredient of the law, and without it

Motion in one plane but where 3-D is named, random steps around a closure of 1 um. A batch of 1 is
`Joint.update` through Python. F: traction alone; FC: with tangent; +L: with the ledger; x2: on two
threads; measures: `batch.measures()`.
"""

import argparse
import os
import time
from dataclasses import replace

import numpy as np
from tables import table

import jointlaw as jl
from jointlaw.parameters.resolution import NAMED
from jointlaw.support.progress import track

SIZES = (1, 10_000)
# column: kernel, threads, tangent, ledger
COLUMNS = {
    "F": ("native", 1, False, False),
    "F+L": ("native", 1, False, True),
    "FC": ("native", 1, True, False),
    "FC+L": ("native", 1, True, True),
    "F x2": ("native", 2, False, False),
    "FC x2": ("native", 2, True, False),
    "measures": ("native", 1, False, False),
    "numpy F": ("numpy", 1, False, False),
}
STEPS = 4  # different increments, so that no branch is learnt by heart
LONGEST = 1.0  # s that one update may take
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
        self.kernel, self.threads, self.tangent, self.ledger = COLUMNS[column]

    @property
    def bytes(self):
        """Memory of one joint."""
        return self.law.joints(0).bytes_per_joint

    def run(self, seconds):
        """Time single updates for a while, two at least."""
        os.environ |= {"JOINTLAW_KERNEL": self.kernel, "JOINTLAW_THREADS": str(self.threads)}
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
            if self.column == "measures":
                batch.measures()
            else:
                batch.update(d[k % len(d)], tangent=self.tangent)

        return 1, once


def possible(n, column):
    """Whether a column has this size."""
    kernel, threads, _, ledger = COLUMNS[column]
    shared = threads == 1 or n >= 10_000  # with fewer there is too little work to share
    return shared and (n > 1 or kernel == "numpy" or ledger)  # one joint always keeps its ledger


def by_resolution(rounds, seconds):
    """Head and rows: one line per named resolution and size."""
    laws = {name: replace(PLANE, resolution=name) for name in NAMED}
    cases = {(name, n, column): Case(law, n, column) for name, law in laws.items()
             for n in SIZES for column in COLUMNS if possible(n, column)}  # fmt: skip
    measure(cases.values(), rounds, seconds)
    rows = []
    for name in NAMED:
        for n in SIZES:
            times = [cases.get((name, n, column)) for column in COLUMNS]
            cells = [f"{1e9 * case.best:.0f}" if case and np.isfinite(case.best) else "-"
                     for case in times]  # fmt: skip
            rows.append([name, n, *cells])
    return ["resolution", "joints", *COLUMNS], rows


def savings(rounds, seconds):
    """Head and rows: one line for each ingredient that can be left out."""
    space, plane = Case(SPACE), Case(PLANE)
    closure = Case(replace(SPACE, closure_only=True))
    linear = replace(PLANE, asperity=replace(PLANE.asperity, eta=0.0))
    pairs = {
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
    measure({id(one): one for pair in pairs.values() for one in pair}.values(), rounds, seconds)
    rows = [[name, f"{1e9 * whole.best:.0f}", f"{1e9 * reduced.best:.0f}",
             f"{reduced.best / whole.best:.2f}", whole.bytes, reduced.bytes]
            for name, (whole, reduced) in pairs.items()]  # fmt: skip
    return ["left out", "ns before", "ns after", "after / before", "bytes before", "after"], rows


def measure(cases, rounds, seconds):
    """Time every case in every round, but for those of which smaller batches show that one update
    takes longer than LONGEST."""
    slow = set()
    for _ in track(range(rounds), "rounds", rounds):
        for case in cases:
            if case not in slow:
                case.run(seconds)
                if case.best * 10_000 > LONGEST:
                    slow |= {one for one in cases if same(one, case)}


def same(one, other):
    """Whether two cases differ in nothing but the size of the batch, and the first is larger."""
    return (one.law, one.column) == (other.law, other.column) and one.n > other.n


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("which", nargs="?", choices=["resolutions", "savings"],
                        default="resolutions")  # fmt: skip
    parser.add_argument("--rounds", type=int, default=6, help="over all cases (6)")
    parser.add_argument("--seconds", type=float, default=0.1, help="per case and round (0.1)")
    given = parser.parse_args()
    make = savings if given.which == "savings" else by_resolution
    print(table(*make(given.rounds, given.seconds)))
