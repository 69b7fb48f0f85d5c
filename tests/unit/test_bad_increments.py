"""A bad increment is refused before anything moves, in one joint and in every joint of a batch."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

small = st.floats(-1e-6, 1e-6)
not_finite = st.sampled_from([np.nan, np.inf, -np.inf])


@given(d=hnp.arrays(float, (5, 3), elements=small), joint=st.integers(0, 4), slot=st.integers(0, 2),
       bad=not_finite, keep=st.booleans())  # fmt: skip
def test_not_finite_in_any_slot(law, d, joint, slot, bad, keep):
    batch = law.joints(5)
    batch.update(np.abs(d))
    before = batch.snapshot().values
    d[joint, slot] = bad
    with pytest.raises(ValueError, match=rf"d of joint {joint} = .*not finite"):
        (batch.update if keep else batch.trial)(d)
    np.testing.assert_array_equal(batch.snapshot().values, before)


@given(shape=hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=6), keep=st.booleans())
def test_wrong_shape(law, shape, keep):
    joint, batch = law.joint(), law.joints(5)
    d = np.full(shape, 1e-7)
    if shape != (3,):
        with pytest.raises(ValueError, match=r"d has shape .*expected \(3,\)"):
            (joint.update if keep else joint.trial)(d)
    if shape != (5, 3):
        with pytest.raises(ValueError, match=r"d has shape .*expected \(5, 3\)"):
            (batch.update if keep else batch.trial)(d)
    if shape != (2, 3):
        with pytest.raises(ValueError, match=r"d has shape .*expected \(2, 3\)"):
            batch.update(d, where=[0, 3])
    assert not joint.snapshot().values.any()
    assert not batch.snapshot().values.any()


@pytest.mark.parametrize(
    "d",
    [
        None,
        "abc",
        ["1e-7", "0", "0"],
        [1e-7, None, 0.0],
        [1j, 0.0, 0.0],
        np.array([1j, 0.0, 0.0]),
        [True, False, True],
        [[1e-7, 0.0], [0.0]],
        [10**400, 0, 0],
        {"closure": 1e-7},
        np.zeros(3, "datetime64[s]"),
    ],
    ids=repr,
)
def test_wrong_type(law, d):
    joint = law.joint()
    joint.update([1e-7, 2e-8, 0.0])
    before = joint.snapshot().values
    with pytest.raises(ValueError, match=r"^d "):
        joint.update(d)
    with pytest.raises(ValueError, match=r"^d "):
        joint.trial(d)
    np.testing.assert_array_equal(joint.snapshot().values, before)


@pytest.mark.parametrize(
    ("where", "told"),
    [
        ([0, 5], "joint 5; joints are 0 to 4"),
        ([-1, 2], "joint -1"),
        ([1, 2, 1], "twice"),
        ([0.0, 1.0], "joint numbers"),
        (2, "joint numbers"),
        ([[0, 1]], "joint numbers"),
        ("ab", "joint numbers"),
        ([True, False], r"mask needs \(5,\)"),
    ],
)
def test_bad_index(moved, where, told):
    before = moved.snapshot().values
    for act in (lambda: moved.update(np.zeros((2, 3)), where=where), lambda: moved.reset(where)):
        with pytest.raises(ValueError, match=told):
            act()
    np.testing.assert_array_equal(moved.snapshot().values, before)
