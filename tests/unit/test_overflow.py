"""A result that is not finite: named joint, replay file, nothing moved."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import jointlaw as jl
from jointlaw.cli.main import main

HUGE = 1e300  # m: its power 1.5 overflows


@pytest.mark.parametrize("tangent", [True, False])
@pytest.mark.parametrize("keep", [True, False])
def test_joint_is_named_and_nothing_moved(moved, replays, tangent, keep):
    before = moved.snapshot().values
    d = np.full((5, 3), 1e-8)
    d[3, 0] = HUGE
    with pytest.raises(
        jl.NonFiniteError, match=r"joint 3: .*not finite; nothing was moved"
    ) as error:
        (moved.update if keep else moved.trial)(d, tangent=tangent)
    np.testing.assert_array_equal(moved.snapshot().values, before)
    assert error.value.replay.parent == replays
    assert str(error.value.replay) in str(error.value)
    assert isinstance(error.value, ValueError)


def test_joint_of_a_selection_is_named_by_its_number_in_the_batch(moved, replays):
    with pytest.raises(jl.NonFiniteError, match="joint 4: "):
        moved.update([[1e-8, 0, 0], [HUGE, 0, 0]], where=[2, 4])


def test_joint_beyond_the_first_chunk(make_law, replays):
    law = make_law(resolution=jl.Resolution(1, 3, 1))
    batch = law.joints(5000)
    d = np.full((5000, 3), 1e-8)
    d[4999, 1] = HUGE
    with pytest.raises(jl.NonFiniteError, match="joint 4999: "):
        batch.update(d)
    assert not batch.snapshot().values.any()


@pytest.mark.parametrize("tangent", [True, False])
def test_replay_runs_the_step_again(any_law, replays, capsys, tangent):
    joint = any_law.joint()
    dim = len(joint.delta)
    joint.update([1e-7, 3e-8, 0.0][:dim])
    with pytest.raises(jl.NonFiniteError) as error:
        joint.update([HUGE, *[0.0] * (dim - 1)], tangent=tangent)
    status = main(["replay", str(error.value.replay)])
    out = capsys.readouterr().out
    assert status == 1
    assert "fails again" in out
    assert " ".join(["1.e-07", "3.e-08"][:dim]) in out  # the state before the step
    assert list(replays.iterdir()) == [error.value.replay]  # replaying leaves no second file


def test_replay_file_goes_to_the_working_folder(law, tmp_path, monkeypatch):
    monkeypatch.delenv("JOINTLAW_REPLAY_DIR", raising=False)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(jl.NonFiniteError) as error:
        law.joint().update([HUGE, 0, 0])
    assert [path.name for path in tmp_path.iterdir()] == [error.value.replay.name]


def test_a_folder_that_does_not_exist_hides_no_error(law, tmp_path, monkeypatch):
    monkeypatch.setenv("JOINTLAW_REPLAY_DIR", str(tmp_path / "missing"))
    with pytest.raises(jl.NonFiniteError, match="no replay file could be written") as error:
        law.joint().update([HUGE, 0, 0])
    assert error.value.replay is None


def test_error_can_be_pickled(law, replays):
    with pytest.raises(jl.NonFiniteError) as error:
        law.joint().update([HUGE, 0, 0])
    copy = pickle.loads(pickle.dumps(error.value))
    assert (str(copy), copy.replay) == (str(error.value), error.value.replay)


@given(data=st.data())
def test_any_finite_increment_passes_or_raises_and_leaves_the_state(
    any_law, tmp_path_factory, data
):
    """From 1e-320 m to 1e308 m: a finite result, or NonFiniteError and the state as it was."""
    joint = any_law.joint()
    dim = len(joint.delta)
    size = st.floats(-320, 308).map(lambda exponent: 10.0**exponent)
    component = st.builds(lambda s, x: s * x, st.sampled_from([-1.0, 0.0, 1.0]), size)
    folder = tmp_path_factory.getbasetemp() / "fuzz"
    folder.mkdir(exist_ok=True)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("JOINTLAW_REPLAY_DIR", str(folder))
        for _ in range(4):
            d = data.draw(st.lists(component, min_size=dim, max_size=dim))
            before = joint.snapshot().values
            try:
                F, C = joint.update(d)
            except jl.NonFiniteError:
                np.testing.assert_array_equal(joint.snapshot().values, before)
            else:
                assert np.isfinite(F).all()
                assert np.isfinite(C).all()
                assert joint.stored_energy >= 0.0
                assert joint.dissipated_energy >= 0.0


@pytest.mark.parametrize("alpha", [20.0, 100.0])
def test_next_to_no_asperity_in_touch_is_no_overflow(make_law, replays, alpha):
    """Far below the asperities the slope of the virgin curve is 1e-200; its square is no number."""
    law = make_law(heights=jl.GammaHeights(alpha, 1.15e-6, 1e-7, "individual"))
    joint = law.joint()
    for d in ([1e-7, 0, 0], [0, 0, 0], [-5e-8, 1e-8, 0], [-1e-6, 0, 0], [2e-6, 1e-6, 0]):
        F, C = joint.update(d)
        assert np.isfinite(F).all()
        assert np.isfinite(C).all()
