"""Quantities as people write them: 10MPa, 2um, 30deg, 5GPa/m; a bare number is SI."""

import math
import re

COMMON = {
    "Pa": "MPa", "m": "mm", "Pa/m": "GPa/m", "rad": "deg", "N": "kN", "m2": "cm2",
}  # fmt: skip
_PREFIX = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "": 1.0,
           "k": 1e3, "M": 1e6, "G": 1e9}  # fmt: skip
_STRESSES = {
    "N/mm2": 1e6,
    "N/mm²": 1e6,
    "MN/m2": 1e6,
    "MN/m²": 1e6,
    "kN/m2": 1e3,
    "kN/m²": 1e3,
    "bar": 1e5,
}
_AREAS = {"m2": 1.0, "m²": 1.0, "cm2": 1e-4, "cm²": 1e-4, "mm2": 1e-6, "mm²": 1e-6}
_PATTERN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def parse(text: str, unit: str) -> float:
    """The SI value of `text`, whose suffix must be `unit` ("Pa", "m", "Pa/m", "rad") or none.

    Raises ValueError naming the text, the unit and an example.
    """
    match = _PATTERN.fullmatch(text)
    if match:
        value, suffix = float(match.group(1)), match.group(2)
        factor = 1.0 if suffix == "" else _factor(suffix, unit)
        if factor is not None:
            return value * factor
    example = {"Pa": "10MPa", "m": "2um", "Pa/m": "5GPa/m", "rad": "30deg",
               "N": "5kN", "m2": "100cm2"}[unit]  # fmt: skip
    raise ValueError(f"{text!r} is not a quantity in {unit}; write a number in {unit} or {example}")


def typed(text: str, unit: str, *, positive: bool = False) -> float:
    """The SI value of what a person typed for an option: only zero needs no unit.

    Raises ValueError for text that `parse` refuses, a number without its unit, a number beyond
    those of a computer and, if it must be positive, any other.
    """
    value = parse(text, unit)
    if math.isinf(value):
        raise ValueError(f"{text} is not finite; give a finite number")
    if value and text.strip()[-1] in "0123456789.":
        short = text.strip()
        raise ValueError(
            f"{short} has no unit: write for example {short}{COMMON[unit]}, or {short}{unit}"
        )
    if positive and value <= 0:
        raise ValueError(f"{text} is out of bounds: it must be > 0 {unit}")
    return value


def _factor(suffix: str, unit: str) -> float | None:
    if unit == "rad":
        return {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180}.get(suffix)
    if unit == "Pa/m":
        top, _, bottom = suffix.partition("/")
        over, under = _factor(top, "Pa"), _factor(bottom, "m")
        return None if over is None or under is None else over / under
    if unit == "m2":
        return _AREAS.get(suffix)
    if unit == "Pa" and suffix in _STRESSES:
        return _STRESSES[suffix]
    if not suffix.endswith(unit):
        return None
    return _PREFIX.get(suffix[: -len(unit)])
