"""Closure increments that meet a normal condition: Newton's method, safeguarded by a bracket."""

from typing import NamedTuple

import numpy as np

from ..support.checks import Array
from .batch import JointBatch

TOLERANCE = 1e-11  # of the normal stress scale
_MAX_ITERATIONS = 200
_RELATIVE_RESOLUTION = 4e-16  # of the closure: rounding


class NormalCondition(NamedTuple):
    """Normal condition F1 = stress + spring (free_closure - closure), for n joints.

    stress: normal stress in Pa, a number or (n,); scale: stress in Pa to which the tolerance
    refers; spring: stiffness of the surrounding rock in Pa/m (CNS); free_closure: closure in m at
    which the spring bears nothing.
    """

    stress: float | Array
    scale: float | Array
    spring: float = 0.0
    free_closure: float = 0.0


def closing_increments(
    batch: JointBatch, step: Array, condition: NormalCondition, tolerance: float = TOLERANCE
) -> Array:
    """Closure increments (n,) in m that meet the condition in a step with the shear of `step`.

    step: (n, dim) in m; its closures are a first guess; tolerance: of `condition.scale`. The batch
    does not change. Raises ArithmeticError where no closure meets the condition, and NonFiniteError
    where a trial closure gives no finite traction.
    """
    closure = batch.delta[:, 0]
    trial = step.copy()
    u = trial[:, 0]
    size = np.maximum(np.abs(closure), np.abs(step[:, 1:]).max(axis=1, initial=0.0))
    if not size.all():
        size = np.where(size > 0, size, batch.law.closure(condition.scale))
    stride = size
    low = np.full_like(u, -np.inf)
    high = np.full_like(u, np.inf)
    for _ in range(_MAX_ITERATIONS):
        F, C = batch.trial(trial)
        assert C is not None
        spring_stress = condition.spring * (condition.free_closure - (closure + u))
        residual = F[:, 0] - condition.stress - spring_stress
        # an open joint meets a stress of zero anywhere: then find the closure of first contact
        is_met = (np.abs(residual) <= tolerance * np.asarray(condition.scale)) & (
            (F[:, 0] != 0) | (residual != 0)
        )
        low = np.where(residual <= 0, u, low)
        high = np.where(residual <= 0, high, u)
        resolution = _RELATIVE_RESOLUTION * np.maximum(np.abs(closure + u), size)
        is_narrow = high - low <= resolution
        if (is_met | is_narrow).all():
            u[:] = np.where(is_met, u, high)
            return u
        slope = condition.spring + C[:, 0, 0]
        guess = _next_guess(u, residual, slope, (low, high), stride, resolution)
        u[:] = np.where(is_met, u, np.where(is_narrow, high, guess))
        stride = np.where(np.isinf(high - low), 2.0 * stride, stride)
    joint = int(np.argmin(is_met | is_narrow))
    stress = np.broadcast_to(condition.stress, u.shape)[joint]
    raise ArithmeticError(
        f"joint {joint}: no closure between {closure[joint] + low[joint]:g} and "
        f"{closure[joint] + high[joint]:g} m gives a normal stress of {stress:g} Pa (spring "
        f"{condition.spring:g} Pa/m)"
    )


def _next_guess(
    u: Array,
    residual: Array,
    slope: Array,
    bracket: tuple[Array, Array],
    stride: Array,
    resolution: Array,
) -> Array:
    """Newton's guess (n,) if it is inside the bracket, else the middle of the bracket.

    A bracket without one of its ends is extended by `stride` at most.
    """
    low, high = bracket
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        newton = np.where(slope > 0, u - residual / slope, np.nan)
        middle = 0.5 * (low + high)
        inside = np.where((low < newton) & (newton < high), newton, middle)
        bound = np.where(np.isinf(high), u + stride, u - stride)
        is_closer = np.abs(newton - u) < np.abs(bound - u)  # False where newton is NaN
        outside = np.where(is_closer, newton, bound)
        # at the root but for rounding: step across it, to complete the bracket
        across = u + np.copysign(resolution, bound - u)
        outside = np.where(np.abs(outside - u) < resolution, across, outside)
    return np.where(np.isinf(high - low), outside, inside)
