"""Initial state of a scene: in-situ stress in the joints, static equilibrium, unstable blocks.

A run starts from static equilibrium under gravity, loads and in-situ stress. It is a nonlinear
problem: joints harden as they close, slide at their friction limit, and open. Some blocks have no
equilibrium at all, and the search must find out which.

Equilibrium (`search.py`). The contacts keep their places and normals in a search; as the
displacements are small, it is repeated at the places just found until they no longer change
(`settle`).

In-situ stress. Joints start with the closure and sliding at which they bear the given stress. The
closure is not a displacement of the blocks, which are drawn in their places under stress: the
contact manager keeps it as a negative closure offset.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from ..contact import ContactManager, ContactRows, Contacts, Joints
from ..scene import Scene
from .blocks import Blocks, apply_loads
from .relaxation import Verdict
from .search import EquilibriumSearch, StaticSystem, vector_length
from .timestep import scaled_kinematics

MAX_UNBALANCED_RATIO = 1e-3  # unbalanced force of a stable block, relative to its weight
STANDARD_GRAVITY = 9.81  # m/s2: for weights in a scene without gravity
MIN_FORCE_SCALE = 1e-6  # of the largest load: lower bound of the weight in a ratio

# Repeated search and in-situ stress
MAX_ROUNDS = 40
SETTLED_RATIO = 1e-10  # displacement relative to the first round, which ends the search
MAX_DRAWN_GAP = 0.01  # of the least skin: joints drawn farther open bear no in-situ stress
MIN_LENGTH = 1e-6  # m: shorter joints bear none either
MAX_TRIALS = 50  # Newton's steps to the closure and sliding at a stress
STRESS_TOLERANCE = 1e-12  # missing stress relative to the normal stress
MIN_SLOPE = 0.05  # of the shear stiffness of the unsheared joint


def unbalanced_force_ratio(blocks: Blocks, force: np.ndarray) -> np.ndarray:
    """Unbalanced forces (n, dof) relative to the weights of the blocks, (n,).

    Weights are on Earth in a scene without gravity, and at least a millionth of the largest load.
    Moments are divided by the radius of the block.
    """
    mass = blocks.inertia[:, 0]
    dim = 2 if force.shape[1] == 3 else 3
    largest_load = np.abs(blocks.gravity + blocks.loads).max(initial=0.0)
    acceleration = (vector_length(blocks.gravity[:, :dim]) / mass).max() or STANDARD_GRAVITY
    free_force = force * blocks.is_free
    free_force[:, dim:] /= blocks.radius[:, None]
    size = np.sqrt((free_force**2).sum(axis=1))
    return size / np.maximum(mass * acceleration, MIN_FORCE_SCALE * largest_load)


def find_unbalanced(blocks: Blocks, rows: ContactRows, joints: Joints) -> np.ndarray:
    """Mask (n,) of blocks that their joints do not carry now, without dashpots and drives."""
    joint_forces = rows.assemble_forces(
        len(blocks.loads), rows.area[:, None] * joints.traction, joints.stored_energy
    )
    unbalanced = joint_forces + blocks.gravity + blocks.loads + blocks.bolts.forces
    return unbalanced_force_ratio(blocks, unbalanced) > MAX_UNBALANCED_RATIO


def static_system(
    scene: Scene,
    blocks: Blocks,
    manager: ContactManager,
    joints: Joints,
    sliding: np.ndarray,
    lengths_changed: bool = False,
) -> StaticSystem:
    """Blocks at their present places, on virgin joints but for their closure and sliding so far.

    sliding (k, dim - 1) in m. lengths_changed: the blocks have moved since the joints closed, so a
    change of the lengths of joints costs stored energy (see `contact/geometry.py`).
    """
    contacts = manager.contacts
    force = blocks.gravity + blocks.loads
    start = np.column_stack([manager.closure, sliding])
    if lengths_changed:
        stored_energy = joints.trial(start - joints.delta)[2]
        length_forces = contacts.assemble_forces(len(force), 0.0 * start, stored_energy)
        force = force + length_forces * blocks.is_mobile
    return StaticSystem(
        blocks.inertia[:, 0],
        blocks.radius,
        blocks.is_free,
        blocks.inverse_sqrt_inertia,
        force,
        contacts.block_a,
        contacts.block_b,
        scaled_kinematics(blocks, contacts),
        contacts.area,
        start,
        joints,
        blocks.bolts.static(blocks.motion, blocks.inverse_sqrt_inertia),
    )


def create_joints(
    scene: Scene, blocks: Blocks, manager: ContactManager, joints: Joints
) -> np.ndarray:
    """Find the contacts of blocks as drawn, and give them virgin joints.

    Returns the sliding (k, 1) in m with which the joints start, and sets the closure offsets of the
    manager: closure and sliding under in-situ stress, zero without it.
    """
    _find_drawn_contacts(scene, blocks, manager)
    return _start_joints(scene, manager, joints)


def _find_drawn_contacts(scene: Scene, blocks: Blocks, manager: ContactManager) -> None:
    """Find the contacts of blocks as drawn, and the loads of the blocks."""
    manager.rebuild(blocks.motion, blocks.neighbour_pairs())
    apply_loads(scene, blocks, manager)


def _start_joints(scene: Scene, manager: ContactManager, joints: Joints) -> np.ndarray:
    """Give virgin joints to the contacts of blocks as drawn; see `create_joints`."""
    contacts = manager.contacts
    is_new = np.full(len(contacts.area), -1)
    joints.rearrange(is_new, manager.law, manager.face_pairs)
    if scene.in_situ is None or not joints.n:
        return np.zeros((joints.n, 1))
    stress = _in_situ_stress(scene, contacts)
    stress[contacts.length < MIN_LENGTH] = 0.0
    skin = float(scene.skins.min())
    manager.closure_offset, sliding = start_under_stress(joints, stress, contacts.closure, skin)
    return sliding


def start_under_stress(
    joints: Any, stress: np.ndarray, closure: np.ndarray, skin: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return closure offsets (k,) and sliding (k, dim - 1) in m with which virgin joints start, so
    that they bear a stress (k, dim) in Pa.

    closure (k,): as drawn, in m; joints that are drawn open bear no stress, nor do joints under
    tension. skin (m): the least range of contact detection.

    Raises ValueError for a stress that closes joints farther than contacts are followed.
    """
    is_apart = closure < -MAX_DRAWN_GAP * skin
    stress = np.where((is_apart | (stress[:, 0] <= 0))[:, None], 0.0, stress)
    start, sliding = np.hsplit(displacement_at_stress(joints, stress), [1])
    start = start[:, 0]
    if start.max(initial=0.0) > skin:
        raise ValueError(
            f"in_situ closes joints by up to {start.max():.3g} m, but contacts are followed to "
            f"{skin:.3g} m: set a larger run.skin, or stiffer laws"
        )
    return np.where(start > 0, closure - start, 0.0), sliding


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


def displacement_at_stress(joints: Any, stress: np.ndarray) -> np.ndarray:
    """Closure and sliding (k, dim) in m at which virgin joints bear a stress (k, dim) in Pa.

    joints: `contact.Joints`, or others with `trial` and `interpolate`. stress: normal stress, then
    shear stresses, one in the plane and two in space.

    Newton's method. A joint that cannot bear the shear stress keeps the first step, with which it
    bears as much as it can.
    """
    closure = joints.interpolate("closure", "stress", stress[:, 0])
    d = np.zeros_like(stress)
    d[:, 0] = closure
    first_step = d
    min_slope = np.full(len(d), 1e-300)
    for trial in range(1, MAX_TRIALS + 1):
        F, C, _ = joints.trial(d)
        missing = stress - F
        converged = (np.abs(missing) <= STRESS_TOLERANCE * stress[:, :1]).all(axis=1)
        if converged.all() or trial == MAX_TRIALS:
            break
        normal_stiffness = np.maximum(C[:, 0, 0], 1e-300)
        # slope of the shear stresses at constant normal stress
        coupling = C[:, 1:, 0] / normal_stiffness[:, None]
        slope = C[:, 1:, 1:] - coupling[:, :, None] * C[:, :1, 1:]
        min_slope = np.maximum(min_slope, MIN_SLOPE * _largest_slope(slope))
        coupled = coupling * missing[:, :1]
        shear_step = _divide_by_slope(missing[:, 1:] - coupled, slope, min_slope)
        shear_step[converged] = 0.0
        by_shear = np.einsum("kj,kj->k", C[:, 0, 1:], shear_step)
        closure_step = (missing[:, 0] - by_shear) / normal_stiffness
        closure = np.maximum(d[:, 0] + closure_step, 0.1 * d[:, 0])
        d = np.column_stack([closure, d[:, 1:] + shear_step])
        if trial == 1:
            first_step = d
    return np.where(converged[:, None], d, first_step)


def _largest_slope(slope: np.ndarray) -> np.ndarray:
    """Largest stiffness (k,) of shear in any direction, from slopes (k, m, m)."""
    return np.linalg.eigvalsh(slope + np.swapaxes(slope, 1, 2))[:, -1] / 2


def _divide_by_slope(stress: np.ndarray, slope: np.ndarray, min_slope: np.ndarray) -> np.ndarray:
    """Shears (k, m) in m that give stresses (k, m) at slopes (k, m, m), none of them less than
    `min_slope` (k,) in any direction."""
    value, vector = np.linalg.eigh((slope + np.swapaxes(slope, 1, 2)) / 2)
    is_steep = value[:, 0] >= min_slope
    components = np.einsum("kji,kj->ki", vector, stress) / np.maximum(value, min_slope[:, None])
    shears = np.einsum("kij,kj->ki", vector, components)
    if is_steep.any():
        shears[is_steep] = np.linalg.solve(slope[is_steep], stress[is_steep, :, None])[:, :, 0]
    return shears


def settle(
    scene: Scene,
    blocks: Blocks,
    manager: ContactManager,
    joints: Joints,
    sliding: np.ndarray,
    apply_loads: Callable = apply_loads,
) -> tuple[np.ndarray, Verdict]:
    """Move the blocks to their static equilibrium, in the plane or in space.

    sliding (k, dim - 1) in m: with which the joints start at the places as drawn. apply_loads: of
    the scene, blocks and manager; sets the loads of the blocks at their present places.

    Returns the sliding with which the joints start at equilibrium, and the verdict. Unstable blocks
    stay almost where they are drawn; the others are in equilibrium with the forces that the
    unstable ones exert on them there.
    """
    verdict = Verdict.EQUILIBRIUM
    unstable = np.zeros(len(blocks.is_free), bool)
    first_displacement = 0.0
    settlement = None  # of stable blocks, from the places as drawn
    pairs = blocks.neighbour_pairs()
    for n_round in range(MAX_ROUNDS):  # each at the last places: joints rotate with the blocks
        manager.update(blocks.motion)
        manager.needs_rebuild[:] = True  # cheap here, and no contact is missed
        old_row = manager.rebuild(blocks.motion, pairs)
        joints.rearrange(old_row, manager.law, manager.face_pairs)
        sliding = np.vstack([sliding, np.zeros(sliding.shape[1])])[old_row]
        apply_loads(scene, blocks, manager)
        system = static_system(scene, blocks, manager, joints, sliding, n_round > 0)
        search = EquilibriumSearch(system)
        is_near = n_round or scene.in_situ is not None
        guess = search.zero if is_near else search.stick_predictor()
        if settlement is None:
            settlement = search.zero
        displacement, unstable, round_verdict = search.solve(guess, unstable, settlement=settlement)
        if round_verdict is Verdict.NOT_DECIDED:
            verdict = Verdict.NOT_DECIDED
        elif verdict is Verdict.EQUILIBRIUM and unstable.any():
            verdict = Verdict.NO_EQUILIBRIUM
        shears = (search.kinematics @ displacement)[len(sliding) :]
        sliding = sliding + shears.reshape(-1, len(sliding)).T
        blocks.displace(search.expand(displacement * search.root))
        is_stable = ~unstable[search.block]
        settlement = np.where(is_stable, settlement + displacement, 0.0)
        largest = np.abs(displacement[is_stable]).max(initial=0.0)
        first_displacement = first_displacement or largest
        if n_round and largest <= SETTLED_RATIO * first_displacement:
            break
    manager.rebuilt_at[:] = blocks.motion[: len(manager.rebuilt_at)]
    return sliding, verdict


class DrawnBlocks(NamedTuple):
    """Blocks of a scene as drawn, with their loads, and the manager of their contacts: what scenes
    have in common that differ in the laws of their joints alone."""

    blocks: Blocks
    manager: ContactManager


def drawn_blocks(scene: Scene) -> DrawnBlocks:
    """The blocks of a scene as drawn."""
    blocks = Blocks(scene)
    manager = ContactManager(scene, blocks.motion)
    _find_drawn_contacts(scene, blocks, manager)
    return DrawnBlocks(blocks, manager)


def equilibrium_displacements(
    scene: Scene,
    guess: np.ndarray | None = None,
    unstable: np.ndarray | None = None,
    drawn: DrawnBlocks | None = None,
) -> np.ndarray | None:
    """Displacements (m,) of the free motions at which virgin joints carry a scene as drawn.

    Scaled by the square root of the inertia; None without an equilibrium. All loads act at
    once. guess: displacements of a similar scene from which the search starts, by default the stick
    predictor. unstable (n,): blocks that need no equilibrium; they move away, so their contacts and
    bolts bear nothing. drawn: the blocks of this scene, or of a scene that differs in its laws
    alone, if they are known.
    """
    search, is_unstable = _search_as_drawn(scene, unstable, drawn)
    start = search.stick_predictor() if guess is None else guess
    solution = search.solve(start, is_unstable, name_unstable=False)
    return solution.displacement if solution.verdict is Verdict.EQUILIBRIUM else None


def stick_displacements(
    scene: Scene, unstable: np.ndarray | None = None, drawn: DrawnBlocks | None = None
) -> np.ndarray:
    """Displacements (m,) of the free motions of a scene as drawn if no joint can slide.

    A guess for `equilibrium_displacements`, with the same units, `unstable` (n,) blocks and
    `drawn` blocks.
    """
    search, _ = _search_as_drawn(scene, unstable, drawn)
    return search.stick_predictor()


def _search_as_drawn(
    scene: Scene, unstable: np.ndarray | None, drawn: DrawnBlocks | None
) -> tuple[EquilibriumSearch, np.ndarray]:
    """The search of a scene as drawn, without forces on the contacts and bolts of the unstable
    blocks; and the mask (n,) of these."""
    blocks, manager = drawn or drawn_blocks(scene)
    joints = Joints(scene)
    sliding = _start_joints(scene, manager, joints)
    search = EquilibriumSearch(static_system(scene, blocks, manager, joints, sliding))
    is_unstable = np.zeros(len(blocks.is_free), bool) if unstable is None else unstable
    contacts = manager.contacts
    has_moved_away = is_unstable[contacts.block_a] | is_unstable[contacts.block_b]
    search.area[np.tile(has_moved_away, 2)] = 0.0
    search.bolts.release(is_unstable)
    return search, is_unstable
