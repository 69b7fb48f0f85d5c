"""A scene without each of its ingredients in turn: what that changes, and what it costs.

An ingredient is removed from all laws of a scene at once, or from its run. Where that changes how
stiff the joints are, the stiffness K of an asperity is scaled so that each law closes as far as
before at the normal stress that its joints carried: what is left is the change of form. A law whose
joints carried nothing stays as it is.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from jointlaw import JointLaw, PathError

from ..dynamics.simulation import Simulation
from ..output.folder import ABLATION, clear_run
from ..output.record import Record, write_csv
from ..output.run import run
from ..scene import Scene, SceneError, overlay

COST = ("steps", "time_step_s", "cpu_s", "time_ratio", "note")

SINGLE = {"formation": "individual"}  # population curves are not convex at eta = 0
STIFFENS = {"orientation", "asperity", "heights"}  # parts that the stiffness depends on
INGREDIENTS: dict[str, dict[str, Any]] = {  # by name: the keys of a law without it
    "no heights": {"heights": None},
    "heights counted one by one": {"heights": SINGLE},
    "linear asperities (eta = 0)": {"asperity": {"eta": 0.0}, "heights": SINGLE},
    "no friction on asperities": {"asperity": {"mu": 0.0}},
    "elastic asperities": {"asperity": {"yield_interference": np.inf}},
    "b = 0": {"orientation": {"b": 0.0}},
    "c = 0": {"orientation": {"c": 0.0}},
    "no large shear": {"mating_length": np.inf, "slope_wear": np.inf},
    "one depth cell": {"resolution": {"depth": 1}},
}


def ablate(scene: Scene, until: float | None = None) -> list[dict]:
    """Rows: the scene as it is, without each ingredient in turn, and as it is once more.

    until: model time to stop at (s). A row holds
    outcomes and "change of ..." against the first row, unit last in the name, and COST. Two rows of
    the whole scene tell how steady the times are; the first also waits for compiled code. A variant
    that cannot be built or run is a row whose note says why.
    """
    whole, record = _run("whole scene", lambda: scene, until)
    if record is None:
        raise SceneError(whole["note"])
    rows = [whole]
    for name, make in variants(scene, record):
        row, other = _run(name, make, until)
        if other is not None:
            apart = np.hypot(*(other.motion[-1] - record.motion[-1])[:2])
            row["end, apart_mm"] = 1e3 * float(np.nanmax(apart))
        rows.append(row)
    rows.append(_run("whole scene again", lambda: scene, until)[0])
    least = min(whole["cpu_s"], rows[-1]["cpu_s"])
    numbers = [key for key, v in whole.items() if isinstance(v, float) and key not in COST]
    for row in rows:
        row |= {f"change of {key}": row[key] - whole[key]
                for key in numbers if row.get(key) is not None}  # fmt: skip
        row["time_ratio"] = row["cpu_s"] / least
    return rows


def variants(scene: Scene, record: Record) -> Iterator[tuple[str, Callable[[], Scene]]]:
    """Names, and what makes the scene without an ingredient; that may raise ValueError.

    record: of the whole scene, for the normal stress that the joints of each law carried.
    """
    of_law, stress = (np.concatenate([frame[key] for frame in record.joints])
                      for key in ("law", "normal_stress_Pa"))  # fmt: skip
    carried = {name: stress[(of_law == i) & (stress > 0)] for i, name in enumerate(scene.laws)}
    pressed = {name: float(np.median(of)) for name, of in carried.items()
               if of.size and isinstance(scene.laws[name], JointLaw)}  # fmt: skip
    lacking: dict[str, dict[str, Any]] = {}
    for law in (scene.laws[name] for name in pressed):
        given = INGREDIENTS | {
            f"resolution {name}": {"resolution": asdict(replace(law, resolution=name).resolution)}
            for name in ("fast", "fine")
        }
        own = {"heights": SINGLE} | {k: v for k, v in asdict(law).items() if v is not None}
        lacking |= {name: keys for name, keys in given.items() if _differ(own, keys)}
    for name, keys in lacking.items():
        yield name, partial(_without, scene, keys, pressed)
    run, steps = scene.run, 1 if scene.run.law_steps > 1 else 4
    dt = float(record.state["dt"])
    others = {
        "no dashpots": {"dashpot_normal": 0.0, "dashpot_shear": 0.0},
        f"law_steps = {steps}": {"law_steps": steps},
        "half the time step": {"step": 0.5 * dt},
        "twice the time step": {"step": 2.0 * dt},
    }
    for name, keys in others.items():
        if (other := replace(run, **keys)) != run:
            yield name, partial(replace, scene, run=other)


def _differ(own: dict[str, Any], keys: dict[str, Any]) -> bool:
    """Has a law, as nested tables, what these keys take away?"""
    return own["heights"] != SINGLE if keys == {"heights": None} else overlay(own, keys) != own


def _changed(part: Any, keys: dict[str, Any]) -> Any:
    """A law, or a part of it, with these keys."""
    nested = {key: getattr(part, key) for key, value in keys.items() if isinstance(value, dict)}
    return replace(part, **keys | {k: own and _changed(own, keys[k]) for k, own in nested.items()})


def _without(scene: Scene, keys: dict[str, Any], pressed: dict[str, float]) -> Scene:
    """The scene with these keys in the laws whose joints carried; pressed: medians (Pa)."""
    laws = dict(scene.laws)
    for name, stress in pressed.items():
        law, other = laws[name], _changed(laws[name], keys)
        if other != law and STIFFENS & set(keys):
            K = law.asperity.K * stress / float(other.normal_stress(law.closure(stress)))
            other = _changed(other, {"asperity": {"K": K}})
        laws[name] = other
    return replace(scene, laws=laws)


def _run(name: str, make: Callable[[], Scene], until: float | None) -> tuple[dict, Record | None]:
    """A row, and the record of its run if there was one."""
    row = {"without": name, "steps": 0, "time_step_s": np.nan, "cpu_s": np.nan, "note": ""}
    started = time.process_time()
    try:
        record, summary = run(Simulation(replace(make(), title=name)), None, until)
    except SceneError as trouble:
        return row | {"note": f"refused: {trouble}"}, None
    except (ValueError, PathError) as error:
        return row | {"note": f"cannot be built: {error}"}, None
    row |= {"cpu_s": time.process_time() - started, **_outcome(record, summary)}
    return row | {key: summary[key] for key in ("steps", "time_step_s")}, record


def _outcome(record: Record, summary: dict) -> dict[str, Any]:
    """What a scene monitors, and what every scene has: the unit ends the name."""
    found = {f"{slip['block']}, slips at_deg": slip["slip_angle"] for slip in summary["slip"]}
    for moving, _ in record.scene.shear:
        name = record.scene.blocks[moving].name
        normal, shear = (record.column(f"{name}: {key}_Pa") for key in ("normal", "shear"))
        angle = np.degrees(np.arctan2(np.abs(shear), normal))
        found[f"{name}, peak friction_deg"] = float(angle.max())
    for rock in summary["rocks"][: len(record.scene.rocks)]:
        found |= {f"{rock['rock']}, {key}": rock[key] for key in ("state", "moved_m")}
    return found | {
        "largest displacement_m": float(np.nanmax(record.moved)),
        "friction_kJ": 1e-3 * summary["energy_J"]["friction"],
        "energy error_1": summary["largest_energy_error"],
    }


def write(rows: list[dict], folder: Path) -> str:
    """ablation.csv of some rows; returns what each changed, a line a row."""
    clear_run(folder)
    columns = [*dict.fromkeys(key for row in rows for key in row if key not in COST), *COST]
    write_csv(folder / ABLATION, columns, ([row.get(c) for c in columns] for row in rows))
    return "\n".join(
        f"{row['without']}: " + (row["note"] or f"ends {row.get('end, apart_mm', 0.0):.3g} mm "
                                 f"apart, time x {row['time_ratio']:.2f}")
        for row in rows
    )  # fmt: skip
