"""A scene without each of its ingredients in turn: changes of the results, and of the cost.

An ingredient is removed from all laws of a scene at once, or from its run. If this changes the
stiffness of the joints, the stiffness K of an asperity is scaled such that each law has the same
closure as before at the normal stress that its joints carried: the remaining change is one of form.
A law whose joints carried no normal stress is not changed.
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
from ..output.record import RunRecord, write_csv
from ..output.run import run
from ..scene import Scene, SceneError, overlay

COST_COLUMNS = ("steps", "time_step_s", "cpu_s", "time_ratio", "note")
DISTANCE = "distance of the ends_mm"

SINGLE = {"formation": "individual"}  # population curves are not convex at eta = 0
STIFFNESS_PARTS = {"orientation", "asperity", "heights"}  # parts that the stiffness depends on
INGREDIENTS: dict[str, dict[str, Any]] = {  # by name: the keys of a law without it
    "no heights": {"heights": None},
    "heights counted one by one": {"heights": SINGLE},
    "linear asperities (eta = 0)": {"asperity": {"eta": 0.0}, "heights": SINGLE},
    "no friction on asperities": {"asperity": {"mu": 0.0}},
    "elastic asperities": {"asperity": {"yield_interference": np.inf}},
    "b = 0": {"orientation": {"b": 0.0}},
    "c = 0": {"orientation": {"c": 0.0}},
    "no large shear": {
        "mating_length": np.inf,
        "slope_wear": np.inf,
        "degradation_stress": np.inf,
    },
    "one depth cell": {"resolution": {"depth": 1}},
}


def ablate(scene: Scene, until: float | None = None) -> list[dict]:
    """Run a scene as it is, without each ingredient in turn, and as it is once more.

    until: model time to stop at (s).

    Returns rows with `variant`, outcomes, "change of ..." relative to the first row (names end in
    their unit), and COST_COLUMNS. The two rows of the whole scene show how reproducible the times
    are; the first one includes the compilation. A variant that cannot be built or run is a row
    whose note says why.

    Raises SceneError if the whole scene cannot be run.
    """
    whole, record = _run("whole scene", lambda: scene, until)
    if record is None:
        raise SceneError(whole["note"])
    rows = [whole]
    for name, build_variant in variants(scene, record):
        row, variant_record = _run(name, build_variant, until)
        if variant_record is not None:
            distances = np.hypot(*(variant_record.motion[-1] - record.motion[-1])[:2])
            row[DISTANCE] = 1e3 * float(np.nanmax(distances))
        rows.append(row)
    rows.append(_run("whole scene again", lambda: scene, until)[0])
    shortest = min(whole["cpu_s"], rows[-1]["cpu_s"])
    results = [key for key, v in whole.items() if isinstance(v, float) and key not in COST_COLUMNS]
    for row in rows:
        changes = {
            f"change of {key}": row[key] - whole[key] for key in results if row.get(key) is not None
        }
        row |= changes
        row["time_ratio"] = row["cpu_s"] / shortest
    return rows


def variants(scene: Scene, record: RunRecord) -> Iterator[tuple[str, Callable[[], Scene]]]:
    """Yield names, and functions that build the scene without an ingredient; these may raise
    ValueError.

    record: of the whole scene, for the normal stress that the joints of each law carried.
    """
    stresses = _median_stresses(scene, record)
    removed_keys: dict[str, dict[str, Any]] = {}
    for law in (scene.laws[name] for name in stresses):
        candidates = INGREDIENTS | {
            f"resolution {name}": {"resolution": asdict(replace(law, resolution=name).resolution)}
            for name in ("fast", "fine")
        }
        law_keys = {"heights": SINGLE} | {k: v for k, v in asdict(law).items() if v is not None}
        removed_keys |= {
            name: keys for name, keys in candidates.items() if _differs(law_keys, keys)
        }
    for name, keys in removed_keys.items():
        yield name, partial(_without, scene, keys, stresses)
    settings = scene.run
    law_steps = 1 if settings.law_steps > 1 else 4
    dt = float(record.last_state["dt"])
    run_variants = {
        "no dashpots": {"dashpot_normal": 0.0, "dashpot_shear": 0.0},
        f"law_steps = {law_steps}": {"law_steps": law_steps},
        "half the time step": {"step": 0.5 * dt},
        "twice the time step": {"step": 2.0 * dt},
    }
    for name, keys in run_variants.items():
        if (variant := replace(settings, **keys)) != settings:
            yield name, partial(replace, scene, run=variant)


def _median_stresses(scene: Scene, record: RunRecord) -> dict[str, float]:
    """Median compressive normal stress (Pa) of the joints of each joint law over a run, by name of
    the law."""
    law, stress = (
        np.concatenate([frame[key] for frame in record.joints])
        for key in ("law", "normal_stress_Pa")
    )
    medians = {}
    for i, name in enumerate(scene.laws):
        carried = stress[(law == i) & (stress > 0)]
        if carried.size and isinstance(scene.laws[name], JointLaw):
            medians[name] = float(np.median(carried))
    return medians


def _differs(own: dict[str, Any], keys: dict[str, Any]) -> bool:
    """Whether these keys change a law, given as nested tables."""
    return own["heights"] != SINGLE if keys == {"heights": None} else overlay(own, keys) != own


def _changed(part: Any, keys: dict[str, Any]) -> Any:
    """Return a law, or a part of it, with these keys."""
    nested = {key: getattr(part, key) for key, value in keys.items() if isinstance(value, dict)}
    return replace(part, **keys | {k: v and _changed(v, keys[k]) for k, v in nested.items()})


def _without(scene: Scene, keys: dict[str, Any], stresses: dict[str, float]) -> Scene:
    """Return the scene with these keys in its laws; stresses (Pa): at which closures are equal."""
    laws = dict(scene.laws)
    for name, stress in stresses.items():
        law = laws[name]
        variant = _changed(law, keys)
        if variant != law and STIFFNESS_PARTS & set(keys):
            K = law.asperity.K * stress / float(variant.normal_stress(law.closure(stress)))
            variant = _changed(variant, {"asperity": {"K": K}})
        laws[name] = variant
    return replace(scene, laws=laws)


def _run(
    name: str, build_variant: Callable[[], Scene], until: float | None
) -> tuple[dict, RunRecord | None]:
    """Run a variant; returns its row, and its record unless it cannot be built or run."""
    row = {"variant": name, "steps": 0, "time_step_s": np.nan, "cpu_s": np.nan, "note": ""}
    started = time.process_time()
    try:
        scene = replace(build_variant(), title=name)
        record, summary = run(Simulation(scene), None, until)
    except SceneError as error:
        return row | {"note": f"stopped: {error}"}, None
    except (ValueError, PathError) as error:
        return row | {"note": f"cannot be built: {error}"}, None
    row |= {"cpu_s": time.process_time() - started, **_results(record, summary)}
    return row | {key: summary[key] for key in ("steps", "time_step_s")}, record


def _results(record: RunRecord, summary: dict) -> dict[str, Any]:
    """Results of a run by name: monitors and rocks of the scene, and numbers that every scene has;
    names end in their unit."""
    results = {f"{slip['block']}, slips at_deg": slip["slip_angle"] for slip in summary["slip"]}
    for moving, _ in record.scene.shear:
        name = record.scene.blocks[moving].name
        normal, shear = (record.series(f"{name}: {key}_Pa") for key in ("normal", "shear"))
        angle = np.degrees(np.arctan2(np.abs(shear), normal))
        results[f"{name}, peak friction_deg"] = float(angle.max())
    for rock in summary["rocks"][: len(record.scene.rocks)]:
        for key in ("state", "displacement_m"):
            results[f"{rock['rock']}, {key}"] = rock[key]
    results["largest displacement_m"] = float(np.nanmax(record.distances))
    results["friction_kJ"] = 1e-3 * summary["energy_J"]["friction"]
    results["energy error_1"] = summary["max_energy_error"]
    return results


def write(rows: list[dict], folder: Path) -> str:
    """Write ablation.csv; returns a line for each row, for the terminal."""
    clear_run(folder)
    results = dict.fromkeys(key for row in rows for key in row if key not in COST_COLUMNS)
    columns = [*results, *COST_COLUMNS]
    write_csv(folder / ABLATION, columns, ([row.get(c) for c in columns] for row in rows))
    return "\n".join(map(_format_row, rows))


def _format_row(row: dict) -> str:
    """Format a row for the terminal."""
    distance = row.get(DISTANCE, 0.0)
    text = row["note"] or f"{distance:.3g} mm from the whole scene, time x {row['time_ratio']:.2f}"
    return f"{row['variant']}: {text}"
