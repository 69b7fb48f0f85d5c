"""Largest stable time step: the eigenvalues of the scene's assembled stiffness and dashpots.

Symplectic Euler with dashpots that lag by half a step is stable while the largest eigenvalue of
dt^2 K + 2 dt C against the mass matrix stays below 4. For one oscillator that is
dt < (2/omega)(sqrt(1 + zeta^2) - zeta). Rocking is in K because every law point is, at its place.
"""

from contextlib import suppress

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array, diags
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from ..contact import Contacts, Points

DENSE = 24  # degrees of freedom up to which a dense eigenproblem is the faster one


class StepLimit:
    """Assembles law points into a matrix over the free motions of the blocks.

    inertia (n, 3): mass, mass and moment of every block; free (n, 3): motions that forces move.
    """

    def __init__(self, inertia: np.ndarray, free: np.ndarray) -> None:
        self.root = np.where(free, 1 / np.sqrt(inertia), 0.0).ravel()
        self.number = (np.cumsum(free) - 1).reshape(free.shape)
        self.free = free
        self.size = int(free.sum())

    def rows(self, contacts: Contacts, points: Points, motion: np.ndarray) -> csr_array:
        """(2 k, free motions): opening rates along normal and tangent of unit-mass motions."""
        k = len(points.closure)
        data, row, col = [], [], []
        for block, sign in ((contacts.a, -1.0), (contacts.b, 1.0)):
            arm = points.at - (motion[0] + 1j * motion[1])[block]
            for first, way in ((0, points.normal), (k, -1j * points.normal)):
                parts = (way.real, way.imag, (arm.conj() * way).imag)
                for axis, part in enumerate(parts):
                    ok = self.free[block, axis]
                    data.append((sign * part * self.root[3 * block + axis])[ok])
                    row.append((first + np.arange(k))[ok])
                    col.append(self.number[block, axis][ok])
        entries = np.concatenate(data), (np.concatenate(row), np.concatenate(col))
        return csr_array(entries, shape=(2 * k, self.size))

    def __call__(self, rows: csr_array, stiffness: np.ndarray, dashpot: np.ndarray) -> float:
        """Largest stable step (s) for K (2 k,) in N/m and C (2 k,) in N s/m; inf without K.

        The largest eigenvalue of dt^2 K + 2 dt C must be 4. Any vector gives too long a step, the
        eigenvector of the step before a better one: two or three eigenproblems in all.
        """
        if 0 in rows.shape or not stiffness.any():
            return np.inf
        K, C = ((rows.T @ (diags(part) @ rows)).tocsc() for part in (stiffness, dashpot))
        step, last = np.inf, np.inf
        vector = self._top(K)
        for _ in range(40):
            k, c = vector @ (K @ vector), vector @ (C @ vector)
            if not k + c > 0:
                return np.inf  # contacts between driven and fixed blocks only
            step, last = 4 / (c + np.sqrt(c * c + 4 * k)), step
            if last - step < 1e-6 * step:
                break
            vector = self._top(step**2 * K + 2 * step * C)
        return float(step)

    def _top(self, matrix: csc_array) -> np.ndarray:
        """Eigenvector (unit length) of the largest eigenvalue."""
        if self.size <= DENSE:
            return self._exactly(matrix)
        start = np.random.default_rng(0).standard_normal(self.size)
        with suppress(ArpackNoConvergence):
            return eigsh(matrix, k=1, v0=start, tol=1e-4)[1][:, 0]
        return self._exactly(matrix)

    def _exactly(self, matrix: csc_array) -> np.ndarray:
        last = [self.size - 1] * 2
        return eigh(matrix.toarray(), subset_by_index=last)[1][:, 0]


def impact_limit(blocks, thickness, inertia, free, stiffness, corner_length) -> float:
    """Step limit (s) with every block touched along its whole outline at `stiffness` (Pa/m).

    Half of every edge acts at either end, or half a corner_length (m) if that is more.
    Proven for any contacts between them: a joint's energy is at most twice what its two blocks
    would store in it alone, so the largest eigenvalue is at most twice that of the worst block.
    """
    top = 0.0
    for block, mass, moves in zip(blocks, inertia, free, strict=True):
        if not moves.any():
            continue
        p, q = block.local, np.roll(block.local, -1, axis=0)
        half = 0.5 * np.maximum(np.hypot(*(q - p).T), corner_length) * thickness * stiffness
        K = np.zeros((3, 3))
        for arm in (p, q):
            for way in (np.array([1.0, 0.0]), np.array([0.0, 1.0])):
                j = np.stack(
                    [*np.tile(way, (len(arm), 1)).T, arm[:, 0] * way[1] - arm[:, 1] * way[0]]
                )
                K += (j * half) @ j.T
        root = 1 / np.sqrt(mass[moves])
        top = max(
            top, 2 * float(np.linalg.eigvalsh(K[np.ix_(moves, moves)] * np.outer(root, root))[-1])
        )
    return 2 / np.sqrt(top)
