"""Quantities of the command line."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from jointlaw.support import units


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("10MPa", "Pa", 10e6),
        ("10e6", "Pa", 10e6),
        (" 1.5 GPa ", "Pa", 1.5e9),
        ("20kPa", "Pa", 20e3),
        ("2N/mm2", "Pa", 2e6),
        ("3kN/m²", "Pa", 3e3),
        ("4bar", "Pa", 4e5),
        ("-2um", "m", -2e-6),
        ("2µm", "m", 2e-6),
        ("2μm", "m", 2e-6),
        ("3mm", "m", 3e-3),
        (".5cm", "m", 5e-3),
        ("+7nm", "m", 7e-9),
        ("2", "m", 2.0),
        ("1e-6m", "m", 1e-6),
        ("5GPa/m", "Pa/m", 5e9),
        ("5MPa/mm", "Pa/m", 5e9),
        ("5e9", "Pa/m", 5e9),
        ("30deg", "rad", math.pi / 6),
        ("30°", "rad", math.pi / 6),
        ("0.5rad", "rad", 0.5),
        ("0.5", "rad", 0.5),
    ],
)
def test_quantities(text, unit, value):
    assert units.parse(text, unit) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "unit"),
    [
        ("", "Pa"),
        ("MPa", "Pa"),
        ("10 mpa", "Pa"),
        ("10XPa", "Pa"),
        ("10um", "Pa"),
        ("10MPa10", "Pa"),
        ("1,5MPa", "Pa"),
        ("nan", "Pa"),
        ("infMPa", "Pa"),
        ("0x10", "m"),
        ("2 u m", "m"),
        ("--2um", "m"),
        ("5GPa", "Pa/m"),
        ("5/m", "Pa/m"),
        ("5Pa/", "Pa/m"),
        ("30grad", "rad"),
        ("30mrad", "rad"),
    ],
)
def test_what_is_no_quantity(text, unit):
    with pytest.raises(ValueError, match="is not a quantity in") as error:
        units.parse(text, unit)
    assert repr(text) in str(error.value)
    assert units.parse(str(error.value).rsplit(" ", 1)[-1], unit)  # the example that it gives


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_bare_number_is_si(x):
    assert units.parse(repr(x), "m") == x
