"""States of a simulation, in memory and in a folder: restart is exact to the last bit.

A folder holds the scene's text, files of arrays, and `state.json`: the version of these files, and
the hashes of them and of the scene that they belong to.

The velocities stored are those that will carry the blocks on, half a step ahead of the places.
"""

import hashlib
import json
import os
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import jointlaw as jl
from jointlaw.support.files import write_json

from ..contact import BatchState, Joints
from ..scene import Scene, parse
from . import guards
from .energy import COLUMNS, Ledger
from .state import Layout, Limit, Moment, State
from .system import System

INDEX = "state.json"
VERSION = 2  # of the files of a folder; those of version 1 have no version in their index


@dataclass(frozen=True, eq=False)
class Saved:
    """A copy of everything that the future depends on: arrays by name, and the joints' states."""

    arrays: dict[str, np.ndarray]
    joints: dict[str, BatchState]


def pack(now: State, joints: Joints, motion: np.ndarray) -> Saved:
    """A state to keep; motion (6, n) as pymunk holds it, with the velocities that follow."""
    it, ledger = now.law_points, now.ledger
    arrays = {
        "motion": motion.copy(),
        "renewed_at": it.renewed_at.copy(),
        "corners": np.stack([it.contacts.corner, it.contacts.edge, it.numbers]),
        "keys": np.array(it.keys, int).reshape(-1, 4),
        "closure_offset": it.closure_offset.copy(),
        "overlaps": np.array(it.overlaps, int).reshape(-1, 4),
        "given": np.array(it.given),
        "forces": ledger.forces.copy(),
        "area": ledger.area.copy(),
        "lost": ledger.lost.copy(),
        "ledger": np.array([*(ledger.value[c] for c in COLUMNS), ledger.start]),
        "reversed_at": now.reversed_at.copy(),
        "clock": np.array([now.t0, now.n, now.dt, now.limit.now, now.limit.least]),
    }
    return Saved(arrays, joints.snapshot())


def unpack(system: System, joints: Joints, saved: Saved, step: float | None = None) -> State:
    """The state that was kept, with its joints; with `step`, ready for another time step (s).

    Raises ValueError for a step that is no finite number > 0 and for joints of another scene,
    Refused for a step beyond the limit.
    """
    guards.require_positive(step)
    a = {name: array.copy() for name, array in saved.arrays.items()}
    t0, n, dt, limit, least = a["clock"].tolist()
    keys, overlaps = ([tuple(k) for k in a[what].tolist()] for what in ("keys", "overlaps"))
    law_points = system.tracker.law_points(
        *a["corners"][:2], keys, a["corners"][2], a["closure_offset"], overlaps, int(a["given"]),
        a["renewed_at"],
    )  # fmt: skip
    layout, motion = Layout.of(system, law_points), a["motion"]
    joints.restore(saved.joints, layout.identities)
    law_points, points, _ = system.tracker.evaluate(law_points, motion)
    value = dict(zip(COLUMNS, a["ledger"].tolist(), strict=False))
    now = State(
        t0, int(n), dt, motion, law_points, points, layout, joints.read("F"),
        a["reversed_at"], Ledger(value, float(a["ledger"][-1]), a["forces"], a["area"], a["lost"]),
        Limit(limit, least, np.zeros(joints.n)),
    )  # fmt: skip
    if not step:
        return now
    # velocities are half a step ahead of the places: of the new step
    motion[3:] += 0.5 * (step - dt) * (a["forces"][0] / system.inertia * system.free).T
    at = Moment(layout, law_points.contacts, motion, points, now.traction)
    found = guards.require_step(guards.step_limit(system, joints, at, least), step)
    return replace(now, t0=now.time, n=0, dt=step, limit=found)


def save(scene: Scene, saved: Saved, folder: Path) -> None:
    """Write a state and its scene to a folder; a state that is there is kept until all is written.

    Raises ValueError for a scene that `text_of` refuses.
    """
    text = text_of(scene)
    folder.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".state-", dir=folder) as new:
        fresh, tables = Path(new), {}
        for i, (values, slots, free) in enumerate(saved.joints.values()):
            values.save(fresh / f"law-{i}.npz")  # numbered: a law's name may be no file's name
            tables[f"slots-{i}"] = np.array([[*k, p, s] for (k, p), s in slots.items()], int)
            tables[f"free-{i}"] = np.array(free, int)
        np.savez(fresh / "joints.npz", **tables)
        np.savez(fresh / "blocks.npz", **saved.arrays)
        hashes = {file.name: _hash(file.read_bytes()) for file in sorted(fresh.iterdir())}
        (fresh / "scene.toml").write_text(text, encoding="utf-8")
        index = {"version": VERSION, "scene": fingerprint(scene), "files": hashes}
        write_json(fresh / INDEX, index)
        for file in list(fresh.iterdir()):
            os.replace(file, folder / file.name)


def load(folder: Path) -> tuple[Scene, Saved]:
    """The scene and the state that `save` wrote. Raises ValueError if they are not whole."""
    index = folder / INDEX
    if not index.is_file():
        raise ValueError(f"{str(folder)!r} holds no saved state ({INDEX} is missing)")
    try:
        about = json.loads(index.read_text(encoding="utf-8"))
        version, whose, hashes = about.get("version", 1), about["scene"], dict(about["files"])
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(f"{index} is damaged ({error!r}): run the scene again") from None
    if version != VERSION:
        raise ValueError(
            f"{index}: version = {version!r}, must be {VERSION}: another version of the demo wrote "
            "this state; go on with that one, or run the scene again"
        )
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
        for i, (name, file) in enumerate(zip(scene.laws, laws, strict=True)):
            slots = {(tuple(s[:4]), s[4]): s[5] for s in data[f"slots-{i}"].tolist()}
            joints[name] = jl.load_state(folder / file), slots, data[f"free-{i}"].tolist()
    return scene, Saved(arrays, joints)


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
    pairs = sorted((sorted(blocks), law) for blocks, law in scene.pairs.items())
    whole = [
        [block.__dict__ | {"corners": block.corners.tolist()} for block in scene.blocks],
        {name: law.fingerprint for name, law in scene.laws.items()},
        scene.default_law, pairs, sorted(scene.edge_laws.items()), asdict(run),
        [asdict(drive) for drive in scene.drives], [float(g) for g in scene.gravity],
        float(scene.thickness),
    ]  # fmt: skip
    return _hash(json.dumps(whole).encode())


def _hash(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()
