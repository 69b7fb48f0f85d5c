"""Every table of units against the constants of scipy, from which each unit is composed anew.

Factors in texts with values (f-strings) are compared with the unit that follows in the text.
"""

import ast
import re

import pytest
from output_faults import ROOT
from scipy import constants

import jointlaw as jl
from dem_demo.scene import drives
from jointlaw.calibration import comparison, tables
from jointlaw.laboratory import record
from jointlaw.parameters.declared import parameters_of
from jointlaw.support import units
from jointlaw.surface import fit as surface
from jointlaw.surface.densities import HEIGHT_PARAMETERS

PREFIXES = {
    "n": constants.nano, "u": constants.micro, "µ": constants.micro, "μ": constants.micro,
    "m": constants.milli, "c": constants.centi, "d": constants.deci, "da": constants.deka,
    "k": constants.kilo, "M": constants.mega, "G": constants.giga,
}  # fmt: skip
NAMES = {  # value in SI units
    "1": 1.0, "m": 1.0, "N": 1.0, "Pa": 1.0, "s": 1.0, "J": 1.0, "Pas": 1.0,
    "rad": 1.0, "deg": constants.degree, "°": constants.degree, "min": constants.minute,
    "l": constants.liter, "bar": constants.bar, "atm": constants.atm, "g": constants.g,
    "gal": constants.centi,  # named after Galilei: 1 cm/s2
    "in": constants.inch, "inch": constants.inch, "inches": constants.inch, '"': constants.inch,
    "ft": constants.foot, "mil": constants.mil, "mils": constants.mil, "thou": constants.mil,
    "psi": constants.psi, "ksi": constants.kilo * constants.psi,
    "psf": constants.lbf / constants.foot**2,
    "tsf": constants.short_ton * constants.g / constants.foot**2,
    "lbf": constants.lbf, "lb": constants.lbf, "lbs": constants.lbf,
    "kip": constants.kilo * constants.lbf, "kips": constants.kilo * constants.lbf,
    "kgf": constants.kgf, "kp": constants.kgf, "kg": constants.kgf,
    "tf": constants.kilo * constants.kgf, "t": constants.kilo * constants.kgf,
    "at": constants.kgf / constants.centi**2,  # technical atmosphere
}  # fmt: skip


# A factor of a value in a text, as a power of ten; the unit may follow after other values
POWER_OF_TEN = re.compile(rb"\{[^{}\n]*\b1(?:e-?\d+|0+)\b[^{}\n]*\}")
UNIT_BELOW = re.compile(
    r"\0(?:[\s\0,.()/+-]|and|to|or|after|at|is|it)*"
    r"((?:n|u|m|c|k|M|G)?(?:Pa s|Pa/m|Pa|N|J/m2|J|m))(?![\w/])"
)


def factors_in_texts():
    """Place, factor and unit of each value that a text of the packages multiplies by a power of
    ten, if the text names its unit."""
    for package in ("jointlaw", "dem_demo"):
        for path in sorted((ROOT / package).rglob("*.py")):
            text = path.read_bytes()
            if not POWER_OF_TEN.search(text):
                continue
            for node in ast.walk(ast.parse(text)):
                if isinstance(node, ast.JoinedStr):
                    name = f"{path.relative_to(ROOT)}:{node.lineno}"
                    yield from ((name, *one) for one in factors_with_units(node))


def factors_with_units(text):
    """Factor and unit of each value of a text."""
    plain = ["\0" if isinstance(one, ast.FormattedValue) else one.value for one in text.values]
    for i, one in enumerate(text.values):
        value = getattr(one, "value", None)
        if not isinstance(one, ast.FormattedValue) or not isinstance(value, ast.BinOp):
            continue
        below = UNIT_BELOW.match("".join(plain[i:]))
        sides = [side.value for side in (value.left, value.right) if isinstance(side, ast.Constant)]
        if below and sides:
            (number,) = sides
            yield (1 / number if isinstance(value.op, ast.Div) else number), below[1]


def test_factors_of_values_in_texts_are_of_their_unit():
    found = [*factors_in_texts()]
    assert len(found) > 30
    for place, factor, unit in found:
        assert factor * value_of(unit.replace(" ", "")) == pytest.approx(1.0, rel=1e-12), place


def value_of(unit):
    """Value of a unit in SI units: quotients, digits as exponents, prefixes."""
    above, _, below = unit.rpartition("/")
    if above:
        return value_of(above) / value_of(below)
    name, exponent = re.fullmatch(r"(.*?)([23]?)", unit).groups()
    if name not in NAMES:
        prefix = next(one for one in ("da", *PREFIXES) if name[len(one) :] in NAMES
                      and name.startswith(one))  # fmt: skip
        return (PREFIXES[prefix] * NAMES[name.removeprefix(prefix)]) ** int(exponent or 1)
    return NAMES[name] ** int(exponent or 1)


@pytest.mark.parametrize(
    ("si_unit", "unit"), [(si, unit) for si, table in units._FACTORS.items() for unit in table]
)
def test_units_of_commands_and_files(si_unit, unit):
    assert value_of(si_unit) == 1.0
    assert units.parse(f"1{unit}", si_unit) == pytest.approx(value_of(unit), rel=1e-12)


@pytest.mark.parametrize("unit", units.OTHER_UNITS)
def test_remedies_for_other_units_are_as_large(unit):
    """To seven digits, as they are written."""
    remedy = units.OTHER_UNITS[unit]
    number, in_unit = re.fullmatch(r"([\d.]+)(\D.*)", remedy).groups()
    assert float(number) * value_of(in_unit) == pytest.approx(value_of(unit), rel=2e-7)


@pytest.mark.parametrize("unit", drives.UNITS)
def test_units_of_records_of_motion(unit):
    """The order is the power of time below the length; g and gal are accelerations."""
    order, factor = drives.UNITS[unit]
    assert factor == pytest.approx(value_of(unit), rel=1e-15)
    of_name = {"": 0, "s": 1, "s2": 2}[unit.partition("/")[2]]
    assert order == (2 if unit in ("g", "gal") else of_name)


@pytest.mark.parametrize("quantity", comparison.UNITS)
def test_units_of_comparisons(quantity):
    unit, factor = comparison.UNITS[quantity]
    assert factor == pytest.approx(1 / value_of(unit), rel=1e-15)
    assert unit == ("mm" if quantity == "opening" else "MPa")


@pytest.mark.parametrize("prefix", record._SI_PREFIXES)
def test_prefixes_of_figures(prefix):
    assert record._SI_PREFIXES[prefix] == value_of(f"{prefix}m")


@pytest.mark.parametrize("spelling", tables._SPELLINGS)
def test_spellings_of_units(spelling):
    """Capitals, and Cyrillic letters, by their sound."""
    latin = spelling.translate(str.maketrans("мксМПаНн", "mksMPaNn"))
    meant = {"mkm": "um", "sm": "cm"}.get(latin, latin)
    assert tables._SPELLINGS[spelling].lower() == meant.lower()
    assert value_of(tables._SPELLINGS[spelling]) > 0


@pytest.mark.parametrize("unit", units.COMMON.items())
def test_examples_of_units_belong_to_the_si_unit(unit):
    si_unit, common = unit
    assert units.parse(f"1{common}", si_unit) == pytest.approx(value_of(common), rel=1e-12)


def test_units_of_the_columns_of_a_laboratory_test():
    """Lengths, stresses, fractions and energies by their meaning."""
    lengths = ("closure", "shear_2", "shear_3")
    expected = {
        **dict.fromkeys(lengths, "m"),
        **dict.fromkeys(("F1", "F2", "F3"), "Pa"),
        **dict.fromkeys(("sliding", "separated"), "1"),
        **dict.fromkeys(("stored", "dissipated"), "J/m2"),
    }
    assert [*record.UNITS.items()] == [*expected.items()]


def test_units_of_the_parameters_of_a_scan():
    """The report of a scan has the units that the parameters declare."""
    declared = parameters_of(jl.GammaHeights) | parameters_of(jl.JointLaw)
    assert {name: declared[name].unit for name in surface.UNITS} == surface.UNITS
    assert surface.UNITS.keys() >= {name for name in HEIGHT_PARAMETERS if declared[name].unit}
