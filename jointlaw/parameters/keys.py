"""Validation of TOML files: known and required keys, and a rule for the value of each.

Every TOML file of the project is read here. Errors name the file, the path of the key, and a
remedy. A rule for the value of a key is one of

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
    """Read the table of a file. Raises ValueError if it does not exist or is no TOML in UTF-8."""
    if not path.is_file():
        raise ValueError(f"{what} {str(path)!r} does not exist")
    try:
        return parse(path.read_text(encoding="utf-8"), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{str(path)!r} is not a text file in UTF-8: {error}") from None


def parse(text: str, where: str) -> Table:
    """Parse the table of TOML text; `where` names it in errors."""
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{where} is not valid TOML: {error}") from None


def validate_table(data: Any, rules: Mapping[str, Any], where: str, path: str = "") -> Table:
    """Validate a table by the rule for each key, and return it with the validated values.

    rules: rule by key; a key that ends in "!" is required. where: name of the file, and path: path
    of the table in the file, for error messages.

    Raises ValueError for an unknown, missing or invalid key.
    """
    if not isinstance(data, dict):
        raise ValueError(f"{where}: key {path!r} must be a table")
    prefix = f"{path}." if path else ""
    rule_of = {key.rstrip("!"): rule for key, rule in rules.items()}
    validated: Table = {}
    for key, value in data.items():
        name = prefix + key
        if key not in rule_of:
            raise ValueError(
                f"{where}: key '{name}' is unknown; {remedy(key, sorted(rule_of), 'known here:')}"
            )
        rule = rule_of[key]
        if isinstance(rule, Mapping):
            validated[key] = validate_table(value, rule, where, name)
        elif isinstance(rule, list):
            if not isinstance(value, list):
                raise ValueError(f"{where}: key {name!r} must be a list of tables")
            validated[key] = [
                validate_table(item, rule[0], where, f"{name}[{i}]") for i, item in enumerate(value)
            ]
        else:
            validated[key] = rule(f"{where}: {name}", value)
    for key in rules:
        if key.endswith("!") and key[:-1] not in data:
            raise ValueError(f"{where}: key '{prefix}{key[:-1]}' is missing; give it a value")
    return validated


def any_value(name: str, value: Any) -> Any:
    """A rule for any value, which the constructor validates."""
    return value


def keys_of(kind: Any) -> dict[str, Any]:
    """Keys that a table may have for the fields of a dataclass, by `validate_table`.

    Keys of fields without a default end in "!", because a table must have them. Any value is
    accepted, because the dataclass validates values itself.
    """
    rules = {}
    for item in fields(kind):
        is_required = item.default is MISSING
        rules[item.name + ("!" if is_required else "")] = any_value
    return rules
