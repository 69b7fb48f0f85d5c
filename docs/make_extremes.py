"""Regenerate the tables of docs/extremes.md by running the stability suite at full length.

`python docs/make_extremes.py [PART ...]`: all parts take about ten minutes on one core. A part is
what stands between its two marks in the page. The measures are those of
tests/verification/test_extremes_*.py.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "verification"))

import os  # noqa: E402
import tempfile  # noqa: E402
import time  # noqa: E402

import numpy as np  # noqa: E402
from _pages import fill, table  # noqa: E402
from extremes import (  # noqa: E402
    continuity,
    control,
    drift,
    dynamics,
    exact,
    fuzz,
    impact,
    laws,
    matrix,
    symmetry,
    units,
)

import jointlaw as jl  # noqa: E402

CYCLES = 1_000_000
STEPS = 1_000_000
SEEDS = range(20_000, 20_700)
JOINTS, PATH = 64, 32  # of each fuzzed law


def verdict(faults):
    return "refused when built" if faults is None else "; ".join(faults[:2]) or "holds"


def matrix_rows():
    """One row per extreme: its own checks, units, continuity, and the pairs it is part of."""
    rows = []
    faults = {laws.name(c): matrix.examine(c, s) for s, c in enumerate(laws.pairs())}
    for changes in laws.alone():
        mine = laws.name(changes)
        items = set(map(str, changes.items()))
        partners = [c for c in laws.pairs() if changes and items <= set(map(str, c.items()))]
        in_pairs = [faults[laws.name(c)] for c in partners]
        bad, refused = sum(map(bool, in_pairs)), sum(f is None for f in in_pairs)
        told = f"{len(in_pairs) - bad - refused} of {len(in_pairs)}" if changes else ""
        told += f", {refused} refused" if refused else ""
        if matrix.ends(changes):
            rows.append([mine, "refused when built", "", "", "", "", "", told])
            continue
        force, _, stored, lost = units.compare(changes, *units.DECIMAL)
        slope, gaps = continuity.steepest(changes), continuity.refinement(changes)
        rows.append([
            mine, verdict(matrix.examine(changes, 1)), f"{slope:.3f}",
            f"{gaps[0]:.0e} to {gaps[-1]:.0e}", f"{force:.0e}", f"{max(stored, lost):.0e}",
            f"{symmetry.asymmetry(changes):.0e}", told,
        ])  # fmt: skip
    return rows


def fuzz_text():
    refused, bad = 0, {}
    for seed in SEEDS:
        found = fuzz.fuzz(seed, JOINTS, PATH)
        refused += found is None
        if found:
            bad[seed] = found
    count = (len(SEEDS) - refused) * JOINTS * PATH
    return (
        f"{count} updates of {len(SEEDS) - refused} random laws ({refused} more were refused when "
        f"built, as narrow populations or too steep for a table): {len(bad)} laws with violations. "
        f"{'Seeds ' + ', '.join(map(str, bad)) + '. ' if bad else ''}"
        f"Found on the way, mended and kept as tests: seeds {', '.join(map(str, fuzz.FOUND))}.\n"
    )


def exact_rows():
    worst = {}
    for case in exact.CASES:
        gap = max(exact.gap(case, seed, 24) for seed in range(6))
        key = tuple(case[k] for k in ("a", "mu", "lam", "depth"))
        worst[key] = max(worst.get(key, 0.0), gap)
    return [[*(f"{k:g}" for k in key), f"{gap:.0e}"] for key, gap in worst.items()]


def control_rows():
    rows = []
    for preset in jl.presets.names():
        row = [preset]
        for test in (control.close, control.shear):
            found = [test(jl.presets.load(preset), stress) for stress in control.STRESSES]
            stopped = [reason for miss, reason in found if miss is None]
            row.append(stopped[0] if stopped else f"{max(miss for miss, _ in found):.0e}")
        rows.append(row)
    return rows


def dynamics_rows():
    rows = []
    dynamics.EVERY = 97  # looks at the energy cost more than steps
    for case in dynamics.CASES:
        for share in (0.95, 0.2) if case in dynamics.LOSSLESS_IMPACTS else (0.95,):
            # without bound it grows beyond all numbers: a short run shows it
            steps = 20_000 if case in dynamics.LOSSLESS_IMPACTS and share > 0.5 else STEPS
            above, growth, reached = dynamics.swing(case, steps, share=share)
            rows.append([case, share, steps, f"{above:.0e}", f"{growth:.0e}", f"{reached:.3f}"])
    return rows


def impact_rows():
    rows = []
    for share in (0.95, 0.8, 0.5, 0.2, 0.1, 0.05):
        row = [share, f"{2 / share:.0f}"]
        for contact in (impact.PowerLaw, impact.Flat):
            gained = impact.gains(contact, 0.5, share, 4000)[0]
            row.append(f"{gained.min():+.1e} to {gained.max():+.1e}")
        for contact in (impact.PowerLaw, impact.Flat):
            grown, steps = impact.bouncing(contact, share, STEPS)
            row.append(f"{grown:.1e}" if steps == STEPS else f"beyond 1e6 in {steps} steps")
        rows.append(row)
    return rows


def drift_rows():
    rows = []
    for kind, changes in drift.LAWS.items():
        for amplitude, *found in zip(drift.AMPLITUDES, *drift.drift(changes, CYCLES), strict=True):
            settled, force, loss = found
            rows.append([kind, amplitude, settled, f"{force:.0e}", f"{loss:.0e}"])
    return rows


def forgetting_rows():
    counts, rows = (1, 10, 100, 1000, 10_000), []
    for depth in (1, 2, 3, 10, 24, "springs"):
        for amplitude in (1e-1, 1e-2, 1e-3):
            if depth == "springs":
                left = drift.in_the_bed(counts[:4], amplitude)
                left.append(left[-1])  # for it forgets once
            else:
                left = drift.forgetting(counts, depth, amplitude)
            name = "4000 springs" if depth == "springs" else depth
            rows.append([name, f"{amplitude:g}", *(f"{share:.4f}" for share in left)])
    return rows


def small_steps_rows():
    counts = (10, 1000, 100_000, 1_000_000)
    return [[n, f"{gap:.1e}"] for n, gap in zip(counts, drift.small_steps(counts), strict=True)]


def main():
    parts = {
        "matrix": lambda: table(
            ["extreme", "every check after every step", "slope / bound", "halving 16 to 128 steps",
             "units, F", "units, energy", "quarter turn", "pairs that hold"], matrix_rows()),
        "fuzz": fuzz_text,
        "exact": lambda: table(["a", "mu", "lam", "cells", "largest error of F"], exact_rows()),
        "control": lambda: table(["preset", "closure test", "direct shear"], control_rows()),
        "steps": lambda: table(["steps", "change of F"], small_steps_rows()),
        "forgetting": lambda: table(
            ["cells", "amplitude / closure", "1 cycle", "10", "100", "1000", "10 000"],
            forgetting_rows()),
        "dynamics": lambda: table(
            ["case", "of the critical step", "steps", "above the first energy",
             "growth after a tenth", "reach / bound"], dynamics_rows()),
        "impact": lambda: table(
            ["of the critical step", "samples of an impact", "one impact, bare law",
             "one impact, joint", "1e6 steps, bare law", "1e6 steps, joint"], impact_rows()),
        "drift": lambda: table(
            ["law", "amplitude / closure", "cycles to shake down", "F, of its peak",
             "loss per cycle, of the peak energy"], drift_rows()),
    }  # fmt: skip
    for key in sys.argv[1:] or parts:
        begun = time.perf_counter()
        made = parts[key]()
        print(f"{key}: {time.perf_counter() - begun:.0f} s", flush=True)
        fill("extremes.md", key, made)


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["JOINTLAW_REPLAY_DIR"] = folder
        main()
