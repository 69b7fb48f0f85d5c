"""Largest stable time step, from the eigenvalues of the assembled stiffness and dashpots.

Symplectic Euler with dashpots that lag by half a step is stable while the largest eigenvalue of
dt^2 K + 2 dt C, relative to the mass matrix, stays below 4. For one oscillator it means
dt < (2/omega)(sqrt(1 + zeta^2) - zeta). K holds every contact at its place, so rocking is included.

Each block alone gives a cheap bound. The eigenvalues of the whole scene are
computed only where the bound does not suffice, or falls.
"""

import math
from contextlib import suppress

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array, diags, vstack
from scipy.sparse.linalg import ArpackNoConvergence, eigsh

from ..contact import ContactRows, Joints, Outlines
from ..scene import Scene, SceneError
from .blocks import Blocks
from .search import free_motion_matrix

MAX_FRACTION_OF_LIMIT = 0.98  # largest time step, relative to the limit
MAX_STIFFNESS_GROWTH = 1.25  # of a joint between two checks of a time step near its limit
RECOMPUTE_BELOW = 0.95  # of the lowest bound: the eigenvalues of the scene are computed again
MIN_STIFFNESS = 0.2  # of the stiffest joint: a joint that barely touches counts as this stiff
MIN_AREA = 0.02  # of the largest joint: the same for its area; else each touch would be checked
MAX_DENSE_SIZE = 24  # degrees of freedom up to which a dense eigenproblem is faster
MAX_EIGENPROBLEMS = 40
STEP_TOLERANCE = 1e-6  # relative change of the step that ends its iteration


class TimeStepLimit:
    """Largest stable time step.

    current: a lower bound of it (s); lowest_bound: the lowest bound (s) of single blocks at which
    it was computed from all eigenvalues; lowest: the lowest value (s) so computed;
    checked_stiffness (k,): stiffness times area (N/m) of the contacts up to which the present time
    step is stable.
    """

    def __init__(self) -> None:
        self.current = np.inf
        self.lowest = np.inf
        self.lowest_bound = np.inf
        self.checked_stiffness = np.zeros(0)

    def update(
        self, scene: Scene, blocks: Blocks, rows: ContactRows, joints: Joints, dt: float = np.inf
    ) -> None:
        """Find the present stability limit from stiffness, dashpots and lever arms.

        A cheap bound by single blocks is computed first. The eigenvalue problem of all blocks
        follows only if the time step `dt` (s) exceeds a fraction of that bound, or if the bound has
        fallen well below the lowest one so far.
        """
        stiffness = np.maximum(
            joints.stiffness, joints.interpolate("stiffness", "closure", rows.closure)
        )
        stiffness = np.maximum(stiffness, MIN_STIFFNESS * stiffness.max(initial=0.0))
        area = np.maximum(rows.area, MIN_AREA * rows.area.max(initial=0.0))
        stiffness = stiffness * area
        self.checked_stiffness = stiffness
        run = scene.run
        critical = blocks.critical_damping(rows, stiffness)
        larger_fraction = max(run.dashpot_normal, run.dashpot_shear)
        self.current = bound_of_blocks(blocks, rows, stiffness, larger_fraction * critical)
        is_allowed = dt <= MAX_FRACTION_OF_LIMIT * self.current
        if is_allowed and self.current > RECOMPUTE_BELOW * self.lowest_bound:
            return
        self.lowest_bound = min(self.lowest_bound, self.current)
        dim = rows.rates.shape[1]
        fractions = [run.dashpot_normal, *[run.dashpot_shear] * (dim - 1)]
        dashpots = np.concatenate([fraction * critical for fraction in fractions])
        bolts = blocks.bolts
        rates = closure_and_shear_rates(blocks, rows)
        springs = np.tile(stiffness, dim)
        if bolts.n:
            bolt_rates = bolts.rates(blocks.motion, blocks.inverse_sqrt_inertia, blocks.is_free)
            rates = vstack([rates, bolt_rates]).tocsr()
            springs = np.append(springs, bolts.stiffness)
            dashpots = np.append(dashpots, 0.0 * bolts.stiffness)
        self.current = largest_step(rates, springs, dashpots)
        self.lowest = min(self.lowest, self.current)

    def require_stable(self, dt: float) -> None:
        """Raise SceneError for a time step (s) beyond the limit; else set `checked_stiffness`.

        The limit falls at most as the square root of the largest growth of any joint's stiffness.
        Far below the limit a larger growth is allowed, so that joints that close under the weight
        of a settling scene do not have it computed in every step.
        """
        allowed = MAX_FRACTION_OF_LIMIT * self.current
        if dt > allowed:
            raise SceneError(
                f"time step {dt:.3g} s: must stay below {MAX_FRACTION_OF_LIMIT} of the limit, "
                f"which has fallen to {self.current:.3g} s as the joints closed; resume with a "
                "smaller step"
            )
        headroom = allowed / dt
        if math.isinf(headroom):  # no joint is stiff: the first one that closes is checked
            growth = MAX_STIFFNESS_GROWTH
        else:
            growth = min(max(MAX_STIFFNESS_GROWTH, 0.5 * headroom), headroom**2)
        self.checked_stiffness = growth * self.checked_stiffness


def block_stiffness(
    block: np.ndarray, kinematics: np.ndarray, springs: np.ndarray, n: int
) -> np.ndarray:
    """Stiffness (n, dof, dof) of each block alone on springs that act in all directions.

    block (k,): numbers of the blocks; kinematics (k, dim, dof): displacements of the springs by the
    motions of the blocks; springs (k,) in N/m.
    """
    dof = kinematics.shape[2]
    stiffness = np.empty((n, dof, dof))
    by_motion = np.ascontiguousarray(kinematics.T)  # (dof, dim, k): sums over dim are fast
    for i in range(dof):
        for j in range(i + 1):
            products = springs * (by_motion[i] * by_motion[j]).sum(axis=0)
            stiffness[:, i, j] = stiffness[:, j, i] = np.bincount(block, products, n)
    return stiffness


def largest_eigenvalue(stiffness: np.ndarray, inverse_sqrt_inertia: np.ndarray) -> float:
    """Largest eigenvalue of any single block.

    stiffness (n, dof, dof): of `block_stiffness`; inverse_sqrt_inertia (n, dof): zero for
    prescribed motions.
    """
    # The largest eigenvalue of a block is at most its trace, and at least its largest diagonal
    # entry. Few blocks can have the largest of all.
    root = inverse_sqrt_inertia
    diagonal = np.diagonal(stiffness, axis1=1, axis2=2) * root**2
    can_be_largest = diagonal.sum(axis=1) >= (1 - 1e-9) * diagonal.max(initial=0.0)
    K = stiffness[can_be_largest]
    root = root[can_be_largest]
    return float(np.linalg.eigvalsh(K * root[:, :, None] * root[:, None, :]).max(initial=0.0))


def bound_of_blocks(blocks: Blocks, rows: ContactRows, stiffness, dashpot) -> float:
    """Lower bound (s) of the largest stable step; infinite without springs.

    stiffness (k,) in N/m and dashpot (k,) in N s/m act in all directions alike; bolts act too. A
    spring between two movable blocks stores at most twice the energy that each alone would store in
    it, so the largest eigenvalue is at most the one of the worst block on springs twice as stiff.
    """
    n, dof = blocks.is_free.shape
    is_movable = blocks.is_free.any(axis=1)
    weight = 1.0 + (is_movable[rows.block_a] & is_movable[rows.block_b])
    of_a = rows.kinematics[:, :, :dof]
    of_b = rows.kinematics[:, :, dof:]

    def stiffness_of_blocks(springs: np.ndarray) -> np.ndarray:
        K = block_stiffness(rows.block_a, of_a, weight * springs, n)
        return K + block_stiffness(rows.block_b, of_b, weight * springs, n)

    K = stiffness_of_blocks(stiffness)
    bolts = blocks.bolts
    if bolts.n:
        elongation = bolts.kinematics(blocks.motion, np.ones((n, dof)))[:, None, :]
        K += block_stiffness(bolts.block_a, elongation[:, :, :dof], 2 * bolts.stiffness, n)
        K += block_stiffness(bolts.block_b, elongation[:, :, dof:], 2 * bolts.stiffness, n)
    k = largest_eigenvalue(K, blocks.inverse_sqrt_inertia)
    c = largest_eigenvalue(stiffness_of_blocks(dashpot), blocks.inverse_sqrt_inertia)
    return 4 / (c + np.sqrt(c * c + 4 * k)) if k else np.inf


def scaled_kinematics(blocks: Blocks, rows: ContactRows) -> np.ndarray:
    """Rates of closure and shears by the motions of block a, then of block b: (k, dim, 2 dof).

    Motions are scaled by the square root of their inertia; columns of prescribed motions are zero.
    """
    root = blocks.inverse_sqrt_inertia
    of_both = np.concatenate([root[rows.block_a], root[rows.block_b]], axis=1)
    return rows.kinematics * of_both[:, None, :]


def closure_and_shear_rates(blocks: Blocks, rows: ContactRows) -> csr_array:
    """Matrix (dim k, free motions) from motions of the blocks to the rates of the contact points.

    Closure rates (k,), then shear rates (k,): `scaled_kinematics` without the prescribed motions.
    """
    kinematics = scaled_kinematics(blocks, rows)
    return free_motion_matrix(rows.block_a, rows.block_b, kinematics, blocks.is_free)


def largest_step(rates: csr_array, stiffness: np.ndarray, dashpot: np.ndarray) -> float:
    """Largest stable step (s); infinite without stiffness.

    rates (dim k, m): of `closure_and_shear_rates`; stiffness (dim k,) in N/m; dashpot (dim k,) in
    N s/m. The largest eigenvalue of dt^2 K + 2 dt C must be 4. Any vector gives a step that is too
    long, the eigenvector of the step before a better one: two or three eigenproblems suffice.
    """
    if 0 in rates.shape or not stiffness.any():
        return np.inf
    K = (rates.T @ (diags(stiffness) @ rates)).tocsc()
    C = (rates.T @ (diags(dashpot) @ rates)).tocsc()
    step = np.inf
    vector = _top_eigenvector(K)
    for _ in range(MAX_EIGENPROBLEMS):
        k = vector @ (K @ vector)
        c = vector @ (C @ vector)
        if not k + c > 0:
            return np.inf  # contacts between driven and fixed blocks only
        previous_step = step
        step = 4 / (c + np.sqrt(c * c + 4 * k))
        if previous_step - step < STEP_TOLERANCE * step:
            break
        vector = _top_eigenvector(step**2 * K + 2 * step * C)
    return float(step)


def _top_eigenvector(matrix: csc_array) -> np.ndarray:
    """Unit eigenvector of the largest eigenvalue of a symmetric matrix."""
    size = matrix.shape[0]
    if size > MAX_DENSE_SIZE:
        start = np.random.default_rng(0).standard_normal(size)
        with suppress(ArpackNoConvergence):
            return eigsh(matrix, k=1, v0=start, tol=1e-4)[1][:, 0]
    return eigh(matrix.toarray(), subset_by_index=[size - 1] * 2)[1][:, 0]


def impact_limit(scene: Scene, blocks: Blocks, outlines: Outlines, stiffness: float) -> float:
    """Step limit (s) if every block were touched along its whole outline; infinite where forces
    move no block.

    stiffness (Pa/m): of the joints. Half of every edge acts at either end, or half a corner length,
    whichever is larger; twice as stiff, as in `bound_of_blocks`, for any contacts between blocks.
    """
    length = np.maximum(outlines.edge_length, outlines.corner_length)
    springs = stiffness * scene.thickness * length  # twice a half
    zero = np.zeros(len(length))
    K = np.zeros((*blocks.is_free.shape, 3))
    for end in (np.arange(len(length)), outlines.next):
        arm = outlines.local_corner[end]
        along_x = [zero + 1.0, zero, -arm.imag]
        along_y = [zero, zero + 1.0, arm.real]
        kinematics = np.transpose([along_x, along_y], (2, 0, 1))
        K += block_stiffness(outlines.block, kinematics, springs, len(K))
    largest = largest_eigenvalue(K, blocks.inverse_sqrt_inertia)
    return 2 / np.sqrt(largest) if largest else np.inf
