"""What is refused: too long steps, too fast blocks, too deep overlaps."""

import numpy as np

from ..contact import Contacts, Joints, Points, StiffnessCurve
from ..errors import Refused
from .forces import damping
from .state import Limit, Moment, System

HEADROOM = 1.25  # most growth of a joint's stiffness between two checks of the time step
SAFE = 0.98  # largest time step as a share of the limit


def require_positive(step: float | None) -> None:
    """Refuse a time step (s) that is none; None leaves the choice to others."""
    if step is not None and not 0 < step < np.inf:
        raise ValueError(f"step = {step} s: must be a finite number > 0")


def step_limit(system: System, joints: Joints, at: Moment, least: float) -> Limit:
    """The limit of a moment from stiffness, dashpots and lever arms; least: so far (s)."""
    layout, contacts, motion, points, traction = at
    area, stress = points.length * system.scene.thickness, traction[:, 0]
    stiffness = np.maximum(
        joints.virgin(StiffnessCurve.at_stress, stress),
        joints.virgin(StiffnessCurve.at_closure, points.closure),
    )
    # Joints that barely touch count as touching well, or each touch would ask again.
    stiffness = np.maximum(stiffness, 0.2 * stiffness.max(initial=0.0))
    stiffness = stiffness * np.maximum(area, 0.02 * area.max(initial=0.0))
    run, critical = system.scene.run, damping(layout, stiffness)
    limit = system.limit(
        system.limit.rows(contacts, points, motion),
        np.tile(stiffness, 2),
        np.concatenate([run.dashpot_normal * critical, run.dashpot_shear * critical]),
    )
    return Limit(limit, min(least, limit), stiffness)


def require_step(limit: Limit, dt: float) -> Limit:
    """Refuse a time step (s) beyond the limit; the limit, with how far joints may stiffen.

    The limit falls at most as the square root of the largest growth of any joint's stiffness.
    """
    if dt > SAFE * limit.now:
        raise Refused(
            f"time step {dt:.3g} s: must stay below {SAFE} of the limit, which has fallen "
            f"to {limit.now:.3g} s as the joints closed; resume with a smaller step or "
            "set run.largest_stress (Pa)"
        )
    growth = min(HEADROOM, (SAFE * limit.now / dt) ** 2)
    return Limit(limit.now, limit.least, growth * limit.checked)


def require_slow(system: System, motion: np.ndarray, dt: float) -> None:
    """Refuse blocks that move too far in a step to find their contacts."""
    speed = np.abs(motion[3]) + np.abs(motion[4]) + np.abs(motion[5]) * system.reach
    fastest = int(speed.argmax())
    if not speed[fastest] * dt < 0.25 * system.skin:  # also true for NaN
        raise Refused(
            f"block {system.scene.blocks[fastest].name!r} moves {speed[fastest] * dt:.3g} m "
            f"in one step: must stay below {0.25 * system.skin:.3g} m (a quarter of run.skin); "
            "resume with a smaller step"
        )


def require_shallow(system: System, contacts: Contacts, points: Points) -> None:
    """Refuse overlaps beyond run.max_overlap."""
    pressed, search = points.closure * (points.length > 0), system.tracker.narrow_phase
    pairs = np.stack([contacts.a, contacts.b])
    limit = search.depth_limit[pairs].min(axis=0)
    if (pressed > limit).any():
        i = int((pressed - limit).argmax())
        search.refuse_overlap(pairs[:, i], pressed[i], limit[i])
