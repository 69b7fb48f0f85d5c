"""Time of one update in C, beside the compiled batch of Python.

    python docs/measure/native.py              the table of docs/native.md, two minutes
    python docs/measure/native.py --cc clang   with another compiler

Each figure is the least of many short rounds, taken in turn, in nanoseconds of one thread's own
time per joint and update, so that other programs count little. C: `jlaw_update`, one joint at a
time as in a pair loop, built with the flags of the Makefile. batch: `JointBatch.update` of all
joints. F: traction alone, FC: with tangent. Steps are random around a closure of 1 um.
"""

import argparse
import ctypes
import os
import subprocess
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import jointlaw as jl
from jointlaw.hosts.c.export import include_dir, table_text

os.environ["JOINTLAW_THREADS"] = "1"
FLAGS = ["-O3", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math", "-Wno-psabi"]
CASES = [  # resolution, plane
    (jl.Resolution(1, 3, 2), 0.0),
    (jl.Resolution(1, 3, 2), None),
    (jl.Resolution(2, 3, 4), 0.0),
    (jl.Resolution(2, 3, 4), None),
]
COLUMNS = {  # of the table, and what was measured
    "C F": "C F",
    "C F, no ledger": "bare F",
    "C FC": "C FC",
    "batch F": "batch F",
    "batch F + ledger": "batch + ledger F",
    "batch FC + ledger": "batch + ledger FC",
}
LOOP = """
#define _POSIX_C_SOURCE 199309L
#define JOINTLAW_IMPLEMENTATION
#include "jointlaw.h"
#include <time.h>
static double now(void)
{
  struct timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e9 * (double) t.tv_sec + (double) t.tv_nsec;
}
double loop(const jlaw_law *law, double *states, const double *d, long n, int tangent)
{
  const int rows = jlaw_state_size(law), dim = jlaw_dim(law);
  double F[3], C[9];
  char message[JLAW_MESSAGE];
  const double start = now();
  for (long i = 0; i < n; i++, states += rows, d += dim)
    if (jlaw_update(law, states, states, d, F, tangent ? C : NULL, message, sizeof message))
      return -1;
  return (now() - start) / (double) n;
}
"""


def library(folder: Path, cc: str, *flags: str) -> ctypes.CDLL:
    """The loop, compiled."""
    name = "-".join(["loop", *flags]).replace("/", "")
    source, target = folder / "loop.c", folder / f"{name}.so"
    source.write_text(LOOP)
    command = [cc, "-std=c99", *FLAGS, *flags, "-shared", "-fPIC", f"-I{include_dir()}"]
    subprocess.run([*command, str(source), "-o", str(target), "-lm"], check=True)
    lib = ctypes.CDLL(str(target))
    lib.loop.restype = ctypes.c_double
    lib.jlaw_read.restype = ctypes.c_void_p
    lib.loop.argtypes = [*[ctypes.c_void_p] * 3, ctypes.c_long, ctypes.c_int]
    return lib


def measure(law: jl.JointLaw, libs: dict[str, ctypes.CDLL], folder: Path, n: int, rounds: int):
    """Least ns per update: name -> figure."""
    rng, dim = np.random.default_rng(1), law.tables.dim
    d = rng.normal(0.0, 2e-8, (4, n, dim))
    d[1::2] = -d[::2]
    start = np.zeros((n, dim))
    start[:, 0] = 1e-6
    batches = {"batch": law.joints(n, ledger=False), "batch + ledger": law.joints(n)}
    for batch in batches.values():
        batch.update(start, tangent=False)
    file = folder / "law.jlaw"
    file.write_text(table_text(law))
    laws = {name: ctypes.c_void_p(lib.jlaw_read(str(file).encode(), None, 0))
            for name, lib in libs.items()}  # fmt: skip
    states = {name: batches["batch"].snapshot().values.copy() for name in libs}
    best: dict[str, float] = {}

    def note(name: str, ns: float) -> None:
        best[name] = min(best.get(name, np.inf), ns)

    for k in range(rounds):
        step = d[k % 4]
        for tangent, column in ((False, "F"), (True, "FC")):
            for name, lib in libs.items():
                ns = lib.loop(laws[name], states[name].ctypes.data, step.ctypes.data, n, tangent)
                note(f"{name} {column}", ns)
            for name, batch in batches.items():
                before = time.thread_time()
                batch.update(step, tangent=tangent)
                note(f"{name} {column}", 1e9 * (time.thread_time() - before) / n)
    return best


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cc", default="cc", help="the C compiler")
    parser.add_argument("--joints", type=int, default=4000, help="of a batch")
    parser.add_argument("--rounds", type=int, default=60, help="of which the least counts")
    options = parser.parse_args()
    preset = jl.presets.load("westerly-smooth")
    print("| sliders | bytes of state |", *(f" {name} |" for name in COLUMNS), sep="")
    print("|---" * (2 + len(COLUMNS)) + "|")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        libs = {"C": library(folder, options.cc),
                "bare": library(folder, options.cc, "-DJOINTLAW_NO_LEDGER")}  # fmt: skip
        for resolution, plane in CASES:
            law = replace(preset, resolution=resolution, plane=plane)
            t = measure(law, libs, folder, options.joints, options.rounds)
            where = "space" if plane is None else "plane"
            cells = [f"{t[key]:.0f}" for key in COLUMNS.values()]
            print(
                f"| {law.tables.sliders} ({where}) | {8 * law.state_size} | {' | '.join(cells)} |"
            )


if __name__ == "__main__":
    main()
