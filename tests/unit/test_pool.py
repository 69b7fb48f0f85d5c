"""Joints of contacts that come and go: each keeps its own history, none takes another's."""

import numpy as np
import pytest

import jointlaw as jl


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
        if keys:
            np.testing.assert_allclose(F, exact, rtol=0, atol=1e-12 * np.abs(exact).max() + 1e-300)
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
