"""Claims of section 4.3 at a kept normal stress, and of section 5 (Figures 17 to 19)."""

import math

import pytest
from paper_numbers import numbers


def test_smooth_interface_is_stronger_at_10_mpa():
    found = numbers("smooth-stronger", "in part")
    assert found["law_least"] > 0  # from the first 0.02 um on
    assert 0 < found["total_overtakes"] < 0.2  # um; the total form starts the other way round
    assert found["total_end"] > 0.02
    assert found["law_end"] > 0.05


def test_smooth_interface_hardens_more_at_10_mpa():
    found = numbers("smooth-hardens")
    assert found["law_smooth"] > 1.1 * found["law_rough"]
    assert found["total_smooth"] > 1.05 * found["total_rough"]
    assert found["yield_smooth"] > found["yield_rough"]


def test_contact_area_is_not_the_reason():
    found = numbers("smooth-reason", "fails")
    # the paper needs a clearly larger area; ours is within 5 %, and not larger
    assert -0.05 < found["area"] < 0
    assert -0.05 < found["count"] < 0
    assert found["heights"] > found["rough"]
    assert found["orientation"] > found["rough"]


def test_friction_angle_depends_on_direction():
    found = numbers("friction-anisotropy")
    for kind in ("law", "total"):
        # the first row at which all slide is found to a step, 0.015 closures: about 0.3 deg
        assert found[f"{kind}_90"] > found[f"{kind}_45"] > found[f"{kind}_0"]
        assert found[f"{kind}_90"] - found[f"{kind}_0"] > 1.0


def test_friction_angle_against_normal_stress_by_two_definitions_of_yield():
    found = numbers("friction-independent", "one reading")
    # fixed slip: falls by several times the 3 degrees that all in touch slide changes by
    for kind in ("total", "law"):
        assert found[f"{kind}_first"] - found[f"{kind}_last"] > 6.0


def test_friction_angle_at_zero_normal_stress_by_two_readings():
    found = numbers("friction-at-zero", "one reading")
    limit = math.degrees(math.atan(0.47)) + 30.0
    assert found["limit"] == pytest.approx(limit)
    assert found["far"] == pytest.approx(limit, abs=0.6)  # 2 % of the cap still touches
    assert found["limit"] > found["at_1MPa"] + 20.0
    assert found["small"] < found["at_1MPa"]  # the other order of the limits


def test_averages_do_not_determine_the_behavior():
    found = numbers("averages-not-enough")
    assert found["two"] > 1.01 * found["minus"]
    assert found["wide"] > 1.5
