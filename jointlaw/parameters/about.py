"""Where a law comes from: the table [about] of its TOML file.

Commands that make a law write it, so that its caveats are not lost: every command that reads the
file repeats the warnings.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Self

from .keys import Table

ABOUT_TABLE = "about"
_TABLES = ("origin", "sha256")


@dataclass(frozen=True)
class About:
    """Origin and caveats of a law.

    Parameters
    ----------
    notes: free texts by name, such as title, source, command, version and date.
    warnings: what a user of this law has to know.
    origin: origin of parameters by name: measured, fitted (with an interval), given or assumed.
    sha256: hashes of the input files by their names.
    """

    notes: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    origin: Mapping[str, str] = field(default_factory=dict)
    sha256: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def from_table(cls, table: Any, where: str) -> Self:
        """The content of a table [about]; `where` names the file in errors.

        Raises ValueError for warnings that are no list of texts, and for other values than texts.
        """
        place = f"{where}: {ABOUT_TABLE}"
        rest = dict(_require_texts(table, place, except_for=("warnings", *_TABLES)))
        warnings = rest.pop("warnings", [])
        if not isinstance(warnings, list) or not all(isinstance(one, str) for one in warnings):
            raise ValueError(f"{place}.warnings = {warnings!r}: must be a list of texts")
        tables = {name: _require_texts(rest.pop(name, {}), f"{place}.{name}") for name in _TABLES}
        return cls(rest, tuple(warnings), **tables)

    def to_toml(self) -> str:
        """The table [about] as TOML; empty if there is nothing to write."""
        lines = [f"{name} = {_quoted(text)}" for name, text in self.notes.items()]
        if self.warnings:
            lines += ["warnings = [", *(f"    {_quoted(text)}," for text in self.warnings), "]"]
        if lines:
            lines.insert(0, f"[{ABOUT_TABLE}]")
        for name in _TABLES:
            if texts := getattr(self, name):
                lines += ["", f"[{ABOUT_TABLE}.{name}]"]
                lines += [f"{_quoted(key)} = {_quoted(text)}" for key, text in texts.items()]
        return "\n".join([*lines, ""]).lstrip("\n") if lines else ""


def _require_texts(table: Any, where: str, except_for: tuple[str, ...] = ()) -> Table:
    """Return a table. Raises ValueError unless its values, except for some, are texts."""
    if not isinstance(table, dict):
        raise ValueError(f"{where} = {table!r}: must be a table")
    for key, value in table.items():
        if key not in except_for and not isinstance(value, str):
            raise ValueError(f"{where}.{key} = {value!r}: must be a text")
    return table


def _quoted(text: str) -> str:
    """A text as a basic string of TOML, whose escapes are those of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
