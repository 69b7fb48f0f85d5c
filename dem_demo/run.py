"""Run a scene to its end and write what a user wants to see."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np
from tqdm import tqdm

from jointlaw.support.files import replace_file, write_json

from . import picture, plots, report, states
from .energy import COLUMNS
from .interfaces import Refused
from .outcome import outcomes
from .record import Record
from .simulation import Simulation
from .watch import EVERY, Watch

MOST_STEPS = 1e12  # of a run: years


def run(sim: Simulation, folder: Path | None = None, until: float | None = None, pictures=True):
    """Run to `until` (s, default the scene's end); writes into `folder` if given.

    Returns (record, summary). A state that the method cannot carry raises Refused and leaves the
    last good one in `folder`/refused, from where the run can be repeated or resumed. Raises
    ValueError, before the first step, for an `until` that cannot be reached and for a scene that
    cannot be saved.
    """
    scene, steps = sim.scene, steps_to(sim, until)
    if folder:
        states.text_of(scene)
        folder.mkdir(parents=True, exist_ok=True)
    record, watch = Record(sim), Watch(sim)
    record.take(sim)
    started, good, first_step = time.perf_counter(), sim.state(), sim.n
    every = max(round(min(scene.run.record / sim.dt, steps + 1)), 1)
    worst, summary = 0.0, {}
    try:
        for i in tqdm(range(1, steps + 1), desc=scene.title, disable=not sys.stderr.isatty()):
            sim.step()
            if i % EVERY == 0 and watch.waiting:
                watch.look(sim)
            if i % every == 0 or i == steps:
                record.take(sim)
                good = sim.state()
                worst = max(worst, abs(sim.ledger.error))
    except Refused as trouble:
        if folder:
            sim.save(folder / "refused", good)
            replace_file(folder / "refused" / "why.txt", f"{trouble}\n".encode())
            write(record, {"refused": str(trouble)}, folder, False)
            raise Refused(f"{trouble}\nThe last good state is in {folder / 'refused'}") from None
        raise
    wall = time.perf_counter() - started
    summary = {
        "scene": scene.title,
        "model_time_s": sim.time,
        "steps": sim.n - first_step,
        "time_step_s": sim.dt,
        "step_limit_s": sim.least_limit,
        "safety_factor": sim.least_limit / sim.dt,
        "started_in_equilibrium": bool(sim.balanced),
        "law_points": sim.joints.n,
        "energy_J": {c: sim.ledger.value[c] for c in COLUMNS},
        "energy_error": sim.ledger.error,
        "largest_energy_error": worst,
        "slip": watch.report(),
        "rocks": outcomes(record),
        "wall_time_s": wall,
    }
    if folder:
        sim.save(folder / "state")
        write(record, summary, folder, pictures)
    return record, summary


def steps_to(sim: Simulation, until: float | None = None) -> int:
    """Steps from now to a model time (s), by default the scene's end: none if that is past.

    Raises ValueError for a time given that is past, not finite, or out of reach.
    """
    end = sim.scene.run.end if until is None else until
    if until is not None and not sim.time - 0.5 * sim.dt <= until < np.inf:
        raise ValueError(f"until = {until} s: must be finite and >= the time now, {sim.time:.6g} s")
    steps = max((end - sim.time) / sim.dt, 0.0)
    if not steps <= MOST_STEPS:
        raise ValueError(
            f"end = {end:g} s: {steps:.3g} steps of {sim.dt:.3g} s; must be <= {MOST_STEPS:g}"
        )
    return round(steps)


def write(record: Record, summary: dict, folder: Path, pictures: bool) -> None:
    """All files of a run."""
    folder.mkdir(parents=True, exist_ok=True)
    record.write(folder)
    write_json(folder / "summary.json", summary)
    if pictures:
        plots.energy(record, folder / "energy.png")
        if record.scene.watch.get("slip") or record.scene.watch.get("shear"):
            plots.curves(record, folder / "curves.png", summary["slip"])
        if record.scene.rocks:
            report.report(record, folder / "report.png")
            picture.motion(record, folder / "motion.gif", report.frame)
        else:
            picture.final(record, folder / "final.png", summary["slip"])
            picture.motion(record, folder / "motion.gif")
