"""Joints that start under a normal stress."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .batch import JointBatch
from .normal_control import NormalCondition, closing_increments
from .validity import warn_if_closed

_TOLERANCE = 1e-14  # of the stress: rounding


def preload(batch: JointBatch, normal_stress: ArrayLike) -> None:
    """Close virgin joints to this normal stress (Pa, >= 0), one for all or (n,), without shear.

    The stress is met to rounding by the cells of the joints in one step. `law.closure` is the limit
    of many cells and small steps. It differs if asperities yield, because few cells slip later, and
    if their slopes decrease by stress, because one step turns the planes once. Raises ValueError as
    `JointLaw.closure` does, and for another shape.
    """
    law = batch.law
    n = len(batch)
    shape = np.shape(normal_stress)
    if shape not in ((), (n,)):
        raise ValueError(f"normal_stress has shape {shape}: give one or ({n},)")
    closure = law.closure(normal_stress)
    step = np.outer(closure, np.eye(law.dim)[0])
    if law.tables.yields or law.tables.degrades_by_stress:  # one step differs from `closure`
        closes = step[:, 0] > 0
        stress = np.ravel(normal_stress)[closes]
        condition = NormalCondition(stress, stress)
        trial_joints = law.joints(len(stress))
        step[closes, 0] = closing_increments(trial_joints, step[closes], condition, _TOLERANCE)
    batch.update(np.broadcast_to(step, (n, law.dim)), tangent=False)
    warn_if_closed(law, closure)
