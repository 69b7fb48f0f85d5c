"""Forces on the blocks: joints, dashpots, gravity, loads, drives."""

import numpy as np

from ..contact import Joints, Points
from .state import Layout, Moment, System


def damping(layout: Layout, stiffness: np.ndarray) -> np.ndarray:
    """Critical damping (k,) in N s/m: 2 sqrt(stiffness times reduced mass); stiffness in N/m."""
    return 2.0 * np.sqrt(stiffness * layout.mass)


def forces(
    system: System,
    joints: Joints,
    at: Moment,
    stiffness: np.ndarray,
    velocity: np.ndarray,
    dt: float,
) -> np.ndarray:
    """(3, n, 3): all forces, those of the dashpots, those of the drives.

    stiffness (k,) of the law points in N/m; velocity (d,): to which the drives bring their blocks
    within dt (s).
    """
    layout, _, motion, points, traction = at
    thick = system.scene.thickness
    stress, shear = (points.length * thick * part for part in traction.T)
    energy = joints.now["stored"] * thick  # J/m: what a change of the length costs
    out = np.zeros((3, *system.mobile.shape))
    damped = 0.0
    if system.damped:
        push, resist = _dashpots(system, joints, points, damping(layout, stiffness), stress)
        damped = layout.assembly(motion, points, push, resist)
    out[1] = damped * system.mobile
    out[0] = layout.assembly(motion, points, stress, -shear, energy) + damped
    out[0] = (out[0] + system.steady) * system.mobile
    if len(velocity):
        driven = system.drives.rows, system.drives.axes
        lacking = velocity - motion[3:].T[driven]
        needed = system.inertia[driven] * lacking / dt - out[0][driven]
        out[2][driven] = needed
        out[0][driven] += needed
    return out


def _dashpots(
    system: System, joints: Joints, points: Points, critical: np.ndarray, pressed: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Forces (k,) of the dashpots along normal and tangent (N); never a pull."""
    run = system.scene.run
    push = np.maximum(-run.dashpot_normal * critical * points.opening, -pressed)
    if not run.dashpot_shear:
        return push, np.zeros(len(push))
    stick = 1.0 - joints.now["separated"] - joints.now["slipping"]
    return push, -run.dashpot_shear * critical * np.maximum(stick, 0.0) * points.sliding
