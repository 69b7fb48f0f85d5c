"""The rocks of a scene one by one: for several seeds, with their own laws and with plain Coulomb.

Plain Coulomb has the friction of the asperities themselves, the same in all directions, and
stiffnesses like those of the joint at half the height of the rock. What it lacks is dilation,
hardening and direction: the difference between the two runs is what these do.
"""

import time
from collections.abc import Iterator, Sequence

import numpy as np

from ..dynamics.simulation import Simulation
from ..errors import Refused
from ..output.record import Record, far, outcomes
from ..output.run import play
from ..scene import DENSITY, GRAVITY, Files, Scene, Tables, build, build_law, read_tables
from .strength import alone


def compare(scene: Scene, seeds: Sequence[int], until: float) -> Iterator[dict]:
    """Every rock of a scene, for each seed and each kind of law; yields outcomes.

    until: model time to stop at (s).
    """
    data, files = read_tables(scene.text), scene.files
    for name in (table["name"] for table in data["rock"]):
        for seed in seeds:
            own = alone(data, name, seed)
            laws = own["laws"].items()
            plain = {law: _plain(table, own, files) for law, table in laws}
            run = {**data["run"], "max_overlap": 0.1}  # constant springs are soft in impacts
            for kind, case in (("joint", own), ("coulomb", {**own, "laws": plain, "run": run})):
                yield {"law": kind, "seed": seed, **_run(build(case, files=files), until)}


def _run(scene: Scene, until: float) -> dict:
    started, trouble = time.perf_counter(), ""
    sim = Simulation(scene)
    record = Record(sim)
    try:
        play(sim, record, until, far)
    except Refused as error:
        trouble = str(error)
    (outcome,) = outcomes(record)
    return {
        **outcome,
        "time_s": sim.time,
        "steps": sim.n,
        "largest_energy_error": record.largest_error,
        "refused": trouble,
        "wall_time_s": time.perf_counter() - started,
    }


def _plain(table: Tables, data: Tables, files: Files) -> Tables:
    if table.get("kind", "joint") == "coulomb":
        return table
    height = np.ptp(np.array(data["rock"][0]["outline"], float)[:, 1])
    stress = 0.5 * data.get("density", DENSITY) * np.hypot(*data.get("gravity", GRAVITY)) * height
    law = build_law(table, "law", files)
    stiffness = float(stress / law.closure(stress))
    return {
        "kind": "coulomb",
        "normal_stiffness": stiffness,
        "shear_stiffness": stiffness / law.asperity.lam,
        "friction": law.asperity.mu,
    }
