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

import ctypes
import os
import subprocess
import tempfile
import time
from dataclasses import replace
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
from tables import asked, least, table

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
from jointlaw.native.build import BUILT

FLAGS = ["-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno", "-fno-trapping-math",
         "-Wno-psabi"]  # fmt: skip
PLACES = {"plane": 0.0, "space": None}
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


def once(batch, steps, clock, threads, tangent=False):
    """Nanoseconds per joint of one update."""
    os.environ["JOINTLAW_THREADS"] = threads
    before = clock()
    batch.update(next(steps), tangent=tangent)
    return 1e9 * (clock() - before) / len(batch)


def measure(law: jl.JointLaw, libs: dict[str, ctypes.CDLL], file: Path, rounds: int):
    """Least ns per update: column -> figure."""
    rng, start = np.random.default_rng(1), np.zeros((MOST, law.dim))
    d = rng.normal(0.0, 2e-8, (4, MOST, law.dim))
    d[1::2] = -d[::2]
    d = np.repeat(d, 2, axis=0)  # two steps each way
    start[:, 0] = 1e-6
    file.write_text(table_text(law))

    def in_c(name, tangent):
        lib, steps, batch = libs[name], cycle(d), law.joints(MOST, ledger=False)
        read = ctypes.c_void_p(lib.jlaw_read(str(file).encode(), None, 0))
        batch.update(start, tangent=False)
        loop, states = lib.many if name == "many" else lib.loop, batch.snapshot().values.copy()
        return lambda: loop(read, states.ctypes.data, next(steps).ctypes.data, MOST, tangent)

    def in_python(ledger, tangent):
        batch = law.joints(MOST, ledger=ledger)
        batch.update(start, tangent=False)
        return partial(once, batch, cycle(d), time.thread_time, "1", tangent)

    cases = {
        "C F, no ledger": in_c("bare", False),
        "C F": in_c("C", False),
        "C FC": in_c("C", True),
        "many F": in_c("many", False),
        "many FC": in_c("many", True),
        "batch F": in_python(False, False),
        "batch F + ledger": in_python(True, False),
        "batch FC + ledger": in_python(True, True),
    }
    return least(cases, rounds)


def beyond_the_cache(rounds):
    """Rows: ns per joint of batches of 1e3 to 1e6 joints at "balanced", on one and two threads."""
    rows = []
    for n in (1000, 10_000, 100_000, 1_000_000):
        cells = []
        for plane in PLACES.values():
            law = replace(jl.presets.load("westerly-smooth"), resolution="balanced", plane=plane)
            batch, rng = law.joints(n, ledger=False), np.random.default_rng(1)
            d = rng.normal(0.0, 2e-8, (n, law.dim))
            batch.update(d + 1e-6 * np.eye(law.dim)[0], tangent=False)
            cases = {threads: partial(once, batch, cycle([d, -d]), time.perf_counter, threads)
                     for threads in "12"}  # fmt: skip
            best = least(cases, max(rounds * 10_000 // n, 6))
            cells += [f"{batch.bytes_per_joint * n / 1e6:.1f}"]
            cells += [f"{ns:.0f}" for ns in best.values()]
        rows.append([n, *cells])
    return rows


def main() -> None:
    """Print the table."""
    options = asked(__doc__, cc="cc", joints=False, rounds=60)
    if options.joints:
        head = [f"{place}: {what}" for place in PLACES for what in ("MB", "1 thread", "2 threads")]
        print(table(["joints", *head], beyond_the_cache(options.rounds)))
        return
    preset, rows = jl.presets.load("westerly-smooth"), []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        libs = {"C": library(folder, options.cc),
                "bare": library(folder, options.cc, "-DJOINTLAW_NO_DISSIPATION"),
                "many": library(folder, options.cc, "-DJOINTLAW_MANY")}  # fmt: skip
        for resolution in ("fast", "balanced", "fine"):
            for where, plane in PLACES.items():
                law = replace(preset, resolution=resolution, plane=plane)
                best = measure(law, libs, folder / "law.jlaw", options.rounds)
                sizes = [law.tables.sliders, 8 * law.state_size]
                rows.append(
                    [f"{resolution}, {where}", *sizes, *(f"{ns:.0f}" for ns in best.values())]
                )
    print(table(["resolution", "sliders", "bytes of state", *best], rows))


if __name__ == "__main__":
    main()
