"""Laws as TOML files, with the same keys as the constructors.

A table holds what differs from its default. Where there are several kinds, its key `kind` names
one; without it the first is meant.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from ..support.checks import one_of
from .declared import parameters_of
from .keys import checked, keys_of

VERSION = 1  # of the keys; a file without one is of version 1
FREE = ("version", "about")  # about: a free table for title, source and notes
Kinds = Mapping[str, Any]


def law_text(law: Any, kinds: Kinds, shown: Mapping[str, Any]) -> str:
    """TOML text of a law of one of these kinds; `shown` replaces values.

    Raises ValueError for what no file can name: a class of the user's own.
    """
    lines = [f"version = {VERSION}  # of this file's keys", *_lines(law, kinds, "law", shown)]
    return "\n".join(lines) + "\n"


def text_or_reason(law: Any) -> tuple[str, str]:
    """TOML text of a law and "", or "" and the reason if a parameter has a class without a name.

    For files that show the parameters but do not need them.
    """
    try:
        return law.to_toml(), ""
    except ValueError as error:
        return "", str(error)


def _lines(values: Any, kinds: Kinds, path: str, shown: Mapping[str, Any]) -> list[str]:
    """Lines of a table, those of tables within it last."""
    names = [name for name, kind in kinds.items() if type(values) is kind]
    if not names:
        raise ValueError(
            f"{path} = {values!r}: no file can name {type(values).__name__}; known are "
            f"{', '.join(kinds)} (a histogram stands for any other heights; CONTRIBUTING.md tells "
            "how to add a kind)"
        )
    lines = [f'kind = "{names[0]}"'] if names[0] != next(iter(kinds)) else []
    inner: list[str] = []
    defaults = {one.name: one.default for one in fields(values)}
    for name, said in parameters_of(values).items():
        value = shown.get(name, getattr(values, name))
        if value is None or value == defaults[name]:
            continue
        if is_dataclass(value):
            inner += ["", f"[{name}]", *_lines(value, kinds_of(said.kind), name, {})]
        else:
            lines.append(f"{name} = {_text(value)}" + (f"  # {said.unit}" if said.unit else ""))
    return [*lines, *inner]


def _text(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, tuple):
        return f"[{', '.join(map(_text, value))}]"
    return f'"{value}"' if isinstance(value, str) else repr(value + 0)  # -0.0 is 0.0


def kinds_of(kind: Any) -> Kinds:
    """The kinds that a parameter may be of, by the names that files have."""
    return kind if isinstance(kind, Mapping) else {"": kind}


def law_of(kinds: Kinds, data: Mapping[str, Any], where: str) -> Any:
    """A law of one of these kinds from the mapping of a file; `where` is named in errors."""
    version = data.get("version", VERSION)
    if version != VERSION:
        raise ValueError(
            f"{where}: key 'version' = {version!r}: this jointlaw reads version {VERSION}; write "
            "the law again with this version, or install the one that wrote it"
        )
    keys = {key: value for key, value in data.items() if key not in FREE}
    try:
        return build(kinds, keys, where, "")
    except ValueError as error:
        text = str(error)
        raise ValueError(text if text.startswith(f"{where}: ") else f"{where}: {text}") from None


def build(kinds: Kinds, data: Any, where: str, path: str) -> Any:
    """An object of one of these kinds from its table, and those within it from theirs."""
    first = next(iter(kinds))
    table = dict(data) if isinstance(data, Mapping) else data
    name = first
    if len(kinds) > 1 and isinstance(table, dict):
        key = f"{where}: {path}.kind" if path else f"{where}: kind"
        name = one_of(key, table.pop("kind", first), tuple(kinds))
    kind = kinds[name]
    values = checked(table, keys_of(kind), where, path)
    for key, said in parameters_of(kind).items():
        inner, value = kinds_of(said.kind), values.get(key)
        tables = is_dataclass(next(iter(inner.values())))
        if tables and value is not None and not isinstance(value, str):
            values[key] = build(inner, value, where, f"{path}.{key}" if path else key)
    return kind(**values)
