"""Run a scene to its end and write what a user wants to see."""

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from jointlaw.support.files import clear_run, replace_file, write_json
from jointlaw.support.pyplot import FORMATS

from ..dynamics.energy import COLUMNS
from ..dynamics.saved_states import require_text
from ..dynamics.simulation import Simulation
from ..errors import Refused
from . import curves, frames, rock_report
from .interrupt import interruptible
from .monitors import LOOKS
from .outcome import outcomes, slip_per_cycle
from .record import Record

MOST_STEPS = 1e12  # of a run: years
VERSION = 1  # of summary.json
TABLES = ("history.csv", "blocks.csv", "joints.csv", "history.npz")


def run(
    sim: Simulation, folder: Path | None = None, until: float | None = None,
    pictures: bool = True, picture_format: str = FORMATS[0], vtk: bool = False,
):  # fmt: skip
    """Run to `until` (s, default the scene's end); writes into `folder` if given.

    vtk: VTK files too, which needs meshio.
    Returns (record, summary). A state that the method cannot carry raises Refused and leaves the
    last good one in `folder`/refused, from where the run can be repeated or resumed. Ctrl-C stops
    it after a step, writes what there is and raises KeyboardInterrupt. Results of another run in
    `folder` are replaced whole. Raises ValueError, before the first step, for an `until` that
    cannot be reached and for a scene that cannot be saved.
    """
    steps_to(sim, until)
    if folder:
        require_text(sim.scene)
        folder.mkdir(parents=True, exist_ok=True)
    started, first_step, record = time.perf_counter(), sim.now.n, Record(sim)
    interrupted = False
    try:
        play(sim, record, until)
    except Refused as trouble:
        if not folder:
            raise
        refused = folder / "refused"
        clear_run(folder)
        sim.save(refused, record.state)
        replace_file(refused / "why.txt", f"{trouble}\n".encode())
        write(record, {"version": VERSION, "refused": str(trouble)}, folder, None, vtk)
        raise Refused(f"{trouble}\nThe last good state is in {refused}") from None
    except KeyboardInterrupt:
        interrupted = True
    wall, now = time.perf_counter() - started, sim.now
    summary = {
        "version": VERSION,
        "scene": sim.scene.title,
        "model_time_s": sim.time,
        "steps": now.n - first_step,
        "time_step_s": now.dt,
        "step_limit_s": now.limit.least,
        "time_step_margin": now.limit.least / now.dt,
        "started_in_equilibrium": bool(sim.balanced),
        "law_points": sim.joints.n,
        "energy_J": {c: now.ledger.value[c] for c in COLUMNS},
        "energy_error": now.ledger.error,
        "largest_energy_error": record.largest_error,
        "slip": record.slips.report(),
        "slip_per_cycle_m": slip_per_cycle(record),
        "rocks": outcomes(record),
        "wall_time_s": wall,
        "interrupted": interrupted,
    }
    if folder:
        clear_run(folder)
        sim.save(folder / "state")
        write(record, summary, folder, picture_format if pictures else None, vtk)
    if interrupted:
        where = f"; go on: python -m dem_demo resume {folder / 'state'} --out NEW" if folder else ""
        raise KeyboardInterrupt(f"interrupted at {sim.time:.4g} s of model time{where}")
    return record, summary


def play(
    sim: Simulation,
    record: Record,
    until: float | None = None,
    stop: Callable[[Record], bool] = lambda record: False,
) -> None:
    """Step to `until` (s), or to where `stop` says so, and record on the way. Raises Refused.

    After Ctrl-C the present is the last frame and KeyboardInterrupt is raised.
    """
    steps = steps_to(sim, until)
    every = max(round(min(sim.scene.run.record / sim.now.dt, steps + 1)), 1)
    title, quiet = sim.scene.title, not sys.stderr.isatty()
    with interruptible() as interrupted:
        for i in tqdm(range(1, steps + 1), desc=title, disable=quiet):
            sim.step()
            if i % LOOKS == 0:
                record.slips.look(sim)
            if i % every == 0 or i == steps or interrupted():
                record.take(sim)
                if interrupted():
                    raise KeyboardInterrupt
                if stop(record):
                    break


def steps_to(sim: Simulation, until: float | None = None) -> int:
    """Steps from now to a model time (s), by default the scene's end: none if that is past.

    Raises ValueError for a time given that is past, not finite, or out of reach.
    """
    now, dt, end = sim.time, sim.now.dt, sim.scene.run.end if until is None else until
    if until is not None and not now - 0.5 * dt <= until < np.inf:
        raise ValueError(f"until = {until} s: must be finite and >= the time now, {now:.6g} s")
    steps = max((end - now) / dt, 0.0)
    if not steps <= MOST_STEPS:
        raise ValueError(
            f"end = {end:g} s: {steps:.3g} steps of {dt:.3g} s; must be <= {MOST_STEPS:g}"
        )
    return round(steps)


def write(
    record: Record, summary: dict[str, Any], folder: Path, picture_format: str | None, vtk: bool
) -> None:
    """All files of a run: numbers before pictures, which take longest; None: no pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = _pictures(record, summary, picture_format) if picture_format else {}
    write_json(folder / "summary.json", {**summary, "files": [*TABLES, *pictures]})
    record.write(folder)
    for name, draw in pictures.items():
        draw(folder / name)
    if vtk:
        from .vtk import write as write_vtk  # loads meshio

        write_vtk(record, folder / "vtk")


def _pictures(
    record: Record, summary: dict[str, Any], picture_format: str
) -> dict[str, Callable[[Path], None]]:
    """The pictures of a run: what draws each to a path."""
    drawn = {"energy": partial(curves.energy, record)}
    if record.scene.monitors.shear:
        drawn["curves"] = partial(curves.shear, record)
    elif record.scene.monitors.slip:
        drawn["curves"] = partial(curves.tilt, record, slips=summary["slip"])
    if record.scene.rocks:
        drawn["report"], frame = partial(rock_report.report, record), rock_report.frame
        drawn["final"] = partial(rock_report.final, record)
    else:
        drawn["final"], frame = partial(frames.final, record, slips=summary["slip"]), frames.frame
    named = {f"{name}.{picture_format}": draw for name, draw in drawn.items()}
    return {**named, "motion.gif": partial(frames.animation, record, draw_frame=frame)}
