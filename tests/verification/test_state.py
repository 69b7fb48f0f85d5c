"""State: batches, snapshots and trials."""

import numpy as np
import pytest
from builders import increments, law, random_corners

import jointlaw as jl

KINDS = {
    "3-D": {"formation": "population"},
    "critical slip": {"critical_slip": 0.3},
    "plane": {"plane": 0.4, "formation": "individual"},
}


def path(seed, kind, n, steps):
    """Random increments (n, 6 steps, dim)."""
    d = increments(random_corners(np.random.default_rng(seed), n), steps)
    return d[..., :2] if "plane" in kind else d


def everything(joint):
    """All that a joint shows."""
    names = ("F", "delta", "sliding", "slipping", "separated", "stored_energy")
    return [np.array(getattr(joint, name)) for name in (*names, "dissipated_energy")]


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_a_batch_is_a_loop_of_singles(kind):
    one = law(**kind)
    d = path(1, kind, 7, 5)
    batch, singles = one.joints(7), [one.joint() for _ in range(7)]
    for k in range(d.shape[1]):
        F, C = batch.update(d[:, k])
        for i, joint in enumerate(singles):
            f, c = joint.update(d[i, k])
            # sums over facets may run in another order: rounding of the peak
            assert np.allclose(F[i], f, rtol=1e-12, atol=1e-12)
            assert np.allclose(C[i], c, rtol=1e-12, atol=1e-11)
    for whole, parts in zip(
        everything(batch), zip(*map(everything, singles), strict=True), strict=True
    ):
        assert np.allclose(whole, np.array(parts), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_restore_repeats_a_thousand_steps_to_the_bit(kind):
    one = law(**kind, resolution="balanced")
    rng = np.random.default_rng(2)
    dim = 2 if "plane" in kind else 3
    batch = one.joints(3)
    batch.update(np.tile([0.7, 0.1, 0.2][:dim], (3, 1)))
    start = batch.snapshot()
    d = rng.normal(0.0, 0.05, (1000, 3, dim))

    def run():
        F = [batch.update(step, tangent=False)[0] for step in d]
        return [np.array(F), *everything(batch)]

    first = run()
    assert np.abs(first[1] - batch.law.joints(3).F).max() > 0.0  # it went somewhere
    batch.restore(start)
    second = run()
    other = one.joints(3)
    other.restore(start)  # a snapshot was not touched by the steps after it
    batch = other
    for a, b, c in zip(first, second, run(), strict=True):
        assert np.array_equal(a, b)
        assert np.array_equal(a, c)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_restore_of_a_single_joint(kind):
    d = path(8, kind, 1, 4)[0]
    joint = law(**kind).joint()
    joint.update(d[0])
    start, shown = joint.snapshot(), everything(joint)
    first = [joint.update(step)[0] for step in d[1:]]
    joint.restore(start)  # a snapshot is a copy, not a view of the joint
    for a, b in zip(everything(joint), shown, strict=True):
        assert np.array_equal(a, b)
    assert np.array_equal([joint.update(step)[0] for step in d[1:]], first)


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS)
def test_trial_leaves_no_trace_and_foretells_the_update(kind):
    one = law(**kind)
    d = path(3, kind, 4, 3)
    tried, plain = one.joints(4), one.joints(4)
    rng = np.random.default_rng(4)
    for k in range(d.shape[1]):
        for _ in range(3):
            tried.trial(rng.normal(0.0, 1.0, d[:, k].shape))
        foretold = tried.trial(d[:, k])
        done = tried.update(d[:, k])
        F = plain.update(d[:, k], tangent=False)[0]
        assert np.array_equal(foretold[0], done[0])
        assert np.array_equal(foretold[1], done[1])
        assert np.array_equal(F, done[0])
    for a, b in zip(everything(tried), everything(plain), strict=True):
        assert np.array_equal(a, b)


def test_a_saved_state_continues_to_the_bit(tmp_path):
    one = law(formation="population", critical_slip=0.4)
    d = path(5, {}, 2, 4)
    batch = one.joints(2)
    for k in range(10):
        batch.update(d[:, k])
    batch.snapshot().save(tmp_path / "state.npz")
    again = law(formation="population", critical_slip=0.4).joints(2)
    again.restore(jl.load_state(tmp_path / "state.npz"))
    for k in range(10, 24):
        assert np.array_equal(batch.update(d[:, k])[0], again.update(d[:, k])[0])


def test_some_joints_of_a_batch_move_alone():
    one = law()
    d = path(6, {}, 5, 4)
    batch, all_move = one.joints(5), one.joints(5)
    some = np.array([3, 1])
    for k in range(8):
        batch.update(d[:, k])
        all_move.update(d[:, k])
    before = everything(batch)
    F = batch.update(d[some, 8], where=some)[0]
    assert np.allclose(F, all_move.update(d[:, 8])[0][some], rtol=1e-12, atol=1e-12)
    others = np.array([0, 2, 4])
    for a, b in zip(before, everything(batch), strict=True):
        assert np.array_equal(a[others], b[others])
    batch.reset(some)
    fresh = one.joints(5)
    for a, b in zip(everything(batch), everything(fresh), strict=True):
        assert np.array_equal(a[some], b[some])


def test_what_a_joint_shows_is_what_update_returned():
    joint = law(formation="individual").joint()
    total = np.zeros(3)
    for d in path(7, {}, 1, 4)[0]:
        F = joint.update(d)[0]
        total += d
        assert np.allclose(joint.F, F, rtol=1e-12, atol=1e-14)  # summed anew: rounding
        assert np.allclose(joint.delta, total, rtol=0.0, atol=1e-14)
    joint.update([-20.0, 0.0, 0.0])
    F, C = joint.trial([0.0, 0.0, 0.0])
    assert joint.separated == pytest.approx(1.0, abs=1e-12)
    assert not F.any()
    assert not C.any()
    assert joint.stored_energy == 0.0
