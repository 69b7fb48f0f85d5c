"""Run a scene to its end and write what a user wants to see."""

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from tqdm import tqdm

from jointlaw.support.files import write_json
from jointlaw.support.pyplot import FORMATS

from ..dynamics.energy_balance import ENERGIES
from ..dynamics.simulation import Simulation, require_text
from ..scene import Scene, SceneError, median_size
from .folder import BLOCKS, HISTORY, clear_run
from .monitors import look
from .pictures import Pictures, curves
from .record import Record, named, outcomes

MOST_STEPS = 1e8  # of a run: days for a hundred blocks
LOOKS = 8  # steps between two looks for slip
VERSION = 2  # of summary.json


def run(
    sim: Simulation, folder: Path | None = None, until: float | None = None,
    pictures: str | None = FORMATS[0], vtk: bool = False,
):  # fmt: skip
    """Run to `until` (s, default the scene's end); writes into `folder` if given.

    pictures: their format, None for none; vtk: VTK files too, which needs meshio.
    Returns (record, summary). A state that the method cannot carry raises SceneError, Ctrl-C raises
    KeyboardInterrupt; before, all is written up to the last frame, and the state of then into
    `folder`/refused or `folder`/state, from where the run can be resumed. Results of another run in
    `folder` are replaced whole. Raises ValueError, before the first step, for an `until` that
    cannot be reached and for a scene that cannot be saved.
    """
    steps_to(sim, until)
    if folder:
        require_text(sim.scene)
        folder.mkdir(parents=True, exist_ok=True)
    started, record = time.perf_counter(), Record(sim)
    stopped: BaseException | None = None
    try:
        play(sim, record, until)
    except (SceneError, KeyboardInterrupt) as error:
        stopped = error
    summary = {
        "version": VERSION,
        "scene": sim.scene.title,
        "model_time_s": record.times[-1],
        "steps": record.steps,
        "time_step_s": sim.dt,
        "step_limit_s": sim.limit.lowest,
        "time_step_margin": sim.limit.lowest / sim.dt,
        "started_in_equilibrium": not record.loose.any(),
        "loose": named(sim.scene, record.loose),
        "law_points": sim.joints.n,
        "stresses_of_joints": "effective" if sim.scene.wet else "total",
        "stages_begun_s": [
            time if time < np.inf else None for time in sim.stage_start_times.tolist()
        ],
        "energy_J": dict(zip(ENERGIES, record.energy[-1][:-1], strict=True)),
        "energy_error": record.energy[-1][-1],
        "largest_energy_error": max((abs(row[-1]) for row in record.energy[1:]), default=0.0),
        "slip": list(record.slips.values()),
        "rocks": outcomes(record),
        "wall_time_s": time.perf_counter() - started,
        "stopped": stopped and (str(stopped) or "interrupted"),
    }
    told = summary["stopped"]
    if folder:
        place = folder / ("refused" if isinstance(stopped, SceneError) else "state")
        clear_run(folder)
        sim.save(place, record.state)
        write(record, summary, folder, pictures, vtk)
        told = (
            f"{summary['stopped']}; go on from {record.times[-1]:.4g} s of model time: "
            f"python -m dem_demo resume {place} --out NEW"
        )
    if stopped:
        raise type(stopped)(told) from None
    return record, summary


def play(
    sim: Simulation,
    record: Record,
    until: float | None = None,
    stop: Callable[[Record], bool] = lambda record: False,
) -> None:
    """Step to `until` (s), or to where `stop` says so, and record on the way. Raises SceneError."""
    left, taken, dt = steps_to(sim, until), 0, 0.0
    with tqdm(total=left, desc=sim.scene.title, disable=not sys.stderr.isatty()) as bar:
        while left:
            if sim.dt != dt:  # at the start, and where the time step was halved
                dt, done, left = sim.dt, 0, steps_to(sim, until)
                every = max(round(min(sim.scene.run.record / dt, left + 1)), 1)
                bar.reset(left)
            sim.step()
            taken, done, left = taken + 1, done + 1, left - 1
            bar.update()
            if done % LOOKS == 0:
                look(record.slips, sim)
            if done % every == 0 or left == 0:
                record.take(sim)
                record.steps = taken
                if stop(record):
                    break


def to_failure(scene: Scene, until: float | None) -> tuple[Record, str]:
    """A run to `until` (s, default the scene's end), or until a block has moved by the usual size
    of a block; and why it was refused, if it was: what is recorded by then is kept."""
    sim, size = Simulation(scene), median_size(block for block in scene.blocks if not block.fixed)
    record, refused = Record(sim), ""
    try:
        play(sim, record, until, lambda record: bool(np.nanmax(record.moved) > size))
    except SceneError as error:
        refused = str(error)
    return record, refused


def steps_to(sim: Simulation, until: float | None = None) -> int:
    """Steps from now to a model time (s), by default the scene's end: none if that is past.

    Raises ValueError for a time given that is past, not finite, or out of reach.
    """
    now, dt = sim.time, sim.dt
    end = max(sim.scene.run.end, now) if until is None else until
    steps = (end - now) / dt
    if not -0.5 <= steps <= MOST_STEPS:
        raise ValueError(f"until = {end:g} s: {steps:.3g} steps of {dt:.3g} s from {now:.6g} s; "
                         f"must be from 0 to {MOST_STEPS:g}; units?")  # fmt: skip
    return round(steps)


def write(record: Record, summary: dict, folder: Path, drawn: str | None, vtk: bool) -> None:
    """All files of a run: numbers before pictures, which take longest; drawn: their format."""
    pictures: dict[str, Callable[[Path], None]] = {}
    if drawn:
        of = Pictures(record)
        pictures = {f"final.{drawn}": of.final, "motion.gif": of.animation}
        if record.scene.shear:
            pictures[f"curves.{drawn}"] = partial(curves, record)
    write_json(folder / "summary.json", {**summary, "files": [HISTORY, BLOCKS, *pictures]})
    record.write(folder / HISTORY)
    record.write_blocks(folder / BLOCKS)
    for name, draw in pictures.items():
        draw(folder / name)
    if vtk:
        from .vtk import write as write_vtk  # loads meshio

        write_vtk(record, folder / "vtk")
