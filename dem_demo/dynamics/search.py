"""Search for a static equilibrium of blocks on virgin joints, in the plane or in space.

The search reads contact points as rows: blocks a and b, area, and how closure and shears follow the
motions of both blocks. It knows neither the geometry nor the number of dimensions.

Equilibrium. The blocks relax from the displacements of joints that stick (`relaxation.py`), and
Newton's method finishes.

Unstable blocks. Where there is no equilibrium, some blocks go on moving at a steady rate while the
unbalanced force no longer falls. Every block that moves by more than a hundredth of the fastest one
is unstable, without static equilibrium. Where it would be in the end has no meaning, as contacts
keep their normals here: it is put back to within a few closures of where it began, in the direction
in which it moved, so that it has released the forces that it exerted on the rest. There it is fixed
and the others are solved again; blocks that only an unstable one supported show then. In the end
the unstable blocks creep from their places as far as it takes to release those forces.

A search without a decision counts as no equilibrium, and is reported (`Verdict.NOT_DECIDED`).
"""

from collections.abc import Callable
from functools import partial, reduce
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csc_array, csr_array, vstack
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import SuperLU, splu

from .bolts import StaticBolts
from .relaxation import UNSTABLE_FRACTION, Relaxation, Verdict

# Newton's method
SOLUTION_TOLERANCE = 1e-11  # residual of an equilibrium, relative to the load
STEP_TOLERANCE = 1e-8  # the same of the stick predictor
ACCEPTED_RESIDUAL = 1e3  # tolerances: where rounding ends the iteration above one
MAX_ITERATIONS = 60
MAX_DAMPINGS = 20  # trials of damping in one iteration
DAMPING_INCREASE = 4.0
DAMPING_DECREASE = 10.0
MIN_DAMPING = 1e-3  # of the largest stiffness
REGULARISATION = 1e-9  # of the least damping, so that free blocks give no singular matrix

# Sparse factorisation: the structure is symmetric, the entries are not
ORDERING = "MMD_AT_PLUS_A"  # of the unknowns, by minimum degree
PIVOT_THRESHOLD = 0.01  # of the largest entry of a column: a larger diagonal entry is the pivot

# Relaxation
RELEASE_CLOSURES = 10.0  # largest closures by which an unstable block may move from its place
RELEASE_DRAG = 0.01  # relative to the median stiffness: of unstable blocks that creep at the end
MAX_RELEASE_STEPS = 40
MIN_RELEASE_RATIO = 0.9  # of residuals of two steps of creep, which ends above it
MAX_FINISHING_ITERATIONS = 12  # of Newton's method after a relaxation
HIGH_STRESS = 2e7  # Pa: bounds the stiffness of joints where nothing touches at first
FIXING_DRAG = 1e25  # 1/s2: holds a block in its place
PREDICTOR_FALL = 0.1  # of its radius: fall of a free block in the stick predictor
MIN_RELEASE = 1e-6  # m: an unstable block may move as far in any case
MAX_SHIFT = 0.05  # of the smaller radius: relative displacement of two blocks at a contact point


class StaticSystem(NamedTuple):
    """n blocks on k contact points, as the search reads them.

    dim: components of a displacement of the law (closure and shears), 2 or 3; dof: motions of a
    block, 3 or 6, displacements first. mass (n,) in kg; radius (n,) in m. is_free (n, dof): motions
    that forces move. scale (n, dof): motion of a block in m or rad per unit of a scaled motion, the
    inverse square root of its inertia; zero for prescribed motions. force (n, dof): loads that do
    not change, N and N m.

    block_a, block_b (k,): blocks that meet at a point. kinematics (k, dim, 2 dof): closure and
    shears by the scaled motions of both. area (k,) in m2. start (k, dim): closure and shears in m
    at the present places. joints: virgin joints of the points (`contact.Joints`). bolts: the rock
    bolts, None without any.
    """

    mass: np.ndarray
    radius: np.ndarray
    is_free: np.ndarray
    scale: np.ndarray
    force: np.ndarray
    block_a: np.ndarray
    block_b: np.ndarray
    kinematics: np.ndarray
    area: np.ndarray
    start: np.ndarray
    joints: Any
    bolts: StaticBolts | None = None


def free_motion_matrix(
    block_a: np.ndarray, block_b: np.ndarray, kinematics: np.ndarray, is_free: np.ndarray
) -> csr_array:
    """Matrix (dim k, free motions) of rows of contact points: of all points their closures, then
    their shears.

    block_a, block_b (k,): blocks that meet; kinematics (k, dim, 2 dof): by the motions of both;
    is_free (n, dof): motions that forces move.
    """
    k, dim, both = kinematics.shape
    dof = both // 2
    block = np.concatenate([block_a, block_b])
    of_a, of_b = np.split(kinematics.transpose(1, 0, 2), 2, axis=2)
    entries = np.concatenate([of_a, of_b], axis=1)  # (dim, 2 k, dof)
    row = np.tile(np.arange(dim * k).reshape(dim, k), 2)[:, :, None]
    column = dof * block[:, None] + np.arange(dof)
    places = tuple(place.ravel() for place in np.broadcast_arrays(row, column))
    matrix = csr_array((entries.ravel(), places), shape=(dim * k, is_free.size))
    return matrix[:, is_free.ravel()]


def vector_length(columns: np.ndarray) -> np.ndarray:
    """Lengths (n,) of vectors (n, dim)."""
    return reduce(np.hypot, np.abs(columns).T)


class Stiffness(NamedTuple):
    """Tangent stiffness of joints (k, dim, dim) in Pa/m, and of bolts (b,) in N/m."""

    joints: np.ndarray
    bolts: np.ndarray


class StiffnessPattern:
    """Places of the entries of a stiffness matrix (m, m), which stay the same in a search.

    Each element couples the motions of two blocks; columns (elements, 2 dof): number of each of
    their motions among the m free ones, -1 for a prescribed one.
    """

    def __init__(self, columns: np.ndarray, m: int) -> None:
        row = columns[:, :, None]
        column = columns[:, None, :]
        code = np.where((row >= 0) & (column >= 0), column * m + row, m * m).ravel()
        diagonal = np.arange(m) * (m + 1)
        codes, place = np.unique(np.concatenate([code, diagonal, [m * m]]), return_inverse=True)
        self.m = m
        self.place = place[: len(code)].reshape(len(columns), columns.shape[1] ** 2)
        self.diagonal = place[len(code) : -1]
        self.count = len(codes) - 1  # the last one collects the entries of prescribed motions
        column_of_entry, row_of_entry = np.divmod(codes[:-1], max(m, 1))
        self.rows = row_of_entry.astype(np.int32)
        self.starts = np.searchsorted(column_of_entry, np.arange(m + 1)).astype(np.int32)

    def matrix(self, stiffness: np.ndarray, elements: np.ndarray) -> csc_array:
        """The sum of the stiffness (n, 2 dof, 2 dof) of n elements, given their numbers (n,); it
        has an entry for every place of the diagonal."""
        place = self.place[elements].ravel()
        entries = np.bincount(place, stiffness.ravel(), self.count + 1)[:-1].astype(float)
        return csc_array((entries, self.rows, self.starts), shape=(self.m, self.m))

    def with_diagonal(self, matrix: csc_array, diagonal: np.ndarray) -> csc_array:
        """A copy of a matrix of this pattern with a diagonal (m,) added, ready to be factorised:
        without the zeros of open contacts, which would fill in."""
        entries = matrix.data.copy()
        entries[self.diagonal] += diagonal
        copy = csc_array((entries, self.rows.copy(), self.starts.copy()), shape=matrix.shape)
        copy.eliminate_zeros()
        return copy


def factorise(matrix: csc_array) -> SuperLU | None:
    """Factorise a stiffness matrix (m, m) with a symmetric structure; None if it is singular.

    Pivots stay on the diagonal unless they are much smaller than the rest of their column. Choosing
    the largest entry instead would undo the ordering, and fill in several times as many entries.
    """
    options = {"SymmetricMode": True}
    try:
        return splu(matrix, ORDERING, diag_pivot_thresh=PIVOT_THRESHOLD, options=options)
    except RuntimeError:
        return None


class Solution(NamedTuple):
    """Result of a search: displacements (m,) of the free motions, unstable blocks (n,), and the
    verdict on all other blocks."""

    displacement: np.ndarray
    unstable: np.ndarray
    verdict: Verdict


class EquilibriumSearch:
    """Search for a static equilibrium from the present places of the blocks.

    The joints are virgin but for their closure and sliding so far. Unknowns are the scaled
    displacements (m,) of the free motions, so forces are divided by the square root of the inertia
    and drags have the unit 1/s2.
    """

    def __init__(self, system: StaticSystem) -> None:
        self.system = system
        self.joints = system.joints
        self.k = len(system.area)
        self.dim = system.kinematics.shape[1]
        self.kinematics = free_motion_matrix(
            system.block_a, system.block_b, system.kinematics, system.is_free
        )
        bolts = system.bolts or StaticBolts.none(system.kinematics.shape[2])
        self.bolts = bolts
        self.bolt_kinematics = free_motion_matrix(
            bolts.block_a, bolts.block_b, bolts.kinematics[:, None, :], system.is_free
        )
        self.area = np.tile(system.area, self.dim)
        radius = np.minimum(system.radius[system.block_a], system.radius[system.block_b])
        self.max_shift = MAX_SHIFT * radius
        self.start = system.start.T.ravel()
        self.root = system.scale[system.is_free]
        self.block = np.nonzero(system.is_free)[0]  # of each free motion
        acceleration = vector_length(system.force[:, : self.dim]) / system.mass / system.radius
        # drag at which the load moves a block by its radius in a step
        self.drag_of_radius = float(np.median(acceleration[system.is_free.any(axis=1)]))
        self.force = system.force[system.is_free] * self.root
        self.zero = np.zeros(len(self.block))
        touched = sum(abs(self.kinematics[i * self.k : (i + 1) * self.k]) for i in range(self.dim))
        touched = vstack([touched, abs(self.bolt_kinematics)])
        number = np.full(system.is_free.shape, -1)
        number[system.is_free] = np.arange(len(self.block))
        block_a = np.concatenate([system.block_a, bolts.block_a]).astype(int)
        block_b = np.concatenate([system.block_b, bolts.block_b]).astype(int)
        columns = np.concatenate([number[block_a], number[block_b]], axis=1)
        self.pattern = StiffnessPattern(columns, len(self.block))
        self.island = connected_components(touched.T @ touched, directed=False)[1]

    def expand(self, values: np.ndarray) -> np.ndarray:
        """Values (n, dof) of all motions from values (m,) of the free ones; zero for the others."""
        out = np.zeros(self.system.is_free.shape)
        out[self.system.is_free] = values
        return out

    def solve(
        self,
        start: np.ndarray,
        unstable: np.ndarray,
        name_unstable: bool = True,
        settlement: np.ndarray | None = None,
    ) -> Solution:
        """Equilibrium of all blocks but the unstable ones, from displacements `start` (m,).

        unstable (n,): blocks known to be unstable; they stay where they are. With `name_unstable`
        further unstable blocks are fixed as well, and the others are solved again; else the search
        ends with the first verdict. settlement (m,): displacements from the places as drawn to the
        present ones, zero by default.
        """
        known_unstable = unstable
        unstable = unstable.copy()
        relaxation = self._relaxation()
        relaxation.fix(unstable)
        verdict = Verdict.EQUILIBRIUM
        y = start
        while True:
            is_fixed = unstable[self.block]
            relaxed = relaxation.relax(
                self.expand(y),
                partial(self._finish, is_fixed),
                partial(self._implicit_step, is_fixed),
                self.expand(self.zero if settlement is None else settlement),
            )
            displacement = relaxed.y[self.system.is_free]
            if relaxed.verdict is Verdict.EQUILIBRIUM:
                if (is_released := unstable & ~known_unstable).any():
                    displacement = self._creep(displacement, unstable, is_released)
                return Solution(displacement, unstable, verdict)
            if not name_unstable:
                return Solution(displacement, unstable, relaxed.verdict)
            if relaxed.verdict is Verdict.NOT_DECIDED:
                verdict = relaxed.verdict
            is_new = self._is_moving(relaxed.growth) & ~unstable
            if not is_new.any():
                return Solution(displacement, unstable, Verdict.NOT_DECIDED)
            unstable |= is_new
            y = self._release(start, displacement, unstable)
            relaxation.fix(unstable)
            if unstable[self.block].all():
                displacement = self._creep(y, unstable, unstable & ~known_unstable)
                return Solution(displacement, unstable, verdict)

    def _relaxation(self) -> Relaxation:
        """The relaxation of the blocks on the contacts of this search."""
        joints = self.joints
        tensile = joints.tensile_stiffness[joints.law]

        def stiffness_at(closure: np.ndarray) -> np.ndarray:
            return np.maximum(joints.interpolate("stiffness", "closure", closure), tensile)

        high_stress = np.full(self.k, HIGH_STRESS)
        return Relaxation(
            [one.law for one in joints.by_law],
            joints.law,
            self.system.block_a,
            self.system.block_b,
            self.system.kinematics,
            self.area[: self.k],
            self.start.reshape(self.dim, -1).T,
            self.expand(self.force),
            self.system.is_free,
            stiffness_at,
            np.maximum(joints.interpolate("stiffness", "stress", high_stress), tensile),
            joints.reduction[1],
            self.bolts,
        )

    def _finish(self, is_fixed: np.ndarray, y: np.ndarray) -> np.ndarray | None:
        """Newton's method from displacements y (n, dof); is_fixed (m,): motions that stay."""
        start = y[self.system.is_free]
        displacement, _, converged = self._step(
            start, FIXING_DRAG * is_fixed, max_iterations=MAX_FINISHING_ITERATIONS
        )
        y = self.expand(displacement)
        return y if converged.all() and not self._is_far(y) else None

    def _is_far(self, y: np.ndarray) -> bool:
        """Whether two blocks have moved so far on each other at displacements y (n, dof) that their
        contact does not hold there: contacts keep their places and normals in a search."""
        shift = (self.kinematics @ y[self.system.is_free]).reshape(self.dim, -1)
        return bool((vector_length(shift.T) > self.max_shift).any())

    def _implicit_step(
        self, is_fixed: np.ndarray, y: np.ndarray, drag: np.ndarray
    ) -> np.ndarray | None:
        """One implicit step (n, dof) from displacements y (n, dof) through a drag (n, dof): the
        solution of (K + drag) step = unbalanced force, None where the matrix is singular.

        is_fixed (m,): motions that stay.
        """
        is_free = self.system.is_free
        unbalanced, stiffness = self._unbalanced(y[is_free])
        diagonal = drag[is_free] + FIXING_DRAG * is_fixed
        matrix = self.pattern.with_diagonal(self._assemble_stiffness(stiffness), diagonal)
        factors = factorise(matrix)
        return None if factors is None else self.expand(factors.solve(unbalanced * ~is_fixed))

    def _distance(self, displacement: np.ndarray) -> np.ndarray:
        """Largest displacement (n,) in m of each block at scaled displacements (n, dof)."""
        motion = displacement * self.system.scale
        rotation = vector_length(motion[:, self.dim :])
        return vector_length(motion[:, : self.dim]) + rotation * self.system.radius

    def _is_moving(self, growth: np.ndarray) -> np.ndarray:
        """Mask (n,) of blocks whose displacement in `growth` is more than a fraction of the largest
        one.

        growth: scaled displacements (n, dof).
        """
        distance = self._distance(growth)
        return distance > UNSTABLE_FRACTION * distance.max(initial=0.0)

    def _release(self, start: np.ndarray, end: np.ndarray, unstable: np.ndarray) -> np.ndarray:
        """Displacements (m,) from which the others are solved.

        Unstable blocks (n,) have moved from `start` (m,) towards `end` (m,) by no more than a few
        closures.
        """
        closure = self.start[: self.k] + (self.kinematics @ start)[: self.k]
        limit = RELEASE_CLOSURES * max(closure.max(initial=0.0), MIN_RELEASE)
        distance = self._distance(self.expand(end - start))
        fraction = unstable * np.minimum(1.0, limit / np.maximum(distance, 1e-300))
        return start + fraction[self.block] * (end - start)

    def _creep(self, y: np.ndarray, unstable: np.ndarray, is_released: np.ndarray) -> np.ndarray:
        """Displacements (m,) of the start: the others in equilibrium with creeping unstable blocks.

        y (m,): equilibrium with the unstable blocks (n,) fixed. The ones that `is_released` (n,)
        creep from their places in implicit steps through a drag, until they no longer release
        forces; so their joints are at their limits, and the result does not depend on rounding in
        the relaxation. It is y where a step does not converge.
        """
        creeps = is_released[self.block]
        creep_drag = max(RELEASE_DRAG * self._median_stiffness(y), 1e3 * self.drag_of_radius)
        drag = np.where(creeps, creep_drag, FIXING_DRAG * unstable[self.block])
        displacement = np.where(creeps, 0.0, y)
        residual = np.inf
        for _ in range(MAX_RELEASE_STEPS):
            displacement, unbalanced, converged = self._step(displacement, drag)
            if not converged.all():
                return y
            previous_residual = residual
            residual = float(np.linalg.norm(unbalanced))
            if residual > MIN_RELEASE_RATIO * previous_residual:
                break
        return displacement

    def _median_stiffness(self, y: np.ndarray) -> float:
        """Median stiffness of the free motions at displacements y (m,), in 1/s2."""
        stiffness = self._assemble_stiffness(self._unbalanced(y)[1]).diagonal()
        return float(np.median(stiffness[stiffness > 0])) if (stiffness > 0).any() else 0.0

    def _assemble_stiffness(self, stiffness: Stiffness) -> csc_array:
        """Stiffness (m, m) of the blocks from the stiffness of joints and bolts."""
        exerts = stiffness.joints.any(axis=(1, 2)) & (self.area[: self.k] > 0.0)
        acting = np.flatnonzero(exerts)  # the others would add zeros
        rows = self.system.kinematics[acting]
        weighted = self.area[acting, None, None] * stiffness.joints[acting]
        weighted = sum(weighted[:, :, c, None] * rows[:, c, None, :] for c in range(self.dim))
        of_joints = sum(rows[:, c, :, None] * weighted[:, c, None, :] for c in range(self.dim))
        rates = self.bolts.kinematics
        of_bolts = stiffness.bolts[:, None, None] * rates[:, :, None] * rates[:, None, :]
        bolts = self.k + np.arange(len(rates))
        elements = np.concatenate([of_joints, of_bolts])
        return self.pattern.matrix(elements, np.concatenate([acting, bolts]))

    def stick_predictor(self) -> np.ndarray:
        """First guess (m,): displacements if no joint can slide.

        One step through a drag with which a free block falls by a tenth of its radius; as near to
        its end as Newton's method comes.
        """
        drag = self.drag_of_radius / PREDICTOR_FALL + self.zero
        y, _, _ = self._step(self.zero, drag, STEP_TOLERANCE, can_slide=False)
        return y

    def _reference_force(self, norms: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Sizes of the loads of islands, to which residuals are relative.

        Without loads, of the forces of the joints at the start, as under in-situ stress alone.
        norms: of values (m,) in each island.
        """
        loads = norms(self.force)
        if loads.all():
            return loads
        F = self.joints.trial(self.start.reshape(self.dim, -1).T)[0]
        joint_forces = abs(self.kinematics).T @ (self.area * np.abs(F.T.ravel()))
        return np.where(loads > 0, loads, norms(joint_forces))

    def unbalanced_force(self, y: np.ndarray) -> np.ndarray:
        """Unbalanced forces and moments (n, dof) in N and N m at displacements y (m,)."""
        return self.expand(self._unbalanced(y)[0] / self.root)

    def _unbalanced(self, y: np.ndarray, can_slide: bool = True) -> tuple[np.ndarray, Stiffness]:
        """Unbalanced forces (m,), and stiffness of joints and bolts, at displacements y (m,)."""
        d = (self.start + self.kinematics @ y).reshape(self.dim, -1).T
        if can_slide:
            F, C, _ = self.joints.trial(d)
        else:
            F, C = self.joints.stick_predictor(d)
        joint_forces = self.kinematics.T @ (self.area * F.T.ravel())
        tension, bolt_stiffness = self.bolts.tension(self.bolt_kinematics @ y)
        bolt_forces = self.bolt_kinematics.T @ tension
        unbalanced = self.force - joint_forces - bolt_forces
        return unbalanced, Stiffness(C, bolt_stiffness)

    def _step(
        self,
        y: np.ndarray,
        drag: np.ndarray,
        tolerance: float = SOLUTION_TOLERANCE,
        can_slide: bool = True,
        max_iterations: int = MAX_ITERATIONS,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One implicit step from y (m,) through a drag (m,); without drag, to the equilibrium.

        Newton's method, with damping where the residual does not fall, in each island by itself.
        Returns displacements (m,), unbalanced forces (m,), and whether the step converged in the
        island of each motion (m,).
        """
        island = self.island
        start = y
        is_movable = drag < FIXING_DRAG

        def norms(values: np.ndarray) -> np.ndarray:
            return np.sqrt(np.bincount(island, values * values))

        def evaluate(y: np.ndarray):
            unbalanced, C = self._unbalanced(y, can_slide)
            residual = (unbalanced - drag * (y - start)) * is_movable
            return unbalanced, C, residual, norms(residual)

        unbalanced, C, residual, size = evaluate(y)
        target = tolerance * self._reference_force(norms)
        damping = 0.0 * target
        is_active = size > target
        for _ in range(max_iterations):
            if not is_active.any():
                break
            K = self._assemble_stiffness(C)
            min_damping = MIN_DAMPING * K.diagonal().max() + 1.0
            needs_damping = is_active
            step = self.zero
            for _ in range(MAX_DAMPINGS):
                diagonal = drag + damping[island] + REGULARISATION * min_damping
                factors = factorise(self.pattern.with_diagonal(K, diagonal))
                solution = np.nan * residual if factors is None else factors.solve(residual)
                step = np.where(needs_damping[island], solution, step)
                trial = evaluate(y + step * is_active[island])
                needs_damping = is_active & ~(trial[-1] < size)
                if not needs_damping.any():
                    break
                increased = np.maximum(DAMPING_INCREASE * damping, min_damping)
                damping = np.where(needs_damping, increased, damping)
            is_active = is_active & ~needs_damping
            y = y + step * is_active[island]
            unbalanced, C, residual, size = evaluate(y) if needs_damping.any() else trial
            is_undamped = is_active & (damping <= min_damping)
            damping = np.where(is_undamped, 0.0, damping / DAMPING_DECREASE)
            is_active = is_active & (size > target)
        return y, unbalanced, (size <= ACCEPTED_RESIDUAL * target)[island]
