"""Joints that start under a normal stress: closed until their own cells bear it."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from .batch import JointBatch
from .crushed import warn_if_crushed
from .normal_control import NormalCondition, closing_increments

_ROUNDING = 1e-14  # of the stress


def seat(batch: JointBatch, normal_stress: ArrayLike) -> None:
    """Close virgin joints to this normal stress (Pa, >= 0), one for all or (n,), without shear.

    Raises ValueError as `JointLaw.closure` does, and for another shape.
    """
    law, n, shape = batch.law, len(batch), np.shape(normal_stress)
    if shape not in ((), (n,)):
        raise ValueError(f"normal_stress has shape {shape}: give one or ({n},)")
    closure = law.closure(normal_stress)
    step = np.outer(closure, np.eye(law.dim)[0])
    if law.tables.yields:  # the few cells of a joint slip later than `closure` has it
        own = step[:, 0] > 0
        stress = np.ravel(normal_stress)[own]
        condition = NormalCondition(stress, stress)
        step[own, 0] = closing_increments(law.joints(len(stress)), step[own], condition, _ROUNDING)
    batch.update(np.broadcast_to(step, (n, law.dim)), tangent=False)
    warn_if_crushed(law, closure)
