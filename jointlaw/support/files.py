"""Atomic writing of files, and the folder of a run: it is created, checked and cleared here."""

import contextlib
import json
import os
import threading
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

SUMMARY = "summary.json"  # lists the other files of a run under "files"


def replace_file(path: Path, data: bytes) -> None:
    """Write a file atomically: a reader finds the old content or the new one, never a part."""
    writer = f"{os.getpid()}-{threading.get_ident()}"  # another thread may write the same file
    temporary = path.with_name(f".{path.name}.{writer}.tmp")
    try:
        temporary.write_bytes(data)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def make_folder(folder: Path) -> Path:
    """Create a folder and its parents if they are missing; returns it.

    Raises ValueError naming the folder and the reason.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ValueError(
            f"no folder can be made at {folder} ({error.strerror}): give one in a place where you "
            "may write"
        ) from None
    return folder


def write_files(directory: str | Path, files: Mapping[str, str | bytes]) -> Path:
    """Write files by name into a folder, which is created if it is missing; returns the folder.

    files: content by name; text is written as UTF-8. Each file is written atomically.

    Raises ValueError where the folder cannot be created.
    """
    folder = make_folder(Path(directory))
    for name, content in files.items():
        replace_file(folder / name, content.encode() if isinstance(content, str) else content)
    return folder


def require_free(folder: Path, marks: Iterable[str] = (SUMMARY,)) -> None:
    """Refuse a folder that holds the results of another run.

    marks: names of files or folders each of which shows that a run has written here.

    Raises ValueError naming the marks that were found, and the remedy.
    """
    present = [name for name in marks if (folder / name).exists()]
    if present:
        raise ValueError(
            f"{folder} holds another run ({', '.join(present)}): give another --out, or --force to "
            "replace it"
        )


def clear_run(folder: Path, patterns: Iterable[str] = ()) -> None:
    """Create a folder for results, or remove the results of an earlier run from it.

    Removed are `summary.json`, the files that it lists, the files that match `patterns` (as
    `Path.glob` reads them), and folders named in the patterns that are empty then. All other files
    stay.
    """
    make_folder(folder)
    paths = [folder / SUMMARY]
    with contextlib.suppress(OSError, ValueError):  # an interrupted run has no summary
        summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
        listed = summary.get("files") if isinstance(summary, dict) else None
        names = listed if isinstance(listed, list) else []  # a summary of another program
        paths += [folder / Path(name).name for name in names if isinstance(name, str)]
    subfolders = set[str]()
    for pattern in patterns:
        paths += folder.glob(pattern)
        subfolders.add(pattern.rpartition("/")[0])
    for path in paths:
        if path.is_file():
            path.unlink()
    for name in subfolders - {""}:
        with contextlib.suppress(OSError):  # missing, or not empty: files of the user are in it
            (folder / name).rmdir()


def write_json(path: Path, data: Any) -> None:
    """Write `data` as strict JSON to `path`, atomically.

    NaN and infinity become null, numpy numbers and arrays plain numbers and lists.
    """
    text = json.dumps(data, default=lambda array: array.tolist())
    finite = json.loads(text, parse_constant=lambda constant: None)
    replace_file(path, (json.dumps(finite, indent=2, ensure_ascii=False) + "\n").encode())
