"""Regenerate the tables of docs/extremes.md by running the stability suite at full length.

`python docs/make_extremes.py [PART ...]`: all parts take about ten minutes on one core. A part is
what stands between its two marks in the page; all laws of the part `matrix` go to
docs/data/extremes.csv, the worst of them to the page. The measures are those that
tests/verification/test_extremes_*.py asserts.
"""

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests" / "verification"))

import re  # noqa: E402
import time  # noqa: E402

import numpy as np  # noqa: E402
from _pages import DATA, fill, load, save, table  # noqa: E402
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
SEEDS = range(20_000, 20_550)
JOINTS, PATH = 64, 32  # of each fuzzed law


def verdict(faults):
    return "refused when built" if faults is None else "; ".join(faults[:2]) or "holds"


EXTREMES = DATA / "extremes.csv"
COLUMNS = ("extreme", "every check after every step", "slope / bound", "halving 16 to 128 steps",
           "units, F", "units, energy", "quarter turn", "pairs that hold")  # fmt: skip


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


def worst_rows():
    """The worst of each check over all laws of docs/data/extremes.csv."""
    laws = load(EXTREMES)
    faults = [law for law in laws if law[COLUMNS[1]] not in ("holds", "refused when built")]
    rows = [[COLUMNS[1], f"holds in {len(laws) - len(faults)} of {len(laws)}", ""]]
    for column in COLUMNS[2:-1]:
        # of a change on halving the steps, the last
        found = {law["extreme"]: law[column].split(" to ")[-1] for law in laws if law[column]}
        at = max(found, key=lambda name: float(found[name]))
        rows.append([column, found[at], at])
    pairs = np.array([[int(n) for n in re.findall(r"\d+", law[COLUMNS[-1]] + ", 0")[:3]]
                      for law in laws if law[COLUMNS[-1]]])  # fmt: skip
    hold, count, refused = pairs.sum(axis=0) // 2  # each pair is in two rows
    rows.append([COLUMNS[-1], f"{hold} of {count}, {refused} refused when built", ""])
    return rows


def matrix_text():
    save(EXTREMES, [dict(zip(COLUMNS, row, strict=True)) for row in matrix_rows()])
    return table(["check", "worst", "at"], worst_rows())


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
    for name, test in (("closure test", control.close), ("direct shear", control.shear)):
        laws = [jl.presets.load(preset) for preset in jl.presets.names()]
        misses = [test(law, stress)[0] for law in laws for stress in control.STRESSES]
        kept = [miss for miss in misses if miss is not None]
        rows.append([name, len(misses), len(misses) - len(kept), f"{max(kept):.0e}"])
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
        gained = impact.gains(0.5, share, 4000)[0]
        rows.append([*row, f"{gained.min():+.1e} to {gained.max():+.1e}"])
    return rows


def drift_rows():
    found = np.array([drift.drift(changes, CYCLES) for changes in drift.LAWS.values()])
    settled, force, loss = np.moveaxis(found, 1, 0)  # (laws, amplitudes)
    return [
        [amplitude, f"{settled[:, k].min():.0f} to {settled[:, k].max():.0f}",
         f"{force[:, k].max():.0e}", f"{loss[:, k].max():.0e}"]
        for k, amplitude in enumerate(drift.AMPLITUDES)
    ]  # fmt: skip


def forgetting_rows():
    counts, amplitude, rows = (1, 10, 100, 1000, 10_000), 1e-2, []
    for depth in (1, 2, 3, 10, 24):
        rows.append([depth, *drift.forgetting(counts, depth, amplitude)])
    left = drift.in_the_bed(counts[:4], amplitude)
    rows.append(["4000 springs", *left, left[-1]])  # for it forgets once
    return [[name, *(f"{share:.4f}" for share in shares)] for name, *shares in rows]


def main():
    parts = {
        "matrix": matrix_text,
        "fuzz": fuzz_text,
        "exact": lambda: table(["a", "mu", "lam", "cells", "largest error of F"], exact_rows()),
        "control": lambda: table(
            ["test", "runs", "stopped", "largest miss"], control_rows()),
        "forgetting": lambda: table(
            ["cells", "1 cycle", "10", "100", "1000", "10 000"],
            forgetting_rows()),
        "dynamics": lambda: table(
            ["case", "of the critical step", "steps", "above the first energy",
             "growth after a tenth", "reach / bound"], dynamics_rows()),
        "impact": lambda: table(
            ["of the critical step", "samples of an impact", "change of energy"], impact_rows()),
        "drift": lambda: table(
            ["amplitude / closure", "cycles to shake down", "F, of its peak",
             "loss per cycle, of the peak energy"], drift_rows()),
    }  # fmt: skip
    for key in sys.argv[1:] or parts:
        begun = time.perf_counter()
        made = parts[key]()
        print(f"{key}: {time.perf_counter() - begun:.0f} s", flush=True)
        fill("extremes.md", key, made)


if __name__ == "__main__":
    np.seterr(all="raise", under="ignore")
    main()
