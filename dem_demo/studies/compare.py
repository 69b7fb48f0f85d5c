"""The rocks of a scene one by one: for several seeds, with their own laws and with plain Coulomb.

Plain Coulomb has the friction of the asperities themselves, the same in all directions, and
stiffnesses like those of the joint at half the height of the rock. What it lacks is dilation,
hardening and direction: the difference between the two runs is what these do.
"""

import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.outcome import far, outcomes
from ..output.record import Record
from ..output.run import play
from ..scene import DENSITY, GRAVITY, Files, Scene, build, build_law, read_tables
from .limit import critical_tilt, tilted


def compare(scene: Scene, seeds: Sequence[int], until: float, tilt: float = 0.0) -> Iterator[dict]:
    """Run every rock of a scene for each seed and each kind of law; yields outcomes.

    until: model time to stop at (s); tilt: angle by which gravity is turned towards +x (degrees).
    """
    for case, data in _cases(scene, seeds):
        yield {**case, **_run(build(tilted(data, tilt), files=scene.files), until)}


def critical_tilts(scene: Scene, seeds: Sequence[int]) -> Iterator[dict]:
    """For the same cases the turn of gravity (degrees) beyond which no balance is found.

    None if it is beyond 60 degrees either way.
    """
    for case, data in _cases(scene, seeds):
        rock = data["rock"][0]["name"]
        yield {**case, "rock": rock, "critical_tilt": critical_tilt(data, scene.files)}


def _cases(scene: Scene, seeds: Sequence[int]) -> Iterator[tuple[dict, dict[str, Any]]]:
    """Every rock alone, for each seed and kind of law: what it is, and the scene's tables."""
    data = read_tables(scene.text)
    for name in (table["name"] for table in data["rock"]):
        own = alone(data, name)
        (rock,) = own["rock"]
        for seed in seeds:
            cut = {**own, "rock": [{**rock, "seed": seed}]}
            if seed != rock.get("seed", 0):  # other blocks, to which the names do not belong
                cut["joint"] = [joint for joint in own["joint"] if not _named(joint, rock)]
            yield {"law": "joint", "seed": seed}, cut
            plain = {
                name: _plain(law, rock, data, scene.files) for name, law in data["laws"].items()
            }
            run = {**data["run"], "max_overlap": 0.1}  # constant springs are soft in impacts
            yield {"law": "coulomb", "seed": seed}, {**cut, "laws": plain, "run": run}


def alone(data: dict[str, Any], name: str) -> dict[str, Any]:
    """A scene's tables with one of its rocks, and nothing watched."""
    rock = _whole(data["rock"])[name]
    blocks = {block["name"] for block in data.get("block", [])}
    joints = [joint for joint in data.get("joint", []) if _belongs(joint, rock, blocks)]
    return {**data, "rock": [rock], "watch": {}, "joint": joints}


def _run(scene: Scene, until: float) -> dict:
    started = time.perf_counter()
    sim, trouble = Simulation(scene), ""
    record = Record(sim)
    try:
        play(sim, record, until, far)
    except Refused as error:
        trouble = str(error)
    (outcome,) = outcomes(record)
    return {
        **outcome,
        "time_s": sim.time,
        "steps": sim.now.n,
        "largest_energy_error": record.largest_error,
        "refused": trouble,
        "wall_time_s": time.perf_counter() - started,
    }


def _whole(tables: list[dict[str, Any]]) -> dict[str, dict[str, Any]]:
    """The [[rock]] tables by name, with what they are `like` filled in."""
    known: dict[str, dict[str, Any]] = {}
    for table in tables:
        known[table["name"]] = {**known.get(table.get("like", ""), {}), **table, "like": ""}
    return known


def _named(joint: dict[str, Any], rock: dict[str, Any]) -> list[str]:
    """The blocks of a rock that a [[joint]] names."""
    return [n for n in joint.get("between", ()) if n.rpartition(" ")[0] == rock["name"]]


def _belongs(joint: dict[str, Any], rock: dict[str, Any], blocks: set[str]) -> bool:
    """Is a [[joint]] one of this rock, or between `blocks` that no rock holds?"""
    if "around" not in joint:
        return blocks.union(_named(joint, rock)).issuperset(joint["between"])
    low, high = np.quantile(np.add(rock["outline"], rock.get("at", [0, 0])), [0, 1], axis=0)
    return bool((low < joint["around"]).all() and (joint["around"] < high).all())


def _plain(
    table: dict[str, Any], rock: dict[str, Any], data: dict[str, Any], files: Files
) -> dict[str, Any]:
    if table.get("kind", "joint") == "coulomb":
        return table
    height = np.ptp(np.array(rock["outline"], float)[:, 1])
    stress = 0.5 * data.get("density", DENSITY) * np.hypot(*data.get("gravity", GRAVITY)) * height
    law = build_law(table, "law", files)
    stiffness = float(stress / law.closure(stress))
    return {
        "kind": "coulomb",
        "normal_stiffness": stiffness,
        "shear_stiffness": stiffness / law.asperity.lam,
        "friction": law.asperity.mu,
    }
