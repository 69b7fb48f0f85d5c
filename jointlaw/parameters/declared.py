"""A parameter, said once: what it is, its unit, bounds and default.

A dataclass whose fields come from `parameter` and that `declared` decorates lists them in its
docstring. Checks, TOML files, fingerprints, tables and fits go through the same list.
"""

import hashlib
import math
from dataclasses import MISSING, field, fields, is_dataclass
from textwrap import fill
from typing import Any, NamedTuple, TypeVar

from ..support.checks import integer, number, one_of

T = TypeVar("T")
_WIDTH = 96


class Parameter(NamedTuple):
    """What is said of a parameter."""

    about: str
    unit: str
    kind: Any  # float, int, bool, what else it must be an instance of, or such by names of files
    choices: tuple[str, ...]
    low: float
    high: float
    above: bool  # whether `low` itself is out of bounds
    infinite: bool  # whether infinity is a value
    fit: tuple[float, float] | None  # bounds in a fit; None where no fit finds it
    log: bool  # whether a fit looks for the logarithm of the value plus `shift`
    shift: float

    @property
    def bounds(self) -> str:
        """The bounds in words, empty if there are none."""
        low = f"{'>' if self.above else '>='} {self.low:g}" if self.low > -math.inf else ""
        high = f"<= {self.high:g}" if self.high < math.inf else ""
        return f"{low} and {high}" if low and high else low or high


def parameter(
    about: str,
    unit: str = "",
    default: Any = MISSING,
    *,
    kind: Any = float,
    choices: tuple[str, ...] = (),
    above: float | None = None,
    low: float = -math.inf,
    high: float = math.inf,
    infinite: bool = False,
    fit: tuple[float, float] | None = None,
    log: bool = True,
    shift: float = 0.0,
) -> Any:
    """A field of a dataclass that is a parameter, `above` or from `low` to `high`."""
    said = Parameter(
        about, unit, kind, choices, low if above is None else above, high, above is not None,
        infinite, fit, log, shift,
    )  # fmt: skip
    return field(default=default, metadata={"parameter": said})


def parameters_of(kind: Any) -> dict[str, Parameter]:
    """The declared parameters of a dataclass, or of an instance, by name."""
    return {
        one.name: one.metadata["parameter"] for one in fields(kind) if "parameter" in one.metadata
    }


def declared(kind: type[T]) -> type[T]:
    """Add the list of its parameters to the docstring of a dataclass."""
    lines = []
    for name, said in parameters_of(kind).items():
        limits = "; ".join(part for part in (said.unit, said.bounds) if part)
        text = f"{name}: {said.about}{f' ({limits})' if limits else ''}."
        lines.append(fill(text, _WIDTH, initial_indent="    ", subsequent_indent=" " * 8))
    text = (kind.__doc__ or "").rstrip()
    head, mark, tail = text.partition("\n\n    Raises")
    kind.__doc__ = "\n".join(
        [head, "", "    Parameters", "    ----------", *lines, *([mark[1:] + tail] if mark else [])]
    )
    return kind


def check(values: Any, path: str = "") -> None:
    """Check every declared parameter of a frozen dataclass; path: its name within a law.

    Numbers become floats. A parameter whose default is None may be None. Raises ValueError naming
    the parameter, its value and its bound.
    """
    optional = {one.name for one in fields(values) if one.default is None}
    for name, said in parameters_of(values).items():
        value, where = getattr(values, name), f"{path}.{name}" if path else name
        if value is None and name in optional:
            continue
        if said.kind is float:
            value = within(where, value, said)
            object.__setattr__(values, name, value)
        elif said.kind is int:
            object.__setattr__(values, name, integer(where, value, int(said.low)))
        elif said.choices:
            object.__setattr__(values, name, one_of(where, value, said.choices))
        elif said.kind is bool and not isinstance(value, bool):
            raise ValueError(f"{where} = {value!r} must be True or False")
        elif isinstance(said.kind, type) and not isinstance(value, said.kind):
            or_none = ", or None" if name in optional else ""
            raise ValueError(f"{where} = {value!r} must be of type {said.kind.__name__}{or_none}")


def within(name: str, value: Any, said: Parameter) -> float:
    """The value as a float within the bounds of the parameter."""
    result = number(name, value, infinite=said.infinite)
    if result < said.low or (said.above and result == said.low) or result > said.high:
        unit = f" {said.unit}" if said.unit else ""
        raise ValueError(f"{name} = {result!r}{unit} is out of bounds: it must be {said.bounds}")
    return result


def fingerprint(parameters: Any) -> str:
    """Hash of a dataclass of parameters and of those within it.

    Fields at their default are left out, so that a parameter that is added later, and is off by
    default, leaves the hashes of all laws without it as they were.
    """
    return hashlib.sha256(_text(parameters).encode()).hexdigest()


def _text(value: Any) -> str:
    if not is_dataclass(value):
        return repr(value + 0.0 if isinstance(value, float) else value)  # -0.0 is 0.0
    parts = []
    for one in fields(value):
        now = getattr(value, one.name)
        if one.compare and (one.default is MISSING or now != one.default):
            parts.append(f"{one.name}={_text(now)}")
    return f"{type(value).__name__}({', '.join(parts)})"
