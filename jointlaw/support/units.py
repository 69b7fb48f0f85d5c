"""Parsing of quantities with units: 10MPa, 2um, 30deg, 5GPa/m; a number alone is in SI units."""

import math
import re

COMMON = {  # a practical unit for each SI unit, for examples in messages
    "Pa": "MPa", "m": "mm", "Pa/m": "GPa/m", "rad": "deg", "N": "kN", "m2": "cm2",
    "m3/s": "ml/min", "Pas": "mPas",
}  # fmt: skip
_PREFIX = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "c": 1e-2, "": 1.0,
           "k": 1e3, "M": 1e6, "G": 1e9}  # fmt: skip
_M, _N, _PA = ({f"{prefix}{unit}": x for prefix, x in _PREFIX.items()} for unit in ("m", "N", "Pa"))
_STRESS = _PA | {
    "N/mm2": 1e6, "N/mm²": 1e6, "MN/m2": 1e6, "MN/m²": 1e6, "kN/m2": 1e3, "kN/m²": 1e3, "bar": 1e5,
}  # fmt: skip
_FACTORS = {  # SI units in each unit
    "Pa": _STRESS,
    "m": _M,
    "Pa/m": {f"{over}/{under}": x / y for over, x in _STRESS.items() for under, y in _M.items()},
    "rad": {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180},
    "N": _N,
    "m2": {"m2": 1.0, "m²": 1.0, "cm2": 1e-4, "cm²": 1e-4, "mm2": 1e-6, "mm²": 1e-6},
    "m3/s": {
        "m3/s": 1.0,
        "m³/s": 1.0,
        "l/s": 1e-3,
        "ml/s": 1e-6,
        "l/min": 1e-3 / 60,
        "ml/min": 1e-6 / 60,
    },
    "Pas": {"Pas": 1.0, "mPas": 1e-3},
}
_PATTERN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def parse(text: str, unit: str) -> float:
    """The value of a quantity in SI units.

    text: a number, alone or followed by a unit.
    unit: SI unit of the result, a key of `COMMON`; units that convert to it are accepted.

    Raises ValueError naming the text, the unit and an example.
    """
    number, given_unit = _split(text)
    if number and (given_unit or unit) in _FACTORS[unit]:
        return float(number) * _FACTORS[unit][given_unit or unit]
    raise ValueError(
        f"{text!r} is not a quantity in {unit}; write a number in {unit} or 10{COMMON[unit]}"
    )


def _split(text: str) -> tuple[str, str]:
    """Number and unit of a quantity, as text; both are empty for other text."""
    match = _PATTERN.fullmatch(text)
    return (match[1], match[2]) if match else ("", "")


def parse_option(text: str, unit: str, *, positive: bool = False) -> float:
    """The value in SI units of an option of the command line, where only zero needs no unit.

    text, unit: as in `parse`. positive: whether the value must be > 0.

    Raises ValueError for text that `parse` refuses, a number without its unit, a number that
    overflows and, with `positive`, a number <= 0.
    """
    value = parse(text, unit)
    short = text.strip()
    if math.isinf(value):
        raise ValueError(f"{text} is not finite; give a finite number")
    if value and not _split(text)[1]:
        raise ValueError(
            f"{short} has no unit: write for example {short}{COMMON[unit]}, or {short}{unit}"
        )
    if positive and value <= 0:
        raise ValueError(f"{text} is out of bounds: it must be > 0 {unit}")
    return value
