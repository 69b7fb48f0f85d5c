"""Tables of TOML files, checked: which keys there are, which are needed, what each may be.

Every TOML file of the project is read here. Errors name the file, the key by its path, and what to
write instead. A rule for the value of a key is one of

    a function (name, value)    returns the value, or raises ValueError; the name has file and key
    a mapping of rules          for a table
    [a mapping of rules]        for a list of tables
"""

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

from ..support.checks import remedy

Table = dict[str, Any]


def read(path: Path, what: str = "TOML file") -> Table:
    """The table of a file. Raises ValueError if there is none, or it is not TOML in UTF-8."""
    if not path.is_file():
        raise ValueError(f"{what} {str(path)!r} does not exist")
    try:
        return parse(path.read_text(encoding="utf-8"), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{str(path)!r} is not a text file in UTF-8: {error}") from None


def parse(text: str, where: str) -> Table:
    """The table of TOML text; `where` is named in errors."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where} is not valid TOML: {error}") from None


def checked(data: Any, rules: Mapping[str, Any], where: str, path: str = "") -> Table:
    """A table whose keys are those of `rules`, and whose values pass them.

    rules: rule by key; a key that ends in "!" is needed. where: file, and path: of the table in
    it, as errors name them.
    """
    if not isinstance(data, dict):
        raise ValueError(f"{where}: key {path!r} must be a table")
    prefix = f"{path}." if path else ""
    rule_of = {key.rstrip("!"): rule for key, rule in rules.items()}
    found: Table = {}
    for key, value in data.items():
        name = prefix + key
        if key not in rule_of:
            raise ValueError(
                f"{where}: key '{name}' is unknown; {remedy(key, sorted(rule_of), 'known here:')}"
            )
        rule = rule_of[key]
        if isinstance(rule, Mapping):
            found[key] = checked(value, rule, where, name)
        elif isinstance(rule, list):
            if not isinstance(value, list):
                raise ValueError(f"{where}: key {name!r} must be a list of tables")
            found[key] = [
                checked(one, rule[0], where, f"{name}[{i}]") for i, one in enumerate(value)
            ]
        else:
            found[key] = rule(f"{where}: {name}", value)
    for key in rules:
        if key.endswith("!") and key[:-1] not in data:
            raise ValueError(f"{where}: key '{prefix}{key[:-1]}' is missing; give it a value")
    return found


def as_given(name: str, value: Any) -> Any:
    """A rule: any value; the constructor that takes it checks it."""
    return value


def keys_of(kind: Any) -> dict[str, Any]:
    """Rules for a table with the fields of a dataclass, which checks their values itself."""
    return {one.name + ("!" if one.default is MISSING else ""): as_given for one in fields(kind)}
