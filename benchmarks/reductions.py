"""What a law saves by leaving out what a scene excludes, as a table and as JSON.

    python benchmarks/reductions.py                       about a minute and a half
    python benchmarks/reductions.py --json reductions.json

Each row is a pair of laws timed in turn in one run: with an ingredient and without it. ns: the
least of many short runs, per joint and update of a batch of 10 000, one thread, traction alone
unless the row says otherwise; bytes: memory per joint. The last rows were not built: their kernels
are made here, by leaving lines out of the compiled one.
"""

from __future__ import annotations

import argparse
import json
import os
import time
import types
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

import jointlaw as jl
from jointlaw.kernels import compiled as kernel
from jointlaw.kernels.engine import NumbaEngine, Step

N = 10_000
STEPS = 4  # different increments, so that no branch is learnt by heart
WHOLE = jl.JointLaw(
    orientation=jl.Orientation(3.0, 0.5, 0.0),
    asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3),
    # "individual" is convex at every eta
    heights=jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6, formation="individual"),
    asperity_density=1e10,
    closure_range=2e-6,
    resolution="balanced",
)
PLANE = replace(WHOLE, plane=0.0)
BARE = replace(PLANE, heights=None)

# Lines of the kernel that a reduction would spare, and what stands there instead.
NO_CAP = (
    (
        "        size = np.sqrt(new2)\n"
        "        cap = strength * G1\n"
        "        slips = size > cap\n"
        "        share = cap / (size if slips else 1.0)\n"
        "        share = share if slips else 1.0\n"
        "        part = share if new2 > TINY else 0.0",
        "        size = cap = part = share = 1.0\n        slips = False",
    ),
)
ONE_WAY = (  # closure alone moves no slider along t
    ("des, oldt * kept + add * det", "des, 0.0"),
    ("new2 = ts * ts + tt * tt", "new2 = ts * ts"),
    ("size = np.sqrt(new2)", "size = abs(ts)"),
    ("qs[l], qt[l] = part * ts, part * tt", "qs[l] = part * ts"),
    ("        pad[_SUMT + l] += part * tt\n", ""),
)  # fmt: skip


class Timed:
    """An engine, a batch of states, and the least time of an update."""

    def __init__(
        self, law: jl.JointLaw, tangent: bool = False, ledger: bool = False, lines: Any = ()
    ) -> None:
        dim = law.tables.dim
        self.engine = NumbaEngine(law.tables)
        if lines:
            self.engine._kernel = without(lines)
        self.bytes = 8 * self.engine.rows
        self.state = np.zeros((-(-N // kernel.LANES), self.engine.rows, kernel.LANES))
        rng = np.random.default_rng(0)
        d = rng.normal(0.0, 1e-7, (STEPS, N, dim)) * ([0.3] + [1.0] * (dim - 1))
        self.d = np.concatenate([d, -d])
        self.F, self.C = np.empty((N, dim)), np.empty((N, dim, dim)) if tangent else None
        self.ledger, self.best, self.turn = ledger, np.inf, 0
        first = np.zeros((N, dim))
        first[:, 0] = rng.uniform(5e-7, 1.5e-6, N)
        self._advance(first)

    def _advance(self, d: Any) -> None:
        self.engine.advance(self.state, Step(d, self.F, self.C, None, True), self.ledger)

    def run(self, seconds: float) -> None:
        """Time single updates for a while."""
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            start = time.perf_counter()
            self._advance(self.d[self.turn % len(self.d)])
            self.best = min(self.best, (time.perf_counter() - start) / N)
            self.turn += 1


class Looked:
    """`law.normal_stress` of 10 000 closures: no joints at all."""

    bytes = 0

    def __init__(self, law: jl.JointLaw) -> None:
        self.law, self.best = law, np.inf
        self.u = np.random.default_rng(0).uniform(5e-7, 1.5e-6, N)

    def run(self, seconds: float) -> None:
        """As `Timed.run`."""
        end = time.perf_counter() + seconds
        while time.perf_counter() < end:
            start = time.perf_counter()
            self.law.normal_stress(self.u)
            self.best = min(self.best, (time.perf_counter() - start) / N)


def without(lines: Any) -> types.ModuleType:
    """The compiled kernel with some of its lines replaced."""
    path = Path(kernel.__file__)
    text = path.read_text().replace("cache=True", "cache=False")
    for old, new in lines:
        if text.count(old) != 1:
            raise RuntimeError(f"the kernel has changed: it no longer holds {old!r} once")
        text = text.replace(old, new)
    made = types.ModuleType("jointlaw.kernels.reduced")
    made.__package__, made.__file__ = kernel.__package__, str(path)
    exec(compile(text, str(path), "exec"), made.__dict__)
    return made


@dataclass
class Pair:
    """A reduction: whole and reduced, timed in the same run."""

    name: str
    whole: Timed
    reduced: Timed | Looked
    built: bool = True

    @property
    def ratio(self) -> float:
        """Time of the reduced law over that of the whole."""
        return self.reduced.best / self.whole.best


def pairs() -> list[Pair]:
    """All reductions; what several need is timed once."""
    space, plane = Timed(WHOLE), Timed(PLANE)
    closure = Timed(replace(WHOLE, closure_only=True))
    linear = replace(PLANE, asperity=replace(PLANE.asperity, eta=0.0))
    bare = replace(linear, heights=None)
    return [
        Pair("no tangent (3-D, with ledger)", Timed(WHOLE, True, True), Timed(WHOLE, False, True)),
        Pair("no tangent (one plane)", Timed(PLANE, True), plane),
        Pair("no ledger (one plane)", Timed(PLANE, False, True), plane),
        Pair("motion in one plane, of 3-D", space, plane),
        Pair("closure only, of 3-D", space, closure),
        Pair("closure only, of one plane", plane, closure),
        Pair("closure that never opens: `law.normal_stress`", closure, Looked(WHOLE)),
        Pair("no heights", plane, Timed(BARE)),
        Pair("no heights, linear asperities: one depth cell", Timed(linear), Timed(bare)),
        Pair("no large shear: `critical_slip = inf`", Timed(replace(PLANE, critical_slip=1e-3)),
             plane),
        Pair("c = 0", Timed(replace(WHOLE, orientation=jl.Orientation(3.0, 0.5, 0.1))), space),
        Pair("no slip: caps left out of the kernel", plane, Timed(PLANE, lines=NO_CAP), False),
        Pair("closure only: sliders of one component", closure,
             Timed(replace(WHOLE, closure_only=True), lines=ONE_WAY), False),
    ]  # fmt: skip


def measure(rounds: int = 25, seconds: float = 0.05) -> list[Pair]:
    """Time every law in every round."""
    os.environ["JOINTLAW_THREADS"] = "1"
    found = pairs()
    timed = list({id(t): t for pair in found for t in (pair.whole, pair.reduced)}.values())
    for _ in range(rounds):
        for one in timed:
            one.run(seconds)
    return found


def table(found: list[Pair]) -> str:
    """Markdown."""
    lines = ["| left out | ns before | ns after | after / before | bytes before | after "
             "| in the package |",
             "| --- | ---: | ---: | ---: | ---: | ---: | --- |"]  # fmt: skip
    for p in found:
        lines.append(
            f"| {p.name} | {1e9 * p.whole.best:.1f} | {1e9 * p.reduced.best:.1f} | {p.ratio:.2f} | "
            f"{p.whole.bytes} | {p.reduced.bytes} | {'yes' if p.built else 'no'} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Print a table; write JSON where asked."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=25, help="rounds over all laws (25)")
    parser.add_argument("--json", type=Path, help="file to write the numbers to")
    given = parser.parse_args()
    found = measure(given.rounds)
    print(table(found))
    if given.json:
        rows = [
            {"without": p.name, "ns_with": 1e9 * p.whole.best, "ns_without": 1e9 * p.reduced.best,
             "ratio": p.ratio, "bytes_with": p.whole.bytes, "bytes_without": p.reduced.bytes,
             "built": p.built}
            for p in found
        ]  # fmt: skip
        given.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()
