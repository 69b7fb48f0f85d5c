"""States of a simulation, in memory and in a file.

`state.npz` holds its version, the text of the scene and of the files that this names, and arrays.

The velocities stored are those that will carry the blocks on, half a step ahead of the places.
"""

import io
import json
from dataclasses import dataclass, replace
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

import jointlaw as jl
from jointlaw.support.files import replace_file

from ..contact import Joints, PoolState
from ..scene import Files, Scene, parse
from . import guards
from .energy import COLUMNS, Ledger
from .state import Layout, Limit, Moment, State, System

STATE = "state.npz"
VERSION = 4  # of state.npz
ARRAYS = (
    "motion", "renewed_at", "corners", "keys", "closure_offset", "overlaps", "given", "forces",
    "area", "lost", "ledger", "reversed_at", "clock", "checked",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Saved:
    """A copy of everything that the future depends on: arrays by name, and the joints' states."""

    arrays: dict[str, np.ndarray]
    joints: dict[str, PoolState]


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
        "checked": now.limit.checked.copy(),
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
        Limit(limit, least, a["checked"]),
    )  # fmt: skip
    if not step:
        return now
    # velocities are half a step ahead of the places: of the new step
    motion[3:] += 0.5 * (step - dt) * (a["forces"][0] / system.inertia * system.free).T
    at = Moment(layout, law_points.contacts, motion, points, now.traction)
    found = guards.require_step(guards.step_limit(system, joints, at, least), step)
    return replace(now, t0=now.time, n=0, dt=step, limit=found)


def save(scene: Scene, saved: Saved, folder: Path) -> None:
    """Write a state with its scene to a folder; a state that is there is kept until all is written.

    Raises ValueError for a scene that was made or changed in memory.
    """
    require_text(scene)
    buffer, tables = io.BytesIO(), {}
    for i, (points, law) in enumerate(saved.joints.values()):
        # numbered: a law's name may be no array's name
        tables[f"law-{i}"], tables[f"fingerprint-{i}"] = law.values, np.array(law.fingerprint)
        tables[f"points-{i}"] = np.array([[*key, number] for key, number in points], int)
    about = {"version": VERSION, "scene": scene.text, "files": json.dumps(scene.files)}
    np.savez(buffer, **about, **saved.arrays, **tables)
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / STATE, buffer.getvalue())


def load(folder: Path) -> tuple[Scene, Saved]:
    """The scene and the state that `save` wrote. Raises ValueError if they are not whole."""
    file = folder / STATE
    if not file.is_file():
        raise ValueError(
            f"{str(folder)!r} holds no saved state ({STATE} is missing): run the scene"
        )
    try:
        with np.load(file, allow_pickle=False) as stored:  # a ZIP file: it checks its sums
            data = {name: stored[name] for name in stored.files}
        if (version := int(data["version"])) == VERSION:
            files = Files(known=json.loads(str(data["files"])).items())
            scene = parse(str(data["scene"]), str(file), files)
            return scene, Saved({name: data[name] for name in ARRAYS}, _joints(data, scene))
    except (OSError, EOFError, LookupError, ValueError, AttributeError, BadZipFile) as error:
        raise ValueError(f"{file} is damaged ({error}): run the scene again") from None
    raise ValueError(
        f"{file} has version {version}, this demo reads {VERSION}: go on with the version of the "
        "demo that wrote it, or run the scene again"
    )


def _joints(data: dict[str, np.ndarray], scene: Scene) -> dict[str, PoolState]:
    joints = {}
    for i, name in enumerate(scene.laws):
        points = data[f"points-{i}"].tolist()
        law = jl.JointState(str(data[f"fingerprint-{i}"]), data[f"law-{i}"])
        joints[name] = [(tuple(key), number) for *key, number in points], law
    return joints


def require_text(scene: Scene) -> None:
    """Refuse a scene without a text. Raises ValueError."""
    if not scene.text:
        raise ValueError(
            "the scene was made or changed in memory, so it has no text to go on from: write the "
            "change into the TOML text and parse that, or keep the state with Simulation.state()"
        )
