"""Laws as TOML files, with the same keys as the constructors.

A table has the parameters that differ from their defaults. If there are several kinds, its key
`kind` names one; the default is the first kind.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from ..support.checks import one_of
from .aperture import APERTURE_TABLE, Aperture
from .declared import parameters_of
from .keys import keys_of, validate_table

VERSION = 1  # of the keys; a file without a version is of version 1
# about: a free table for title, source and notes; aperture: a map beside the law, not a part of it
OTHER_KEYS = ("version", "about", APERTURE_TABLE)
Kinds = Mapping[str, Any]


def law_text(law: Any, kinds: Kinds, shown: Mapping[str, Any]) -> str:
    """TOML text of a law of one of these kinds; `shown` replaces values of attributes.

    Raises ValueError for a class without a name in files.
    """
    lines = [f"version = {VERSION}  # of this file's keys", *_lines(law, kinds, "law", shown)]
    return "\n".join(lines) + "\n"


def text_or_reason(law: Any, flow: Aperture | None = None) -> tuple[str, str]:
    """TOML text of a law and "", or "" and the reason if a parameter has a class without a name.

    For files that show the parameters but do not need them. flow: hydraulic aperture to add.
    """
    try:
        text = law.to_toml()
        return (f"{text}\n{flow.to_toml()}" if flow else text), ""
    except ValueError as error:
        return "", str(error)


def _lines(values: Any, kinds: Kinds, path: str, shown: Mapping[str, Any]) -> list[str]:
    """Lines of a table; tables inside it come last."""
    names = [name for name, kind in kinds.items() if type(values) is kind]
    if not names:
        raise ValueError(
            f"{path} = {values!r}: no file can name {type(values).__name__}; known are "
            f"{', '.join(kinds)} (a histogram represents any other heights; CONTRIBUTING.md says "
            "how to add a kind)"
        )
    lines = [f'kind = "{names[0]}"'] if names[0] != next(iter(kinds)) else []
    inner: list[str] = []
    defaults = {item.name: item.default for item in fields(values)}
    declared = parameters_of(values)
    for item in fields(values):
        if item.init and item.name not in declared:
            raise ValueError(
                f"{path} = {values!r}: {item.name} of {type(values).__name__} is no declared "
                "parameter, so no file can hold it: declare it by jl.parameter() (CONTRIBUTING.md)"
            )
    for name, declaration in declared.items():
        value = shown.get(name, getattr(values, name))
        if value is None or value == defaults[name]:
            continue
        if is_dataclass(value):
            inner += ["", f"[{name}]", *_lines(value, kinds_of(declaration.kind), name, {})]
        else:
            unit = f"  # {declaration.unit}" if declaration.unit else ""
            lines.append(f"{name} = {_text(value)}{unit}")
    return [*lines, *inner]


def _text(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return f"[{', '.join(map(_text, value))}]"
    return f'"{value}"' if isinstance(value, str) else repr(value + 0)  # -0.0 is 0.0


def kinds_of(kind: Any) -> Kinds:
    """Classes that the value of a parameter may have, by their names in files."""
    return kind if isinstance(kind, Mapping) else {"": kind}


def law_of(kinds: Kinds, data: Mapping[str, Any], where: str) -> Any:
    """A law of one of these kinds from the mapping of a file; `where` names it in errors.

    Raises ValueError naming the key.
    """
    version = data.get("version", VERSION)
    if version != VERSION:
        raise ValueError(
            f"{where}: key 'version' = {version!r}: this jointlaw reads version {VERSION}; write "
            "the law again with this version, or install the one that wrote it"
        )
    if APERTURE_TABLE in data:
        Aperture.from_table(data[APERTURE_TABLE], where)  # validated here, used by exports
    keys = {key: value for key, value in data.items() if key not in OTHER_KEYS}
    try:
        return build(kinds, keys, where, "")
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(f"{where}: ") else f"{where}: {text}") from None


def build(kinds: Kinds, data: Any, where: str, path: str) -> Any:
    """An object of one of these kinds from its table, with the objects inside it."""
    first = next(iter(kinds))
    table = dict(data) if isinstance(data, Mapping) else data
    name = first
    if len(kinds) > 1 and isinstance(table, dict):
        key = f"{where}: {path}.kind" if path else f"{where}: kind"
        name = one_of(key, table.pop("kind", first), tuple(kinds))
    kind = kinds[name]
    values = validate_table(table, keys_of(kind), where, path)
    for key, declaration in parameters_of(kind).items():
        inner = kinds_of(declaration.kind)
        value = values.get(key)
        is_table = is_dataclass(next(iter(inner.values())))
        if is_table and value is not None and not isinstance(value, str):
            values[key] = build(inner, value, where, f"{path}.{key}" if path else key)
    return kind(**values)
