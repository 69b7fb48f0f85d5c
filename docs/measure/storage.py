"""Joints that store the forces of their sliders as float: errors, memory and time.

python docs/measure/storage.py errors [--steps 10000] [--joints 64]
python docs/measure/storage.py cost [--rounds 60]
"""

import tempfile
import time
from dataclasses import replace
from functools import partial
from itertools import cycle
from pathlib import Path

import numpy as np
from common import print_table, run_command, shortest_times
from native import BATCH_SIZE, batch_time, timing_library

import jointlaw as jl
from jointlaw.hosts.c.export import table_text

DTYPES = {"double": np.float64, "float": np.float32}
STEP_SIZES = 1e-2, 1e-4, 1e-6  # of the closure range, mean square of a step
CLOSURES = 0.1, 0.6  # of the closure range, of the first and the last joint
REVERSALS = 4


def errors(steps=10_000, joints=64):
    """Largest errors by float storage along many steps, for three sizes of a step.

    Joints of smooth Westerly granite at "balanced" in space are closed, then sheared by random
    steps with a drift that reverses four times, while their closures vary. Each error is the
    largest of all joints: of the traction over the largest traction of the joint, of the change of
    the traction along the path over the largest change, and of the energy that the path dissipates
    over this energy.
    """
    law = replace(jl.presets.load("westerly-smooth"), resolution="balanced")
    rows = []
    for size in STEP_SIZES:
        double, single = (path(law, dtype, size, steps, joints) for dtype in DTYPES.values())
        F, start, lost = double
        largest = np.abs(F).max(axis=(0, 2))
        change = np.abs(F - start).max(axis=(0, 2))
        error = np.abs(single[0] - F).max(axis=(0, 2))
        ledger = np.abs(single[2] - lost) / lost
        figures = (error / largest).max(), (error / change).max(), ledger.max()
        rows.append([f"D/{1 / size:.0f}", *(f"{value:.1e}" for value in figures)])
    head = "size of a step", "traction", "change of the traction", "dissipated energy"
    print_table(head, rows)


def path(law, dtype, size, steps, joints):
    """Tractions (steps, n, 3), tractions before the path (n, 3), energy dissipated by it (n,)."""
    D = law.closure_range
    batch = law.joints(joints, slider_dtype=dtype)
    closure = D * np.linspace(*CLOSURES, joints)
    shear = 0.05 * D * np.ones((joints, 2))
    batch.update(np.column_stack([closure, shear]), tangent=False)
    start = batch.F
    lost = batch.dissipated_energy
    rng = np.random.default_rng(1)
    tractions = np.empty((steps, joints, 3))
    for k in range(steps):
        d = size * D * rng.normal(size=(joints, 3))
        d[:, 0] = 0.1 * (d[:, 0] + closure - batch.delta[:, 0])
        d[:, 1] += 0.5 * size * D * (-1) ** (REVERSALS * k // steps)
        tractions[k], _ = batch.update(d, tangent=False)
    return tractions, start, batch.dissipated_energy - lost


def cost(rounds=60):
    """Bytes of a joint, and nanoseconds per update, with slider forces as double and as float.

    As `native.py updates`: shortest processor times of rounds taken in turn, one thread. C: the
    state of jointlaw.h, and jlaw_update_many. batch: a batch of 4000 joints in Python. Traction and
    dissipated energy; FC: with the tangent.
    """
    preset = jl.presets.load("westerly-smooth")
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        libraries = {
            "double": timing_library(folder, "cc", "-DJOINTLAW_MANY"),
            "float": timing_library(folder, "cc", "-DJOINTLAW_MANY", "-DJOINTLAW_FLOAT_SLIDERS"),
        }
        for resolution in ("fast", "balanced", "fine"):
            law = replace(preset, resolution=resolution)
            (folder / "law.jlaw").write_text(table_text(law))
            cases = {}
            sizes = {}
            for storage, dtype in DTYPES.items():
                batch = law.joints(BATCH_SIZE, slider_dtype=dtype)
                in_c, size = c_case(libraries[storage], folder / "law.jlaw", law)
                sizes[storage] = size, batch.bytes_per_joint
                cases |= {(storage, "C"): in_c}
                for tangent in (False, True):
                    cases |= {(storage, tangent): batch_case(law, dtype, tangent)}
            times = shortest_times(cases, rounds)
            for storage in DTYPES:
                figures = [times[storage, case] for case in ("C", False, True)]
                cells = [f"{ns:.0f}" for ns in figures]
                rows.append([f"{resolution}, {storage}", *sizes[storage], *cells])
    print_table(
        ["resolution, slider forces", "bytes, C", "bytes, batch", "C many F", "batch F",
         "batch FC"], rows)  # fmt: skip


def steps_of(law):
    """Increments of a batch, which go forward and back."""
    increment = np.random.default_rng(1).normal(0.0, 2e-8, (BATCH_SIZE, law.dim))
    return cycle([increment, increment, -increment, -increment])


def batch_case(law, dtype, tangent):
    """A function that advances a batch and returns the nanoseconds per joint."""
    batch = law.joints(BATCH_SIZE, slider_dtype=dtype)
    batch.update(np.tile([1e-6, 0.0, 0.0], (BATCH_SIZE, 1)), tangent=False)
    return partial(batch_time, batch, steps_of(law), time.thread_time, "1", tangent)


def c_case(library, file, law):
    """The same for jlaw_update_many, and the bytes of a state."""
    c_law = library.jlaw_read(str(file).encode(), None, 0)
    rows = library.jlaw_state_size(c_law)
    states = np.zeros((BATCH_SIZE, rows))
    steps = steps_of(law)
    closing = np.tile([1e-6, 0.0, 0.0], (BATCH_SIZE, 1))
    library.update_many(c_law, states.ctypes.data, closing.ctypes.data, BATCH_SIZE, False)

    def update():
        d = next(steps)
        return library.update_many(c_law, states.ctypes.data, d.ctypes.data, BATCH_SIZE, False)

    return update, states.nbytes // BATCH_SIZE


if __name__ == "__main__":
    run_command(__doc__, errors, cost)
