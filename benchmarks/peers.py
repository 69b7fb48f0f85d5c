"""The law beside its peers, in one run on one core: contacts of a DEM code, and the obvious numpy.

    python benchmarks/peers.py [--preset westerly-smooth] [--rounds 4] [--json peers.json]
    python benchmarks/peers.py --million       a million joints at the 1 % setting: memory, time

Nanoseconds per joint (or contact) and step, the least of rounds in which all take turns; ratios are
those of these least times.

- ours: the fewest sliders that meet the tolerance on the standard paths, motion in one plane,
  traction alone, no ledger, a batch of 10 000; at 1 % also with the tangent. "at_tolerance" is
  `law.at_tolerance(t)`, which keeps the tolerance on other paths too and needs more sliders.
- numpy: the same law the obvious way (`plain_bed.py`): fixed springs, each with its slider, evenly
  spaced in inclination, azimuth and touch depth, array operations over all joints (10 000, or as
  many as make ten million springs). "tuned" places the springs as well as the tests do. Either is
  the smallest bed of a spread that meets the same tolerance on the standard paths. "in blocks" is
  the tuned one for 64 joints, whose arrays stay in the cache, "one by one" for one.
- Hertz-Mindlin: YADE's InteractionLoop with its Law2_ScGeom_MindlinPhys_Mindlin, geometry included,
  on one thread (`yade -n -x`).
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

os.environ["JOINTLAW_THREADS"] = os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
from plain_bed import PlainBed, Springs, even, smallest, tuned

import jointlaw as jl
from jointlaw.accuracy.suite import standard_suite
from jointlaw.accuracy.tolerance import coarsest

TOLERANCES = (0.01, 0.001)
JOINTS, BLOCK = 10_000, 64
SPRINGS = 10_000_000  # most of a plain bed: its arrays take half a gigabyte

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


def plain(law: jl.JointLaw, springs: Springs, n: int) -> Any:
    """As `ours`, for the plain bed."""
    bed = PlainBed(law, springs, n)
    first, steps = steps_of(law, n)
    bed.update(first.T.copy())
    count = [0]

    def once() -> float:
        count[0] += 1
        d = steps[count[0] % 6].T.copy()
        start = time.perf_counter()
        bed.update(d)
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


def compare(law: jl.JointLaw, rounds: int) -> dict[str, Any]:
    """Least times of all, in ns, with what each is."""
    suite = standard_suite(law)
    rows: dict[str, dict[str, Any]] = {}
    cases: dict[str, Any] = {}
    places = (even, ""), (tuned, ", tuned")
    with ProcessPoolExecutor(2) as pool:  # nothing is timed yet
        safe = {t: pool.submit(law.at_tolerance, t) for t in TOLERANCES}
        beds = {
            (t, place): pool.submit(smallest, law, suite, t, place)
            for t in TOLERANCES[::-1]
            for place, _ in places
        }
    for tolerance in TOLERANCES:
        least, _ = coarsest(law, tolerance)
        if least is None:
            raise SystemExit(f"no resolution meets {tolerance:.2g} on the standard paths")
        kept = safe[tolerance].result().resolution
        kinds = [("ours", least, False), ("at_tolerance", kept, False)]
        if tolerance == 0.01:
            kinds.insert(1, ("ours with tangent", least, True))
        for what, r, tangent in kinds:
            made, name = replace(law, resolution=r), f"{what} at {tolerance:.1%}"
            error = float(suite.errors(made)[0].max())
            rows[name] = {"tolerance": tolerance, "error": error, "sliders": made.tables.sliders,
                          "resolution": f"{r.u}, {r.phi}, {r.depth}"}  # fmt: skip
            cases[name] = ours(made, JOINTS, tangent)
        for place, form in places:
            rule, error = beds[tolerance, place].result()
            count, springs = int(np.prod(rule)), place(law, rule)
            about = {"tolerance": tolerance, "error": error, "sliders": count,
                     "resolution": ", ".join(map(str, rule))}  # fmt: skip
            sizes = {"": min(JOINTS, SPRINGS // count)}
            if place is tuned:
                sizes |= {", in blocks": BLOCK, ", one by one": 1}
            for how, size in sizes.items():
                name = f"numpy at {tolerance:.1%}{form}{how}"
                rows[name], cases[name] = about, plain(law, springs, size)
    with tempfile.TemporaryDirectory() as folder:
        yade = Yade(folder)
        rows["Hertz-Mindlin, YADE"], cases["Hertz-Mindlin, YADE"] = {}, yade.once
        best = dict.fromkeys(cases, float("inf"))
        quick = ("ours", "at_tolerance"), (", in blocks", ", one by one")
        for turn in range(rounds):
            for name, once in cases.items():
                times = 30 if name.startswith(quick[0]) or name.endswith(quick[1]) else 1
                best[name] = min(best[name], *(once() for _ in range(times)))
            print(f"round {turn + 1} of {rounds}", file=sys.stderr)
        yade.close()
    for name, value in best.items():
        rows[name] = rows[name] | {"ns": value * 1e9}
    return rows


def table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown, with ratios to Hertz-Mindlin and of numpy to ours at the same tolerance."""
    hertz = rows["Hertz-Mindlin, YADE"]["ns"]
    head = "| what | u, phi, depth | sliders | error | ns | time / Hertz-Mindlin | time / ours |"
    lines = [head,
             "| --- | --- | ---: | ---: | ---: | ---: | ---: |"]  # fmt: skip
    for name, row in rows.items():
        ratio = ""
        if name.startswith("numpy"):
            ratio = f"{row['ns'] / rows[name.split(',')[0].replace('numpy', 'ours')]['ns']:.0f}"
        error = f"{row['error']:.2%}" if "error" in row else ""
        lines.append(f"| {name} | {row.get('resolution', '')} | {row.get('sliders', '')} | {error} "
                     f"| {row['ns']:.0f} | {row['ns'] / hertz:.2f} | {ratio} |")  # fmt: skip
    return "\n".join(lines)


def million(law: jl.JointLaw, n: int = 1_000_000) -> dict[str, Any]:
    """A million joints at 1 %: bytes, memory of the process, and the time of steps."""
    made = law.at_tolerance(0.01)
    base = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    once = ours(made, n, False)
    best = min(once() for _ in range(7))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
    state = made.joints(0).bytes_per_joint * n
    steps = 8 * n * 2 * 8  # six steps, the first and the result
    r = made.resolution
    return {"joints": n, "resolution": repr(r), "sliders": made.tables.sliders,
            "state": state, "increments": steps, "process": peak, "before": base,
            "ns": best * 1e9}  # fmt: skip


def in_words(found: dict[str, Any]) -> str:
    """What `million` found."""
    state, steps, peak, base = (
        f"{found[key] / 1e6:.0f} MB" for key in ("state", "increments", "process", "before")
    )
    return (
        f"{found['joints']} joints at 1 % ({found['resolution']}, {found['sliders']} sliders):\n"
        f"state {state}, increments and tractions {steps},\n"
        f"process {peak}, of which {base} before the joints were made,\n"
        f"{found['ns']:.0f} ns per joint, {found['ns'] * found['joints'] / 1e6:.0f} ms per step"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--preset", default="westerly-smooth")
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--million", action="store_true", help="only a million joints at 1 %%")
    parser.add_argument("--json", help="file to write the numbers to")
    options = parser.parse_args()
    law = replace(jl.presets.load(options.preset), plane=0.0)
    result: dict[str, Any]
    if options.million:
        result = million(law)
        print(in_words(result))
    else:
        result = compare(law, options.rounds)
        print(f"{options.preset}, plane motion, traction alone, one core\n\n{table(result)}")
    if options.json:
        Path(options.json).write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()
