"""Laboratory tests: the normal condition, turning points, unloading, and what stops them."""

import math

import numpy as np
import pytest
from refusals import refused

import jointlaw as jl
from jointlaw import PathError

N = 10e6  # Pa


@pytest.mark.parametrize("stress", [1.0, 10e6, 1e9])
def test_constant_normal_stress(any_sheared_law, stress):
    record = jl.direct_shear(any_sheared_law.joint(), 5e-7, normal=stress, steps=40)
    # 1e-9, or what one rounding of a closure of some 5e-7 m makes in the stiffest joint
    rounding = 2e-16 * 1e-6 * any_sheared_law.max_stiffness(1e-6)
    np.testing.assert_allclose(record.F1, stress, rtol=1e-9, atol=rounding)


def test_constant_normal_stiffness(any_sheared_law):
    spring = 2e13
    record = jl.direct_shear(any_sheared_law.joint(), [5e-7, -2e-7], N, stiffness=spring, steps=30)
    asked = N + spring * (record.closure[0] - record.closure)
    np.testing.assert_allclose(record.F1, asked, atol=1e-9 * N, rtol=1e-9)
    dilates = any_sheared_law.tables.asperities is not None
    assert (np.ptp(record.F1) > 0.001 * N) == dilates


@pytest.mark.parametrize("azimuth", [math.radians(30), -2.5])
def test_reversals_end_where_they_should(law, azimuth):
    to = [6e-7, -4e-7, 0.0, 2e-7]
    joint = law.joint()
    record = jl.direct_shear(joint, to, N, azimuth=azimuth, steps=25)
    assert len(record) == 1 + 25 * len(to)
    # 1e-12 of the longest leg: 25 equal increments are summed
    np.testing.assert_allclose(record.shear[25::25], to, atol=1e-18)
    across = record.shear_3 * math.cos(azimuth) - record.shear_2 * math.sin(azimuth)
    np.testing.assert_allclose(across, 0.0, atol=1e-18)
    np.testing.assert_allclose(joint.delta[1:], [record.shear_2[-1], record.shear_3[-1]])
    assert (np.diff(record.dissipated) >= 0).all()


def test_a_law_with_a_plane_is_recorded_in_three_dimensions(make_law):
    record = jl.direct_shear(make_law(plane=0.4).joint(), 5e-7, N, steps=10)
    assert record.azimuth == 0.4
    assert record.shear_3[-1] == pytest.approx(5e-7 * math.sin(0.4))


def test_closure_test_loads_and_unloads(any_law):
    joint = any_law.joint()
    record = jl.closure_test(joint, 20e6, steps=30)
    assert record.F1[[0, 30, -1]] == pytest.approx([0.0, 20e6, 0.0], abs=20e6 * 1e-9)
    assert (np.diff(record.F1[:31]) > 0).all()
    assert (np.diff(record.F1[30:]) < 0).all()
    assert (np.diff(record.dissipated) >= 0).all()
    # summed in another order, both round in the last digits of the largest stress
    np.testing.assert_allclose(joint.F[0], record.F1[-1], atol=20e6 * 1e-14)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"to": [1e-7, float("inf")]}, "to = inf"),
        ({"to": []}, r"to = \[\]"),
        ({"to": "2um"}, "to = '2um'"),
        ({"normal": 0.0}, r"normal = 0\.0 .*> 0"),
        ({"stiffness": -1.0}, "stiffness = -1.0 is out of bounds"),
        ({"steps": 2.5}, r"steps = 2\.5"),
    ],
)
def test_bad_arguments_of_direct_shear(law, arguments, told):
    joint = law.joint()
    with refused(joint, told):
        jl.direct_shear(joint, **({"to": 1e-7, "normal": N} | arguments))


def test_a_path_error_keeps_the_record_so_far(law):
    """The third turning point is so far away that the tractions overflow."""
    joint = law.joint()
    with pytest.raises(PathError, match="stopped after 21 rows") as error:
        jl.direct_shear(joint, [1e-7, -1e-7, 1e301], N, steps=10)
    record = error.value.record
    assert len(record) == 21
    assert record.shear[-1] == pytest.approx(-1e-7)
    # rounding: the record holds what the update returned, joint.F sums the state again
    last = [record.F1[-1], record.F2[-1], record.F3[-1]]
    np.testing.assert_allclose(joint.F, last, rtol=0, atol=1e-14 * N)
