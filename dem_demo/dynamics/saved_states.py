"""States of a simulation, in memory and in a folder: restart is exact to the last bit.

A folder holds the scene's text and `state.npz`: its version, the hash of the scene that it belongs
to, and arrays.

The velocities stored are those that will carry the blocks on, half a step ahead of the places.
"""

import hashlib
import io
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from jointlaw.joints.state import JointState
from jointlaw.support.files import replace_file

from ..contact import Joints, PoolState
from ..scene import Run, Scene, parse
from . import guards
from .energy import COLUMNS, Ledger
from .state import Layout, Limit, Moment, State, System

SCENE, STATE = "scene.toml", "state.npz"
VERSION = 3  # of state.npz


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
    text, buffer, tables = text_of(scene), io.BytesIO(), {}
    for i, (points, law) in enumerate(saved.joints.values()):
        # numbered: a law's name may be no array's name
        tables[f"law-{i}"], tables[f"fingerprint-{i}"] = law.values.T, np.array(law.fingerprint)
        tables[f"points-{i}"] = np.array([[*key, number] for key, number in points], int)
    about = {"version": VERSION, "scene": fingerprint(scene)}
    np.savez(buffer, **about, **saved.arrays, **tables)
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / SCENE, text.encode())
    replace_file(folder / STATE, buffer.getvalue())


def load(folder: Path) -> tuple[Scene, Saved]:
    """The scene and the state that `save` wrote. Raises ValueError if they are not whole."""
    file = folder / STATE
    if not file.is_file():
        raise ValueError(
            f"{str(file.parent)!r} holds no saved state ({STATE} is missing): run the scene"
        )
    try:
        with np.load(file, allow_pickle=False) as stored:  # a ZIP file: it checks its sums
            data = {name: stored[name] for name in stored.files}
        version = int(data.pop("version"))
    except (OSError, EOFError, LookupError, ValueError, AttributeError, BadZipFile) as error:
        raise ValueError(f"{file} is damaged ({error}): run the scene again") from None
    if version != VERSION:
        raise ValueError(
            f"{file} has version {version}, this demo reads {VERSION}: go on with the version of "
            "the demo that wrote it, or run the scene again"
        )
    scene = parse((folder / SCENE).read_text(encoding="utf-8"), SCENE)
    if data.pop("scene") != fingerprint(scene):
        raise ValueError(
            f"{folder / SCENE} is not the scene of this state: only end, record, fraction, "
            "step, title and watch may change; undo the rest, or run it as a scene of its own"
        )
    joints = {}
    for i, name in enumerate(scene.laws):
        law = JointState(str(data.pop(f"fingerprint-{i}")), data.pop(f"law-{i}").T)
        points = data.pop(f"points-{i}").tolist()
        joints[name] = [(tuple(key), number) for *key, number in points], law
    return scene, Saved(data, joints)


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
    """Hash of what the motion depends on, but not when a run ends, records, or at which step.

    Keys of [run] at their defaults are left out, and order and period of drives that have none, so
    that what is added later leaves the hashes of scenes without it as they were.
    """
    run = asdict(replace(scene.run, end=0.0, record=Run.record, fraction=Run.fraction, step=None))
    given = {key: value for key, value in run.items() if value != getattr(Run, key, None)}
    drives = [asdict(drive) for drive in scene.drives]
    drives = [{k: v for k, v in d.items() if v or k not in ("order", "period")} for d in drives]
    pairs = sorted((sorted(blocks), law) for blocks, law in scene.pairs.items())
    whole = [
        [block.__dict__ | {"corners": block.corners.tolist()} for block in scene.blocks],
        # the parameters alone: another discretisation is refused with its own remedy
        {name: law.fingerprint.rpartition(":")[2] for name, law in scene.laws.items()},
        scene.default_law, pairs, sorted(scene.edge_laws.items()), given,
        drives, [float(g) for g in scene.gravity],
        float(scene.thickness),
    ]  # fmt: skip
    return hashlib.sha256(json.dumps(whole).encode()).hexdigest()
