"""Time of one joint update, as a table and as JSON.

    python benchmarks/update.py                      every case, a few minutes
    python benchmarks/update.py --json update.json   also the numbers, for other programs

Each figure is the least of several rounds, spread over the whole run, in nanoseconds per joint and
update. Motion in one plane (--space: in 3-D), random steps around a closure of 1 um. A batch of 1
is `Joint.update` through Python. F: traction alone; FC: with tangent; +L: with the ledger; x2: on
two threads; measures: `batch.measures()`, the shares, energy and reach of all joints. Cases whose
states need more than --memory, or one run more than --longest, are left out and shown as a dash.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
import tempfile
import time
from typing import Any

import numba
import numpy as np

import jointlaw as jl
from jointlaw.parameters.resolution import NAMED

NAMES = ("fast", "balanced", "fine", "reference")
SIZES = (1, 100, 10_000, 1_000_000)
# column: kernel, threads, tangent, ledger
COLUMNS = {
    "F": ("numba", 1, False, False),
    "F+L": ("numba", 1, False, True),
    "FC": ("numba", 1, True, False),
    "FC+L": ("numba", 1, True, True),
    "F x2": ("numba", 2, False, False),
    "FC x2": ("numba", 2, True, False),
    "measures": ("numba", 1, False, False),
    "numpy F": ("numpy", 1, False, False),
    "numpy FC": ("numpy", 1, True, False),
}
STEPS = 4  # different increments, so that no branch is learnt by heart

FIRST = """
import time
import jointlaw as jl
law = jl.presets.load("westerly-smooth")
times = []
for n in (1, 100):
    batch = law.joints(n, ledger=False)
    d = [[1e-7] * law.tables.dim] * n
    for tangent in (False, True):
        start = time.perf_counter()
        batch.update(d, tangent=tangent)
        times.append(time.perf_counter() - start)
print(sum(times))
"""


def law(name: str, plane: bool) -> jl.JointLaw:
    """Smooth Westerly granite at a named resolution."""
    return jl.JointLaw(
        orientation=jl.Orientation(3.0, 0.5, 0.0),
        asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.3),
        heights=jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6),
        asperity_density=1e10,
        closure_range=2e-6,
        resolution=name,
        plane=0.0 if plane else None,
    )


def state_bytes(made: jl.JointLaw) -> int:
    """Bytes that a joint of a large batch occupies."""
    os.environ["JOINTLAW_KERNEL"] = "numba"
    return made.joints(0).bytes_per_joint


def limits() -> dict[str, float]:
    """What this processor can do, one thread, in ns per number: the floor under any kernel."""

    @numba.njit(error_model="numpy")
    def divide(x: Any, y: Any) -> None:
        for _ in range(1000):
            for i in range(x.size):
                y[i] = 1.5 / (x[i] + 1.0)

    @numba.njit(error_model="numpy")
    def root(x: Any, y: Any) -> None:
        for _ in range(1000):
            for i in range(x.size):
                y[i] = np.sqrt(x[i] + 1.0)

    @numba.njit(error_model="numpy")
    def move(x: Any, y: Any) -> None:  # reads and writes, as a step does to the state
        for i in range(x.size):
            x[i] += 1.0

    few, many = np.random.default_rng(0).random(1024), np.zeros(40_000_000)
    some = np.zeros(520_000)  # as much as 10 000 joints
    result = {}
    for name, call, x, count in (
        ("division (ns)", divide, few, 1000 * few.size),
        ("square root (ns)", root, few, 1000 * few.size),
        ("8 bytes of state moved, 4 MB (ns)", move, some, some.size),
        ("8 bytes of state moved, 320 MB (ns)", move, many, many.size),
    ):
        y, best = np.empty_like(x), np.inf
        call(x, y)
        for _ in range(15):
            start = time.perf_counter()
            call(x, y)
            best = min(best, time.perf_counter() - start)
        result[name] = best / count * 1e9
    return result


class Case:
    """One law, batch size and column; holds its least time."""

    def __init__(self, made: jl.JointLaw, n: int, column: str, rng: np.random.Generator) -> None:
        self.law, self.n, self.column = made, n, column
        self.kernel, self.threads, self.tangent, self.ledger = COLUMNS[column]
        self.best, self.rng = np.inf, rng

    def run(self, seconds: float) -> None:
        """Time single updates for a while, two at least."""
        os.environ |= {"JOINTLAW_KERNEL": self.kernel, "JOINTLAW_THREADS": str(self.threads)}
        n, dim = self.n, self.law.tables.dim
        d = self.rng.normal(0.0, 1e-7, (STEPS, n, dim)) * ([0.3] + [1.0] * (dim - 1))
        d = np.concatenate([d, -d])
        first = np.zeros((n, dim))
        first[:, 0] = self.rng.uniform(5e-7, 1.5e-6, n)
        if n == 1:
            joint, calls = self.law.joint(), 50
            joint.update(first[0])
            steps = list(d[:, 0])

            def once(k: int) -> None:
                for i in range(k, k + calls):
                    joint.update(steps[i % len(steps)], tangent=self.tangent)
        else:
            batch, calls = self.law.joints(n, ledger=self.ledger), 1
            F, C = np.empty((n, dim)), np.empty((n, dim, dim)) if self.tangent else None
            batch.update(first, tangent=False)

            def once(k: int) -> None:
                if self.column == "measures":
                    batch.measures()
                    return
                batch.update(d[k % len(d)], tangent=self.tangent, out=(F, C))

        once(0)  # compiles, or loads from the cache
        end, k = time.perf_counter() + seconds, 0
        while k < 2 * calls or time.perf_counter() < end:
            start = time.perf_counter()
            once(k)
            took = (time.perf_counter() - start) / (calls * n)
            self.best, k = min(self.best, took), k + calls


def cases(args: argparse.Namespace) -> list[Case]:
    """Cases that fit in memory."""
    made, rng = [], np.random.default_rng(0)
    for name in NAMES:
        one = law(name, not args.space)
        for n in SIZES:
            if n * (state_bytes(one) + 400) > args.memory * 1e9:
                continue
            for column, (kernel, threads, _, ledger) in COLUMNS.items():
                if threads > 1 and n < 10_000:  # too little work to share
                    continue
                if n == 1 and kernel == "numba" and not ledger:  # one joint always keeps its own
                    continue
                made.append(Case(one, n, column, rng))
    return made


def compile_times() -> tuple[float, float]:
    """Seconds of the first updates in a new process: compiled, and loaded from the cache."""
    with tempfile.TemporaryDirectory() as folder:
        env = os.environ | {"NUMBA_CACHE_DIR": folder, "JOINTLAW_KERNEL": "numba"}
        runs = [
            float(subprocess.run([sys.executable, "-c", FIRST], env=env, check=True,
                                 capture_output=True, text=True).stdout)
            for _ in range(2)
        ]  # fmt: skip
    return runs[0], runs[1]


def exponent(x: list[float], y: list[float]) -> float | None:
    """Power with which y grows in x."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0]) if len(x) > 1 else None


def summary(found: list[Case]) -> dict[str, Any]:
    """Growth of the time of a whole step with sliders and with joints, and ratios."""
    best = {(c.law.resolution, c.n, c.column): c.best * 1e9 for c in found}
    laws = {c.law.resolution: c.law for c in found}
    sliders = {r: one.tables.sliders for r, one in laws.items()}
    result: dict[str, Any] = {}
    for column in ("F", "FC"):
        same_n = [(sliders[r], v) for (r, n, c), v in best.items() if n == 10_000 and c == column]
        result[f"{column}: time ~ sliders^p at 10 000 joints"] = exponent(
            *map(list, zip(*same_n, strict=True))
        )
        balanced = NAMED["balanced"]
        joints = [
            (n, n * v) for (r, n, c), v in best.items() if r == balanced and n > 1 and c == column
        ]
        result[f"{column}: time ~ joints^p at balanced"] = exponent(
            *map(list, zip(*joints, strict=True))
        )
        if (balanced, 10_000, f"{column} x2") in best:
            two = best[balanced, 10_000, f"{column} x2"]
            result[f"{column}: two threads, times faster at 10 000"] = (
                best[balanced, 10_000, column] / two
            )
    return result


def table(found: list[Case]) -> str:
    """Markdown: one line per resolution and batch size."""
    lines = [
        f"| resolution | sliders | bytes | joints | {' | '.join(COLUMNS)} |",
        "|---|" + "---:|" * (3 + len(COLUMNS)),
    ]
    best = {(c.law.resolution, c.n, c.column): c.best * 1e9 for c in found}
    for name in NAMES:
        one = next(c.law for c in found if c.law.resolution == NAMED[name])
        sliders, size = one.tables.sliders, state_bytes(one)
        for n in SIZES:
            cells = [best.get((one.resolution, n, column)) for column in COLUMNS]
            if any(cells):
                text = " | ".join("-" if v is None else f"{v:.0f}" for v in cells)
                lines.append(f"| {name} | {sliders} | {size} | {n} | {text} |")
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--space", action="store_true", help="motion in 3-D, not in one plane")
    parser.add_argument("--rounds", type=int, default=6, help="rounds over all cases (6)")
    parser.add_argument("--seconds", type=float, default=0.1, help="per case and round")
    parser.add_argument("--longest", type=float, default=1.0, help="seconds that one run may take")
    parser.add_argument("--memory", type=float, default=1.0, help="GB that one batch may take")
    parser.add_argument("--json", help="file to write the numbers to")
    args = parser.parse_args()
    first, cached = compile_times()
    todo, left = cases(args), []
    for turn in range(args.rounds):
        for case in todo:
            if case not in left:
                smaller = [c.best for c in todo if c.law is case.law and c.column == case.column]
                known = min(smaller)  # of smaller batches, in seconds per joint
                if np.isfinite(known) and known * case.n > args.longest:
                    left.append(case)
                    continue
                case.run(args.seconds)
        print(f"round {turn + 1} of {args.rounds}", file=sys.stderr)
    found = [case for case in todo if np.isfinite(case.best)]

    about = {
        "processors": os.cpu_count(),
        "machine": platform.machine(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "first updates, compiled (s)": first,
        "first updates, from the cache (s)": cached,
        **limits(),
    }
    print(table(found))
    print()
    for key, value in (about | summary(found)).items():
        print(f"{key}: {value:.3g}" if isinstance(value, float) else f"{key}: {value}")
    if args.json:
        rows = [
            {
                "resolution": [c.law.resolution.u, c.law.resolution.phi, c.law.resolution.depth],
                "sliders": c.law.tables.sliders,
                "bytes": state_bytes(c.law),
                "joints": c.n,
                "kernel": c.kernel,
                "threads": c.threads,
                "tangent": c.tangent,
                "ledger": c.ledger or c.n == 1,
                "ns": c.best * 1e9,
            }
            for c in found
        ]
        with open(args.json, "w") as stream:
            json.dump({"about": about, "summary": summary(found), "rows": rows}, stream, indent=1)


if __name__ == "__main__":
    main()
