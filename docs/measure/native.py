"""Time of one update in C, beside the compiled batch of Python, of the named resolutions.

    python docs/measure/native.py              the first table of docs/native.md, three minutes
    python docs/measure/native.py --cc clang   with another compiler
    python docs/measure/native.py --joints     the second table: when states leave the cache

Each figure is the least of many short rounds, taken in turn, in nanoseconds per joint and update.
In the first table it is the time of one thread, so that other programs count little. C:
`jlaw_update`, one joint at a time as in a pair loop; many: `jlaw_update_many`; both built with the
flags of the exported Makefile. batch: `JointBatch.update` of all joints. F: traction alone, FC:
with tangent. Steps are random around a closure of 1 um. The second table is by the clock.
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
from tables import table

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
from jointlaw.native.build import BUILT

os.environ["JOINTLAW_THREADS"] = "1"
FLAGS = ["-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math",
         "-Wno-psabi"]  # fmt: skip
NAMES, PLACES = ("fast", "balanced", "fine"), {"plane": 0.0, "space": None}
COLUMNS = {  # of the table, and what was measured
    "C F, no ledger": "bare F",
    "C F": "C F",
    "C FC": "C FC",
    "many F": "many F",
    "many FC": "many FC",
    "batch F": "batch F",
    "batch F + ledger": "batch + ledger F",
    "batch FC + ledger": "batch + ledger FC",
}
MOST = 4000  # joints of a batch
LOOP = (
    f"#define MOST {MOST}\n"
    + """
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
double many(const jlaw_law *law, double *states, const double *d, long n, int tangent)
{
  static double F[3 * MOST], C[9 * MOST];
  const size_t rows = (size_t) jlaw_state_size(law), count = (size_t) n;
  const double start = now();
  if (jlaw_update_many(law, states, rows, d, F, tangent ? C : NULL, count) != count) return -1;
  return (now() - start) / (double) n;
}
"""
)


def library(folder: Path, cc: str, *flags: str) -> ctypes.CDLL:
    """The loop, compiled."""
    source, target = folder / "loop.c", folder / f"{'-'.join(['loop', *flags])}.so"
    source.write_text(LOOP)
    command = [cc, "-std=c99", *FLAGS, *flags, "-shared", "-fPIC", f"-I{BUILT}"]
    subprocess.run([*command, str(source), "-o", str(target), "-lm"], check=True)
    lib = ctypes.CDLL(str(target))
    lib.jlaw_read.restype = ctypes.c_void_p
    for function in (lib.loop, lib.many):
        function.restype = ctypes.c_double
        function.argtypes = [*[ctypes.c_void_p] * 3, ctypes.c_long, ctypes.c_int]
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
    loops = {name: lib.many if name == "many" else lib.loop for name, lib in libs.items()}
    states = {name: batches["batch"].snapshot().values.copy() for name in libs}
    best: dict[str, float] = {}

    def note(name: str, ns: float) -> None:
        best[name] = min(best.get(name, np.inf), ns)

    for k in range(rounds):
        step = d[k % 4]
        for tangent, column in ((False, "F"), (True, "FC")):
            for name, loop in loops.items():
                ns = loop(laws[name], states[name].ctypes.data, step.ctypes.data, n, tangent)
                note(f"{name} {column}", ns)
            for name, batch in batches.items():
                before = time.thread_time()
                batch.update(step, tangent=tangent)
                note(f"{name} {column}", 1e9 * (time.thread_time() - before) / n)
    return best


def beyond_the_cache(rounds):
    """Rows: ns per joint of batches of 1e3 to 1e6 joints at "balanced", on one and two threads."""
    rows = []
    for n in (1000, 10_000, 100_000, 1_000_000):
        cells = []
        for plane in PLACES.values():
            law = replace(jl.presets.load("westerly-smooth"), resolution="balanced", plane=plane)
            batch, rng = law.joints(n, ledger=False), np.random.default_rng(1)
            d = rng.normal(0.0, 2e-8, (2, n, law.dim))
            d[1], d[0, :, 0] = -d[0], d[0, :, 0] + 1e-6
            batch.update(d[0], tangent=False)
            d[0] = -d[1]
            best = {"1": np.inf, "2": np.inf}
            for k in range(max(rounds * 10_000 // n, 6)):
                for threads in best:
                    os.environ["JOINTLAW_THREADS"] = threads
                    before = time.perf_counter()
                    batch.update(d[k % 2], tangent=False)
                    took = time.perf_counter() - before
                    best[threads] = min(best[threads], took)
            cells += [f"{batch.bytes_per_joint * n / 1e6:.1f}"]
            cells += [f"{1e9 * took / n:.0f}" for took in best.values()]
        rows.append([n, *cells])
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cc", default="cc", help="the C compiler")
    parser.add_argument("--joints", action="store_true", help="the second table")
    parser.add_argument("--rounds", type=int, default=60, help="of which the least counts")
    options = parser.parse_args()
    if options.joints:
        head = [f"{place}: {what}" for place in PLACES for what in ("MB", "1 thread", "2 threads")]
        print(table(["joints", *head], beyond_the_cache(options.rounds)))
        return
    preset, rows = jl.presets.load("westerly-smooth"), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        libs = {"C": library(folder, options.cc),
                "bare": library(folder, options.cc, "-DJOINTLAW_NO_LEDGER"),
                "many": library(folder, options.cc, "-DJOINTLAW_MANY")}  # fmt: skip
        for resolution in NAMES:
            for where, plane in PLACES.items():
                law = replace(preset, resolution=resolution, plane=plane)
                t = measure(law, libs, folder, MOST, options.rounds)
                sizes = [law.tables.sliders, 8 * law.state_size]
                times = [f"{t[key]:.0f}" for key in COLUMNS.values()]
                rows.append([f"{resolution}, {where}", *sizes, *times])
    print(table(["resolution", "sliders", "bytes of state", *COLUMNS], rows))


if __name__ == "__main__":
    main()
