"""Lists of names that belong together: a new row is tested by standing in its list."""

import re
from dataclasses import MISSING, fields
from pathlib import Path

import numpy as np
import pytest

import jointlaw as jl
from dem_demo.scene import Run
from jointlaw.calibration.priors import PRIORS, TRANSFORMS
from jointlaw.laboratory.record import UNITS
from jointlaw.parameters.resolution import NAMED, NAMED_FLAT, NAMED_LATE, NAMED_SHORT

KEYS = (Path(__file__).parents[2] / "docs/blocks.md").read_text().partition("## The keys of")[2]
FIELD = {"jrc": 10.0, "jcs": 100e6, "length": 0.1, "normal_stress": 1e6,
         "normal_stiffness": 30e9, "basic_friction": np.radians(30.0)}  # fmt: skip


@pytest.mark.parametrize("group", [NAMED_SHORT, NAMED_LATE, NAMED_FLAT])
def test_what_replaces_a_resolution_has_its_name(group):
    assert set(group) <= set(NAMED)


def test_priors_are_of_what_a_fit_can_find():
    assert set(PRIORS) <= set(TRANSFORMS)


def test_columns_of_a_record_have_si_units():
    assert set(UNITS.values()) == {"m", "Pa", "J/m2", "1"}


@pytest.mark.parametrize("name", FIELD)
def test_a_number_of_the_field_that_is_none_is_named(name):
    with pytest.raises(ValueError, match=f"^{name} = nan"):
        jl.from_field(**(FIELD | {name: np.nan}))


@pytest.mark.parametrize("one", [one for one in fields(Run) if one.default not in (MISSING, None)])
def test_the_page_tells_the_default_of_each_key_of_a_run(one):
    (row,) = re.findall(rf"^\|.*`{one.name}`.*\|.*$", KEYS, re.MULTILINE)
    assert f"({str(one.default).lower()})" in row
