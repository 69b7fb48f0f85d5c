"""Run a scene with each ingredient removed in turn: what it changes, and what it costs."""

import time
from collections.abc import Collection
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from jointlaw.laboratory.experiments import PathError
from jointlaw.support.files import clear_run, replace_file, write_json

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.record import Record, write_csv
from ..output.run import run
from ..scene import Scene
from .ingredients import Variant, variants, working_stress

WARM = 20  # steps before the first run, which else would pay for compiled code
VERSION = 1  # of summary.json
HALVINGS = 3  # of the time step, where a variant is too stiff for that of the scene

Outcome = dict[str, float | str | None]


@dataclass
class Row:
    """One run: outcome by name, unit last in the name; time in s of this process."""

    name: str
    outcome: Outcome = field(default_factory=dict)
    steps: int = 0
    time_step: float = np.nan
    cpu: float = np.nan
    note: str = ""


def ablate(scene: Scene, until: float | None = None, leave_out: Collection[str] = ()) -> list[Row]:
    """The scene as it is, without each ingredient in turn, and as it is once more.

    until: model time to stop at (s); leave_out: names of variants that are not run.
    Two rows of the whole scene, the first and the last, tell how steady the times are. A variant
    that cannot be built or run is a row whose note says why.
    """
    warm = Simulation(scene)
    for _ in range(WARM):
        warm.step()
    base, record = _run(replace(scene, title="whole scene"), "whole scene", until)
    if record is None:
        raise Refused(base.note)
    todo = [v for v in variants(scene, working_stress(record)) if v.name not in leave_out]
    rows = [base]
    for i, variant in enumerate(todo):
        rows.append(_without(variant, record, until, f"{i + 1}/{len(todo)}"))
    rows.append(_run(replace(scene, title="whole scene again"), "whole scene again", until)[0])
    return rows


def _without(variant: Variant, record: Record, until: float | None, count: str) -> Row:
    try:
        scene = variant.make()
    except (ValueError, PathError) as error:
        return Row(variant.name, note=f"cannot be built: {error}")
    scene = replace(scene, title=f"{count} {variant.name}")
    row, other = _run(scene, variant.name, until, 0 if variant.own_step else HALVINGS)
    if other is not None:
        apart = np.hypot(*(other.motion[-1] - record.motion[-1])[:2])
        row.outcome["end, apart_mm"] = 1e3 * float(apart.max())
    return row


def _run(
    scene: Scene, name: str, until: float | None, halvings: int = HALVINGS
) -> tuple[Row, Record | None]:
    """A run, with half the time step for as often as given where it is refused for its step."""
    step, note = scene.run.step, ""
    for halved in range(halvings + 1):
        started, sim = time.process_time(), None
        try:
            sim = Simulation(replace(scene, run=replace(scene.run, step=step)))
            record, summary = run(sim, None, until)
        except Refused as trouble:
            note = f"refused: {trouble}"
            used = step or (sim and sim.now.dt)  # none if the start itself is refused
            if "smaller step" not in str(trouble) or not used:
                break
            step = 0.5 * used
            continue
        cpu, dt = time.process_time() - started, sim.now.dt
        note = f"time step / {2**halved}" if halved else ""
        return Row(name, outcome(record, summary), summary["steps"], dt, cpu, note), record
    return Row(name, note=note), None


def outcome(record: Record, summary: dict[str, Any]) -> Outcome:
    """What a scene monitors, and what every scene has: the unit ends the name."""
    found: Outcome = {}
    for slip in summary["slip"]:
        found[f"{slip['block']}, slips at_deg"] = slip["slip_angle"]
    for moving, _ in record.scene.monitors.shear:
        name = record.scene.blocks[moving].name
        normal, shear = (record.column(f"{name}: {key}_Pa") for key in ("normal", "shear"))
        closure = record.column(f"{name}: closure_m")
        angle = np.degrees(np.arctan2(np.abs(shear), normal))
        found[f"{name}, peak friction_deg"] = float(angle.max())
        found[f"{name}, last shear_kPa"] = 1e-3 * float(shear[-1])
        found[f"{name}, dilation_mm"] = 1e3 * float(closure[0] - closure.min())
    for rock in summary["rocks"]:
        found[f"{rock['rock']}, state"] = rock["state"]
        found[f"{rock['rock']}, moved_m"] = rock["moved_m"]
    found["largest displacement_m"] = float(record.moved.max())
    found["friction_kJ"] = 1e-3 * summary["energy_J"]["friction"]
    found["energy error_1"] = summary["largest_energy_error"]
    return found


def changes(rows: list[Row]) -> list[Outcome]:
    """Outcome of each run less that of the first; None where there is none to compare."""
    base = rows[0].outcome

    def less(key: str, value: float | str | None) -> float | None:
        was = base.get(key)
        numeric = isinstance(value, float) and isinstance(was, float)
        return value - was if numeric else None

    return [{key: less(key, value) for key, value in row.outcome.items()} for row in rows]


def time_ratios(rows: list[Row]) -> list[float]:
    """Time of each run over the smaller of the two of the whole scene."""
    least = min(rows[0].cpu, rows[-1].cpu)
    return [row.cpu / least for row in rows]


def table(rows: list[Row]) -> str:
    """Markdown: a line for each run, a column for each outcome and one for the time."""
    keys = list(dict.fromkeys(key for row in rows[1:] for key in row.outcome))
    shift = "end, apart_mm"
    keys = [k for k in keys if k != shift] + [shift] * (shift in keys)
    head = ["without", *(_title(key) for key in keys), "steps", "time"]
    lines, notes = [head, ["---", *["---:"] * (len(head) - 1)]], []
    for row, change, ratio in zip(rows, changes(rows), time_ratios(rows), strict=True):
        name = row.name
        if row.note:
            notes.append(f"({len(notes) + 1}) {row.note}")
            name += f" ({len(notes)})"
        shown = [_shown(row.outcome, change, key, row is rows[0]) for key in keys]
        cost = [str(row.steps), f"{ratio:.2f}"] if row.outcome else ["-", "-"]
        lines.append([name, *shown, *cost])
    text = "\n".join("| " + " | ".join(line) + " |" for line in lines)
    return "\n\n".join([text, *notes])


def _title(key: str) -> str:
    what, has_unit, unit = key.rpartition("_")
    if not has_unit:
        return key
    return what if unit == "1" else f"{what} ({unit})"


def _shown(values: Outcome, change: Outcome, key: str, whole: bool) -> str:
    """A value, or its change against the whole scene."""
    if key not in values:
        return "-"
    value, by = values[key], change.get(key)
    if value is None or isinstance(value, str):
        return "none" if value is None else value
    if key.startswith("energy error"):
        return f"{value:.1e}"
    if whole or by is None:
        return f"{value:.4g}"
    return f"{by:+.3g}" if abs(by) > 1e-12 else "0"


def write(rows: list[Row], folder: Path) -> None:
    """ablation.csv (values, changes, times), ablation.md (the table) and summary.json."""
    clear_run(folder)
    keys = list(dict.fromkeys(key for row in rows for key in row.outcome))
    columns = [column for key in keys for column in (key, f"change of {key}")]
    cost = ["steps", "time_step_s", "cpu_s", "time_ratio", "note"]
    lines = []
    for row, change, ratio in zip(rows, changes(rows), time_ratios(rows), strict=True):
        cells = [cell for key in keys for cell in (row.outcome.get(key), change.get(key))]
        lines.append([row.name, *cells, row.steps, row.time_step, row.cpu, ratio, row.note])
    write_csv(folder / "ablation.csv", ["without", *columns, *cost], lines)
    replace_file(folder / "ablation.md", (table(rows) + "\n").encode())
    summary = {
        "version": VERSION,
        "files": ["ablation.csv", "ablation.md"],
        "runs": [row.__dict__ for row in rows],
        "time_ratio": time_ratios(rows),
    }
    write_json(folder / "summary.json", summary)
