"""Rows of contact points: forces do the work that the joints take up."""

import numpy as np
import pytest

from dem_demo.contact import ContactRows


@pytest.mark.parametrize(("dim", "dof"), [(2, 3), (3, 6)])
def test_forces_do_the_work_of_the_joints(dim, dof):
    """Power of the forces, plus the rate of the energy of joints whose areas change, is zero."""
    rng = np.random.default_rng(1)
    k = 7
    rows = ContactRows.zeros(k, dim, dof, 2)
    rows.block_a[:], rows.block_b[:] = rng.integers(0, 2, k), rng.integers(2, 4, k)
    for name in ("area", "kinematics", "area_gradient"):
        getattr(rows, name)[:] = rng.uniform(-1.0, 1.0, getattr(rows, name).shape)
    traction = rng.normal(size=(k, dim))
    energy = rng.uniform(size=k)
    velocity = rng.normal(size=(4, dof))
    force = rows.assemble_forces(4, rows.area[:, None] * traction, energy)
    both = np.concatenate([velocity[rows.block_a], velocity[rows.block_b]], axis=1)
    displacement_rate = np.einsum("kcm,km->kc", rows.kinematics, both)
    power = rows.area @ (traction * displacement_rate).sum(axis=1)
    power += energy @ (rows.area_gradient * both).sum(axis=1)
    assert (force * velocity).sum() == pytest.approx(-power, rel=1e-13)
    assert rows.keys.shape == (2, k)
