"""Claims on sliding in closure and on one asperity: Table 2, Eq. 10, 21 and 29 to 36."""

import math

import numpy as np
import pytest
from paper_numbers import numbers

from jointlaw import closed_form
from jointlaw.paper.closed_form import Shape


def test_eq_30_sliding_angle():
    found = numbers("sliding-angle")
    assert found["half"] == pytest.approx(math.degrees(math.atan(1.2)))
    assert found["double"] == pytest.approx(math.degrees(math.atan(0.3)))
    assert found["half"] > found["double"]  # not by friction alone


def test_table_2_against_quadrature_and_print():
    found = numbers("table-2", "misprint")
    assert found["free"] == pytest.approx(0.5, rel=1e-14)  # mean of cos^2 phi, not 1 as printed
    assert found["rough"] == 0.0  # the sliding domain lies outside the cap


@pytest.mark.parametrize("a", [10.0, 100.0, 1e4])
def test_last_row_of_table_2_is_approached(a):
    # at mu = 0, C22p = K_s <cos^2 theta>(1 + c)/2 up to terms in E[theta^2] < 2/a^2
    free = closed_form.inelastic(Shape(a, 0.0, 0.2), 1.0, 1.0, 0.0)
    np.testing.assert_allclose(free, [0.0, 0.6, 0.4], atol=2 / a**2)
    assert not closed_form.inelastic(Shape(a), 1.0, 1.0, 0.2).any()


def test_eq_35_range_and_the_incremental_law_at_constant_load():
    found = numbers("shear-law")
    assert found["start"] == pytest.approx(1.5, abs=1e-11)  # read at x = 1e-12
    assert found["end"] == pytest.approx(1.0, abs=1e-15)
    assert found["law"] < 2e-3  # 64 depth cells; falls with their number


def test_eq_36_series_needs_a_cap():
    found = numbers("shear-series", "one reading")
    assert found["start"] == 1.5
    assert found["end"] == pytest.approx(1.0625, rel=1e-14)  # printed 1.063
    assert found["limit"] == pytest.approx(0.899, abs=5e-4)
    assert found["peak"] == pytest.approx(1.196, abs=5e-4)


def test_sliding_angle_of_the_power_law():
    found = numbers("sliding-angle-power")
    assert found["exact"] == pytest.approx(found["arctan"], abs=1e-9)  # arccos of a share
    # the capped series slides at 0.899 of the tangent
    early = math.degrees(math.atan(0.899 * 0.36))
    assert found["series"] == pytest.approx(early, abs=0.02)


def test_eq_37b_limits_are_those_of_the_asperities_that_stick():
    assert numbers("sliding-limits", "misprint")["beyond"] == pytest.approx(2 / 3, rel=1e-14)


def test_inelastic_is_zero_beyond_the_cap_and_continuous_at_its_edge():
    edge = math.tan(math.pi / 6)  # mu at which theta_s is the edge of the cap, a = 3, K_s = K_n
    assert not closed_form.inelastic(Shape(3.0), 1.0, 1.0, edge * (1 + 1e-9)).any()
    inside = closed_form.inelastic(Shape(3.0), 1.0, 1.0, edge * (1 - 1e-9))
    assert np.abs(inside).max() < 1e-7  # the sliding band is 1e-9 wide


@pytest.mark.parametrize("mu", [-0.1, math.inf])
def test_bad_friction_is_named(mu):
    with pytest.raises(ValueError, match="mu"):
        closed_form.inelastic(Shape(1.0), 1.0, 1.0, mu)
