"""States of a simulation, in memory and in a file.

`state.npz` holds its version, the text of the scene and of the files that this names, and arrays.
"""

import io
import json
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from jointlaw.support.files import replace_file

from ..contact import PARTS
from ..scene import Files, Scene, parse

FILE = "state.npz"
VERSION = 8  # of state.npz
KEPT = (  # of what changes in a run, but for the joints: arrays that stay in their place
    "blocks.motion", "blocks.velocity", "blocks.loads", "blocks.gone", "blocks.support", "begun",
    "blocks.drives.reversed_at",
    "tracker.renewed_at", "tracker.urgent", "ledger.energy", "ledger.forces",
)  # fmt: skip
STATE = (
    *KEPT, "t0", "n", "dt", "halvings", "limit.now", "limit.least", "limit.bound", "limit.checked",
    "tracker.keys", "tracker.law", "tracker.offset",
    "ledger.start", "ledger.area", "ledger.lost", "loose",
)  # fmt: skip
PLACES = "contacts.corner", "contacts.edge"  # from which the contacts are made anew


Saved = dict[str, np.ndarray]  # a copy of everything that the future depends on


def save(scene: Scene, saved: Saved, folder: Path) -> None:
    """Write a state with its scene to a folder; a state that is there is kept until all is written.

    Raises ValueError for a scene that was made or changed in memory.
    """
    require_text(scene)
    buffer, files = io.BytesIO(), json.dumps(scene.files)
    np.savez(buffer, version=VERSION, scene=scene.text, files=files, **saved)
    folder.mkdir(parents=True, exist_ok=True)
    replace_file(folder / FILE, buffer.getvalue())


def load(folder: Path) -> tuple[Scene, Saved]:
    """The scene and the state that `save` wrote into a folder, or a run into folders in it. Raises
    ValueError if they are not whole."""
    places = (folder / part / FILE for part in ("", "state", "refused"))
    file = next((place for place in places if place.is_file()), folder / FILE)
    if not file.is_file():
        raise ValueError(f"{str(folder)!r} holds no saved state: {FILE} is missing")
    try:
        # a ZIP file: it checks its sums; opened here, for numpy leaves a damaged one open
        with file.open("rb") as opened, np.load(opened, allow_pickle=False) as stored:
            data = {name: stored[name] for name in stored.files}
        if (version := int(data["version"])) == VERSION:
            files = Files(known=json.loads(str(data["files"])).items())
            scene = parse(str(data["scene"]), str(file), files)
            joints = [f"{part}-{i}" for part in PARTS for i in range(len(scene.laws))]
            return scene, {name: data[name] for name in (*STATE, *PLACES, "touch", *joints)}
    except (OSError, EOFError, LookupError, ValueError, AttributeError, BadZipFile) as error:
        raise ValueError(f"{file} is damaged ({error}): run the scene again") from None
    raise ValueError(
        f"{file} has version {version}, this demo reads {VERSION}: go on with the version of the "
        "demo that wrote it, or run the scene again"
    )


def require_text(scene: Scene) -> None:
    """Refuse a scene without a text. Raises ValueError."""
    if not scene.text:
        raise ValueError(
            "the scene was made or changed in memory, so it has no text to go on from: write the "
            "change into the TOML text and parse that, or go on in memory with "
            "Simulation(scene, saved=state)"
        )
