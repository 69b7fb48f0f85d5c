"""Blocks in motion, and the loads on their edges.

pymunk holds the shapes of the blocks and does the broad-phase contact detection. Its shapes are
sensors with a skin: pymunk reports which blocks come near each other, and never moves them. The
compiled step moves them by symplectic Euler: positions by the present velocities, then velocities
by the forces at the new positions.
"""

import numpy as np
import pymunk

from ..contact import ContactManager, ContactRows, Outlines
from ..scene import Drives, FacePressure, Scene, SceneError, Stress
from .bolts import Bolts

MAX_SKIN_PER_STEP = 0.25  # fraction of its skin that a block may move in a step: no contact missed
MAX_DRAWN_OVERLAP = 1e-3  # of the width of the smaller block: a larger overlap is a drawing fault
FLOATING_SHARE = 1e-6  # of the weight: a smaller rest of buoyancy is rounding
BROAD_PHASE_STEP = 1e-9  # s: pymunk detects pairs in a step; with no velocity nothing moves


class RigidBlocks:
    """What blocks in the plane and in space have in common: removal, damping, largest speed.

    Arrays as in `Blocks`, with 3 motions of a block in the plane and 6 in space, displacements
    first.
    """

    names: list[str]
    skins: np.ndarray
    radius: np.ndarray
    motion: np.ndarray
    velocity: np.ndarray
    inverse_mass: np.ndarray
    inverse_sqrt_inertia: np.ndarray
    is_mobile: np.ndarray
    is_free: np.ndarray
    is_removed: np.ndarray

    def remove(self, rows: list[int]) -> None:
        """Remove blocks: they neither move nor touch other blocks any more."""
        self.is_removed[rows] = True
        for array in (
            self.is_mobile,
            self.is_free,
            self.inverse_sqrt_inertia,
            self.inverse_mass,
        ):
            array[rows] = 0
        self.motion[len(self.velocity) :, rows] = 0.0
        self.velocity[:, rows] = 0.0

    def critical_damping(self, rows: ContactRows, stiffness: np.ndarray) -> np.ndarray:
        """Critical damping (k,) in N s/m of contacts with a stiffness (k,) in N/m.

        2 sqrt(stiffness * reduced mass of the two blocks), with half of a joint for each block.
        """
        inverse_mass = self.inverse_mass[rows.block_a] + self.inverse_mass[rows.block_b]
        reduced_mass = 0.5 / np.where(inverse_mass > 0, inverse_mass, np.inf)
        return 2.0 * np.sqrt(stiffness * reduced_mass)

    def refuse_speed(self, i: int, dt: float) -> None:
        """Raise SceneError for block i, too fast for a step dt (s) to find all its contacts."""
        dim = 2 if len(self.velocity) == 3 else 3
        speeds = np.abs(self.velocity[:, i])
        path = (speeds[:dim].sum() + speeds[dim:].sum() * self.radius[i]) * dt
        limit = MAX_SKIN_PER_STEP * self.skins[i]
        raise SceneError(
            f"block {self.names[i]!r} moves {path:.3g} m in one step: must stay below "
            f"{limit:.3g} m (a quarter of its skin, run.skin); resume with a smaller step"
        )


class Blocks(RigidBlocks):
    """The blocks of a scene in the plane.

    Arrays (n, 3) run over blocks and the motions x, y, rotation. motion (6, n): positions, angles,
    and the velocities that led there; velocity (3, n): velocities of the next step. The compiled
    step writes both in place. inertia (n, 3): mass, mass, moment of inertia; inverse_sqrt_inertia
    (n, 3): of free motions, else 0; inverse_mass (n,) in 1/kg: of blocks that forces move, else 0.
    is_mobile (n, 1): blocks that move, also fixed rock that a drive moves; is_free (n, 3): motions
    that forces move; is_removed (n,): excavated blocks. gravity, steady_loads (n, 3): constant
    forces (N), gravity with the pseudo-static seismic forces; loads (n, 3): steady loads, pressures
    on edges and support (`apply_loads`); support (n, 3): the remaining part of the forces that
    removed blocks exerted on the others (N). bolts: the rock bolts, with their forces on the
    blocks.
    """

    def __init__(self, scene: Scene) -> None:
        blocks = scene.blocks
        n = len(blocks)
        self.names = [block.name for block in blocks]
        self.skins = scene.skins
        self.radius = np.array([block.reach for block in blocks])
        sections = [block.section for block in blocks]
        self.inertia = scene.thickness * np.array([[s.mass, s.mass, s.moment] for s in sections])
        self.drives = Drives(scene.drives)
        self.is_mobile = np.array([[block.moves] for block in blocks])
        self.is_free = self.is_mobile.repeat(3, axis=1)
        self.is_free[self.drives.rows, self.drives.axes] = False
        self.is_removed = np.zeros(n, bool)
        self.inverse_sqrt_inertia = np.where(self.is_free, 1 / np.sqrt(self.inertia), 0.0)
        self.inverse_mass = self.is_free[:, :2].any(axis=1) / self.inertia[:, 0]
        self.gravity = self.is_mobile * self.inertia * [*scene.acceleration, 0.0]
        self.steady_loads = np.array([[*block.load, 0.0] for block in blocks]) * self.is_mobile
        self.loads = self.steady_loads.copy()
        self.support = np.zeros((n, 3))
        position = np.array([[*block.centroid, 0.0] for block in blocks]).T
        start_velocity = np.array([[*block.velocity, block.spin] for block in blocks])
        self.velocity = np.ascontiguousarray((start_velocity * self.is_mobile).T)
        self.motion = np.concatenate([position, self.velocity])
        self.bolts = Bolts(scene.bolts, self.motion)
        self._neighbours: set[tuple[int, ...]] = set()
        self._build_broad_phase(scene)
        self.remove(list(scene.removed))

    def _build_broad_phase(self, scene: Scene) -> None:
        """Make the bodies of pymunk, and callbacks that keep the set of neighbouring pairs."""
        self._space = pymunk.Space()
        self._bodies = []
        number_of_shape = {}
        for i, block in enumerate(scene.blocks):
            kind = pymunk.Body.DYNAMIC if block.moves else pymunk.Body.STATIC
            body = pymunk.Body(self.inertia[i, 0], self.inertia[i, 2], kind)
            body.position = tuple(block.centroid)
            shape = pymunk.Poly(body, block.local.tolist(), radius=float(self.skins[i]))
            shape.sensor = True
            shape.collision_type = 1
            self._space.add(body, shape)
            self._bodies.append(body)
            number_of_shape[shape] = i

        def pair(arbiter: pymunk.Arbiter) -> tuple[int, ...]:
            return tuple(sorted(number_of_shape[shape] for shape in arbiter.shapes))

        self._space.on_collision(
            1,
            1,
            begin=lambda arbiter, *_: self._neighbours.add(pair(arbiter)),
            separate=lambda arbiter, *_: self._neighbours.discard(pair(arbiter)),
        )
        self._space.step(BROAD_PHASE_STEP)

    def neighbour_pairs(self) -> np.ndarray:
        """Pairs (p, 2) of blocks, at least one of which moves, whose gap is less than the sum of
        their skins; sorted.

        From the broad phase of pymunk at the present positions, which may add pairs with a slightly
        larger gap. Removed blocks have no pairs.
        """
        for i in np.flatnonzero(self.is_mobile).tolist():
            x, y, angle = self.motion[:3, i].tolist()
            self._bodies[i].position = x, y
            self._bodies[i].angle = angle
        self._space.step(BROAD_PHASE_STEP)
        pairs = np.array(sorted(self._neighbours), int).reshape(-1, 2)
        return pairs[~self.is_removed[pairs].any(axis=1)]

    def displace(self, motion: np.ndarray) -> None:
        """Displace the blocks by their motions (n, 3), in m and rad."""
        self.motion[:3] += motion.T


def apply_loads(
    scene: Scene, blocks: Blocks, manager: ContactManager, time: float = 0.0
) -> np.ndarray:
    """Update the loads of the blocks for the present places of their edges, and the water table of
    a time (s); their change (n, 3).

    Water acts on all edges, so the joints carry the rest, the effective stress. The water pressure
    of the joints of a law acts on both faces where edges lie on each other; being uniform, it is
    the same as half of it at either end of the overlap.
    """
    stresses = [stress for stress in (scene.water_at(time), scene.in_situ) if stress]
    pressures = scene.face_pressures
    if not (stresses or scene.wet or scene.stages or pressures):
        return 0.0 * blocks.loads
    contacts = manager.contacts
    old_loads = blocks.loads.copy()
    loads = blocks.steady_loads + blocks.support
    for stress in stresses:
        loads += scene.thickness * _stress_on_edges(stress, contacts.outlines, blocks.motion)
    for face_pressure in pressures:
        loads += scene.thickness * _pressure_on_faces(
            face_pressure, contacts.outlines, blocks.motion
        )
    if any(scene.pressure.values()):
        pressure = np.array([scene.pressure.get(name, 0.0) for name in scene.laws])[manager.law]
        push = pressure * contacts.overlap_length.sum(axis=0) * scene.thickness
        loads += contacts.assemble_forces(len(loads), np.stack([push, 0.0 * push], axis=1))
    blocks.loads[:] = loads * blocks.is_mobile
    return blocks.loads - old_loads


def drawn_overlaps(scene: Scene) -> list[tuple[str, str, float]]:
    """Pairs of blocks that are drawn in each other: two names and the depth (m), deepest first.

    Smaller depths than a share of the block's width count as rounding, or as the closure of a joint
    that is drawn closed.
    """
    blocks = Blocks(scene)
    manager = ContactManager(scene, blocks.motion)
    manager.rebuild(blocks.motion, blocks.neighbour_pairs())
    contacts = manager.contacts
    width = np.array([block.width for block in scene.blocks])
    smaller = np.minimum(width[contacts.block_a], width[contacts.block_b])
    is_fault = (contacts.closure > MAX_DRAWN_OVERLAP * smaller) & (contacts.length > 0)
    depths: dict[tuple[int, int], float] = {}
    for row in np.flatnonzero(is_fault).tolist():
        pair = int(contacts.block_a[row]), int(contacts.block_b[row])
        depths[pair] = max(depths.get(pair, 0.0), float(contacts.closure[row]))
    return [
        (blocks.names[a], blocks.names[b], depth)
        for (a, b), depth in sorted(depths.items(), key=lambda item: -item[1])
    ]


def floating_blocks(scene: Scene, blocks: Blocks, manager: ContactManager) -> np.ndarray:
    """Mask (n,) of blocks that the water table lifts with more than their weight and load."""
    if scene.water is None:
        return np.zeros(len(scene.blocks), bool)
    water = _stress_on_edges(scene.water, manager.contacts.outlines, blocks.motion)
    weight = blocks.inertia[:, 0] * scene.gravity[1] + blocks.steady_loads[:, 1]
    can_float = blocks.is_free[:, 1] & ~blocks.is_removed
    return can_float & (scene.thickness * water[:, 1] + weight > FLOATING_SHARE * np.abs(weight))


def pressure_forces(
    pressure: FacePressure, outlines: Outlines
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Forces of a uniform pressure on parts of edges, at the present places of the blocks.

    Returns block (p,), place of the force (p,) in m and force per m of thickness (p,) in N/m of
    each part; vectors are complex.
    """
    blocks, edges, first, last = np.array(pressure.parts).T
    block = blocks.astype(int)
    corner = outlines.first_corner[block] + edges.astype(int)
    along = outlines.edge_direction[corner]
    middle = outlines.corner_position[corner] + 0.5 * (first + last) * along
    inward = 1j * along
    return block, middle, inward * pressure.value * (last - first)


def _pressure_on_faces(
    pressure: FacePressure, outlines: Outlines, motion: np.ndarray
) -> np.ndarray:
    """Forces and torques (n, 3) of a uniform pressure on parts of edges, per m of thickness."""
    block, at, force = pressure_forces(pressure, outlines)
    arm = at - (motion[0] + 1j * motion[1])[block]
    parts = force.real, force.imag, (arm.conj() * force).imag
    return np.stack([np.bincount(block, part, motion.shape[1]) for part in parts], axis=1)


def _stress_on_edges(stress: Stress, outlines: Outlines, motion: np.ndarray) -> np.ndarray:
    """Forces and torques (n, 3) of a stress on the edges that it loads, per m of thickness.

    An edge is split where the line of the stress bends and where the edge crosses it. Along each
    part from a to b, of length L, the stress varies linearly from u_a to u_b. Its force is
    -S.n L (u_a + u_b)/2 and acts at a + (b - a)(u_a + 2 u_b)/(3 (u_a + u_b)).
    """
    edges = np.flatnonzero(stress.edges)
    start = outlines.corner_position[edges]
    block = outlines.block[edges]
    centroid = (motion[0] + 1j * motion[1])[block, None]
    along = (outlines.corner_position[outlines.next[edges]] - start)[:, None]
    run = np.where(along.real, along.real, np.inf)
    bends = np.sort(np.clip((stress.line[:, 0] - start.real[:, None]) / run, 0.0, 1.0))
    zero = 0.0 * along.real
    splits = start[:, None] + np.concatenate([zero, bends, zero + 1.0], axis=1) * along
    a = splits[:, :-1]
    b = splits[:, 1:]
    depth_a = stress.signed(a)
    depth_b = stress.signed(b)
    difference = np.where(depth_a == depth_b, 1.0, depth_a - depth_b)
    crossing = a + (b - a) * depth_a / difference
    crosses = (depth_a > 0) != (depth_b > 0)
    a = np.where(crosses & (depth_a <= 0), crossing, a)
    b = np.where(crosses & (depth_b <= 0), crossing, b)
    u_a = np.maximum(depth_a, 0.0)
    u_b = np.maximum(depth_b, 0.0)
    inward = 1j * (b - a)  # minus the outward normal, times the length
    push = stress.on(inward)
    force = push * (u_a + u_b) / 2
    arms = ((a - centroid) * (2 * u_a + u_b) + (b - centroid) * (u_a + 2 * u_b)) / 6
    torque = (arms.conj() * push).imag
    sums = [part.sum(axis=1) for part in (force.real, force.imag, torque)]
    return np.stack([np.bincount(block, part, motion.shape[1]) for part in sums], axis=1)
