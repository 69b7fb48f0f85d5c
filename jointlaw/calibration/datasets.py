"""Measured curves that come with the package, with their sources."""

from __future__ import annotations

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from .curve_files import ClosureData, read_closure


def names() -> list[str]:
    """Names of all data sets."""
    folder = resources.files(__package__) / "data"
    return sorted(entry.name[:-4] for entry in folder.iterdir() if entry.name.endswith(".csv"))


def about(name: str) -> dict[str, Any]:
    """Title, source and remarks of a data set."""
    _known(name)
    folder = resources.files(__package__) / "data"
    return tomllib.loads((folder / f"{name}.toml").read_text(encoding="utf-8"))


def load(name: str) -> ClosureData:
    """Stress (Pa) and closure (m) of a data set, loading and unloading in the order measured."""
    _known(name)
    with resources.as_file(resources.files(__package__) / "data" / f"{name}.csv") as path:
        return read_closure(Path(path))


def _known(name: str) -> None:
    if name not in names():
        raise ValueError(f"data set {name!r} is unknown; choose one of {', '.join(names())}")
