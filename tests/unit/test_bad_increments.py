"""A bad increment is refused before anything moves, in one joint and in every joint of a batch."""

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from refusals import refused

small = st.floats(-1e-6, 1e-6)
not_finite = st.sampled_from([np.nan, np.inf, -np.inf])


@given(d=hnp.arrays(float, (5, 3), elements=small), joint=st.integers(0, 4), slot=st.integers(0, 2),
       bad=not_finite, keep=st.booleans())  # fmt: skip
def test_not_finite_in_any_slot(law, d, joint, slot, bad, keep):
    batch = law.joints(5)
    batch.update(np.abs(d))
    d[joint, slot] = bad
    with refused(batch, rf"d of joint {joint} = .*not finite"):
        (batch.update if keep else batch.trial)(d)


@given(shape=hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=6), keep=st.booleans())
def test_wrong_shape(law, shape, keep):
    joint, batch = law.joint(), law.joints(5)
    for joints, expected, some in (
        (joint, (3,), {}), (batch, (5, 3), {}), (batch, (2, 3), {"where": [0, 3]})
    ):  # fmt: skip
        if shape != expected:
            with refused(joints, re.escape(f"d has shape {shape}; expected {expected}")):
                (joints.update if keep else joints.trial)(np.full(shape, 1e-7), **some)


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
    joint = law.joint(normal_stress=1e6)
    for step in (joint.update, joint.trial):
        with refused(joint, r"^d "):
            step(d)


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
    for act in (lambda: moved.update(np.zeros((2, 3)), where=where), lambda: moved.reset(where)):
        with refused(moved, told):
            act()
