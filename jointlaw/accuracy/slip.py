"""Shear tests with slip far beyond the closure: friction and dilation angle at constant stress.

The joint is loaded to a normal stress and sheared to several mating lengths (without a mating
length to 30 closure ranges), and back. Each resolution controls the normal stress by itself: one
common path of displacement would compare the accumulated dilation of resolutions, not their
strength.
"""

import math
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from ..joints.normal_control import NormalCondition, closing_increments
from ..support.checks import Array

JointLaw: TypeAlias = Any  # of jointlaw.laws, which imports this package

STEPS_PER_LEG = 24  # forwards, and as many back
STRESS_TOLERANCE = 1e-5  # relative, of the constant normal stress
_STRESS_FRACTIONS = (1.0, 0.1)  # of the normal stress S/2 of the standard paths
_AZIMUTHS = (0.0, 25.0, 90.0)  # degrees, in 3-D
# Friction is mobilised from here on, over a mating length, or over 10 closure ranges without one
_MOBILISED_SLIP = 0.2
_FIRST_STEP = 0.1  # closure ranges
_MAX_SLIP_OVER_MATING_LENGTH = 3.0
_MAX_SLIP_OVER_CLOSURE_RANGE = 30.0  # without a mating length


class SlipResults(NamedTuple):
    """Results of shear tests, by step and test.

    F: (steps, tests, dim) in Pa.
    friction, dilation: angles (steps, tests) in degrees.
    is_mobilised: (steps, tests), whether friction is mobilised: beyond 0.2 mating lengths, and on
        the way back beyond its first fifth and two closure ranges, within which sliders still turn.
    """

    F: Array
    friction: Array
    dilation: Array
    is_mobilised: NDArray[np.bool_]

    def largest_differences(self, reference: "SlipResults") -> list[float]:
        """Largest absolute differences in degrees of the friction and of the dilation angle.

        Only steps with mobilised friction (`is_mobilised` of this object) count; else it is 0.
        """
        differences = np.abs(
            [self.friction - reference.friction, self.dilation - reference.dilation]
        )
        return differences.max(axis=(1, 2), where=self.is_mobilised, initial=0.0).tolist()


def max_slip(mating_length: float, closure_range: float) -> float:
    """Slip (m) at which the slip tests reverse.

    A multiple of the mating length, or of the closure range (m) for an infinite mating length.
    """
    if math.isfinite(mating_length):
        return _MAX_SLIP_OVER_MATING_LENGTH * mating_length
    return _MAX_SLIP_OVER_CLOSURE_RANGE * closure_range


def standard_slip_tests(dim: int) -> Array:
    """Tests (n, 3): fraction of the stress S/2, azimuth in degrees, fraction of `max_slip`."""
    azimuths = _AZIMUTHS if dim == 3 else _AZIMUTHS[:1]
    return np.array(
        [(fraction, azimuth, 1.0) for fraction in _STRESS_FRACTIONS for azimuth in azimuths]
    )


def random_slip_tests(rng: np.random.Generator, count: int, dim: int) -> Array:
    """Random tests (count, 3) as in `standard_slip_tests`, at stresses from 0.05 S/2 on."""
    fraction = rng.uniform(0.05, 1.0, count)
    azimuth = rng.uniform(0.0, 360.0, count)
    return np.column_stack([fraction, azimuth * (dim == 3), rng.uniform(0.3, 1.0, count)])


def run_slip_tests(law: JointLaw, closure_range: float, stress: float, tests: Array) -> SlipResults:
    """Shear new joints forwards and back at constant normal stress, in steps of a geometric series.

    closure_range: of the standard paths, in m. stress: the normal stress S/2 in Pa.

    tests: (n, 3), one row for each test: its normal stress as a fraction of `stress`, the azimuth
    of shear in degrees, and its slip as a fraction of `max_slip`.

    Returns tractions, friction angles and dilation angles by step and test, and where friction is
    mobilised.
    """
    stress_fraction, azimuth, length_fraction = tests.T
    dim = law.tables.dim
    mating_length = law.mating_length
    farthest = max_slip(mating_length, closure_range)
    unit = mating_length if math.isfinite(mating_length) else 10 * closure_range
    first = _FIRST_STEP * min(closure_range, farthest)
    slip = np.geomspace(first, farthest, STEPS_PER_LEG)[:, None] * length_fraction
    increments = np.diff(slip, axis=0, prepend=0.0)
    psi = np.radians(azimuth)
    direction = np.stack([np.cos(psi), np.sin(psi)], axis=-1)[:, : dim - 1]
    normal = stress * stress_fraction
    batch = law.joints(len(normal), track_dissipation=False, normal_stress=normal)
    F = np.empty((2 * STEPS_PER_LEG, len(normal), dim))
    tan_dilation = np.empty(F.shape[:2])
    closing_rate = np.zeros(len(normal))  # first guess of closure over slip
    for k, shear in enumerate(np.concatenate([increments, -increments])):
        step = np.column_stack([closing_rate * shear, shear[:, None] * direction])
        step[:, 0] = closing_increments(
            batch, step, NormalCondition(normal, normal), STRESS_TOLERANCE
        )
        F[k], _ = batch.update(step, tangent=False)
        closing_rate = step[:, 0] / shear
        tan_dilation[k] = -step[:, 0] / np.abs(shear)
    sense = np.repeat([1.0, -1.0], STEPS_PER_LEG)[:, None]
    shear_stress = sense * np.sum(F[:, :, 1:] * direction, axis=2)
    is_mobilised_back = slip >= np.maximum(
        _MOBILISED_SLIP * farthest * length_fraction, 2 * closure_range
    )
    is_mobilised = np.concatenate([slip >= _MOBILISED_SLIP * unit, is_mobilised_back])
    friction = np.degrees(np.arctan2(shear_stress, F[:, :, 0]))
    return SlipResults(F, friction, np.degrees(np.arctan(tan_dilation)), is_mobilised)
