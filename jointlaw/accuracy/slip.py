"""Slip far beyond the closure: friction and dilation angle at constant normal stress.

The joint is seated and sheared to several mating lengths (without one to 30 closure ranges), and
back by as much. The normal stress is held for every resolution by itself: one and the same path of
displacement would compare their dilation, summed up over the slip, and not their strength.
"""

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..joints.normal_control import NormalCondition, closing_increments
from ..support.checks import Array

JointLaw: TypeAlias = Any  # of jointlaw.laws, which lies above

LEG = 24  # steps each way
SHARES = (1.0, 0.1)  # of the normal stress S/2 of the standard paths
DIRECTIONS = (0.0, 25.0, 90.0)  # degrees, in space
MOBILISED = 0.2  # of a mating length, or without one of 10 closure ranges: friction from there on
_FIRST = 0.1  # first step, in closure ranges
_FAR, _ENDLESS = 3.0, 30.0  # mating lengths; closure ranges without one
HELD = 1e-5  # of the normal stress


class Slip(NamedTuple):
    """F (steps, paths, dim) in Pa, and friction and dilation angle (steps, paths) in degrees.

    `counts` (steps, paths): whether friction is mobilised: beyond 0.2 mating lengths, and on the
    way back beyond its first fifth and two closure ranges, within which sliders still turn.
    """

    F: Array
    friction: Array
    dilation: Array
    counts: NDArray[np.bool_]

    def apart(self, other: "Slip") -> list[float]:
        """Largest difference of the friction and of the dilation angle, in degrees."""
        off = np.abs([self.friction - other.friction, self.dilation - other.dilation])
        return off.max(axis=(1, 2), where=self.counts, initial=0.0).tolist()


def distance(mating_length: float, closure_range: float) -> float:
    """How far (m) the paths that slip go."""
    if math.isfinite(mating_length):
        return _FAR * mating_length
    return _ENDLESS * closure_range


def standard_ways(dim: int) -> Array:
    """Ways (paths, 3) to slip: share of the stress S/2, azimuth in degrees, share of `distance`."""
    azimuths = DIRECTIONS if dim == 3 else DIRECTIONS[:1]
    return np.array([(share, azimuth, 1.0) for share in SHARES for azimuth in azimuths])


def random_ways(rng: np.random.Generator, count: int, dim: int) -> Array:
    """As `standard_ways`, anywhere: at stresses from a twentieth of S/2 on."""
    share, azimuth = rng.uniform(0.05, 1.0, count), rng.uniform(0.0, 360.0, count)
    return np.column_stack([share, azimuth * (dim == 3), rng.uniform(0.3, 1.0, count)])


def slip(law: JointLaw, closure_range: float, stress: float, ways: Array) -> Slip:
    """Shear there and back along `ways` (paths, 3), of which the stress S/2 is in Pa."""
    share, azimuth, length = ways.T
    dim, R, D = law.tables.dim, closure_range, law.mating_length
    unit, far = D if math.isfinite(D) else 10 * R, distance(D, R)
    places = np.geomspace(_FIRST * min(R, far), far, LEG)[:, None] * length
    leg = np.diff(places, axis=0, prepend=0.0)
    turn = np.radians(azimuth)
    along = np.stack([np.cos(turn), np.sin(turn)], axis=-1)[:, : dim - 1]
    goal = stress * share
    batch = law.joints(len(goal), ledger=False, normal_stress=goal)
    F = np.empty((2 * LEG, len(goal), dim))
    rise, rate = np.empty(F.shape[:2]), np.zeros(len(goal))
    for k, steps in enumerate(np.concatenate([leg, -leg])):
        step = np.column_stack([rate * steps, steps[:, None] * along])
        step[:, 0] = closing_increments(batch, step, NormalCondition(goal, goal), HELD)
        F[k], _ = batch.update(step, tangent=False)
        rate = step[:, 0] / steps
        rise[k] = -step[:, 0] / np.abs(steps)
    shear = np.repeat([1.0, -1.0], LEG)[:, None] * np.sum(F[:, :, 1:] * along, axis=2)
    turned = places >= np.maximum(MOBILISED * far * length, 2 * R)
    counts = np.concatenate([places >= MOBILISED * unit, turned])
    return Slip(F, np.degrees(np.arctan2(shear, F[:, :, 0])), np.degrees(np.arctan(rise)), counts)
