"""A result that is not finite: named joint, state and increment on the error, nothing moved."""

import pickle

import numpy as np
import pytest
from refusals import refused

import jointlaw as jl

HUGE = 1e300  # m: its power 1.5 overflows


@pytest.mark.parametrize("keep", [True, False])
def test_the_error_repeats_the_step_and_nothing_moved(law, moved, tmp_path, monkeypatch, keep):
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
