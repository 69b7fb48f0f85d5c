"""The rocks of a scene one by one: for several seeds, with their own laws and with plain Coulomb.

Plain Coulomb has the friction of the asperities themselves, the same in all directions, and
stiffnesses like those of the joint at half the height of the rock. What it lacks is dilation,
hardening and direction: the difference between the two runs is what these do.
"""

from __future__ import annotations

import sys
import time
import tomllib
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from tqdm import tqdm

from .interfaces import Refused
from .laws import build_law
from .outcome import outcomes
from .record import Record
from .scene import build
from .shapes import turn
from .simulation import Simulation

FAR = 1.0  # m: a rock whose blocks have moved farther has failed, and need not go on


def compare(
    text: str, where: str, seeds: Sequence[int], until: float, tilt: float = 0.0
) -> Iterator[dict]:
    """Run every rock of a scene's text for each seed and each kind of law; yields outcomes.

    until: model time to stop at (s); tilt: angle by which gravity is turned towards +x (degrees).
    """
    data = tomllib.loads(text)
    gravity = turn(np.radians(tilt)) @ data.get("gravity", [0.0, -9.81])
    data["gravity"] = gravity.tolist()
    for rock in _whole(data["rock"]):
        for seed in seeds:
            for kind in ("joint", "coulomb"):
                alone = {**data, "rock": [{**rock, "seed": seed}], "watch": {}}
                alone["joint"] = [j for j in data.get("joint", []) if _belongs(j, rock)]
                if kind == "coulomb":
                    laws = data["laws"].items()
                    alone["laws"] = {name: _plain(law, rock, data) for name, law in laws}
                    alone["run"] = {**data["run"], "max_overlap": 0.1}  # springs that never harden
                yield {"law": kind, "seed": seed, **_one(alone, where, until)}


def _one(data: dict[str, Any], where: str, until: float) -> dict:
    started = time.perf_counter()
    sim, trouble = Simulation(build(data, where)), ""
    record = Record(sim)
    record.take(sim)
    every = max(round(sim.scene.run.record / sim.dt), 1)
    steps, worst = round(until / sim.dt), 0.0
    try:
        for i in tqdm(range(1, steps + 1), leave=False, disable=not sys.stderr.isatty()):
            sim.step()
            if i % every == 0 or i == steps:
                record.take(sim)
                worst = max(worst, abs(sim.ledger.error))
                moved = np.hypot(*(record.motion[-1] - record.motion[0])[:2])
                if moved.max() > FAR:
                    break
    except Refused as error:
        trouble = str(error)
    (outcome,) = outcomes(record)
    return {
        **outcome,
        "time_s": sim.time,
        "steps": sim.n,
        "largest_energy_error": worst,
        "refused": trouble,
        "wall_time_s": time.perf_counter() - started,
    }


def _whole(tables: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The [[rock]] tables with what they are `like` filled in."""
    known: dict[str, dict[str, Any]] = {}
    for table in tables:
        known[table["name"]] = {**known.get(table.get("like", ""), {}), **table, "like": ""}
    return list(known.values())


def _belongs(joint: dict[str, Any], rock: dict[str, Any]) -> bool:
    if "around" not in joint:
        return False
    low, high = np.quantile(np.add(rock["outline"], rock.get("at", [0, 0])), [0, 1], axis=0)
    return bool((low < joint["around"]).all() and (joint["around"] < high).all())


def _plain(table: dict[str, Any], rock: dict[str, Any], data: dict[str, Any]) -> dict[str, Any]:
    if table.get("kind", "joint") == "coulomb":
        return table
    height = np.ptp(np.array(rock["outline"], float)[:, 1])
    stress = 0.5 * data.get("density", 2600.0) * np.hypot(*data.get("gravity", (0, -9.81))) * height
    law = build_law(table, "law")
    stiffness = float(stress / law.closure(stress))
    return {
        "kind": "coulomb",
        "normal_stiffness": stiffness,
        "shear_stiffness": stiffness / law.asperity.lam,
        "friction": law.asperity.mu,
    }
