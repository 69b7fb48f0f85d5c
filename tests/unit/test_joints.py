"""Joints, one, many at once, or coming and going in a pool: each has its own history, goes on
bit for bit from a snapshot, and is not moved by what is refused."""

import pickle
import re
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import kinds
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import jointlaw as jl


@contextmanager
def refused(joints, told, error=ValueError):
    """What follows raises an error with this text, and the joints stay as they were."""
    before = joints.snapshot().values
    with pytest.raises(error, match=told) as caught:
        yield caught
    np.testing.assert_array_equal(joints.snapshot().values, before)


@pytest.mark.parametrize(
    "form",
    [
        lambda d: d.tolist(),
        lambda d: np.repeat(d, 2, axis=1)[:, ::2],
        lambda d: d[::-1].copy()[::-1],
        np.asfortranarray,
        lambda d: d.astype(">f8"),
    ],
    ids=["list", "strided", "reversed", "fortran", "big-endian"],
)
def test_any_array_is_accepted_and_left_alone(law, form):
    d = np.array([[1e-7, 2e-8, 0.0], [2e-7, -1e-8, 3e-8]])
    given = form(d)
    np.testing.assert_array_equal(law.joints(2).update(given)[0], law.joints(2).update(d)[0])
    np.testing.assert_array_equal(given, d)


def test_energies_that_are_not_added_up(law):
    batch = law.joints(2, track_dissipation=False)
    assert not hasattr(batch, "dissipated_energy")
    with pytest.raises(AttributeError, match=r"plastic_work is not .* track_dissipation=True"):
        _ = batch.plastic_work


def test_a_joint_shows_what_a_batch_does(law):
    joint, batch = law.joint(2e6), law.joints(1, normal_stress=2e6)
    F, C = joint.update([1e-7, 2e-8, 0.0])
    before = joint.snapshot().values
    F[:], C[:], joint.delta[:], joint.F[:] = 0.0, 0.0, 0.0, 0.0  # the caller's own
    np.testing.assert_array_equal(joint.snapshot().values, before)
    assert (law.dim, batch.law.state_size) == (3, batch.snapshot().values.shape[1])
    assert jl.Joint.delta.__doc__.startswith(
        "Displacement from the interlocked position (dim,): closure"
    )


def test_each_contact_has_the_history_of_a_joint_of_its_own(any_law):
    """A random coming and going, against a dictionary of joints; rounding of F only."""
    rng, dim = np.random.default_rng(4), any_law.tables.dim
    pool, alone = jl.JointPool(any_law), {}
    for _ in range(40):
        keys = [(int(a), int(a) + 1) for a in rng.permutation(12)[: rng.integers(0, 10)]]
        alone = {key: alone.get(key) or any_law.joint() for key in keys}
        d = rng.normal(2e-8, 2e-7, (len(keys), dim))
        F, _ = pool.batch.update(d, where=pool.assign(keys), tangent=False)
        exact = [alone[key].update(step)[0] for key, step in zip(keys, d, strict=True)]
        assert len(pool) == len(keys) == len(pool.keys)
        largest = np.abs(exact).max(initial=1e-300)
        np.testing.assert_allclose(F, np.reshape(exact, F.shape), rtol=0, atol=1e-12 * largest)
    assert len(pool.batch) <= 10  # places are used again


def test_places_without_keys_are_used_again_and_keep_their_history(law):
    pool = jl.JointPool(law)
    first, second, third = pool.allocate(3)
    pool.batch.update(np.full((3, law.dim), 1e-7))
    keyed = pool.add(["key"])
    assert len(pool) == 4
    pool.release([second, first])
    assert len(pool) == 2
    np.testing.assert_array_equal(pool.allocate(1), [first])  # the lowest free place
    closures = pool.batch.delta[:, 0]
    assert closures.tolist() == [0.0, 0.0, 1e-7, 0.0]
    for places in ([second], keyed, [third, third], [9]):  # free, of a key, twice, out of bounds
        with pytest.raises(ValueError, match="places name"):
            pool.release(places)
    with pytest.raises(ValueError, match="n = -1"):
        pool.allocate(-1)
    with pytest.raises(ValueError, match="mated=False"):
        pool.allocate(1, mated=False)
    assert len(pool) == 3
    np.testing.assert_array_equal(pool.batch.delta[:, 0], closures)
    pool.release([third])
    assert pool.keys == ["key"]


def test_a_snapshot_restores_a_pool_and_what_is_refused_changes_none(law):
    pool = jl.JointPool(law)
    pool.batch.update(np.eye(3) * 1e-7, where=pool.add("abc"))
    pool.remove("a")
    keys, state = pool.keys, pool.snapshot()
    alternative = jl.JointPool(law)
    alternative.add("xyz")
    alternative.restore(keys, state)
    with pytest.raises(ValueError, match="keys name 1 contacts, state holds 2 joints"):
        alternative.restore("b", state)
    with pytest.raises(KeyError, match="x"):
        alternative.remove(["b", "x"])
    with pytest.raises(ValueError, match="mated=False"):
        alternative.assign("cd", mated=False)
    assert alternative.keys == ["b", "c"]
    np.testing.assert_array_equal(
        alternative.batch.delta[alternative.places], pool.batch.delta[pool.places]
    )


def walk(joints, rng, steps=30):
    """Random increments, mostly closing, of one joint or of each of a batch."""
    for _ in range(steps):
        d = rng.normal(0.0, 1e-7, np.shape(joints.delta))
        d[..., 0] += 2e-8
        joints.update(d)


def test_copies_of_joints_go_on_as_their_sources_bit_for_bit(any_law):
    """Across blocks of eight joints; one source has two copies, and one is replaced itself."""
    batch = any_law.joints(20)
    walk(batch, np.random.default_rng(3))
    for sources, targets, message in (
        ([0, 20], [1, 2], "joint 20"),
        ([0, 1], [2, -1], "joint -1"),
        ([0, 1], [2, 2], "twice"),
        ([0, 1], [2], "sources name 2 joints, targets 1"),
    ):
        with refused(batch, message):
            batch.copy(sources, targets)
    before = batch.snapshot().values
    sources, targets = [2, 17, 2, 9], [9, 0, 19, 5]
    batch.copy(sources, targets)
    expected = before.copy()
    expected[targets] = before[sources]
    np.testing.assert_array_equal(batch.snapshot().values, expected)
    restored = any_law.joints(20)
    restored.restore(batch.snapshot())
    d = np.random.default_rng(4).normal(0.0, 1e-7, np.shape(batch.delta))
    np.testing.assert_array_equal(batch.update(d)[0], restored.update(d)[0])
    np.testing.assert_array_equal(batch.snapshot().values, restored.snapshot().values)


def test_a_trial_and_copies_leave_a_joint_alone_and_go_the_same_way_bit_for_bit(any_law, tmp_path):
    """A joint that was elsewhere and is restored, one from a file, one that is pickled."""
    joint, restored, from_file = (any_law.joint() for _ in range(3))
    walk(joint, np.random.default_rng(1))
    walk(restored, np.random.default_rng(3))
    state, d = joint.snapshot(), np.full(any_law.dim, 1e-7)
    state.save(tmp_path / "state.npz")
    restored.restore(state)
    from_file.restore(jl.load_state(tmp_path / "state.npz"))
    copies = [restored, from_file, pickle.loads(pickle.dumps(joint))]
    tried = joint.trial(d)
    for copy in copies:
        np.testing.assert_equal(copy.update(d), tried)
        walk(copy, np.random.default_rng(2), 300)
    np.testing.assert_array_equal(joint.snapshot().values, state.values)
    np.testing.assert_equal(joint.update(d), tried)
    np.testing.assert_allclose(joint.F, tried[0], rtol=1e-14, atol=1e-14 * np.abs(tried[0]).max())
    np.testing.assert_allclose(joint.delta, state.values[0, : any_law.dim] + d, rtol=1e-14)
    walk(joint, np.random.default_rng(2), 300)
    for copy in copies:
        np.testing.assert_array_equal(copy.snapshot().values, joint.snapshot().values)


# What the first release writes. A change of the format keeps it and adds new files beside it; a
# version that is no longer read is refused with the remedy.
SPECIMENS = Path(__file__).with_name("specimens")


def test_a_state_of_version_1_is_read():
    joint = jl.JointLaw.from_toml(SPECIMENS / "law.toml").joint()
    joint.restore(jl.load_state(SPECIMENS / "state.npz"))
    assert joint.delta == pytest.approx([5e-7, 3e-7, 1e-7])
    traction = [63304360.5971507, 23287604.80354232, 7718342.099482712]  # Pa
    assert pytest.approx(traction, rel=1e-9) == joint.F


@pytest.mark.parametrize(
    "content",
    [
        lambda path: None,
        lambda path: path.write_bytes(b""),
        lambda path: path.write_text("closure,F1\n0,0\n"),
        lambda path: np.zeros(3).dump(path),
        lambda path: np.savez(path, values=np.zeros((3, 1))),
        lambda path: np.savez(path, version=99, fingerprint="a", values=np.zeros(3)),
        lambda path: np.savez(path, version=1, fingerprint="a", values=np.zeros(3)),
        lambda path: np.savez(path, version=1, fingerprint="a", values="text"),
        lambda path: np.savez(path, version=1, fingerprint="a", values=np.full((3, 1), np.nan)),
        lambda path: path.mkdir(),
    ],
)
def test_a_file_that_is_no_state(tmp_path, content):
    path = tmp_path / "state.npz"
    content(path)
    with pytest.raises(ValueError, match=r"state\.npz.* is not a saved joint state"):
        jl.load_state(path)


FEW_CELLS = [  # that yield: a step to the closure of many cells bears up to 10 % more
    kinds.make_law(
        a=a, b=2.0, c=0.0, mu=mu, heights=heights, lam=1.75, damage={"yield_interference": 5e-9}
    )
    for a, mu, heights in ((1.0, 5.0, None), (3.0, 0.3, "individual"), (1.5, 0.0, "population"))
]


@pytest.mark.parametrize("law", [*kinds.LAWS.values(), *FEW_CELLS])
def test_joints_start_closed_to_a_normal_stress(law):
    stress = law.normal_stress(1e-6) * np.array([1e-3, 0.0, 1.0, 0.2])
    batch = law.joints(4, normal_stress=stress)
    np.testing.assert_allclose(batch.F[:, 0], stress, rtol=1e-12)
    at_rest, _ = batch.trial(np.zeros((4, law.dim)))
    np.testing.assert_allclose(at_rest[:, 0], stress, rtol=1e-12)
    assert not batch.delta[:, 1:].any()
    assert batch.delta[1, 0] == 0.0
    for alike in (law.joint(normal_stress=stress[3]), law.joints(2, normal_stress=stress[3])):
        closed = np.broadcast_to(batch.delta[3], alike.delta.shape)
        np.testing.assert_allclose(alike.delta, closed, rtol=1e-12)


def test_joints_move_between_batches_and_go_on_as_before(any_law):
    rng = np.random.default_rng(3)
    here, there = any_law.joints(5), any_law.joints(4)
    for batch in (here, there):
        walk(batch, rng)
    stays = there.snapshot([0, 2])
    there.restore(here.snapshot(where=[4, 1]), where=[3, 1])
    np.testing.assert_array_equal(there.snapshot([0, 2]).values, stays.values)
    d = rng.normal(0.0, 1e-7, (5, any_law.tables.dim))
    F, _ = here.update(d)
    displaced, _ = there.update(d[[4, 1]], where=[3, 1])
    np.testing.assert_array_equal(displaced, F[[4, 1]])
    with pytest.raises(ValueError, match="state holds 2 joints, for 1 of the batch"):
        there.restore(here.snapshot([0, 1]), where=[0])


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


NO_INCREMENTS = [
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
]


@pytest.mark.parametrize(
    ("act", "told"),
    [
        *((lambda joint, d=d: joint.update(d), "^d ") for d in NO_INCREMENTS),
        *((lambda joint, d=d: joint.trial(d), "^d ") for d in NO_INCREMENTS),
        (lambda joint: jl.direct_shear(joint, [1e-7, np.inf], 1e7), "to = inf"),
        (lambda joint: jl.direct_shear(joint, [], 1e7), r"to = \[\]"),
        (lambda joint: jl.direct_shear(joint, "2um", 1e7), "to = '2um'"),
        (lambda joint: jl.direct_shear(joint, 1e-7, 0.0), r"normal = 0\.0 .*> 0"),
        (lambda joint: jl.direct_shear(joint, 1e-7, 1e7, -1.0), "stiffness = -1.0 is out"),
        (lambda joint: jl.direct_shear(joint, 1e-7, 1e7, steps=2.5), r"steps = 2\.5"),
    ],
)
def test_a_joint_is_not_moved_by_what_it_refuses(law, act, told):
    joint = law.joint(normal_stress=1e6)
    with refused(joint, told):
        act(joint)


NO_INDEX = [
    ([0, 5], "joint 5; joints are 0 to 4"),
    ([-1, 2], "joint -1"),
    ([1, 2, 1], "twice"),
    ([0.0, 1.0], "joint numbers"),
    (2, "joint numbers"),
    ([[0, 1]], "joint numbers"),
    ("ab", "joint numbers"),
    ([True, False], r"mask needs \(5,\)"),
]


@pytest.mark.parametrize(
    ("act", "told"),
    [
        *((lambda batch, i=i: batch.update(np.zeros((2, 3)), i), told) for i, told in NO_INDEX),
        *((lambda batch, i=i: batch.reset(i), told) for i, told in NO_INDEX),
        (lambda batch: batch.restore(np.zeros((5, 3))), "not a snapshot"),
        (lambda batch: batch.restore(batch.snapshot([0, 1, 2])), "3 joints, for 5 of the batch"),
        (
            lambda batch: batch.restore(replace(batch.law, plane=0.0).joints(5).snapshot()),
            "law with other parameters",
        ),
        (
            lambda batch: batch.restore(replace(batch.snapshot(), fingerprint="9:0")),
            "run the path again, or install the version",
        ),
        (
            lambda batch: batch.restore(
                replace(batch.snapshot(), values=np.nan * batch.snapshot().values)
            ),
            r"delta\[0\] .* is nan, out of bounds",
        ),
    ],
)
def test_a_batch_is_not_moved_by_what_it_refuses(moved, act, told):
    with refused(moved, told):
        act(moved)


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
