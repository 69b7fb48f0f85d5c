"""The closure increment at which a normal condition holds: Newton's method kept in a bracket."""

from typing import NamedTuple

import numpy as np

from ..support.checks import Array
from .batch import JointBatch

TOLERANCE = 1e-11  # of the normal stress scale
_TRIES = 200
_ROUNDING = 4e-16  # of the closure: what rounding leaves of it


class NormalCondition(NamedTuple):
    """Normal condition F1 = stress + spring (seat - closure), met to a share of `scale` (Pa).

    Each is one number, or (n,) for n joints.
    """

    stress: float | Array
    scale: float | Array
    spring: float = 0.0
    seat: float = 0.0


def closing_increments(
    batch: JointBatch, step: Array, condition: NormalCondition, tolerance: float = TOLERANCE
) -> Array:
    """Closure increments (n,) in m that meet the condition in a step with the shear of `step`.

    step: (n, dim) in m; its closures are a first guess. The batch is left as it was. Raises
    ArithmeticError where no closure meets the condition, and NonFiniteError where the law gives no
    finite traction on the way.
    """
    here, trial = batch.delta[:, 0], step.copy()
    u = trial[:, 0]
    size = np.maximum(np.abs(here), np.abs(step[:, 1:]).max(axis=1, initial=0.0))
    if not size.all():
        size = np.where(size > 0, size, batch.law.closure(condition.scale))
    reach, low, high = size, np.full_like(u, -np.inf), np.full_like(u, np.inf)
    for _ in range(_TRIES):
        F, C = batch.trial(trial)
        assert C is not None
        miss = F[:, 0] - condition.stress - condition.spring * (condition.seat - (here + u))
        # an open joint meets a stress of zero anywhere: look for the point of contact
        met = (np.abs(miss) <= tolerance * np.asarray(condition.scale)) & (
            (F[:, 0] != 0) | (miss != 0)
        )
        low, high = np.where(miss <= 0, u, low), np.where(miss <= 0, high, u)
        finest = _ROUNDING * np.maximum(np.abs(here + u), size)
        closed = high - low <= finest
        guess = _next_guess(u, miss, condition.spring + C[:, 0, 0], (low, high), reach, finest)
        u[:] = np.where(met, u, np.where(closed, high, guess))
        if (met | closed).all():
            return u
        reach = np.where(np.isinf(high - low), 2.0 * reach, reach)
    joint = int(np.argmin(met | closed))
    stress = np.broadcast_to(condition.stress, u.shape)[joint]
    raise ArithmeticError(
        f"joint {joint}: no closure between {here[joint] + low[joint]:g} and "
        f"{here[joint] + high[joint]:g} m gives a normal stress of {stress:g} Pa (spring "
        f"{condition.spring:g} Pa/m)"
    )


def _next_guess(
    u: Array, miss: Array, slope: Array, bracket: tuple[Array, Array], reach: Array, finest: Array
) -> Array:
    """Newton's guess (n,) where it stays in the bracket, else its middle, or `reach` farther."""
    low, high = bracket
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        newton = np.where(slope > 0, u - miss / slope, np.nan)
        middle = 0.5 * (low + high)
        inside = np.where((low < newton) & (newton < high), newton, middle)
        bound = np.where(np.isinf(high), u + reach, u - reach)
        near = np.abs(newton - u) < np.abs(bound - u)  # not where newton is NaN
        outside = np.where(near, newton, bound)
        # there but for rounding: step across, to bracket it
        across = u + np.copysign(finest, bound - u)
        outside = np.where(np.abs(outside - u) < finest, across, outside)
    return np.where(np.isinf(high - low), outside, inside)
