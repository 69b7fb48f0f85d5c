"""States of a simulation, in memory and in a file.

`state.npz` holds its version, the text of the scene and of the files that this names, and arrays.
"""

import io
import json
from dataclasses import dataclass
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from jointlaw.joints.state import JointState
from jointlaw.support.files import replace_file

from ..contact import PoolState
from ..scene import Files, Scene, parse

FILE = "state.npz"
VERSION = 4  # of state.npz
STATE = (  # what changes in a run, but for the joints and the velocities to go on with
    "t0", "n", "dt", "reversed_at", "limit.now", "limit.least", "limit.checked", "blocks.motion",
    "tracker.corner", "tracker.edge", "tracker.keys", "tracker.numbers", "tracker.offset",
    "tracker.renewed_at", "tracker.given", "tracker.urgent", "ledger.value", "ledger.start",
    "ledger.forces", "ledger.area", "ledger.lost",
)  # fmt: skip


@dataclass(frozen=True, eq=False)
class Saved:
    """A copy of everything that the future depends on: arrays by name, and the joints' states."""

    arrays: dict[str, np.ndarray]
    joints: dict[str, PoolState]


def save(scene: Scene, saved: Saved, folder: Path) -> None:
    """Write a state with its scene to a folder; a state that is there is kept until all is written.

    Raises ValueError for a scene that was made or changed in memory.
    """
    require_text(scene)
    buffer, tables = io.BytesIO(), {}
    for i, (contacts, law) in enumerate(saved.joints.values()):
        # numbered: a law's name may be no array's name
        tables[f"law-{i}"], tables[f"fingerprint-{i}"] = law.values.T, np.array(law.fingerprint)
        tables[f"contacts-{i}"] = np.array([[*key, number] for key, number in contacts], int)
    about = {"version": VERSION, "scene": scene.text, "files": json.dumps(scene.files)}
    np.savez(buffer, **about, **saved.arrays, **tables)
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / FILE, buffer.getvalue())


def load(folder: Path) -> tuple[Scene, Saved]:
    """The scene and the state that `save` wrote. Raises ValueError if they are not whole."""
    file = folder / FILE
    if not file.is_file():
        raise ValueError(f"{str(folder)!r} holds no saved state: {FILE} is missing")
    try:
        with np.load(file, allow_pickle=False) as stored:  # a ZIP file: it checks its sums
            data = {name: stored[name] for name in stored.files}
        if (version := int(data["version"])) == VERSION:
            files = Files(known=json.loads(str(data["files"])).items())
            scene = parse(str(data["scene"]), str(file), files)
            return scene, Saved({k: data[k] for k in (*STATE, "velocity")}, _joints(data, scene))
    except (OSError, EOFError, LookupError, ValueError, AttributeError, BadZipFile) as error:
        raise ValueError(f"{file} is damaged ({error}): run the scene again") from None
    raise ValueError(
        f"{file} has version {version}, this demo reads {VERSION}: go on with the version of the "
        "demo that wrote it, or run the scene again"
    )


def _joints(data: dict[str, np.ndarray], scene: Scene) -> dict[str, PoolState]:
    joints = {}
    for i, name in enumerate(scene.laws):
        contacts = data[f"contacts-{i}"].tolist()
        law = JointState(str(data[f"fingerprint-{i}"]), data[f"law-{i}"].T)
        joints[name] = [(tuple(key), number) for *key, number in contacts], law
    return joints


def require_text(scene: Scene) -> None:
    """Refuse a scene without a text. Raises ValueError."""
    if not scene.text:
        raise ValueError(
            "the scene was made or changed in memory, so it has no text to go on from: write the "
            "change into the TOML text and parse that, or go on in memory with "
            "Simulation(scene, saved=state)"
        )
