"""Forces on the blocks: joints, dashpots, gravity, loads, drives."""

import numpy as np

from ..contact import Contacts, Joints
from ..scene import Scene
from .blocks import Blocks


def forces(
    scene: Scene, blocks: Blocks, contacts: Contacts, joints: Joints, velocity, dt: float
) -> np.ndarray:
    """(3, n, 3) in N and N m: all forces, those of the dashpots, those of the drives.

    velocity (d,): to which the drives bring their blocks within dt (s).
    """
    area, motion = contacts.length * scene.thickness, blocks.motion
    stress, shear = (area * part for part in joints.traction.T)
    energy = joints.stored * scene.thickness  # J/m: what a change of the length costs
    out = np.zeros((3, *blocks.mobile.shape))
    push, resist = _dashpots(scene, blocks, contacts, joints, area, stress)
    damped = contacts.assemble(motion, push, resist)
    out[1] = damped * blocks.mobile
    out[0] = contacts.assemble(motion, stress, -shear, energy) + damped
    out[0] = (out[0] + (blocks.gravity + blocks.loads)) * blocks.mobile
    if len(velocity):
        driven = blocks.drives.rows, blocks.drives.axes
        lacking = velocity - motion[3:].T[driven]
        needed = blocks.inertia[driven] * lacking / dt - out[0][driven]
        out[2][driven] = needed
        out[0][driven] += needed
    return out


def _dashpots(scene, blocks, contacts, joints, area, pressed) -> tuple[np.ndarray, np.ndarray]:
    """Forces (k,) of the dashpots along normal and tangent (N); a pull only where a bond holds."""
    run = scene.run
    critical = blocks.damping(contacts, joints.stiffness * area)
    least = np.where(joints.damage < 1, -np.inf, -pressed)
    push = np.maximum(-run.dashpot_normal * critical * contacts.opening, least)
    stick = np.maximum(1.0 - joints.separated - joints.slipping, 1.0 - joints.damage)
    return push, -run.dashpot_shear * critical * stick * contacts.sliding
