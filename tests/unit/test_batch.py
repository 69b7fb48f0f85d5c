"""Many joints at once: any array goes in, none is changed; and contacts that come and go, each of
which keeps its own history and takes no other's."""

import numpy as np
import pytest

import jointlaw as jl


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
    batch = law.joints(2, ledger=False)
    assert not hasattr(batch, "dissipated_energy")
    with pytest.raises(AttributeError, match=r"plastic_work is not .* ledger=True"):
        _ = batch.plastic_work


def test_a_joint_shows_what_a_batch_does(law):
    joint, batch = law.joint(2e6), law.joints(1, normal_stress=2e6)
    F, C = joint.update([1e-7, 2e-8, 0.0])
    before = joint.snapshot().values
    F[:], C[:], joint.delta[:], joint.F[:] = 0.0, 0.0, 0.0, 0.0  # the caller's own
    np.testing.assert_array_equal(joint.snapshot().values, before)
    assert (law.dim, batch.law.state_size) == (3, batch.snapshot().values.shape[1])
    assert jl.Joint.delta.__doc__.startswith("Displacement from the mated position (dim,): closure")


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


def test_unknown_keys_are_refused_and_nothing_is_dropped(law):
    pool = jl.JointPool(law)
    pool.add("ab")
    with pytest.raises(KeyError, match="x"):
        pool.drop(["a", "x"])
    assert pool.keys == ["a", "b"]


def test_snapshot_and_restore(law):
    pool = jl.JointPool(law)
    pool.batch.update(np.eye(3) * 1e-7, where=pool.add("abc"))
    pool.drop("a")
    keys, state = pool.keys, pool.snapshot()
    other = jl.JointPool(law)
    other.add("xyz")
    other.restore(keys, state)
    with pytest.raises(ValueError, match="keys name 1 contacts, state holds 2 joints"):
        other.restore("b", state)
    assert other.keys == ["b", "c"]
    np.testing.assert_array_equal(other.batch.delta[other.places], pool.batch.delta[pool.places])
