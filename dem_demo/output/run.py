"""Run a scene to its end, and write its files."""

import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tqdm import tqdm

from jointlaw.support.files import SUMMARY, write_json
from jointlaw.support.pyplot import FORMATS

from ..dynamics.energy_balance import ENERGIES
from ..dynamics.simulation import Simulation, require_text
from ..scene import Scene, SceneError, median_size
from .folder import BLOCKS, HISTORY, LAST_VALID_STATE, STATE, clear_run
from .monitors import update_slip_monitors
from .pictures import Pictures, curves
from .record import RunRecord, bolt_summary, list_blocks, outcomes

MAX_STEPS = 1e8  # of a run: days for a hundred blocks
SLIP_CHECK_INTERVAL = 8  # steps
SUMMARY_VERSION = 4


def run(
    sim: Simulation, folder: Path | None = None, until: float | None = None,
    pictures: str | None = FORMATS[0], vtk: bool = False,
) -> tuple[RunRecord, dict]:  # fmt: skip
    """Run a simulation, and write its files into a folder.

    folder: for the files, None to write none; results of another run in it are replaced. until:
    model time (s), by default the end of the scene. pictures: their format, None for no pictures.
    vtk: whether to write VTK files too, which needs meshio.

    Returns record and summary. Raises SceneError for a state that the method cannot continue from,
    and KeyboardInterrupt for Ctrl-C; before, all files are written up to the last frame, and its
    state into `folder`/last_valid_state or `folder`/state, from where the run can be resumed.
    Raises ValueError, before the first step, for an `until` that cannot be reached and for a scene
    that cannot be saved.
    """
    output = next(OUTPUTS[kind] for kind in type(sim).__mro__ if kind in OUTPUTS)
    steps_to(sim, until)
    if folder:
        require_text(sim.scene)
        folder.mkdir(parents=True, exist_ok=True)
    started = time.perf_counter()
    record = output.record(sim)
    stopped: BaseException | None = None
    try:
        advance(sim, record, until)
    except (SceneError, KeyboardInterrupt) as error:
        stopped = error
    summary = summarise(sim, record, stopped)
    summary["wall_time_s"] = time.perf_counter() - started
    message = summary["stopped"]
    if folder:
        state = folder / (LAST_VALID_STATE if isinstance(stopped, SceneError) else STATE)
        clear_run(folder)
        sim.save(state, record.last_state)
        output.write(record, summary, folder, pictures, vtk)
        message = (
            f"{message}; resume from {record.times[-1]:.4g} s of model time: "
            f"python -m dem_demo resume {state} --out NEW"
        )
    if stopped:
        raise type(stopped)(message) from None
    return record, summary


def summarise(sim: Simulation, record: RunRecord, stopped: BaseException | None = None) -> dict:
    """Return the content of summary.json (docs/blocks.md). stopped: the error that ended the run,
    if any."""
    start_times = sim.stage_start_times.tolist()
    return {
        "version": SUMMARY_VERSION,
        "scene": sim.scene.title,
        "model_time_s": record.times[-1],
        "steps": record.steps,
        "time_step_s": sim.dt,
        "time_step_limit_s": sim.limit.lowest,
        "time_step_margin": sim.limit.lowest / sim.dt,
        "started_in_equilibrium": not record.unstable.any(),
        "equilibrium": record.verdict or None,
        "unstable": list_blocks(sim.scene, record.unstable),
        "contact_points": sim.joints.n,
        "joint_stresses": "effective" if sim.scene.wet else "total",
        "stage_start_s": [start if start < np.inf else None for start in start_times],
        "bolts": bolt_summary(record) if sim.scene.bolts else [],
        "energy_J": dict(zip(ENERGIES, record.energy[-1][:-1], strict=True)),
        "energy_error": record.energy[-1][-1],
        "max_energy_error": max((abs(row[-1]) for row in record.energy[1:]), default=0.0),
        "slip": list(record.slips.values()),
        "rocks": outcomes(record),
        "stopped": stopped and (str(stopped) or "interrupted"),
    }


def advance(
    sim: Simulation,
    record: RunRecord,
    until: float | None = None,
    stop: Callable[[RunRecord], bool] = lambda record: False,
) -> None:
    """Step to a model time (s), or until `stop` of a new frame is true, recording on the way.

    Raises SceneError for a state that the method cannot continue from.
    """
    remaining = steps_to(sim, until)
    step_count = 0
    dt = 0.0
    with tqdm(total=remaining, desc=sim.scene.title, disable=not sys.stderr.isatty()) as bar:
        while remaining:
            if sim.dt != dt:  # at the start, and where the time step was halved
                dt = sim.dt
                since_change = 0
                remaining = steps_to(sim, until)
                interval = max(round(min(sim.scene.run.record / dt, remaining + 1)), 1)
                bar.reset(remaining)
            sim.step()
            step_count += 1
            since_change += 1
            remaining -= 1
            bar.update()
            if since_change % SLIP_CHECK_INTERVAL == 0:
                update_slip_monitors(record.slips, sim)
            if since_change % interval == 0 or remaining == 0:
                record.add_frame(sim)
                record.steps = step_count
                if stop(record):
                    break


def run_to_failure(scene: Scene, until: float | None) -> tuple[RunRecord, str]:
    """Run to a model time (s), or until a block has moved by the median size of a block.

    Returns the record, and the message of a SceneError that ended the run, empty without one.
    """
    sim = Simulation(scene)
    size = median_size(block for block in scene.blocks if not block.fixed)
    record = RunRecord(sim)
    message = ""
    try:
        advance(sim, record, until, lambda record: bool(np.nanmax(record.distances) > size))
    except SceneError as error:
        message = str(error)
    return record, message


def steps_to(sim: Simulation, until: float | None = None) -> int:
    """Number of steps to a model time (s), by default to the scene's end; zero if the end is past.

    Raises ValueError for a given time that is past, not finite, or more than MAX_STEPS away.
    """
    now = sim.time
    dt = sim.dt
    end = max(sim.scene.run.end, now) if until is None else until
    steps = (end - now) / dt
    if steps < -0.5:
        raise ValueError(f"until = {end:g} s: must not be before the present time, {now:.6g} s")
    if not steps <= MAX_STEPS:  # NaN too
        raise ValueError(f"until = {end:g} s: {steps:.3g} steps of {dt:.3g} s from {now:.6g} s; "
                         f"must be at most {MAX_STEPS:g}; units?")  # fmt: skip
    return round(steps)


class Output(NamedTuple):
    """What a run records and writes: the class of its record, and the function of its files."""

    record: type[RunRecord]
    write: Callable[[RunRecord, dict, Path, str | None, bool], None]


def write(
    record: RunRecord, summary: dict, folder: Path, picture_format: str | None, vtk: bool
) -> None:
    """Write all files of a run: tables before pictures, which take longest.

    picture_format: None for no pictures; vtk: whether to write VTK files.
    """
    drawings: dict[str, Callable[[Path], None]] = {}
    if picture_format:
        pictures = Pictures(record)
        drawings = {f"final.{picture_format}": pictures.final, "motion.gif": pictures.animation}
        if record.scene.shear:
            drawings[f"curves.{picture_format}"] = partial(curves, record)
    write_json(folder / SUMMARY, {**summary, "files": [HISTORY, BLOCKS, *drawings]})
    record.write_history(folder / HISTORY)
    record.write_blocks(folder / BLOCKS)
    for name, draw in drawings.items():
        draw(folder / name)
    if vtk:
        from .vtk import write as write_vtk  # loads meshio

        write_vtk(record, folder / "vtk")


# By the class of a simulation; `space.record` adds its own
OUTPUTS: dict[type, Output] = {Simulation: Output(RunRecord, write)}
