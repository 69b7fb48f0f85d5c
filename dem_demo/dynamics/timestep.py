"""Largest stable time step: the eigenvalues of the scene's assembled stiffness and dashpots.

Each block alone gives a bound, which is cheap: the eigenvalues of the whole are worked out only
where the bound does not do, or falls.

Symplectic Euler with dashpots that lag by half a step is stable while the largest eigenvalue of
dt^2 K + 2 dt C against the mass matrix stays below 4. For one oscillator that is
dt < (2/omega)(sqrt(1 + zeta^2) - zeta). Rocking is in K because every contact is, at its place.
"""

from contextlib import suppress

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array, diags
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from ..contact import Contacts, Joints, Outlines
from ..scene import Scene, SceneError
from .blocks import Blocks

DENSE = 24  # degrees of freedom up to which a dense eigenproblem is the faster one
HEADROOM = 1.25  # most growth of a joint's stiffness between two checks of the time step
SAFE = 0.98  # largest time step as a share of the limit
FALLEN = 0.95  # share of the lowest bound below which the limit is worked out anew


class StepLimit:
    """Largest stable time step.

    current: a lower bound of it (s); bound: the lowest bound (s) at which it was computed from all
    eigenvalues; lowest: the lowest value (s) so computed; checked_stiffness (k,): stiffness times
    area (N/m) of the contacts up to which the present time step is stable.
    """

    def __init__(self) -> None:
        self.current = self.lowest = self.bound = np.inf
        self.checked_stiffness = np.zeros(0)

    def look(
        self, scene: Scene, blocks: Blocks, contacts: Contacts, joints: Joints, dt: float = np.inf
    ) -> None:
        """Find the limit of a moment from stiffness, dashpots and lever arms, or a bound of it that
        is good enough for a step dt (s)."""
        stiffness = np.maximum(
            joints.stiffness, joints.virgin("stiffness", "closure", contacts.closure)
        )
        # Joints that barely touch count as touching well, or each touch would ask again.
        area = contacts.length * scene.thickness
        stiffness = np.maximum(stiffness, 0.2 * stiffness.max(initial=0.0))
        stiffness = stiffness * np.maximum(area, 0.02 * area.max(initial=0.0))
        run, critical = scene.run, blocks.damping(contacts, stiffness)
        share = max(run.dashpot_normal, run.dashpot_shear)
        self.checked_stiffness = stiffness
        self.current = bound_of_blocks(blocks, contacts, stiffness, share * critical)
        if dt <= SAFE * self.current and self.current > FALLEN * self.bound:
            return
        self.bound = min(self.bound, self.current)
        dashpots = np.concatenate([run.dashpot_normal * critical, run.dashpot_shear * critical])
        self.current = largest_step(rates(blocks, contacts), np.tile(stiffness, 2), dashpots)
        self.lowest = min(self.lowest, self.current)

    def require(self, dt: float) -> None:
        """Refuse a time step (s) beyond the limit; else note how far joints may stiffen.

        The limit falls at most as the square root of the largest growth of any joint's stiffness.
        """
        if dt > SAFE * self.current:
            raise SceneError(
                f"time step {dt:.3g} s: must stay below {SAFE} of the limit, which has fallen "
                f"to {self.current:.3g} s as the joints closed; resume with a smaller step"
            )
        self.checked_stiffness = (
            min(HEADROOM, (SAFE * self.current / dt) ** 2) * self.checked_stiffness
        )


def _largest(sums: np.ndarray, root: np.ndarray) -> float:
    """Largest eigenvalue of any block (n,) alone, on springs that hold it in all directions.

    sums (4, n): of stiffness, and of it times x, y and x^2 + y^2 from the centroid; root (n, 3):
    1/sqrt(inertia) of the free motions, else 0.
    """
    k, kx, ky, turning = sums
    none = np.zeros_like(k)
    K = np.array([[k, none, -ky], [none, k, kx], [-ky, kx, turning]]).transpose(2, 0, 1)
    # Of a block it is at most the trace, and at least each number on the diagonal: few can have it.
    diagonal = np.stack([k, k, turning], axis=1) * root**2
    few = diagonal.sum(axis=1) >= (1 - 1e-9) * diagonal.max(initial=0.0)
    K, root = K[few], root[few]
    return float(np.linalg.eigvalsh(K * root[:, :, None] * root[:, None, :]).max(initial=0.0))


def _held(block: np.ndarray, at: np.ndarray, each: np.ndarray, n: int) -> np.ndarray:
    """Sums (4, n), for `_largest`, of springs `each` at complex places from centroids of blocks."""
    parts = each, each * at.real, each * at.imag, each * np.abs(at) ** 2
    return np.array([np.bincount(block, part, n) for part in parts])


def bound_of_blocks(blocks: Blocks, contacts: Contacts, stiffness, dashpot) -> float:
    """Lower bound (s) of the largest stable step for springs (k,) in N/m and dashpots (k,) in N s/m
    that act alike along normal and tangent; inf without springs.

    A spring between two blocks that give way stores at most twice what each alone would store in
    it, so the largest eigenvalue is at most that of the worst block on springs twice as stiff.
    """
    free, n = blocks.free.any(axis=1), len(blocks.free)
    both = 1.0 + (free[contacts.a] & free[contacts.b])
    sides, centre = (contacts.a, contacts.b), blocks.motion[0] + 1j * blocks.motion[1]
    k, c = (
        _largest(sum(_held(x, contacts.at - centre[x], both * part, n) for x in sides), blocks.root)
        for part in (stiffness, dashpot)
    )
    return 4 / (c + np.sqrt(c * c + 4 * k)) if k else np.inf


def rates(blocks: Blocks, contacts: Contacts) -> csr_array:
    """(2 k, free motions): opening rates along normal and tangent of unit-mass motions."""
    k, block = len(contacts.closure), np.concatenate([contacts.a, contacts.b])
    arm = np.tile(contacts.at, 2) - (blocks.motion[0] + 1j * blocks.motion[1])[block]
    way = np.repeat([-1.0, 1.0], k) * np.tile([contacts.normal, -1j * contacts.normal], 2)
    parts = np.stack([way.real, way.imag, (arm.conj() * way).imag], axis=2) * blocks.root[block]
    row = np.tile(np.arange(2 * k).reshape(2, k), 2)[:, :, None]
    places = np.broadcast_arrays(row, 3 * block[:, None] + np.arange(3))
    entries = parts.ravel(), tuple(place.ravel() for place in places)
    return csr_array(entries, shape=(2 * k, blocks.free.size))[:, blocks.free.ravel()]


def largest_step(rates: csr_array, stiffness: np.ndarray, dashpot: np.ndarray) -> float:
    """Largest stable step (s) for K (2 k,) in N/m and C (2 k,) in N s/m; inf without K.

    The largest eigenvalue of dt^2 K + 2 dt C must be 4. Any vector gives too long a step, the
    eigenvector of the step before a better one: two or three eigenproblems in all.
    """
    if 0 in rates.shape or not stiffness.any():
        return np.inf
    K, C = ((rates.T @ (diags(part) @ rates)).tocsc() for part in (stiffness, dashpot))
    step, last = np.inf, np.inf
    vector = _top(K)
    for _ in range(40):
        k, c = vector @ (K @ vector), vector @ (C @ vector)
        if not k + c > 0:
            return np.inf  # contacts between driven and fixed blocks only
        step, last = 4 / (c + np.sqrt(c * c + 4 * k)), step
        if last - step < 1e-6 * step:
            break
        vector = _top(step**2 * K + 2 * step * C)
    return float(step)


def _top(matrix: csc_array) -> np.ndarray:
    """Eigenvector (unit length) of the largest eigenvalue."""
    size = matrix.shape[0]
    if size > DENSE:
        start = np.random.default_rng(0).standard_normal(size)
        with suppress(ArpackNoConvergence):
            return eigsh(matrix, k=1, v0=start, tol=1e-4)[1][:, 0]
    return eigh(matrix.toarray(), subset_by_index=[size - 1] * 2)[1][:, 0]


def impact_limit(scene: Scene, blocks: Blocks, outlines: Outlines, stiffness: float) -> float:
    """Step limit (s) with every block touched along its whole outline at `stiffness` (Pa/m); inf
    where forces move none.

    Half of every edge acts at either end, or half a corner length if that is more. Twice as stiff,
    as in `bound_of_blocks`, for any contacts between them.
    """
    o, n = outlines, len(blocks.free)
    each = stiffness * scene.thickness * np.maximum(o.side, o.corner_length)  # twice a half
    ends = np.arange(len(o.block)), o.after
    largest = _largest(sum(_held(o.block, o.local[c], each, n) for c in ends), blocks.root)
    return 2 / np.sqrt(largest) if largest else np.inf
