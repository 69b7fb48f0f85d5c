"""Initial state of a scene: in-situ stress in the joints, static equilibrium, unstable blocks.

A run starts from static equilibrium under gravity, loads and in-situ stress. It is a nonlinear
problem: joints harden as they close, slide at their friction limit, and open. Some blocks have no
equilibrium at all, and the search must find out which.

Equilibrium. The blocks relax from the displacements of joints that stick (`relaxation.py`), and
Newton's method finishes. The contacts keep their places and normals; as the displacements are
small, the search is repeated at the places just found until they no longer change (`settle`).

Unstable blocks. Where there is no equilibrium, some blocks go on moving at a steady rate while the
unbalanced force no longer falls. Every block that moves by more than a hundredth of the fastest one
is unstable, without static equilibrium. Where it would be in the end has no meaning, as contacts
keep their normals here: it is put back to within a few closures of where it began, in the direction
in which it moved, so that it has released the forces that it exerted on the rest. There it is fixed
and the others are solved again; blocks that only an unstable one supported show then. In the end
the unstable blocks creep from their places as far as it takes to release those forces.

A search without a decision counts as no equilibrium, and is reported (`Verdict.NOT_DECIDED`).

In-situ stress. Joints start with the closure and sliding at which they bear the given stress. The
closure is not a displacement of the blocks, which are drawn in their places under stress: the
contact manager keeps it as a negative closure offset.
"""

from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.sparse import bmat, csc_array, csr_array, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from ..contact import ContactManager, Contacts, Joints
from ..scene import Scene
from .blocks import Blocks, apply_loads
from .relaxation import UNSTABLE_FRACTION, Relaxation, Verdict
from .timestep import contact_kinematics, opening_and_sliding_rates

MAX_UNBALANCED_RATIO = 1e-3  # unbalanced force of a stable block, relative to its weight
STANDARD_GRAVITY = 9.81  # m/s2: for weights in a scene without gravity
MIN_FORCE_SCALE = 1e-6  # of the largest load: lower bound of the weight in a ratio

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

# Relaxation
RELEASE_CLOSURES = 10.0  # largest closures by which an unstable block may move from its place
RELEASE_DRAG = 0.01  # relative to the median stiffness: of unstable blocks that creep at the end
MAX_RELEASE_STEPS = 40
MIN_RELEASE_RATIO = 0.9  # of residuals of two steps of creep, which ends above it
MAX_FINISHING_ITERATIONS = 12  # of Newton's method after a relaxation
HIGH_STRESS = 2e7  # Pa: bounds the stiffness of joints where nothing touches at first
FIXING_DRAG = 1e25  # 1/s2: holds a block in its place
PREDICTOR_FALL = 0.1  # of its radius: fall of a free block in the stick predictor

# Repeated search and in-situ stress
MAX_ROUNDS = 40
SETTLED_RATIO = 1e-10  # displacement relative to the first round, which ends the search
MAX_DRAWN_GAP = 0.01  # of the least skin: joints drawn farther open bear no in-situ stress
MIN_LENGTH = 1e-6  # m: shorter joints bear none either
MAX_TRIALS = 50  # Newton's steps to the closure and sliding at a stress
STRESS_TOLERANCE = 1e-12  # missing stress relative to the normal stress
MIN_SLOPE = 0.05  # of the shear stiffness of the unsheared joint


def unbalanced_force_ratio(blocks: Blocks, force: np.ndarray) -> np.ndarray:
    """Unbalanced forces (n, 3) relative to the weights of the blocks, (n,).

    Weights are on Earth in a scene without gravity, and at least a millionth of the largest load.
    Moments are divided by the radius of the block.
    """
    mass = blocks.inertia[:, 0]
    largest_load = np.abs(blocks.gravity + blocks.loads).max(initial=0.0)
    acceleration = (np.hypot(*blocks.gravity[:, :2].T) / mass).max() or STANDARD_GRAVITY
    x, y, moment = (force * blocks.is_free).T
    size = np.sqrt(x**2 + y**2 + (moment / blocks.radius) ** 2)
    return size / np.maximum(mass * acceleration, MIN_FORCE_SCALE * largest_load)


def find_unbalanced(scene: Scene, blocks: Blocks, contacts: Contacts, joints: Joints) -> np.ndarray:
    """Mask (n,) of blocks that their joints do not carry now, without dashpots and drives."""
    push, shear = (joints.traction * contacts.length[:, None] * scene.thickness).T
    stored_energy = joints.stored_energy * scene.thickness
    joint_forces = contacts.assemble(blocks.motion, push, -shear, stored_energy)
    unbalanced = joint_forces + blocks.gravity + blocks.loads
    return unbalanced_force_ratio(blocks, unbalanced) > MAX_UNBALANCED_RATIO


class Solution(NamedTuple):
    """Result of a search: displacements (m,) of the free motions, unstable blocks (n,), and the
    verdict on all other blocks."""

    displacement: np.ndarray
    unstable: np.ndarray
    verdict: Verdict


class EquilibriumSearch:
    """Search for a static equilibrium from the present places of the blocks.

    The joints are virgin but for their closure and sliding so far (k,), in m. Unknowns are the
    displacements (m,) of the free motions, scaled by the square root of their inertia, so forces
    are divided by it and drags have the unit 1/s2.

    lengths_changed: the blocks have moved since the joints closed, so a change of the lengths of
    joints costs stored energy (see `contact/geometry.py`).
    """

    def __init__(
        self,
        scene: Scene,
        blocks: Blocks,
        manager: ContactManager,
        joints: Joints,
        sliding: np.ndarray,
        lengths_changed: bool = False,
    ) -> None:
        contacts = manager.contacts
        self.blocks = blocks
        self.joints = joints
        self.contacts = contacts
        self.k = joints.n
        to_closure_and_shear = diags(np.repeat([-1.0, 1.0], self.k))
        rates = opening_and_sliding_rates(blocks, contacts)
        self.kinematics: csr_array = to_closure_and_shear @ rates
        self.area = np.tile(contacts.length * scene.thickness, 2)
        self.start = np.concatenate([manager.closure, sliding])
        self.root = blocks.inverse_sqrt_inertia[blocks.is_free]
        self.block = np.nonzero(blocks.is_free)[0]  # of each free motion
        force = blocks.gravity + blocks.loads
        if lengths_changed:
            displacement = np.stack([manager.closure, sliding], axis=1) - joints.delta
            stored_energy = joints.trial(displacement)[2] * scene.thickness
            zero = np.zeros(self.k)
            length_forces = contacts.assemble(blocks.motion, zero, zero, stored_energy)
            force = force + length_forces * blocks.is_mobile
        acceleration = np.hypot(*force[:, :2].T) / blocks.inertia[:, 0] / blocks.radius
        # drag at which the load moves a block by its radius in a step
        self.drag_of_radius = float(np.median(acceleration[blocks.is_free.any(axis=1)]))
        self.force = force[blocks.is_free] * self.root
        self.zero = np.zeros(len(self.block))
        touched = abs(self.kinematics[: self.k]) + abs(self.kinematics[self.k :])
        self.island = connected_components(touched.T @ touched, directed=False)[1]

    def expand(self, values: np.ndarray) -> np.ndarray:
        """Values (n, 3) of all motions from values (m,) of the free ones; zero for the others."""
        out = np.zeros(self.blocks.is_free.shape)
        out[self.blocks.is_free] = values
        return out

    def solve(
        self, start: np.ndarray, unstable: np.ndarray, name_unstable: bool = True
    ) -> Solution:
        """Equilibrium of all blocks but the unstable ones, from displacements `start` (m,).

        unstable (n,): blocks known to be unstable; they stay where they are. With `name_unstable`
        further unstable blocks are fixed as well, and the others are solved again; else the search
        ends with the first verdict.
        """
        known_unstable = unstable
        unstable = unstable.copy()
        relaxation = self._relaxation()
        relaxation.fix(unstable)
        verdict = Verdict.EQUILIBRIUM
        y = start
        while True:
            is_fixed = unstable[self.block]
            relaxed = relaxation.relax(self.expand(y), partial(self._finish, is_fixed))
            displacement = relaxed.y[self.blocks.is_free]
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
        joints, contacts = self.joints, self.contacts
        opening_to_closure = np.array([-1.0, 1.0])[:, None]
        tensile = joints.tensile_stiffness[joints.law]

        def stiffness_at(closure: np.ndarray) -> np.ndarray:
            return np.maximum(joints.interpolate("stiffness", "closure", closure), tensile)

        high_stress = np.full(self.k, HIGH_STRESS)
        return Relaxation(
            [one.law for one in joints.by_law],
            joints.law,
            contacts.block_a,
            contacts.block_b,
            contact_kinematics(self.blocks, contacts) * opening_to_closure,
            self.area[: self.k],
            self.start.reshape(2, -1).T,
            self.expand(self.force),
            self.blocks.is_free,
            stiffness_at,
            np.maximum(joints.interpolate("stiffness", "stress", high_stress), tensile),
            joints.reduction[1],
        )

    def _finish(self, is_fixed: np.ndarray, y: np.ndarray) -> np.ndarray | None:
        """Newton's method from displacements y (n, 3); is_fixed (m,): motions that stay."""
        start = y[self.blocks.is_free]
        displacement, _, converged = self._step(
            start, FIXING_DRAG * is_fixed, max_iterations=MAX_FINISHING_ITERATIONS
        )
        return self.expand(displacement) if converged.all() else None

    def _distance(self, displacement: np.ndarray) -> np.ndarray:
        """Largest displacement (n,) in m of each block at scaled displacements (n, 3)."""
        x, y, rotation = np.abs(displacement * self.blocks.inverse_sqrt_inertia).T
        return np.hypot(x, y) + rotation * self.blocks.radius

    def _is_moving(self, growth: np.ndarray) -> np.ndarray:
        """Mask (n,) of blocks whose displacement in `growth` is more than a fraction of the largest
        one.

        growth: scaled displacements (n, 3).
        """
        distance = self._distance(growth)
        return distance > UNSTABLE_FRACTION * distance.max(initial=0.0)

    def _release(self, start: np.ndarray, end: np.ndarray, unstable: np.ndarray) -> np.ndarray:
        """Displacements (m,) from which the others are solved.

        Unstable blocks (n,) have moved from `start` (m,) towards `end` (m,) by no more than a few
        closures.
        """
        closure = self.start[: self.k] + (self.kinematics @ start)[: self.k]
        limit = RELEASE_CLOSURES * max(closure.max(initial=0.0), MIN_LENGTH)
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

    def _assemble_stiffness(self, C: csr_array) -> csc_array:
        """Stiffness (m, m) of the blocks from the stiffness C (2 k, 2 k) of the joints."""
        return (self.kinematics.T @ (diags(self.area) @ C) @ self.kinematics).tocsc()

    def stick_predictor(self) -> np.ndarray:
        """First guess (m,): displacements if no joint can slide.

        One step through a drag with which a free block falls by a tenth of its radius; as near to
        its end as Newton's method comes.
        """
        drag = self.drag_of_radius / PREDICTOR_FALL + self.zero
        y, _, _ = self._step(self.zero, drag, STEP_TOLERANCE, can_slide=False)
        return y

    def _unbalanced(self, y: np.ndarray, can_slide: bool = True) -> tuple[np.ndarray, csr_array]:
        """Unbalanced forces (m,) and stiffness of the joints (2 k, 2 k) at displacements y (m,)."""
        d = (self.start + self.kinematics @ y).reshape(2, -1).T
        if can_slide:
            F, C, _ = self.joints.trial(d)
        else:
            F, C = self.joints.stick_predictor(d)
        nn, ns, sn, ss = (diags(part) for part in C.reshape(-1, 4).T)
        joint_stiffness = csr_array(bmat([[nn, ns], [sn, ss]]))
        joint_forces = self.kinematics.T @ (self.area * F.T.ravel())
        return self.force - joint_forces, joint_stiffness

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
        target = tolerance * norms(self.force)
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
                solution = spsolve((K + diags(diagonal)).tocsc(), residual)
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


def create_joints(
    scene: Scene, blocks: Blocks, manager: ContactManager, joints: Joints
) -> np.ndarray:
    """Find the contacts of blocks as drawn, and give them virgin joints.

    Returns the sliding (k,) in m with which the joints start, and sets the closure offsets of the
    manager: closure and sliding under in-situ stress, zero without it.
    """
    old_row = manager.rebuild(blocks.motion, blocks.neighbour_pairs())
    joints.rearrange(old_row, manager.law, manager.edge_pairs)
    apply_loads(scene, blocks, manager)
    if scene.in_situ is None or not joints.n:
        return np.zeros(joints.n)
    contacts = manager.contacts
    skin = scene.skins.min()
    stress = _in_situ_stress(scene, contacts)
    is_apart = contacts.closure < -MAX_DRAWN_GAP * skin
    stress[is_apart | (contacts.length < MIN_LENGTH) | (stress[:, 0] <= 0)] = 0.0
    closure, sliding = _displacement_at_stress(joints, stress).T
    if closure.max() > skin:
        raise ValueError(
            f"in_situ closes joints by up to {closure.max():.3g} m, but contacts are followed to "
            f"{skin:.3g} m: set a larger run.skin, or stiffer laws"
        )
    manager.closure_offset = np.where(closure > 0, contacts.closure - closure, 0.0)
    return sliding


def _in_situ_stress(scene: Scene, contacts: Contacts) -> np.ndarray:
    """Effective normal and shear stress (k, 2) in Pa that the in-situ stress gives the contacts.

    End p of an overlap bears (2 S(p) + S(q))/3 with q the other end: so both together have the
    force and the moment of a stress that varies linearly from p to q. It is the stress at (2 p +
    q)/3.
    """
    stress = scene.in_situ
    toward_end, toward_start = contacts.overlap_length
    length = np.maximum(contacts.length, 1e-300)
    shift = 2 / 3 * (toward_end**2 - toward_start**2) / length * contacts.edge_direction
    at = contacts.position + shift
    depth = np.maximum(stress.signed(at), 0.0)
    on_joint = depth * stress.on(contacts.normal) * contacts.normal.conj()
    if scene.water:
        on_joint -= np.maximum(scene.water.signed(at), 0.0)
    return np.stack([on_joint.real, on_joint.imag], axis=1)


def _displacement_at_stress(joints: Joints, stress: np.ndarray) -> np.ndarray:
    """Closure and sliding (k, 2) in m at which virgin joints bear normal and shear stress (k, 2).

    Newton's method. A joint that cannot bear the shear stress keeps the first step, with which it
    bears as much as it can.
    """
    closure = joints.interpolate("closure", "stress", stress[:, 0])
    d = np.stack([closure, np.zeros(joints.n)], axis=1)
    first_step = d
    min_slope = np.full(joints.n, 1e-300)
    for trial in range(1, MAX_TRIALS + 1):
        F, C, _ = joints.trial(d)
        missing = stress - F
        converged = (np.abs(missing) <= STRESS_TOLERANCE * stress[:, :1]).all(axis=1)
        if converged.all() or trial == MAX_TRIALS:
            break
        normal_stiffness = np.maximum(C[:, 0, 0], 1e-300)
        # slope of the shear stress at constant normal stress
        slope = C[:, 1, 1] - C[:, 1, 0] * C[:, 0, 1] / normal_stiffness
        min_slope = np.maximum(min_slope, MIN_SLOPE * slope)
        coupled = C[:, 1, 0] / normal_stiffness * missing[:, 0]
        shear_step = (missing[:, 1] - coupled) / np.maximum(slope, min_slope)
        shear_step[converged] = 0.0
        closure_step = (missing[:, 0] - C[:, 0, 1] * shear_step) / normal_stiffness
        closure = np.maximum(d[:, 0] + closure_step, 0.1 * d[:, 0])
        d = np.stack([closure, d[:, 1] + shear_step], axis=1)
        if trial == 1:
            first_step = d
    return np.where(converged[:, None], d, first_step)


def settle(
    scene: Scene, blocks: Blocks, manager: ContactManager, joints: Joints, sliding: np.ndarray
) -> tuple[np.ndarray, Verdict]:
    """Move the blocks to their static equilibrium.

    sliding (k,) in m: with which the joints start at the places as drawn. Returns the sliding with
    which they start at equilibrium, and the verdict. Unstable blocks stay almost where they
    are drawn; the others are in equilibrium with the forces that the unstable ones exert on them
    there.
    """
    verdict = Verdict.EQUILIBRIUM
    unstable = np.zeros(len(blocks.is_free), bool)
    first_displacement = 0.0
    pairs = blocks.neighbour_pairs()
    for n_round in range(MAX_ROUNDS):  # each at the last places: joints rotate with the blocks
        manager.update(blocks.motion)
        manager.needs_rebuild[:] = True  # cheap here, and no contact is missed
        old_row = manager.rebuild(blocks.motion, pairs)
        joints.rearrange(old_row, manager.law, manager.edge_pairs)
        sliding = np.append(sliding, 0.0)[old_row]
        apply_loads(scene, blocks, manager)
        search = EquilibriumSearch(scene, blocks, manager, joints, sliding, n_round > 0)
        is_near = n_round or scene.in_situ is not None
        guess = search.zero if is_near else search.stick_predictor()
        displacement, unstable, round_verdict = search.solve(guess, unstable)
        if round_verdict is Verdict.NOT_DECIDED:
            verdict = Verdict.NOT_DECIDED
        elif verdict is Verdict.EQUILIBRIUM and unstable.any():
            verdict = Verdict.NO_EQUILIBRIUM
        sliding = sliding + (search.kinematics @ displacement)[len(sliding) :]
        blocks.motion[:3] += search.expand(displacement * search.root).T
        is_stable = ~unstable[search.block]
        largest = np.abs(displacement[is_stable]).max(initial=0.0)
        first_displacement = first_displacement or largest
        if n_round and largest <= SETTLED_RATIO * first_displacement:
            break
    manager.rebuilt_at[:] = blocks.motion[:3]
    return sliding, verdict


def equilibrium_displacements(
    scene: Scene, guess: np.ndarray | None = None, unstable: np.ndarray | None = None
) -> np.ndarray | None:
    """Displacements (m,) of the free motions at which virgin joints carry a scene as drawn.

    Scaled by the square root of the inertia; None without an equilibrium. All loads act at
    once. guess: displacements of a similar scene from which the search starts, by default the stick
    predictor. unstable (n,): blocks that need no equilibrium; they move away, so their contacts
    bear nothing.
    """
    blocks = Blocks(scene)
    joints = Joints(scene)
    manager = ContactManager(scene, blocks.motion)
    sliding = create_joints(scene, blocks, manager, joints)
    search = EquilibriumSearch(scene, blocks, manager, joints, sliding)
    known_unstable = np.zeros(len(blocks.is_free), bool) if unstable is None else unstable
    contacts = manager.contacts
    has_moved_away = known_unstable[contacts.block_a] | known_unstable[contacts.block_b]
    search.area[np.tile(has_moved_away, 2)] = 0.0
    start = search.stick_predictor() if guess is None else guess
    solution = search.solve(start, known_unstable, name_unstable=False)
    return solution.displacement if solution.verdict is Verdict.EQUILIBRIUM else None
