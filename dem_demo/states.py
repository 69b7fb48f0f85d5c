"""States of a simulation, in memory and in a folder: restart is exact to the last bit.

The velocities stored are those that will carry the blocks on, half a step ahead of the places.
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from .energy import COLUMNS


def state(sim) -> dict:
    """A copy of everything that the future depends on."""
    it = sim.interfaces
    arrays = {
        "motion": sim.world.motion(),
        "renewed_at": it.renewed_at.copy(),
        "corners": np.stack([it.contacts.corner, it.contacts.edge, it.numbers]),
        "keys": np.array(it.keys, int).reshape(-1, 4),
        "crushed": it.crushed.copy(),
        "overlaps": np.array(it.overlaps, int).reshape(-1, 4),
        "given": np.array(it.given),
        "forces": sim.ledger.forces.copy(),
        "area": sim.ledger.area.copy(),
        "e_lost": sim.ledger.e_lost.copy(),
        "ledger": np.array([*(sim.ledger.value[c] for c in COLUMNS), sim.ledger.total0]),
        "turned_at": sim.drives.turned_at.copy(),
        "clock": np.array([sim.t0, sim.n, sim.dt, sim.step_limit, sim.least_limit]),
    }
    return {"arrays": arrays, "joints": sim.joints.snapshot()}


def restore(sim, state: dict, step: float | None = None) -> None:
    """Return to a state; with `step`, go on from there with another time step."""
    a = state["arrays"]
    sim.t0, sim.n, sim.dt, sim.step_limit, sim.least_limit = a["clock"].tolist()
    sim.n = int(sim.n)
    sim.drives.turned_at = a["turned_at"].copy()
    if step:
        sim.t0, sim.n, sim.dt = sim.time, 0, step
    keys, overlaps = ([tuple(k) for k in a[what].tolist()] for what in ("keys", "overlaps"))
    corner, edge, numbers = a["corners"].copy()
    crushed, given = a["crushed"].copy(), int(a["given"])
    sim.interfaces.adopt(corner, edge, keys, numbers, crushed, overlaps, given)
    sim.interfaces.renewed_at, sim.interfaces.urgent = a["renewed_at"].copy(), False
    sim.points = None
    sim.joints.restore(state["joints"], sim.interfaces.of_points)
    sim.arrange()
    sim.motion = a["motion"].copy()
    sim.traction = sim.joints.read("F")
    sim.area = a["area"].copy()
    sim.ledger.value = dict(zip(COLUMNS, a["ledger"].tolist(), strict=False))
    sim.ledger.total0 = float(a["ledger"][-1])
    sim.ledger.remember(a["forces"].copy(), sim.area, a["e_lost"].copy())
    sim.points = sim.evaluate(sim.motion)
    if step:  # velocities are half a step ahead of the places: of the new step
        sim.motion[3:] += 0.5 * (step - a["clock"][2]) * (a["forces"][0] / sim.inertia * sim.free).T
    sim.world.place(sim.motion)


def save(sim, folder: Path, state: dict) -> None:
    """Write a state and its scene to a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    np.savez(folder / "blocks.npz", **state["arrays"])
    joints = sim.joints.save(state["joints"], folder)
    (folder / "joints.json").write_text(json.dumps(joints))
    (folder / "scene.toml").write_text(sim.scene.text)


def load(sim, folder: Path) -> dict:
    """The state that `save` wrote, for a simulation of the same scene."""
    with np.load(folder / "blocks.npz") as data:
        arrays = {name: data[name] for name in data.files}
    joints = sim.joints.load(json.loads((folder / "joints.json").read_text()), folder)
    return {"arrays": arrays, "joints": joints}
