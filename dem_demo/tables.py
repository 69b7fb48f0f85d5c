"""Reading TOML tables with errors that name the key, its value, the bound and the remedy."""

from __future__ import annotations

import sys
from collections.abc import Container
from difflib import get_close_matches
from typing import Any

import numpy as np


class SceneError(ValueError):
    """A scene file that cannot be run: says which key, its value, the bound and the remedy."""


class Table:
    """A TOML table that knows its place in the file and which of its keys were read."""

    def __init__(self, data: dict[str, Any], where: str) -> None:
        if not isinstance(data, dict):
            raise SceneError(f"{where} = {data!r}: must be a table")
        self.data, self.where, self.known = data, where, set()

    def take(self, key: str, kind, default=..., above=None, least=None, say=""):
        """A value, checked; `kind` is float, str, bool, list or dict."""
        self.known.add(key)
        if key not in self.data:
            if default is ...:
                raise SceneError(f"{self.path(key)} is missing{': ' + say if say else ''}")
            return default
        value = self.data[key]
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value) if finite(value) else np.inf  # TOML's integers have no bound
        if not isinstance(value, kind):
            name = {float: "a number", str: "a text", bool: "true or false", list: "a list"}
            raise SceneError(f"{self.path(key)} = {value!r}: must be {name.get(kind, 'a table')}")
        if kind is float and not (np.isfinite(value) or (key == "point_spacing" and value > 0)):
            raise SceneError(f"{self.path(key)} = {value}: must be finite")
        if above is not None and not value > above:
            raise SceneError(f"{self.path(key)} = {value}: must be > {above}{' ' + say}".rstrip())
        if least is not None and not value >= least:
            raise SceneError(f"{self.path(key)} = {value}: must be >= {least}{' ' + say}".rstrip())
        return value

    def whole(self, key: str, default: int, least: int) -> int:
        """A whole number."""
        value = self.take(key, float, default, least=least)
        if value % 1:
            raise SceneError(f"{self.path(key)} = {value}: must be a whole number")
        return int(value)

    def vector(self, key: str, default=...):
        """Two finite numbers."""
        value = self.take(key, list, default)
        if value is default:
            return default
        if len(value) != 2 or not all(map(finite, value)):
            raise SceneError(f"{self.path(key)} = {value!r}: must be two numbers [x, y]")
        return tuple(float(v) for v in value)

    def numbers(self, key: str) -> np.ndarray:
        """Finite numbers (k,)."""
        value = self.take(key, list)
        if not all(map(finite, value)):
            raise SceneError(f"{self.path(key)} = {value!r}: must be finite numbers")
        return np.array(value, float)

    def corners(self, key: str, say: str = "") -> np.ndarray:
        """Corners (k, 2) in m, three of them or more."""
        value = self.take(key, list, say=say)
        pairs = all(isinstance(p, list) and len(p) == 2 and all(map(finite, p)) for p in value)
        if not pairs or len(value) < 3:
            raise SceneError(f"{self.path(key)} must be a list of at least 3 corners [x, y] in m")
        return np.array(value, float)

    def path(self, key: str) -> str:
        """The key with its place in the file."""
        return f"{self.where}.{key}" if "=" not in self.where else f"{self.where}: {key}"

    def finish(self) -> None:
        """Refuse keys that nobody asked for."""
        for key in self.data:
            if key not in self.known:
                near = get_close_matches(key, self.known, 1)
                hint = (
                    f"did you mean {near[0]!r}?"
                    if near
                    else "known: " + ", ".join(sorted(self.known))
                )
                raise SceneError(f"{self.path(key)} is unknown; {hint}")


def finite(value: Any) -> bool:
    """Is it a finite number that a float can hold?"""
    number = isinstance(value, int | float) and not isinstance(value, bool)
    return number and abs(value) <= sys.float_info.max


def distinct(values: Any, known: Container[str], count: int | None = None) -> bool:
    """Is it a list of different known names, `count` of them?"""
    if not (isinstance(values, list) and all(isinstance(v, str) and v in known for v in values)):
        return False
    return len(set(values)) == len(values) and count in (None, len(values))
