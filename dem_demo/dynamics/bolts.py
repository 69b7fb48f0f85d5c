"""Rock bolts in motion and in equilibrium: tensions, forces on the blocks, kinematics.

A bolt connects two points, each fixed in its block. Its tension follows from their distance,
elastic up to the capacity and perfectly plastic there; shorter than its free length it is slack. A
run keeps the plastic elongation. The searches for an equilibrium start from bolts that have not
yielded and take the elongation in one step, as they do with joints; there the directions of the
bolts are the ones at the places of the blocks, and the search is repeated at new places.
"""

import ctypes
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from ..compiled import BoltArrays, RelaxedBolts, RelaxedLaw, address, library
from ..scene import Bolt

NEXT_JOINT = np.zeros(1, np.int64)  # of the counter of a law of joints, which bolts do not use


class Bolts:
    """The b bolts of a scene.

    block_a, block_b (b,): blocks in which the ends are anchored. stiffness (b,) in N/m; capacity
    (b,) in N; free_length (b,) in m: without tension, before any yielding. yielding (b,): plastic
    elongation (m); tension (b,) in N and forces (n, 3) on the blocks, at the last `pull`.
    """

    def __init__(self, bolts: Sequence[Bolt], motion: np.ndarray) -> None:
        """Bolts of blocks that are as drawn at a motion (6, n)."""
        self.n = len(bolts)
        self.block_a, self.block_b = np.array([b.blocks for b in bolts], int).reshape(-1, 2).T
        self.block_a, self.block_b = self.block_a.copy(), self.block_b.copy()
        ends = np.array([b.ends for b in bolts], float).reshape(-1, 2, 2) @ [1, 1j]
        centroid = motion[0] + 1j * motion[1]
        self.local_a = ends[:, 0] - centroid[self.block_a]
        self.local_b = ends[:, 1] - centroid[self.block_b]
        self.stiffness = np.array([b.stiffness for b in bolts], float)
        self.capacity = np.array([b.capacity for b in bolts], float)
        pretension = np.array([b.pretension for b in bolts], float)
        self.free_length = np.abs(ends[:, 1] - ends[:, 0]) - pretension / self.stiffness
        self.yielding = np.zeros(self.n)
        self.tension = np.zeros(self.n)
        self.forces = np.zeros((motion.shape[1], 3))
        self.arrays = BoltArrays(n_bolts=self.n, n_blocks=motion.shape[1])
        self.arrays.bind(
            self, "block_a", "block_b", "local_a", "local_b", "stiffness", "capacity",
            "free_length", "yielding", "tension", "forces", motion=motion,
        )  # fmt: skip

    def pull(self) -> float:
        """Update tensions, yielding and forces on the blocks at their present motion.

        Returns the energy (J) that all bolts store, and have dissipated by yielding.
        """
        return self.arrays.call("pull_bolts") if self.n else 0.0

    def ends(self, motion: np.ndarray) -> np.ndarray:
        """Ends (b, 2) of the bolts at a motion (6, n), complex, in m."""
        centroid = motion[0] + 1j * motion[1]
        turn = np.exp(1j * motion[2])
        return np.stack(
            [
                centroid[self.block_a] + turn[self.block_a] * self.local_a,
                centroid[self.block_b] + turn[self.block_b] * self.local_b,
            ],
            axis=1,
        )

    def elongation(self, motion: np.ndarray) -> np.ndarray:
        """Elongation (b,) in m over the free length at a motion (6, n)."""
        start, end = self.ends(motion).T
        return np.abs(end - start) - self.free_length

    def kinematics(self, motion: np.ndarray, inverse_sqrt_inertia: np.ndarray) -> np.ndarray:
        """Rates of elongation (b, 6) by the motions of both blocks at a motion (6, n).

        inverse_sqrt_inertia (n, 3): motions are scaled by the square root of their inertia.
        """
        start, end = self.ends(motion).T
        centroid = motion[0] + 1j * motion[1]
        along = (end - start) / np.maximum(np.abs(end - start), 1e-300)
        parts = []
        for block, at, sign in ((self.block_a, start, -1.0), (self.block_b, end, 1.0)):
            rotation = ((at - centroid[block]).conj() * along).imag
            rates = sign * np.stack([along.real, along.imag, rotation], axis=1)
            parts.append(rates * inverse_sqrt_inertia[block])
        return np.concatenate(parts, axis=1)

    def rates(
        self, motion: np.ndarray, inverse_sqrt_inertia: np.ndarray, is_free: np.ndarray
    ) -> csr_array:
        """`kinematics` as a matrix (b, free motions); is_free (n, 3)."""
        entries = self.kinematics(motion, inverse_sqrt_inertia)
        first = 3 * np.stack([self.block_a, self.block_b], axis=1)
        column = (first[:, :, None] + np.arange(3)).reshape(-1, 6)
        row = np.repeat(np.arange(self.n), 6)
        shape = (self.n, is_free.size)
        matrix = csr_array((entries.ravel(), (row, column.ravel())), shape=shape)
        return matrix[:, is_free.ravel()]

    def static(self, motion: np.ndarray, inverse_sqrt_inertia: np.ndarray) -> "StaticBolts":
        """The bolts as a search for an equilibrium reads them, at a motion (6, n)."""
        kinematics = self.kinematics(motion, inverse_sqrt_inertia)
        capacity = self.capacity.copy()  # which `release` changes
        elongation = self.elongation(motion)
        return StaticBolts(
            self.block_a, self.block_b, kinematics, elongation, self.stiffness, capacity
        )


class StaticBolts(NamedTuple):
    """b bolts that have not yielded, as a search for an equilibrium reads them.

    block_a, block_b (b,). kinematics (b, 2 dof): rates of elongation by the scaled motions of both
    blocks. elongation (b,) in m: over the free length at the present places. stiffness (b,) in
    N/m; capacity (b,) in N.
    """

    block_a: np.ndarray
    block_b: np.ndarray
    kinematics: np.ndarray
    elongation: np.ndarray
    stiffness: np.ndarray
    capacity: np.ndarray

    @classmethod
    def none(cls, motions: int) -> "StaticBolts":
        """No bolts; motions: of two blocks, 2 dof."""
        no_blocks = np.zeros(0, int)
        nothing = np.zeros(0)
        return cls(no_blocks, no_blocks, np.zeros((0, motions)), nothing, nothing, nothing)

    def release(self, blocks: np.ndarray) -> None:
        """Let the bolts that are anchored in blocks (mask) bear nothing."""
        self.capacity[blocks[self.block_a] | blocks[self.block_b]] = 0.0

    def tension(self, further: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tensions (b,) in N and their slopes (b,) in N/m at further elongations (b,) in m, in one
        step."""
        elastic = self.stiffness * (self.elongation + further)
        tension = np.clip(elastic, 0.0, self.capacity)
        return tension, np.where(tension == elastic, self.stiffness, 0.0)

    def relaxed_law(self, contact: np.ndarray, dim: int) -> RelaxedLaw:
        """The bolts as a law of a relaxation with `dim` components; contact (b,): their points."""
        count = len(self.stiffness)
        d = np.zeros((count, dim))
        F = np.zeros((count, dim))
        bolts = RelaxedBolts(n_bolts=count, dim=dim)
        bolts.bind(stiffness=self.stiffness, capacity=self.capacity, d=d, F=F)
        law = RelaxedLaw(
            advance=ctypes.cast(library().dem_bolt_tractions, ctypes.c_void_p).value,
            batch=ctypes.addressof(bolts),
            next_joint=address(NEXT_JOINT),
            contact=address(contact),
            n_joints=count,
            d=address(d),
            F=address(F),
        )
        law.bolts = bolts  # which keeps the arrays alive
        return law
