"""Claims of section 3.1 of the paper: Table 1, Eq. 27 and 28, Figures 8 and 9."""

import math

import numpy as np
import pytest
from paper_numbers import numbers

from jointlaw import closed_form
from jointlaw.paper.closed_form import Shape


def test_table_1_against_quadrature_and_print():
    found = numbers("table-1", "misprint")
    # sign of the c term of C33 at a = 3: off by twice (531 sqrt3 - 688) c/3080 (K_n - K_s)
    twice = 2 * (531 * math.sqrt(3) - 688) / 3080 * 0.11 * 0.5
    assert found["c33"] == pytest.approx(twice, rel=1e-12)


def test_ratio_tends_to_that_of_one_asperity():
    found = numbers("ratio-limit")
    assert found["ainf"] == pytest.approx(0.5, rel=1e-14)
    # K_n - C11 and C22 - K_s go as E[theta^2], which is below 2/a^2
    assert abs(found["a100"] - 0.5) < 2 / 100**2
    assert found["a10"] > found["a100"] > 0.5


def test_interface_can_be_stiffer_in_shear_than_its_asperities():
    found = numbers("ratio-above-one")
    assert found["at_one"] == pytest.approx(0.7 / 0.6, rel=1e-14)
    assert 1.0 < found["until"] < 1.5


def test_hertz_mindlin_ratio():
    found = numbers("hertz-mindlin-ratio", "misprint")
    assert found["none"] == 1.0
    assert found["half"] == pytest.approx(2 / 3, rel=1e-15)
    assert found["quartz"] == pytest.approx(1.4 / 1.7, rel=1e-15)
    assert round(found["quartz"], 2) == 0.82  # the paper prints 0.83


def test_measured_stiffness_ratios_are_reached_in_part():
    found = numbers("measured-ratios", "in part")
    # 12/11 and 2/3 by hand from Table 1 at K_s/K_n = 2/3
    assert found["high"] == pytest.approx(12 / 11, rel=1e-12)
    assert found["low"] == pytest.approx(2 / 3, rel=1e-12)
    assert found["high"] < 1.1 < found["high_c"]  # 1.1 needs c > 0
    assert found["quartz_low"] > 0.78  # out of reach for nu = 0.3
    assert found["quartz_high_c"] < 1.1


def test_shear_stiffness_is_anisotropic_with_c():
    found = numbers("anisotropic-stiffness")
    assert found["axis_2"] == pytest.approx(1.1, rel=1e-14)  # Table 1: 2/3 + (2/5)(1/3)(1/2)
    assert found["axis_3"] == pytest.approx(0.9, rel=1e-14)
    assert found["roundness"] < 1e-15
    assert found["reverse"] < 1  # K_s > K_n turns the order round


@pytest.mark.parametrize("c", [0.05, 0.2, 1 / 3])
@pytest.mark.parametrize("a", [1.0, 1.7, 3.0, 9.0])
def test_c22_exceeds_c33_for_positive_c(a, c):
    _, c22, c33 = closed_form.elastic(Shape(a, 0.0, c), 1.0, 0.5)
    assert c22 > c33


@pytest.mark.parametrize("a", [2.0 - 1e-9, 2.0, 2.0 + 1e-9])
def test_the_pole_at_a_2_is_removed(a):
    # the row a = 2 as printed; its slope in a is of order one, so 1e-8 covers the 1e-9 steps
    c11, c22, c33 = closed_form.elastic(Shape(a, 0.4, 0.1), 1.0, 0.5)
    assert c11 == pytest.approx(3.5 / 4 + 0.4 / 16 * 0.5, abs=1e-8)
    assert c22 == pytest.approx(4.5 / 8 - 0.4 / 32 * 0.5 + 0.5 / 32 * 0.5, abs=1e-8)
    assert c33 == pytest.approx(4.5 / 8 - 0.4 / 32 * 0.5 - 0.5 / 32 * 0.5, abs=1e-8)


def test_closed_forms_reach_the_limit_smoothly():
    near = closed_form.elastic(Shape(1e8, -1.0, 0.4), 1.0, 0.3)
    np.testing.assert_allclose(near, [1.0, 0.3, 0.3], atol=1e-14)  # differs by 1/a^2 = 1e-16


@pytest.mark.parametrize(("kn", "ks", "name"), [(-1, 1, "kn"), (1, math.nan, "ks"), ("x", 1, "kn")])
def test_bad_stiffness_is_named(kn, ks, name):
    with pytest.raises(ValueError, match=name):
        closed_form.elastic(Shape(1.0), kn, ks)


def test_bad_poisson_ratio_is_named():
    with pytest.raises(ValueError, match=r"nu = 0\.6"):
        closed_form.hertz_mindlin_ratio(0.6)
