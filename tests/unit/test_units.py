"""Quantities of the command line."""

import math
import re

import pytest

from jointlaw.support import units


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        (" 1.5 GPa ", "Pa", 1.5e9),
        ("10e6", "Pa", 10e6),  # a bare number is SI
        ("2N/mm2", "Pa", 2e6),
        ("3kN/m²", "Pa", 3e3),
        ("4bar", "Pa", 4e5),
        ("-2um", "m", -2e-6),
        ("2µm", "m", 2e-6),
        ("2μm", "m", 2e-6),
        (".5cm", "m", 5e-3),
        ("+7nm", "m", 7e-9),
        ("1e-6m", "m", 1e-6),
        ("5MPa/mm", "Pa/m", 5e9),
        ("30deg", "rad", math.pi / 6),
        ("30°", "rad", math.pi / 6),
        ("0.5rad", "rad", 0.5),
    ],
)
def test_quantities(text, unit, value):
    assert units.parse(text, unit) == pytest.approx(value, rel=1e-15)


PREFIXES = {"n": 1e-9, "u": 1e-6, "m": 1e-3, "c": 1e-2, "": 1.0, "k": 1e3, "M": 1e6, "G": 1e9}


@pytest.mark.parametrize(
    ("row", "unit"),
    [
        (row, unit)
        for unit in ("m", "N", "Pa", "m2")
        for row in units._FACTORS[unit]
        if row != "bar"
    ],
)
def test_every_row_of_the_tables_of_units(row, unit):
    """By the parts of its name: kN/m2 is a thousand newtons on a square metre."""
    plain = re.sub("[µμ]", "u", row.replace("²", "2"))
    prefix, of_area = re.fullmatch("(.?)(?:m2|m|N|Pa)(?:/(.?)m2)?", plain).groups(default="")
    exact = PREFIXES[prefix] ** (2 if unit == "m2" else 1) / PREFIXES[of_area] ** 2
    assert units.parse(f"1{row}", unit) == pytest.approx(exact, rel=1e-15)


def test_every_unit_has_an_example_and_a_common_unit():
    for unit, common in units.COMMON.items():
        assert units.parse(f"1{common}", unit) > 0
        with pytest.raises(ValueError, match=f"is not a quantity in {unit}; write") as error:
            units.parse("x", unit)
        assert units.parse(str(error.value).rsplit(" ", 1)[-1], unit) > 0


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("", "Pa"),
        ("10 mpa", "Pa"),
        ("10um", "Pa"),
        ("10MPa10", "Pa"),
        ("1,5MPa", "Pa"),
        ("nan", "Pa"),
        ("0x10", "m"),
        ("--2um", "m"),
        ("5GPa", "Pa/m"),
        ("5Pa/", "Pa/m"),
        ("30mrad", "rad"),
    ],
)
def test_what_is_no_quantity(text, unit):
    with pytest.raises(ValueError, match="is not a quantity in") as error:
        units.parse(text, unit)
    assert repr(text) in str(error.value)
    assert units.parse(str(error.value).rsplit(" ", 1)[-1], unit)  # the example that it gives


def test_what_a_person_types_has_a_unit():
    assert units.typed("0", "Pa") == 0.0
    assert units.typed("5MPa", "Pa", positive=True) == 5e6
    for text, told in (("5", "write for example 5MPa"), ("0", "> 0 Pa"), ("1e400Pa", "finite")):
        with pytest.raises(ValueError, match=told):
            units.typed(text, "Pa", positive=True)
