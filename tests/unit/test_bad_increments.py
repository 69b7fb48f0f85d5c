"""A bad increment, or one that ends in no finite number, is refused and nothing moves, in one joint
and in every joint of a batch."""

import pickle
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from refusals import refused

import jointlaw as jl

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


HUGE = 1e300  # m: its power 1.5 overflows


@pytest.mark.parametrize("keep", [True, False])
def test_an_overflow_can_be_repeated_and_moved_nothing(law, moved, tmp_path, monkeypatch, keep):
    monkeypatch.chdir(tmp_path)
    step = moved.update if keep else moved.trial
    with refused(moved, r"joint 4: .*not finite; nothing was", jl.NonFiniteError) as caught:
        step([[1e-8, 0.0, 0.0], [HUGE, 0.0, 1e-9]], where=[2, 4])  # its number in the batch
    error = pickle.loads(pickle.dumps(caught.value))
    assert isinstance(error, ValueError)
    assert str(error) == str(caught.value)
    assert (error.joint, error.d.tolist()) == (4, [HUGE, 0.0, 1e-9])
    joint = law.joint()
    joint.restore(error.state)
    np.testing.assert_array_equal(joint.delta, moved.delta[4])
    with pytest.raises(jl.NonFiniteError):
        joint.update(error.d)
    assert not list(tmp_path.iterdir())  # as it did in every trial


@pytest.mark.parametrize("alpha", [20.0, 100.0])
def test_next_to_no_asperity_in_touch_is_no_overflow(make_law, alpha):
    """Far below the asperities the slope of the virgin curve is 1e-200; its square is no number."""
    law = make_law(heights=jl.GammaHeights(alpha, 1.15e-6, 1e-7, "individual"))
    joint = law.joint()
    for d in ([1e-7, 0, 0], [0, 0, 0], [-5e-8, 1e-8, 0], [-1e-6, 0, 0], [2e-6, 1e-6, 0]):
        assert all(np.isfinite(one).all() for one in joint.update(d))
