"""The law beside the Hertz-Mindlin contact of YADE, in one run on one core.

    python docs/measure/peers.py [--preset westerly-smooth] [--rounds 4]

Nanoseconds per joint (or contact) and step, the least of rounds in which both take turns.

- fewest sliders: the coarsest resolution that meets the tolerance on the standard paths, motion in
  one plane, traction alone, no ledger, a batch of 10 000, by `law.tradeoff`; at 1 % also with the
  tangent. `at_tolerance` keeps the tolerance on other paths too and needs more sliders.
- Hertz-Mindlin: YADE's InteractionLoop with its Law2_ScGeom_MindlinPhys_Mindlin, geometry included,
  on one thread (`yade -n -x`).
"""

import os
from dataclasses import replace

os.environ["JOINTLAW_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

from tables import asked, table
from yade import measure

import jointlaw as jl
from jointlaw.accuracy.tolerance import coarsest
from jointlaw.support.progress import track

HEAD = ["what", "u, phi, depth", "sliders", "error", "ns", "time / Hertz-Mindlin"]


def compare(law, rounds):
    """Rows: what, its resolution, sliders, error, ns, and the time over that of YADE."""
    cases = []  # name, resolution, which of the times
    for tolerance in (0.01, 0.001):
        kept, (fewest, _) = law.at_tolerance(tolerance).resolution, coarsest(law, tolerance)
        cases.append((f"{tolerance:.1%}, fewest sliders", fewest, "ns"))
        if tolerance == 0.01:
            cases.append((f"{tolerance:.1%}, the same with tangent", fewest, "ns_tangent"))
        cases.append((f"{tolerance:.1%}, `at_tolerance`", kept, "ns"))
    prices, loops, rows = [], [], []
    for _ in track(range(rounds), "rounds", rounds):
        loops.append(measure(replace(law, plane=None), ["hertz"], runs=10)["hertz"]["loop"])
        prices += law.tradeoff([r for _, r, _ in cases]).rows
    for name, r, time in cases:
        some = [price for price in prices if price.resolution == r]
        ns = min(getattr(price, time) for price in some)
        rows.append([name, f"{r.u}, {r.phi}, {r.depth}", some[0].sliders, f"{some[0].worst:.2%}",
                     f"{ns:.0f}", f"{ns / min(loops):.2f}"])  # fmt: skip
    return [*rows, ["Hertz-Mindlin, YADE", "", "", "", f"{min(loops):.0f}", "1.00"]]


if __name__ == "__main__":
    options = asked(__doc__, preset="westerly-smooth", rounds=4)
    law = replace(jl.presets.load(options.preset), plane=0.0)
    print(table(HEAD, compare(law, options.rounds)))
