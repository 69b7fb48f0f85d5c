"""Blocks in space in motion, and the loads on them.

The compiled step moves them by symplectic Euler, as in the plane: positions by the present
velocities, then velocities by the forces at the new positions. A block rotates by its angular
velocity about its principal axes, and the gyroscopic moment is taken at the mean of the angular
velocities before and after it, so a free block keeps its energy.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from ..contact import ContactRows
from ..dynamics.blocks import RigidBlocks
from ..dynamics.timestep import block_stiffness, largest_eigenvalue
from ..scene import Drive, Drives
from .contacts import Surfaces
from .loads import applied_loads
from .scene import SpaceScene

MOTIONS = {"x": (0,), "y": (1,), "z": (2,), "turn": (3, 4, 5)}  # numbers, by the names in scenes


class NoBolts:
    """Stands for the rock bolts, which blocks in space do not have."""

    def __init__(self, n_blocks: int) -> None:
        self.n = 0
        self.forces = np.zeros((n_blocks, 6))

    def pull(self) -> float:
        """Return the energy (J) of the bolts, zero."""
        return 0.0

    def static(self, *_: Any) -> None:
        """Return the bolts of a search for an equilibrium, none."""


def _fixed_motions(scene: SpaceScene) -> Iterator[Drive]:
    """Yield drives that hold the prescribed motions of blocks that no other drive moves."""
    driven = {(block, min(drive.axis, 3)) for drive in scene.drives for block in drive.blocks}
    for i, block in enumerate(scene.blocks):
        for name in block.prescribed:
            axes = MOTIONS[name]
            if (i, axes[0]) not in driven:
                yield from (Drive((i,), axis, (0.0,), (0.0,)) for axis in axes)


def _driven_motions(scene: SpaceScene, axes: np.ndarray) -> Iterator[Drive]:
    """Yield the drives of a scene, for motions about the principal axes (n, 3, 3) of the blocks.

    A block that rotates about a fixed direction only has constant components of this direction
    along its own axes, so its rotation about each of them is a constant share of the prescribed
    one.
    """
    for drive in scene.drives:
        if drive.axis < 3:
            yield drive
            continue
        (block,) = drive.blocks
        for i, share in enumerate(axes[block, drive.axis - 3]):
            yield replace(drive, axis=3 + i, values=tuple(share * np.array(drive.values)))


class SpaceBlocks(RigidBlocks):
    """The blocks of a scene in space; arrays (n, 6) run over blocks and their motions.

    Motions are displacements along x, y, z, then rotations about the three principal axes of a
    block. motion (12, n): positions (m), sums of the rotations (rad), and the velocities that led
    there; axes (n, 3, 3): principal axes of the blocks, as columns. The other arrays are as in the
    plane (`dynamics.Blocks`). surfaces: vertices and faces, whose places follow with `place`.
    """

    def __init__(self, scene: SpaceScene) -> None:
        blocks = scene.blocks
        n = len(blocks)
        self.names = [block.name for block in blocks]
        self.skins = scene.skins
        is_mobile = np.array([block.moves for block in blocks])
        self.surfaces = surfaces = Surfaces([block.solid for block in blocks], is_mobile)
        self.axes = surfaces.rotation
        self.radius = surfaces.radius
        density = np.array([block.density for block in blocks])
        mass = np.repeat((density * surfaces.volume)[:, None], 3, axis=1)
        self.inertia = np.concatenate([mass, density[:, None] * surfaces.moments], axis=1)
        self.drives = Drives((*_fixed_motions(scene), *_driven_motions(scene, self.axes)))
        self.is_mobile = is_mobile[:, None].copy()
        self.is_free = self.is_mobile.repeat(6, axis=1)
        self.is_free[self.drives.rows, self.drives.axes] = False
        self.is_removed = np.zeros(n, bool)
        self.inverse_sqrt_inertia = np.where(self.is_free, 1 / np.sqrt(self.inertia), 0.0)
        self.inverse_mass = self.is_free[:, :3].any(axis=1) / mass[:, 0]
        no_moment = np.zeros(3)
        self.gravity = self.is_mobile * self.inertia * [*scene.acceleration, *no_moment]
        loads = [[*block.load, *no_moment] for block in blocks]
        self.steady_loads = np.array(loads) * self.is_mobile
        self.loads = self.steady_loads.copy()
        self.support = np.zeros((n, 6))
        spin = np.array([block.spin for block in blocks])
        spin = np.einsum("nji,nj->ni", self.axes, spin)
        start = np.concatenate([[block.velocity for block in blocks], spin], axis=1)
        self.velocity = np.ascontiguousarray((start * self.is_mobile).T)
        self.motion = np.concatenate([surfaces.position.T, np.zeros((3, n)), self.velocity])
        self.bolts = NoBolts(n)
        self.remove(list(scene.removed))

    def place(self) -> None:
        """Let vertices, normals and boxes of the surfaces follow the blocks."""
        self.surfaces.position[:] = self.motion[:3].T
        self.surfaces.place()

    def neighbour_pairs(self) -> np.ndarray:
        """Pairs (p, 2) of blocks, at least one of which moves, whose boxes are nearer than the sum
        of their skins; sorted. Removed blocks have no pairs."""
        self.place()
        pairs = self.surfaces.near_pairs(self.skins)
        return pairs[~self.is_removed[pairs].any(axis=1)]

    def displace(self, motion: np.ndarray) -> None:
        """Displace the blocks by their motions (n, 6), in m and rad."""
        self.motion[:6] += motion.T
        self.axes[:] = self.axes @ Rotation.from_rotvec(motion[:, 3:]).as_matrix()

    def gyroscopic_acceleration(self) -> np.ndarray:
        """Angular accelerations (3, n) in rad/s2 by the present gyroscopic moments."""
        spin = self.motion[9:]
        moments = self.inertia[:, 3:].T
        momentum = moments * spin
        return -np.cross(spin, momentum, axis=0) / moments


def apply_loads(
    scene: SpaceScene, blocks: SpaceBlocks, rows: ContactRows, law: np.ndarray, time: float = 0.0
) -> np.ndarray:
    """Update the loads of the blocks for the present places of their faces, and the water table of
    a time (s); returns their change (n, 6).

    rows, law (k,): contact points and the numbers of their laws.
    """
    if not (scene.wet or scene.in_situ or scene.stages):
        return 0.0 * blocks.loads
    blocks.place()
    old_loads = blocks.loads.copy()
    loads = applied_loads(scene, blocks.surfaces, rows, law, time) + blocks.support
    blocks.loads[:] = loads * blocks.is_mobile
    return blocks.loads - old_loads


def impact_limit(blocks: SpaceBlocks, stiffness: float) -> float:
    """Step limit (s) if every block were touched on all its faces; infinite where forces move no
    block.

    stiffness (Pa/m): of the joints. The corners of a face share its area; twice as stiff, for any
    contacts between blocks.
    """
    surfaces = blocks.surfaces
    areas = np.concatenate([solid.face_areas for solid in surfaces.solids])
    corners = np.diff(surfaces.first_corner)
    springs = 2.0 * stiffness * np.repeat(areas / corners, corners)
    block = np.repeat(surfaces.block_of_face, corners)
    arm = surfaces.local_vertex[surfaces.corner]
    directions = np.broadcast_to(np.eye(3), (len(arm), 3, 3))
    kinematics = np.concatenate([directions, np.cross(arm[:, None], directions)], axis=2)
    K = block_stiffness(block, kinematics, springs, len(blocks.names))
    largest = largest_eigenvalue(K, blocks.inverse_sqrt_inertia)
    return 2 / np.sqrt(largest) if largest else np.inf
