"""Nanoseconds per joint and update with an ingredient, and without it: the least of several rounds
in which all cases take turns.

Motion in one plane but where 3-D is named, random steps around a closure of 1 um, one thread;
traction alone but where a tangent or the ledger is named.
"""

import os
from dataclasses import replace
from functools import partial
from itertools import cycle
from timeit import Timer

import numpy as np
from tables import asked, least, table

import jointlaw as jl

os.environ |= {"JOINTLAW_KERNEL": "native", "JOINTLAW_THREADS": "1"}
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


def once(law, n, tangent, ledger, seconds):
    """Least ns per joint of single updates for a while; n joints: 1 by `Joint`, more by a batch."""
    rng = np.random.default_rng(0)
    d = rng.normal(0.0, 1e-7, (STEPS, n, law.dim)) * ([0.3] + [1.0] * (law.dim - 1))
    first, d = np.zeros((n, law.dim)), np.concatenate([d, -d])
    first[:, 0] = rng.uniform(5e-7, 1.5e-6, n)
    joints, calls = law.joints(n, ledger=ledger), 1
    if n == 1:
        joints, calls, first, d = law.joint(), 50, first[0], d[:, 0]
    steps = cycle(d)
    joints.update(first, tangent=False)
    timer = Timer(lambda: joints.update(next(steps), tangent=tangent))
    runs = max(2, round(seconds / timer.timeit(calls)))
    return 1e9 * min(timer.repeat(runs, calls)) / (calls * n)


def savings(rounds, seconds):
    """Rows: one line for each ingredient that can be left out."""

    def case(law, n=10_000, tangent=False, ledger=False):
        return law, n, tangent, ledger

    space, plane = case(SPACE), case(PLANE)
    closure = case(replace(SPACE, closure_only=True))
    linear = replace(PLANE, asperity=replace(PLANE.asperity, eta=0.0))
    pairs = {
        "one `Joint` by Python, in a batch (tangent, ledger)": (
            case(PLANE, n=1, tangent=True, ledger=True), case(PLANE, tangent=True, ledger=True),
        ),
        "no tangent (3-D, with ledger)": (
            case(SPACE, tangent=True, ledger=True), case(SPACE, ledger=True),
        ),
        "no tangent (one plane)": (case(PLANE, tangent=True), plane),
        "no ledger (one plane)": (case(PLANE, ledger=True), plane),
        "motion in one plane, of 3-D": (space, plane),
        "closure only, of 3-D": (space, closure),
        "closure only, of one plane": (plane, closure),
        "no heights": (plane, case(replace(PLANE, heights=None))),
        "no heights, linear asperities: one depth cell": (
            case(linear), case(replace(linear, heights=None)),
        ),
        "no large shear: `mating_length = inf`": (
            case(replace(PLANE, mating_length=1e-3)), plane,
        ),
        "c = 0": (case(replace(SPACE, orientation=jl.Orientation(3.0, 0.5, 0.1))), space),
    }  # fmt: skip
    cases = {one: partial(once, *one, seconds) for pair in pairs.values() for one in pair}
    best, rows = least(cases, rounds), []
    for name, pair in pairs.items():
        before, after = (best[one] for one in pair)
        sizes = [law.joints(0).bytes_per_joint for law, *_ in pair]
        rows.append([name, f"{before:.0f}", f"{after:.0f}", f"{after / before:.2f}", *sizes])
    return rows


if __name__ == "__main__":
    given = asked(__doc__, rounds=6, seconds=0.1)
    head = ["left out", "ns before", "ns after", "after / before", "bytes before", "after"]
    print(table(head, savings(given.rounds, given.seconds)))
