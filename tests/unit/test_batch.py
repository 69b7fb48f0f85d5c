"""Batches: any array goes in, none is changed."""

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
