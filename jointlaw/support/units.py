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
    "N/mm2": 1e6, "MN/m2": 1e6, "kN/m2": 1e3, "N/m2": 1.0, "N/cm2": 1e4, "kN/cm2": 1e7,
    "bar": 1e5, "mbar": 1e2,
}  # fmt: skip
_FACTORS = {  # SI units in each unit
    "Pa": _STRESS,
    "m": _M,
    "Pa/m": {f"{over}/{under}": x / y for over, x in _STRESS.items() for under, y in _M.items()},
    "rad": {"rad": 1.0, "deg": math.pi / 180, "°": math.pi / 180},
    "N": _N,
    "m2": {"m2": 1.0, "cm2": 1e-4, "mm2": 1e-6},
    "m3/s": {
        "m3/s": 1.0,
        "l/s": 1e-3,
        "ml/s": 1e-6,
        "l/min": 1e-3 / 60,
        "ml/min": 1e-6 / 60,
    },
    "Pas": {"Pas": 1.0, "mPas": 1e-3},
}
# of units that `parse` refuses: a quantity of the same size, as a remedy in messages
OTHER_UNITS = {
    "in": "25.4mm", "inch": "25.4mm", "inches": "25.4mm", '"': "25.4mm", "ft": "304.8mm",
    "mil": "25.4um", "mils": "25.4um", "thou": "25.4um",
    "psi": "6.894757kPa", "ksi": "6.894757MPa", "psf": "47.88026Pa", "tsf": "95.76052kPa",
    "kgf/cm2": "98.0665kPa", "kg/cm2": "98.0665kPa", "kp/cm2": "98.0665kPa", "at": "98.0665kPa",
    "kgf/mm2": "9.80665MPa", "kg/mm2": "9.80665MPa", "atm": "101.325kPa",
    "t/m2": "9.80665kPa", "tf/m2": "9.80665kPa", "daN/cm2": "100kPa",
    "lbf": "4.448222N", "lb": "4.448222N", "lbs": "4.448222N", "kip": "4.448222kN",
    "kips": "4.448222kN", "kgf": "9.80665N", "kp": "9.80665N", "kg": "9.80665N",
    "tf": "9.80665kN", "daN": "10N",
}  # fmt: skip
_EXPONENTS = str.maketrans("²³", "23", "^*")
_PATTERN = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(\S*)\s*")


def parse(text: str, unit: str) -> float:
    """The value of a quantity in SI units.

    text: a number, alone or followed by a unit.
    unit: SI unit of the result, a key of `COMMON`; units that convert to it are accepted.

    Raises ValueError naming the text, the unit and an example.
    """
    number, given_unit = _split(text)
    factor = _FACTORS[unit].get(plain_exponents(given_unit or unit))
    if number and factor is not None:
        return float(number) * factor
    raise ValueError(
        f"{text!r} is not a quantity in {unit}; write a number in {unit} or 10{COMMON[unit]}"
    )


def plain_exponents(unit: str) -> str:
    """A unit with its exponents as digits: N/mm2 for N/mm², N/mm^2 and N/mm**2."""
    return unit.translate(_EXPONENTS)


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
