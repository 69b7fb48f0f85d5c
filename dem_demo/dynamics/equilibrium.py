"""Initial state of a scene: in-situ stress in the joints, static equilibrium, unstable blocks.

A run starts from static equilibrium under gravity, loads and in-situ stress. It is a nonlinear
problem: joints harden as they close, slide at their friction limit, and open. Some blocks have no
equilibrium at all, and the search must find out which.

Equilibrium. Newton's method finds the displacements at which the forces on all blocks vanish. The
contacts keep their places and normals; as the displacements are small, the search is repeated at
the places just found until they no longer change (`settle`). Blocks that touch form islands, and
each island is damped and judged by itself.

Unstable blocks. Where Newton's method finds no equilibrium, the blocks are moved by viscous
relaxation: drag times displacement = unbalanced force, in implicit steps, with less and less drag.
A block that its joints can carry comes to rest, and its unbalanced force vanishes. A block that
cannot be carried moves on, and its unbalanced force stays: it is unstable, without static
equilibrium. Where an unstable block would be in the end has no meaning, as contacts keep their
normals here.

Then the search is repeated for the others, while the unstable blocks can move away and so release
the forces that they exert on the rest. A block that only the drag of an unstable block supports is
unstable as well: it shows in a few steps with less drag (`_find_followers`).

In-situ stress. Joints start with the closure and sliding at which they bear the given stress. The
closure is not a displacement of the blocks, which are drawn in their places under stress: the
contact manager keeps it as a negative closure offset.
"""

import numpy as np
from scipy.sparse import bmat, csc_array, csr_array, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from jointlaw.support.progress import track

from ..contact import ContactManager, Contacts, Joints
from ..scene import Scene
from .blocks import Blocks, apply_loads
from .timestep import opening_and_sliding_rates

MAX_UNBALANCED_RATIO = 1e-3  # unbalanced force of a stable block, relative to its weight
UNSTABLE_RATIO = 1e-2  # least that an unstable block keeps; stable ones that follow it keep less
STANDARD_GRAVITY = 9.81  # m/s2: for weights in a scene without gravity
MIN_FORCE_SCALE = 1e-6  # of the largest load: lower bound of the weight in a ratio

# Newton's method
SOLUTION_TOLERANCE = 1e-11  # residual of an equilibrium, relative to the load
STEP_TOLERANCE = 1e-8  # the same of a step of the relaxation
ACCEPTED_RESIDUAL = 1e3  # tolerances: where rounding ends the iteration above one
MAX_ITERATIONS = 60
MAX_DAMPINGS = 20  # trials of damping in one iteration
DAMPING_INCREASE = 4.0
DAMPING_DECREASE = 10.0
MIN_DAMPING = 1e-3  # of the largest stiffness
REGULARISATION = 1e-9  # of the least damping, so that free blocks give no singular matrix

# Viscous relaxation; drags are relative to the median stiffness
MAX_RELAXATION_STEPS = 40
DRAG_DECREASE = 0.1  # factor of the drag after a step
DRAG_INCREASE = 10.0  # factor after a step that did not converge
WEAK_DRAG = 2e-3  # from here on an unbalanced force that does not fall is judged as lasting
WEAK_DRAG_REPEATED = 1e-1  # the same where the last two steps had one drag
LASTING_RATIO = 0.8  # unbalanced force relative to the step before, with less drag
LASTING_RATIO_REPEATED = 0.9  # the same with the same drag
RELEASE_DRAG = 0.01  # drag of unstable blocks while they release the others
MAX_RELEASE_STEPS = 40
MIN_RELEASE_RATIO = 0.9  # of residuals of two steps; release ends above it
FOLLOWER_STEPS = 6  # in which blocks that only an unstable block supports follow it
FIXING_DRAG = 1e25  # 1/s2: holds a block in its place
PREDICTOR_FALL = 0.1  # of its reach: fall of a free block in the stick predictor

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
        self, guess: np.ndarray, unstable: np.ndarray, fixed: np.ndarray | bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Displacements (m,) at equilibrium of all blocks but the unstable ones, or new unstable
        blocks (n,) where there is none.

        guess (m,): where to begin; unstable (n,): blocks known to be unstable; fixed (n,): the ones
        of them that stay where they are. The other unstable blocks move by a few closures, as far
        as it takes to release their forces on the rest.
        """
        is_unstable = unstable[self.block]
        is_fixed = (unstable & fixed)[self.block]
        drag = max(RELEASE_DRAG * self._median_stiffness(guess), 1e3 * self.drag_of_radius)
        min_drag = np.where(is_fixed, FIXING_DRAG, drag) * is_unstable
        y = np.where(is_unstable, 0.0, guess)
        residual = np.inf
        has_moving = (unstable & np.logical_not(fixed)).any()
        for _ in range(MAX_RELEASE_STEPS if has_moving else 1):
            solution, unbalanced, converged = self._step(y, min_drag)
            y = np.where(converged, solution, y)
            previous_residual = residual
            residual = np.linalg.norm(unbalanced)
            if not converged.all() or residual > MIN_RELEASE_RATIO * previous_residual:
                break
        if converged.all():
            return y, self._find_followers(y, unstable, min_drag)
        min_drag = np.where(converged, FIXING_DRAG, min_drag)
        relaxed, unbalanced = self._relax(y, min_drag)
        ratio = self._ratio(np.where(min_drag > 0, 0.0, unbalanced))
        if ratio.max() <= MAX_UNBALANCED_RATIO:
            # at rest, or still creeping?
            y, _, converged = self._step(relaxed, min_drag)
            if converged.all():
                return y, np.zeros_like(unstable)
        return relaxed, ratio > min(UNSTABLE_RATIO, 0.5 * ratio.max())

    def _find_followers(
        self, y: np.ndarray, unstable: np.ndarray, min_drag: np.ndarray
    ) -> np.ndarray:
        """Blocks (n,) that only the drag of unstable blocks supports.

        The unstable blocks go on with less drag, and a block that follows them is unstable as well.
        """
        ratio = 0.0 * unstable
        weak_drag = WEAK_DRAG * self._median_stiffness(y)
        drag = np.where(min_drag < FIXING_DRAG, weak_drag, FIXING_DRAG)
        has_moving = ((min_drag > 0) & (min_drag < FIXING_DRAG)).any()
        for _ in range(FOLLOWER_STEPS if has_moving else 0):
            y, unbalanced, converged = self._step(y, drag, STEP_TOLERANCE)
            if not converged.all():
                break
            ratio = self._ratio(np.where(drag < FIXING_DRAG, unbalanced, 0.0)) * ~unstable
        return ratio > UNSTABLE_RATIO

    def _ratio(self, unbalanced: np.ndarray) -> np.ndarray:
        """Unbalanced-force ratios (n,) of scaled forces (m,)."""
        return unbalanced_force_ratio(self.blocks, self.expand(unbalanced / self.root))

    def _assemble_stiffness(self, C: csr_array) -> csc_array:
        """Stiffness (m, m) of the blocks from the stiffness C (2 k, 2 k) of the joints."""
        return (self.kinematics.T @ (diags(self.area) @ C) @ self.kinematics).tocsc()

    def stick_predictor(self) -> np.ndarray:
        """First guess (m,): displacements if no joint can slide.

        One step through a drag with which a free block falls by a tenth of its radius. Zero in
        islands where the step does not converge.
        """
        drag = self.drag_of_radius / PREDICTOR_FALL + self.zero
        y, _, converged = self._step(self.zero, drag, STEP_TOLERANCE, can_slide=False)
        return y * converged

    def _median_stiffness(self, y: np.ndarray) -> float:
        """Median stiffness of the free motions at displacements y (m,), in 1/s2."""
        stiffness = self._assemble_stiffness(self._unbalanced(y)[1]).diagonal()
        return float(np.median(stiffness[stiffness > 0])) if (stiffness > 0).any() else 0.0

    def _relax(self, y: np.ndarray, min_drag: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Viscous relaxation from y (m,) until all blocks are balanced, or until the unbalanced
        forces no longer fall.

        min_drag (m,): lower bound of the drag; motions that have one are not judged. Returns
        displacements and unbalanced forces (m,).
        """
        stiffness = self._median_stiffness(y)
        drag = max(1e3 * stiffness, 1e4 * self.drag_of_radius)
        change = DRAG_DECREASE
        unbalanced = self.zero
        previous_ratio: np.ndarray | float = np.inf
        for _ in track(range(MAX_RELAXATION_STEPS), "looking for unstable blocks"):
            solution, residual, converged = self._step(
                y, np.maximum(drag, min_drag), STEP_TOLERANCE
            )
            if not converged.all():
                drag = drag * DRAG_INCREASE
                change = 1.0
                previous_ratio = np.inf
                continue
            y = solution
            unbalanced = residual
            ratio = self._ratio(np.where(min_drag > 0, 0.0, unbalanced))
            is_repeated = change == 1.0
            lasting = LASTING_RATIO_REPEATED if is_repeated else LASTING_RATIO
            weak_drag = WEAK_DRAG_REPEATED if is_repeated else WEAK_DRAG
            judged = UNSTABLE_RATIO if ratio.max() > UNSTABLE_RATIO else MAX_UNBALANCED_RATIO
            is_lasting = (ratio > lasting * previous_ratio)[ratio > judged].all()
            # zero where all blocks fall
            stiffness = max(stiffness, self._median_stiffness(y))
            is_balanced = ratio.max() <= MAX_UNBALANCED_RATIO
            if is_balanced or (is_lasting and drag < weak_drag * stiffness):
                break
            previous_ratio = ratio
            drag = drag * change
        return y, unbalanced

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
        for _ in track(range(MAX_ITERATIONS), "equilibrium"):
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
) -> np.ndarray:
    """Move the blocks to their static equilibrium.

    sliding (k,) in m: with which the joints start at the places as drawn. Returns the sliding with
    which they start at equilibrium. Unstable blocks stay almost where they are drawn; the
    others are in equilibrium with the forces that the unstable ones exert on them there.
    """
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
        known_unstable = unstable
        displacement, new_unstable = search.solve(guess, unstable, known_unstable)
        unstable = unstable | new_unstable
        while new_unstable.any():
            displacement, new_unstable = search.solve(guess, unstable, known_unstable)
            unstable = unstable | new_unstable
        sliding = sliding + (search.kinematics @ displacement)[len(sliding) :]
        blocks.motion[:3] += search.expand(displacement * search.root).T
        is_stable = ~unstable[search.block]
        largest = np.abs(displacement[is_stable]).max(initial=0.0)
        first_displacement = first_displacement or largest
        if n_round and largest <= SETTLED_RATIO * first_displacement:
            break
    manager.rebuilt_at[:] = blocks.motion[:3]
    return sliding


def equilibrium_displacements(
    scene: Scene, guess: np.ndarray | None = None, unstable: np.ndarray | None = None
) -> np.ndarray | None:
    """Displacements (m,) of the free motions at which virgin joints carry a scene as drawn.

    Scaled by the square root of the inertia; None without an equilibrium. All loads act at
    once. guess: displacements of a similar scene. The search starts from it, and from the stick
    predictor: where bonds break and joints soften, one may find an equilibrium that the other
    misses. unstable (n,): blocks that need no equilibrium.
    """
    blocks = Blocks(scene)
    joints = Joints(scene)
    manager = ContactManager(scene, blocks.motion)
    sliding = create_joints(scene, blocks, manager, joints)
    search = EquilibriumSearch(scene, blocks, manager, joints, sliding)
    known_unstable = np.zeros(len(blocks.is_free), bool) if unstable is None else unstable
    start = search.stick_predictor() if guess is None else guess
    displacement, new_unstable = search.solve(start, known_unstable)
    if new_unstable.any() and guess is not None:
        displacement, new_unstable = search.solve(search.stick_predictor(), known_unstable)
    return None if new_unstable.any() else displacement
