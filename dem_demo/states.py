"""States of a simulation, in memory and in a folder: restart is exact to the last bit.

A folder holds the scene's text, files of arrays, and `state.json`: the hashes of these files and of
the scene that they belong to.

The velocities stored are those that will carry the blocks on, half a step ahead of the places.
"""

from __future__ import annotations

import hashlib
import json
import os
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from jointlaw.support.files import write_json

from . import timestep
from .coulomb import CoulombLaw
from .energy import COLUMNS
from .laws import load_state
from .scene import Scene, parse

INDEX = "state.json"


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
    timestep.require_positive(step)
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
    if step:
        sim.check_step(sim.points)
        sim.require_step()


def save(sim, folder: Path, state: dict) -> None:
    """Write a state and its scene to a folder; a state that is there is kept until all is written.

    Raises ValueError for a scene that `text_of` refuses.
    """
    text = text_of(sim.scene)
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".state-", dir=folder) as new:
        fresh, tables = Path(new), {}
        for i, (values, slots, free) in enumerate(state["joints"].values()):
            values.save(fresh / f"law-{i}.npz")  # numbered: a law's name may be no file's name
            tables[f"slots-{i}"] = np.array([[*k, p, s] for (k, p), s in slots.items()], int)
            tables[f"free-{i}"] = np.array(free, int)
        np.savez(fresh / "joints.npz", **tables)
        np.savez(fresh / "blocks.npz", **state["arrays"])
        hashes = {file.name: _hash(file.read_bytes()) for file in sorted(fresh.iterdir())}
        (fresh / "scene.toml").write_text(text, encoding="utf-8")
        write_json(fresh / INDEX, {"scene": fingerprint(sim.scene), "files": hashes})
        for file in list(fresh.iterdir()):
            os.replace(file, folder / file.name)


def load(folder: Path) -> tuple[Scene, dict]:
    """The scene and the state that `save` wrote. Raises ValueError if they are not whole."""
    index = folder / INDEX
    if not index.is_file():
        raise ValueError(f"{str(folder)!r} holds no saved state ({INDEX} is missing)")
    try:
        about = json.loads(index.read_text(encoding="utf-8"))
        whose, hashes = about["scene"], dict(about["files"])
    except (ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{index} is damaged ({error!r}): run the scene again") from None
    scene = parse((folder / "scene.toml").read_text(encoding="utf-8"), "scene.toml")
    if fingerprint(scene) != whose:
        raise ValueError(
            f"{folder / 'scene.toml'} is not the scene of this state: only end, record, fraction, "
            "step, title and watch may change; undo the rest, or run it as a scene of its own"
        )
    laws = [f"law-{i}.npz" for i in range(len(scene.laws))]
    for name in ["blocks.npz", "joints.npz", *laws]:
        file = folder / name
        if not file.is_file() or _hash(file.read_bytes()) != hashes.get(name):
            raise ValueError(f"{file} is missing, damaged or of another state: run the scene again")
    with np.load(folder / "blocks.npz") as data:
        arrays = {name: data[name] for name in data.files}
    joints = {}
    with np.load(folder / "joints.npz") as data:
        for i, (name, law) in enumerate(scene.laws.items()):
            slots = {(tuple(s[:4]), s[4]): s[5] for s in data[f"slots-{i}"].tolist()}
            joints[name] = load_state(law, folder / laws[i]), slots, data[f"free-{i}"].tolist()
    return scene, {"arrays": arrays, "joints": joints}


def text_of(scene: Scene) -> str:
    """The text of a scene. Raises ValueError where it is not what the scene was read from."""
    if not scene.text or fingerprint(parse(scene.text)) != fingerprint(scene):
        raise ValueError(
            "the scene was made or changed in memory, so its text would go on with another one: "
            "write the change into the TOML text and parse that, or keep the state with "
            "Simulation.state()"
        )
    return scene.text


def fingerprint(scene: Scene) -> str:
    """Hash of what the motion depends on, but not when a run ends, records, or at which step."""
    run = replace(scene.run, end=0.0, record=0.0, fraction=0.0, step=None)
    laws = {
        name: asdict(law) if isinstance(law, CoulombLaw) else law.fingerprint
        for name, law in scene.laws.items()
    }
    pairs = sorted((sorted(blocks), law) for blocks, law in scene.pairs.items())
    whole = [
        [block.__dict__ | {"corners": block.corners.tolist()} for block in scene.blocks],
        laws, scene.default_law, pairs, sorted(scene.edge_laws.items()), asdict(run),
        [asdict(drive) for drive in scene.drives], [float(g) for g in scene.gravity],
        float(scene.thickness),
    ]  # fmt: skip
    return _hash(json.dumps(whole).encode())


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
