"""Reading TOML tables with errors that name the key, its value, the bound and the remedy.

Written by hand: a validation library would word these errors itself, and would not name the key by
its place in the file, the unit and the remedy.
"""

import sys
from collections.abc import Container, Iterator
from typing import Any

import numpy as np

from jointlaw.support.checks import remedy

from ..errors import SceneError

KINDS = {float: "a number", str: "a text", bool: "true or false", list: "a list", dict: "a table"}


class Table:
    """A TOML table that knows its place in the file and which of its keys were read."""

    def __init__(self, data: dict[str, Any], where: str) -> None:
        if not isinstance(data, dict):
            raise SceneError(f"{where} = {data!r}: must be a table")
        self.data, self.where, self.known = data, where, set()

    def take(
        self, key: str, kind, default=..., above=None, least=None, below=None, most=None,
        infinite=False, say="",
    ):  # fmt: skip
        """A value, checked; `kind` is float, str, bool, list or dict; `say`: unit or remedy."""
        self.known.add(key)
        if key not in self.data:
            if default is ...:
                raise SceneError(f"{self.path(key)} is missing{': ' + say if say else ''}")
            return default
        value = self.data[key]
        if kind is float and isinstance(value, int) and not isinstance(value, bool):
            value = float(value) if finite(value) else np.inf  # TOML's integers have no bound
        if not isinstance(value, kind):
            raise self.error(key, f"must be {KINDS[kind]}")
        if kind is float and not (np.isfinite(value) or (infinite and value > 0)):
            raise self.error(key, "must be finite", value)
        for bound, kept, sign in (
            (above, above is None or value > above, ">"),
            (least, least is None or value >= least, ">="),
            (below, below is None or value < below, "<"),
            (most, most is None or value <= most, "<="),
        ):
            if not kept:
                raise self.error(key, f"must be {sign} {bound} {say}".rstrip(), value)
        return value

    def whole(self, key: str, default: int, least: int) -> int:
        """A whole number."""
        value = self.take(key, float, default, least=least)
        if value % 1:
            raise self.error(key, "must be a whole number", value)
        return int(value)

    def density(self, default: float) -> float:
        """The density of rock."""
        say = "kg/m3; 2.6 g/cm3 is 2600 kg/m3"
        return self.take("density", float, default, least=50.0, most=30000.0, say=say)

    def vector(self, key: str, default=...):
        """Two finite numbers."""
        value = self.take(key, list, default)
        return default if value is default else self.two_numbers(key, value)

    def two_numbers(self, key: str, value: Any) -> tuple[float, float]:
        """A value that must be two finite numbers."""
        if not (isinstance(value, list) and len(value) == 2 and all(map(finite, value))):
            raise self.error(key, "must be two numbers [x, y]", value)
        return float(value[0]), float(value[1])

    def numbers(self, key: str) -> np.ndarray:
        """Finite numbers (k,)."""
        value = self.take(key, list)
        if not all(map(finite, value)):
            raise self.error(key, "must be finite numbers")
        return np.array(value, float)

    def corners(self, key: str, say: str = "") -> np.ndarray:
        """Corners (k, 2) in m, three of them or more."""
        value = self.take(key, list, say=say)
        pairs = all(isinstance(p, list) and len(p) == 2 and all(map(finite, p)) for p in value)
        if not pairs or len(value) < 3:
            raise SceneError(f"{self.path(key)} must be a list of at least 3 corners [x, y] in m")
        return np.array(value, float)

    def tables(self, key: str, default=..., say: str = "") -> "Iterator[Table]":
        """The tables of a list of tables."""
        for i, data in enumerate(self.take(key, list, default, say=say)):
            yield Table(data, f"{self.path(key)}[{i}]")

    def path(self, key: str) -> str:
        """The key with its place in the file."""
        return f"{self.where}.{key}"

    def error(self, key: str, must: str, value: Any = ...) -> SceneError:
        """What is wrong with the value of a key, or with a part of it."""
        value = self.data[key] if value is ... else value
        return SceneError(f"{self.path(key)} = {value!r}: {must}")

    def finish(self) -> None:
        """Refuse keys that nobody asked for."""
        for key in self.data:
            if key not in self.known:
                hint = remedy(key, sorted(self.known), "known:")
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


def overlay(below: Any, above: Any) -> Any:
    """Tables are joined key by key, lists of tables table by table; all else is replaced."""
    if isinstance(above, dict) and isinstance(below, dict):
        return below | {key: overlay(below.get(key), value) for key, value in above.items()}
    if isinstance(below, list) and all(isinstance(table, dict) for table in (*below, *above)):
        joined = [overlay(*pair) for pair in zip(below, above, strict=False)]
        return joined + below[len(joined) :] + above[len(joined) :]
    return above
