"""Files that are written whole or not at all."""

import contextlib
import json
import os
import threading
from collections.abc import Mapping
from pathlib import Path
from typing import Any

# What a run leaves beside what its summary lists; a folder that has one of these holds a run
LEFT = ("summary.json", "history.csv", "ablation.csv", "state/scene.toml", "state/state.npz",
        "refused/scene.toml", "refused/state.npz")  # fmt: skip
MARKS = (*dict.fromkeys(name.partition("/")[0] for name in LEFT), "strength.json")


def replace_file(path: Path, data: bytes) -> None:
    """Write a file whole or not at all."""
    mine = f"{os.getpid()}-{threading.get_ident()}"  # another thread may write the same file
    temporary = path.with_name(f".{path.name}.{mine}.tmp")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def made(folder: Path) -> Path:
    """The folder, made if it is missing. Raises ValueError where it cannot be."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(
            f"no folder can be made at {folder} ({error.strerror}): give one in a place where you "
            "may write"
        ) from None
    return folder


def write_files(directory: str | Path, files: Mapping[str, str | bytes]) -> Path:
    """Write files by name into a folder, which is made if missing; returns it."""
    folder = made(Path(directory))
    for name, data in files.items():
        replace_file(folder / name, data.encode() if isinstance(data, str) else data)
    return folder


def require_free(folder: Path) -> None:
    """Refuse a folder that holds another run. Raises ValueError with the remedy."""
    if held := [name for name in MARKS if (folder / name).exists()]:
        raise ValueError(
            f"{folder} holds another run ({', '.join(held)}): give another --out, or --force to "
            "replace it"
        )


def clear_run(folder: Path) -> None:
    """Make a folder for results; of a run that it holds what that wrote is removed, and no more."""
    made(folder)
    paths = [*(folder / name for name in LEFT), *folder.glob("vtk/*.vtu")]
    with contextlib.suppress(OSError, ValueError):  # an interrupted run has no summary
        written = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["files"]
        paths += [folder / Path(name).name for name in written]
    for path in paths:
        if path.is_file():
            path.unlink()
    for name in ("state", "refused", "vtk"):
        with contextlib.suppress(OSError):  # it is not empty: other files are in it
            (folder / name).rmdir()


def write_json(path: Path, data: Any) -> None:
    """Strict JSON: what is not finite becomes null, numpy's numbers and arrays plain ones."""
    plain = json.dumps(data, default=lambda one: one.tolist())
    finite = json.loads(plain, parse_constant=lambda name: None)
    replace_file(path, (json.dumps(finite, indent=2, ensure_ascii=False) + "\n").encode())
