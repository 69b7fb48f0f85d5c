"""Contact points as rows: the part of a contact that does not depend on its geometry.

A geometry, such as corners on edges in the plane or faces on faces in space, fills one row for each
contact point. Forces, dashpots, energy balance, time step, equilibrium, drives, records and saved
states read rows only. They are therefore written once, for blocks with 3 motions in the plane and
with 6 motions in space.

Motions of a block: displacements of its centroid along x, y (and z), then its rotation, in space
about its three principal axes. In the plane there are dof = 3 motions, and dim = 2 components of a
displacement of the law, closure and sliding; in space dof = 6, and dim = 3, closure and two shears.

A row turns motions into displacements of the law, and by the same numbers tractions into forces on
the motions, so the work of both is equal.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(eq=False)
class ContactRows:
    """k contact points at the present places of the blocks.

    block_a, block_b (k,) int64: numbers of the two blocks that meet, block_a < block_b.
    closure (k,) in m: depth to which the two faces overlap; below zero a gap.
    area (k,) in m2: of the joint that a point stands for.
    kinematics (k, dim, 2 dof): rates of closure (first) and shears (m/s) per velocity of each
        motion (m/s or rad/s), of block a, then of block b.
    area_gradient (k, 2 dof): derivatives of the area by the motions of block a, then of block b
        (m2/m or m2/rad); zero where the area does not change.
    keys (m, k) int64: numbers from which the geometry makes the same points again, such as corner
        and edge, or two faces and a number. A saved state holds them.
    rates (k, dim) in m/s: of closure and shears at the present velocities, computed by the step.

    The arrays are contiguous. A geometry changes them in place while the blocks move, and makes new
    ones when the list of points changes.
    """

    block_a: np.ndarray
    block_b: np.ndarray
    closure: np.ndarray
    area: np.ndarray
    kinematics: np.ndarray
    area_gradient: np.ndarray
    keys: np.ndarray
    rates: np.ndarray

    @classmethod
    def zeros(cls, k: int, dim: int, dof: int, n_keys: int) -> "ContactRows":
        """Return rows for k points, all numbers zero; n_keys: numbers in the key of a point."""
        return cls(
            block_a=np.zeros(k, np.int64),
            block_b=np.zeros(k, np.int64),
            closure=np.zeros(k),
            area=np.zeros(k),
            kinematics=np.zeros((k, dim, 2 * dof)),
            area_gradient=np.zeros((k, 2 * dof)),
            keys=np.zeros((n_keys, k), np.int64),
            rates=np.zeros((k, dim)),
        )

    def assemble_forces(
        self, n_blocks: int, joint_force: np.ndarray, stored_energy: np.ndarray | float = 0.0
    ) -> np.ndarray:
        """Return the forces (n_blocks, dof) of the joints on the motions of the blocks.

        joint_force (k, dim) in N: area times traction, which resists closure and shears.
        stored_energy (k,) in J/m2: a change of the area costs it. Forces in N, moments in N m.
        """
        k, _, both = self.kinematics.shape
        dof = both // 2
        energy = np.broadcast_to(stored_energy, k)[:, None]
        force = np.einsum("kc,kcm->km", joint_force, self.kinematics)
        force = -force - energy * self.area_gradient
        block = np.concatenate([self.block_a, self.block_b])
        place = dof * block[:, None] + np.arange(dof)
        parts = np.concatenate([force[:, :dof], force[:, dof:]])
        total = np.bincount(place.ravel(), parts.ravel(), dof * n_blocks)
        return total.reshape(n_blocks, dof)
