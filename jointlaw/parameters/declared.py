"""Declared parameters: description, unit, bounds and default of each, in one place.

A dataclass whose fields are made by `parameter`, with the decorator `declared`, lists them in its
docstring. Checks, TOML files, fingerprints, tables and fits use the same declarations.
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
    """Declaration of a parameter."""

    about: str
    unit: str
    kind: Any  # float, int, bool, another class, or classes by their names in files
    choices: tuple[str, ...]
    low: float
    high: float
    above: bool  # whether `low` itself is out of bounds
    infinite: bool  # whether infinity is allowed
    fit: tuple[float, float] | None  # bounds in a fit; None if it cannot be fitted
    log: bool  # whether a fit varies the logarithm of the value plus `shift`
    shift: float

    @property
    def bounds(self) -> str:
        """The bounds as text, empty if there are none."""
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
    """Declare a field of a dataclass as a parameter.

    about: description; unit: in SI; default: without one the parameter is required. kind: float,
    int, bool, another class, or a mapping of classes by their names in files; choices: allowed
    texts. above, low, high: bounds, `above` itself excluded; infinite: whether infinity is allowed.
    fit: bounds in a fit, None if it cannot be fitted; log, shift: a fit varies the logarithm of the
    value plus `shift`.
    """
    declaration = Parameter(
        about=about,
        unit=unit,
        kind=kind,
        choices=choices,
        low=low if above is None else above,
        high=high,
        above=above is not None,
        infinite=infinite,
        fit=fit,
        log=log,
        shift=shift,
    )
    return field(default=default, metadata={"parameter": declaration})


def parameters_of(kind: Any) -> dict[str, Parameter]:
    """The declared parameters of a dataclass, or of an instance, by name."""
    return {
        item.name: item.metadata["parameter"]
        for item in fields(kind)
        if "parameter" in item.metadata
    }


def declared(kind: type[T]) -> type[T]:
    """Add the list of its parameters to the docstring of a dataclass `kind`: a decorator."""
    lines = []
    for name, declaration in parameters_of(kind).items():
        limits = "; ".join(text for text in (declaration.unit, declaration.bounds) if text)
        text = f"{name}: {declaration.about}{f' ({limits})' if limits else ''}."
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
    optional = {item.name for item in fields(values) if item.default is None}
    for name, declaration in parameters_of(values).items():
        value = getattr(values, name)
        where = f"{path}.{name}" if path else name
        if value is None and name in optional:
            continue
        if declaration.kind is float:
            value = within(where, value, declaration)
            object.__setattr__(values, name, value)
        elif declaration.kind is int:
            object.__setattr__(values, name, integer(where, value, int(declaration.low)))
        elif declaration.choices:
            object.__setattr__(values, name, one_of(where, value, declaration.choices))
        elif declaration.kind is bool and not isinstance(value, bool):
            raise ValueError(f"{where} = {value!r} must be True or False")
        elif isinstance(declaration.kind, type) and not isinstance(value, declaration.kind):
            or_none = ", or None" if name in optional else ""
            raise ValueError(
                f"{where} = {value!r} must be of type {declaration.kind.__name__}{or_none}"
            )


def within(name: str, value: Any, declaration: Parameter) -> float:
    """The value as a float. Raises ValueError if it is outside the bounds of the parameter."""
    result = number(name, value, infinite=declaration.infinite)
    if (
        result < declaration.low
        or (declaration.above and result == declaration.low)
        or result > declaration.high
    ):
        unit = f" {declaration.unit}" if declaration.unit else ""
        raise ValueError(
            f"{name} = {result!r}{unit} is out of bounds: it must be {declaration.bounds}"
        )
    return result


def fingerprint(parameters: Any) -> str:
    """Hash of a dataclass of parameters, including dataclasses inside it.

    Fields at their default are left out. So a parameter that is added later, and inactive by
    default, does not change the hashes of laws without it.
    """
    return hashlib.sha256(_text(parameters).encode()).hexdigest()


def _text(value: Any) -> str:
    if not is_dataclass(value):
        return repr(value + 0.0 if isinstance(value, float) else value)  # -0.0 is 0.0
    parts = []
    for item in fields(value):
        current = getattr(value, item.name)
        if item.compare and (item.default is MISSING or current != item.default):
            parts.append(f"{item.name}={_text(current)}")
    return f"{type(value).__name__}({', '.join(parts)})"
