"""The closure increment at which a normal condition holds: Newton's method kept in a bracket."""

import math
from typing import NamedTuple

import numpy as np

from ..joints.batch import JointBatch
from ..joints.joint import Joint
from ..support.checks import Array

TOLERANCE = 1e-11  # of the normal stress scale, for one joint
TOLERANCE_OF_MANY = 1e-9  # of the normal stress, for a batch


class NormalCondition(NamedTuple):
    """Normal condition F1 = stress + spring (seat - closure), met to a share of `scale` (Pa)."""

    stress: float
    scale: float
    spring: float = 0.0
    seat: float = 0.0

    def misfit(self, F1: float, closure: float) -> float:
        """How far F1 (Pa) lies above what the condition asks at this closure (m)."""
        return F1 - self.stress - self.spring * (self.seat - closure)


def closing_increment(joint: Joint, shear: Array, condition: NormalCondition) -> float:
    """Closure increment (m) that meets the condition in a step with the shear increment `shear`.

    shear: (dim - 1,) in m. The joint is left as it was. Raises ArithmeticError where no closure
    meets the condition, and NonFiniteError where the law gives no finite traction on the way.
    """
    here = float(joint.delta[0])
    size = max(abs(here), float(np.max(np.abs(shear), initial=0.0)))
    length = reach = size or float(joint.law.closure(condition.scale))
    u, low, high = 0.0, -math.inf, math.inf
    for _ in range(200):
        F, C = joint.trial(np.concatenate([[u], shear]))
        value = condition.misfit(float(F[0]), here + u)
        if abs(value) <= TOLERANCE * condition.scale and not (F[0] == 0.0 and value == 0.0):
            return u
        low, high = (u, high) if value <= 0 else (low, u)
        finest = 4e-16 * max(abs(here + u), length)  # what rounding of the closure leaves
        if high - low <= finest:
            return high
        slope = condition.spring + (float(C[0, 0]) if C is not None else 0.0)
        newton = u - value / slope if slope > 0 else math.nan
        if math.isinf(low) or math.isinf(high):
            bound = u + reach if math.isinf(high) else u - reach
            if not (math.isfinite(newton) and abs(newton - u) < abs(bound - u)):
                newton = bound
            if abs(newton - u) < finest:  # there but for rounding: step across, to bracket it
                newton = u + math.copysign(finest, bound - u)
            reach *= 2.0
            u = newton
            continue
        u = newton if low < newton < high else 0.5 * (low + high)
    raise ArithmeticError(
        f"no closure between {here + low:g} and {here + high:g} m gives a normal stress of "
        f"{condition.stress:g} Pa (spring {condition.spring:g} Pa/m)"
    )


def closing_increments(batch: JointBatch, step: Array, stress: Array) -> Array:
    """Closure increments (n,) in m at which the shear of `step` leaves these normal stresses.

    step: (n, dim) in m, of which the shear counts; stress: (n,) in Pa, > 0. The batch is left as
    it was. The same method as for one joint, for all joints at once and to fewer digits. Raises
    ArithmeticError where the stress of a joint is not met.
    """
    x, trial = np.zeros(len(stress)), step.copy()
    low, high = np.full(len(x), -np.inf), np.full(len(x), np.inf)
    reach = np.abs(step).max(axis=1)
    for _ in range(100):
        trial[:, 0] = x
        F, C = batch.trial(trial)
        assert C is not None
        miss = F[:, 0] - stress
        met = np.abs(miss) <= TOLERANCE_OF_MANY * stress
        if met.all():
            return x
        low, high = np.where(miss < 0, x, low), np.where(miss < 0, high, x)
        slope = np.maximum(C[:, 0, 0], 1e-3 * stress / reach)  # an open joint has none
        newton = x - np.clip(miss / slope, -reach, reach)
        inside = (low < newton) & (newton < high)
        half = low / 2 + high / 2  # finite wherever it is taken: both ends are known then
        x, reach = np.where(met, x, np.where(inside, newton, half)), 2 * reach
    joint = int(np.argmin(met))
    raise ArithmeticError(
        f"joint {joint}: no closure between {low[joint]:g} and {high[joint]:g} m from here gives "
        f"a normal stress of {stress[joint]:g} Pa"
    )
