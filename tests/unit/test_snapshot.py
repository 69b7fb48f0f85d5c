"""Snapshots: bit-identical return, files, and what does not belong to the joint."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

import jointlaw as jl
from jointlaw.joints.state import JointState


def walk(joints, rng, steps=30):
    """Random increments, mostly closing, of one joint or of each of a batch."""
    for _ in range(steps):
        d = rng.normal(0.0, 1e-7, np.shape(joints.delta))
        d[..., 0] += 2e-8
        joints.update(d)


def test_trial_leaves_no_trace(any_law):
    joint = any_law.joint()
    walk(joint, np.random.default_rng(1))
    before = joint.snapshot().values
    d = np.full(any_law.tables.dim, 1e-7)
    F, C = joint.trial(d)
    np.testing.assert_array_equal(joint.snapshot().values, before)
    for tried, taken in zip((F, C), joint.update(d), strict=True):
        np.testing.assert_array_equal(tried, taken)
    np.testing.assert_allclose(joint.F, F, rtol=1e-14, atol=1e-14 * np.abs(F).max())
    np.testing.assert_allclose(joint.delta, before[0, : any_law.dim] + d, rtol=1e-14)


def test_a_copy_goes_the_same_way_bit_for_bit_and_moves_alone(any_law, tmp_path):
    """A joint that was elsewhere and is restored, one from a file, one that is pickled."""
    joint, restored, from_file = (any_law.joint() for _ in range(3))
    walk(joint, np.random.default_rng(1))
    walk(restored, np.random.default_rng(3))
    state = joint.snapshot()
    state.save(tmp_path / "state.npz")
    restored.restore(state)
    from_file.restore(jl.load_state(tmp_path / "state.npz"))
    copies = [restored, from_file, pickle.loads(pickle.dumps(joint))]
    for copy in copies:
        walk(copy, np.random.default_rng(2), 300)
    np.testing.assert_array_equal(joint.snapshot().values, state.values)
    walk(joint, np.random.default_rng(2), 300)
    for copy in copies:
        np.testing.assert_array_equal(copy.snapshot().values, joint.snapshot().values)


# What the first release writes. A change of the format keeps it and adds new files beside it; a
# version that is no longer read is refused with the remedy.
SPECIMENS = Path(__file__).with_name("specimens")
TRACTION = [63304360.5971507, 23287604.80354232, 7718342.099482712]  # Pa, of state.npz


def test_a_state_of_version_1_is_read():
    joint = jl.JointLaw.from_toml(SPECIMENS / "law.toml").joint()
    joint.restore(jl.load_state(SPECIMENS / "state.npz"))
    assert joint.delta == pytest.approx([5e-7, 3e-7, 1e-7])
    assert pytest.approx(TRACTION, rel=1e-9) == joint.F


def of_another_discretisation(law):
    version, _, parameters = law.fingerprint.partition(":")
    return JointState(f"{int(version) + 1}:{parameters}", np.zeros((5, law.state_size)))


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda law: replace(law, plane=0.0).joints(5).snapshot(), "law with other parameters"),
        (lambda law: law.joints(3).snapshot(), "state holds 3 joints, for 5 of the batch"),
        (lambda law: np.zeros((5, 3)), "not a snapshot"),
        (of_another_discretisation, "run the path again, or install the version"),
        (lambda law: JointState(law.fingerprint, np.full((5, law.state_size), np.nan)), "damaged"),
    ],
)
def test_a_state_of_other_joints_or_none_is_refused(law, moved, make, told):
    with refused(moved, told):
        moved.restore(make(law))


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
        lambda path: path.mkdir(),
    ],
)
def test_a_file_that_is_no_state(tmp_path, content):
    path = tmp_path / "state.npz"
    content(path)
    with pytest.raises(ValueError, match=r"state\.npz.* is not a saved joint state"):
        jl.load_state(path)


def test_joints_start_closed_to_a_normal_stress(any_law):
    stress = np.array([0.0, 2e6, 5e6])
    batch = any_law.joints(3, normal_stress=stress)
    np.testing.assert_allclose(batch.F[:, 0], stress, rtol=1e-12)
    assert not batch.delta[:, 1:].any()
    same = [any_law.joint(normal_stress=2e6).F[0], *any_law.joints(2, normal_stress=2e6).F[:, 0]]
    assert same == pytest.approx(3 * [2e6], rel=1e-12)
    with pytest.raises(ValueError, match=r"normal_stress has shape \(2,\): give one or \(3,\)"):
        any_law.joints(3, normal_stress=[1e6, 2e6])
    with pytest.raises(ValueError, match="normal_stress = -1"):
        any_law.joint(normal_stress=-1.0)


def test_few_cells_that_yield_bear_the_whole_stress(make_law):
    """Their closure is not that of many cells: a step to it bears up to 10 % more."""
    for a, mu, heights in ((1.0, 5.0, None), (3.0, 0.3, "individual"), (1.5, 0.0, "population")):
        law = make_law(a=a, b=2.0, c=0.0, mu=mu, heights=heights, lam=1.75,
                       damage={"yield_interference": 5e-9})  # fmt: skip
        stress = law.normal_stress(1e-6) * np.array([1e-3, 0.0, 1.0, 0.2])
        batch = law.joints(4, normal_stress=stress)
        np.testing.assert_allclose(batch.F[:, 0], stress, rtol=1e-12)
        assert batch.delta[1, 0] == 0.0
        assert law.joint(normal_stress=stress[0]).delta[0] == batch.delta[0, 0]
    with pytest.raises(ValueError, match=r"normal_stress = 1e\+20 Pa is beyond any closure"):
        law.joint(normal_stress=1e20)


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
    moved, _ = there.update(d[[4, 1]], where=[3, 1])
    np.testing.assert_array_equal(moved, F[[4, 1]])
    with pytest.raises(ValueError, match="state holds 2 joints, for 1 of the batch"):
        there.restore(here.snapshot([0, 1]), where=[0])
