"""Claims of section 2 of the paper: heights (Eq. 11-13) and orientations (Eq. 14-18, Fig. 5, 7)."""

import math

import pytest
from paper_numbers import numbers


def test_eq_13_mean_and_variance_of_heights():
    found = numbers("height-moments")
    # equal-step sum of a density that vanishes smoothly at both ends, step beta/500
    assert found["worst"] < 1e-8
    # 1.15 um * 4.82 and 3.52 um * 7.14
    assert found["smooth"] == pytest.approx(5.543, rel=1e-6)
    assert found["rough"] == pytest.approx(25.1328, rel=1e-6)


def test_eq_14_domain_of_the_sentence_is_a_misprint():
    # a whole period of sin(a theta) sums to zero, not to one; 1e-12 is rounding
    assert abs(numbers("density-domain", "misprint")["sentence"]) < 1e-12


def test_density_tends_to_a_delta_function():
    found = numbers("smooth-limit")
    assert math.radians(found["mean"]) == pytest.approx(1e-4, rel=1e-12)  # 6/(6a)
    assert found["at_infinity"] == 0.0


def test_extent_of_the_inclinations():
    found = numbers("inclination-extent")
    step = 0.01  # degrees, of the grid on which the extent is looked for
    assert found["a1"] == pytest.approx(90, abs=step)
    assert found["a2"] == pytest.approx(45, abs=step)


def test_b_moves_the_asperities_between_horizon_and_normal():
    found = numbers("shape-b")
    # by hand: u + b (u^3 - u)/2 at u = cos 45 deg
    assert found["minus"] == pytest.approx(0.88388, abs=1e-5)
    assert found["zero"] == pytest.approx(0.70711, abs=1e-5)
    assert found["two"] == pytest.approx(0.35355, abs=1e-5)
    assert found["minus"] > 0.5  # "most of the asperity contacts are inclined at theta > 45 deg"


def test_b_zero_is_uniform_per_solid_angle_at_a_1_only():
    found = numbers("shape-b0", "one reading")
    assert found["a1"] == pytest.approx(1.0, abs=1e-12)
    assert found["a2"] == pytest.approx(2**0.5, rel=1e-12)  # 2 cos(theta) from 0 to 45 deg


def test_c_makes_the_density_anisotropic():
    found = numbers("shape-c")
    assert found["axis_2"] == pytest.approx(1 / 3.14159265, rel=1e-8)  # (1 + 3c)/(2 pi)
    assert abs(found["axis_3"]) < 1e-15  # 1 - 3c
    assert found["ratio"] == pytest.approx(1.0, abs=1e-15)


def test_mean_inclinations_19_and_10_degrees():
    found = numbers("mean-inclination")
    assert round(found["a3"]) == 19  # as the paper rounds
    assert round(found["a6"]) == 10
