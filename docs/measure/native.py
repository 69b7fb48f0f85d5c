"""Time of one update in C, in batches of Python, and on a graphics processor (GPU).

python docs/measure/native.py updates [--cc clang] [--rounds 60]
python docs/measure/native.py batch-size [--rounds 60]
python docs/measure/native.py joint-lists [--rounds 60]
python docs/measure/native.py graphics FOLDER [--preset westerly-rough] [--joints 1000000]
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
from common import ROOT, print_table, run_command, shortest_times

import jointlaw as jl
from jointlaw.hosts.c.export import table_text
from jointlaw.native.build import BUILT

COMPILER_FLAGS = ["-O3", "-march=native", "-ffp-contract=off", "-fno-math-errno",
                  "-fno-trapping-math", "-Wno-psabi"]  # fmt: skip
PLANES = {"plane": 0.0, "space": None}
BATCH_SIZE = 4000  # joints
GPU_STEPS = 50
COMPARED_JOINTS = 2000  # on the GPU and in Python; the other joints repeat their steps
THREADS_PER_BLOCK = 128
TIMING_SOURCE = (
    f"#define BATCH_SIZE {BATCH_SIZE}\n"
    + """
#define _POSIX_C_SOURCE 199309L
#define JOINTLAW_IMPLEMENTATION
#include "jointlaw.h"
#include <time.h>
static double thread_time(void)
{
  struct timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e9 * (double) t.tv_sec + (double) t.tv_nsec;
}
double update_each(const jlaw_law *law, double *states, const double *d, long n, int tangent)
{
  const int rows = jlaw_state_size(law), dim = jlaw_dim(law);
  double F[3], C[9];
  char message[JLAW_MESSAGE];
  const double start = thread_time();
  for (long i = 0; i < n; i++, states += rows, d += dim)
    if (jlaw_update(law, states, states, d, F, tangent ? C : NULL, message, sizeof message))
      return -1;
  return (thread_time() - start) / (double) n;
}
double update_many(const jlaw_law *law, double *states, const double *d, long n, int tangent)
{
  static double F[3 * BATCH_SIZE], C[9 * BATCH_SIZE];
  const size_t rows = (size_t) jlaw_state_size(law), count = (size_t) n;
  const double start = thread_time();
  if (jlaw_update_many(law, states, rows, d, F, tangent ? C : NULL, count) != count) return -1;
  return (thread_time() - start) / (double) n;
}
"""
)


def updates(cc="cc", rounds=60):
    """Nanoseconds per joint and update in C and in a batch of Python, at named resolutions.

    Each figure is the shortest of many rounds taken in turn, in processor time of one thread, so
    that other programs count little. C: `jlaw_update`, one joint at a time as in a pair loop; many:
    `jlaw_update_many`; both built with the flags of the exported Makefile. batch:
    `JointBatch.update` of all joints. F: traction alone, FC: with tangent. Steps are random around
    a closure of 1 um. Three minutes.
    """
    preset = jl.presets.load("westerly-smooth")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        libraries = {
            "C": timing_library(folder, cc),
            "no dissipation": timing_library(folder, cc, "-DJOINTLAW_NO_DISSIPATION"),
            "many": timing_library(folder, cc, "-DJOINTLAW_MANY"),
        }
        for resolution in ("fast", "balanced", "fine"):
            for place, plane in PLANES.items():
                law = replace(preset, resolution=resolution, plane=plane)
                times = update_times(law, libraries, folder / "law.jlaw", rounds)
                sizes = [law.tables.sliders, 8 * law.state_size]
                cells = [f"{ns:.0f}" for ns in times.values()]
                rows.append([f"{resolution}, {place}", *sizes, *cells])
    print_table(["resolution", "sliders", "bytes of state", *times], rows)


def timing_library(folder, cc, *flags):
    """Compile TIMING_SOURCE with these flags beside the usual ones, and load it."""
    source = folder / "timing.c"
    target = folder / f"{'-'.join(['timing', *flags])}.so"
    source.write_text(TIMING_SOURCE)
    command = [cc, "-std=c99", *COMPILER_FLAGS, *flags, "-shared", "-fPIC", f"-I{BUILT}"]
    subprocess.run([*command, str(source), "-o", str(target), "-lm"], check=True)
    library = ctypes.CDLL(str(target))
    library.jlaw_read.restype = ctypes.c_void_p
    library.jlaw_state_size.argtypes = [ctypes.c_void_p]
    for function in (library.update_each, library.update_many):
        function.restype = ctypes.c_double
        function.argtypes = [*[ctypes.c_void_p] * 3, ctypes.c_long, ctypes.c_int]
    return library


def update_times(law, libraries, file, rounds):
    """Shortest times (ns) per joint and update, by column of the table."""
    rng = np.random.default_rng(1)
    increments = rng.normal(0.0, 2e-8, (4, BATCH_SIZE, law.dim))
    increments[1::2] = -increments[::2]
    increments = np.repeat(increments, 2, axis=0)  # two steps forward, two back
    closing = np.zeros((BATCH_SIZE, law.dim))
    closing[:, 0] = 1e-6
    file.write_text(table_text(law))

    def in_c(name, tangent):
        library = libraries[name]
        steps = cycle(increments)
        batch = law.joints(BATCH_SIZE, track_dissipation=False)
        batch.update(closing, tangent=False)
        states = batch.snapshot().values.copy()
        c_law = ctypes.c_void_p(library.jlaw_read(str(file).encode(), None, 0))
        update = library.update_many if name == "many" else library.update_each
        return lambda: update(c_law, states.ctypes.data, next(steps).ctypes.data, BATCH_SIZE,
                              tangent)  # fmt: skip

    def in_python(track_dissipation, tangent):
        batch = law.joints(BATCH_SIZE, track_dissipation=track_dissipation)
        batch.update(closing, tangent=False)
        return partial(batch_time, batch, cycle(increments), time.thread_time, "1", tangent)

    cases = {
        "C F, no dissipation": in_c("no dissipation", False),
        "C F": in_c("C", False),
        "C FC": in_c("C", True),
        "many F": in_c("many", False),
        "many FC": in_c("many", True),
        "batch F": in_python(False, False),
        "batch F + dissipation": in_python(True, False),
        "batch FC + dissipation": in_python(True, True),
    }
    return shortest_times(cases, rounds)


def batch_time(batch, steps, clock, threads, tangent=False):
    """Nanoseconds per joint of one update."""
    os.environ["JOINTLAW_THREADS"] = threads
    start = clock()
    batch.update(next(steps), tangent=tangent)
    return 1e9 * (clock() - start) / len(batch)


def batch_size(rounds=60):
    """Nanoseconds per joint in batches of 1e3 to 1e6 joints, on one and two threads.

    Wall-clock time at "balanced": how much it grows when the states exceed the cache.
    """
    rows = []
    for n in (1000, 10_000, 100_000, 1_000_000):
        cells = []
        for plane in PLANES.values():
            law = replace(jl.presets.load("westerly-smooth"), resolution="balanced", plane=plane)
            batch = law.joints(n, track_dissipation=False)
            increment = np.random.default_rng(1).normal(0.0, 2e-8, (n, law.dim))
            batch.update(increment + 1e-6 * np.eye(law.dim)[0], tangent=False)
            steps = increment, -increment
            cases = {
                threads: partial(batch_time, batch, cycle(steps), time.perf_counter, threads)
                for threads in "12"
            }
            times = shortest_times(cases, max(rounds * 10_000 // n, 6))
            cells += [f"{batch.bytes_per_joint * n / 1e6:.1f}"]
            cells += [f"{ns:.0f}" for ns in times.values()]
        rows.append([n, *cells])
    head = [f"{place}: {column}" for place in PLANES for column in ("MB", "1 thread", "2 threads")]
    print_table(["joints", *head], rows)


def joint_lists(rounds=60):
    """Nanoseconds per listed joint of an update with `where`, and ratios to the whole batch.

    The resolution "balanced" in space, and Coulomb's law; traction alone, without the dissipated
    energy, in processor time of one thread; the shortest of many rounds taken in turn. Three
    minutes.
    """
    preset = jl.presets.load("westerly-smooth")
    laws = {
        "balanced": replace(preset, resolution="balanced", plane=None),
        "Coulomb": jl.CoulombLaw(normal_stiffness=1e10, shear_stiffness=5e9, friction=0.6),
    }
    rng = np.random.default_rng(1)
    rows = []
    for law_name, law in laws.items():
        for n in (300, 2000, 20_000, 100_000, 1_000_000):
            batch = law.joints(n, track_dissipation=False)
            increment = rng.normal(0.0, 2e-8, (n, law.dim))
            batch.update(increment + 1e-6 * np.eye(law.dim)[0], tangent=False)
            permutation = rng.permutation(n)
            lists = {
                "all, no `where`": None,
                "all, in order": np.arange(n),
                "1 in 50 left out": np.sort(permutation[n // 50 :]),
                "all, any order": permutation,
                "half, in order": np.sort(permutation[: n // 2]),
                "half, any order": permutation[: n // 2],
                "1 in 8, in order": np.sort(permutation[: n // 8]),
            }
            cases = {
                name: partial(list_time, batch, cycle(listed_steps(increment, where)), where)
                for name, where in lists.items()
            }
            times = shortest_times(cases, max(rounds * 5000 // n, 8))
            whole, *others = times.values()
            ratios = (f"{ns:.0f} ({ns / whole:.2f})" for ns in others)
            rows.append([law_name, n, f"{whole:.0f}", *ratios])
    print_table(["law", "joints", *lists], rows)


def listed_steps(increment, where):
    """Increments of the listed joints, forward and back."""
    listed = increment if where is None else increment[where]
    return listed, -listed


def list_time(batch, steps, where):
    """Nanoseconds per listed joint of one update on one thread."""
    os.environ["JOINTLAW_THREADS"] = "1"
    d = next(steps)
    start = time.thread_time()
    batch.update(d, where=where, tangent=False)
    return 1e9 * (time.thread_time() - start) / len(d)


def graphics(folder: Path, preset="westerly-rough", joints=1_000_000):
    """The kernel of docs/native.md on a GPU, compared with the law in Python.

    Exports the law into FOLDER and prints the largest difference of the traction in random steps
    in space, over the largest traction, and the time per joint and step. Needs CuPy.
    """
    import cupy  # few machines have it
    from cupyx.profiler import benchmark

    law = jl.presets.load_any(preset)
    batch = law.joints(COMPARED_JOINTS)
    rng = np.random.default_rng(0)
    increments = law.closure_range * rng.normal(0.0, 0.05, (GPU_STEPS, COMPARED_JOINTS, 3))
    increments[0, :, 0] = law.closure_range * rng.uniform(0.3, 0.8, COMPARED_JOINTS)
    jl.export_c(law, folder, "rock")
    page = (ROOT / "docs" / "native.md").read_text(encoding="utf-8")
    source = page.partition('RawModule(code=r"""\n')[2].partition('\n"""')[0]
    module = cupy.RawModule(code=source, options=(f"-I{folder}", f"-DLAW={law.fingerprint}"))
    advance = module.get_function("advance")
    states = cupy.zeros((law.state_size, joints))
    d = cupy.zeros((joints, 3))
    F = cupy.zeros((joints, 3))
    blocks = -(-joints // THREADS_PER_BLOCK)
    call = (blocks,), (THREADS_PER_BLOCK,), (states, d, F, np.int32(joints))
    gpu_tractions = []
    python_tractions = []
    for increment in increments:
        d[:] = cupy.asarray(np.resize(increment, (joints, 3)))
        advance(*call)
        gpu_tractions.append(F[:COMPARED_JOINTS].get())
        python_tractions.append(batch.update(increment, tangent=False)[0])
    difference = np.abs(np.subtract(gpu_tractions, python_tractions)).max()
    seconds = benchmark(advance, call, n_repeat=20).gpu_times.min()
    device = cupy.cuda.runtime.getDeviceProperties(0)["name"].decode()
    print(
        f"{preset}, {joints} joints of {8 * law.state_size} bytes: traction within "
        f"{difference / np.abs(python_tractions).max():.1e} of the largest in {GPU_STEPS} steps, "
        f"{1e9 * seconds / joints:.2g} ns per joint and step on {device}"
    )


if __name__ == "__main__":
    run_command(__doc__, updates, batch_size, joint_lists, graphics)
