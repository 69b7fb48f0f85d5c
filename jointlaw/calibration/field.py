"""A law from field values: JRC, JCS, a basic friction angle and a stiffness at a normal stress."""

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..laboratory.experiments import direct_shear
from ..laboratory.record import TestRecord
from ..laws.joint_law import JointLaw
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..parameters.rock import ROCK
from ..support.checks import more_than, one_of

ASSUMED = (
    "Assumed (not constrained by field values): contacts of asperities of 1 mm radius in rock of "
    "G = 20 GPa and nu = 0.25, a gamma density of heights (alpha = 4, beta = 30 um), {}, no "
    "direction dependence. JRC and JCS must be values of "
    "a joint of this length: scale the values of a laboratory sample first (docs/field.md). "
    "Dilation is not fitted to Barton's: asperities of the law do not break, so most of the peak "
    "strength above the basic friction is dilation, where Barton assumes half. {}"
)
DEGRADATION = {  # by argument of from_field: what is assumed, and where the law holds
    "work": (
        "asperity degradation over 1.25 mating lengths",
        "The law holds near this normal stress; for other stresses fit a closure and a shear test "
        "(jointlaw fit).",
    ),
    "stress": (
        "asperity degradation by a contact stress of JCS/4",
        "The peak strength follows Barton's at other normal stresses too, within 1.5 degrees from "
        "0.5 to 10 MPa for JRC 10 and JCS 100 MPa; cycles of shear do not degrade the asperities, "
        "and the stiffness holds near this normal stress (docs/field.md).",
    ),
}
# JCS over degradation stress. The peak then follows Barton's from 0.5 to 10 MPa within 1.5 degrees
# (JRC 10, JCS 100 MPa), without degradation by work
_JCS_OVER_DEGRADATION_STRESS = 4.0
_MAX_ITERATIONS = 30
_SHEAR_PER_PEAK = 4.0  # shear displacement of a test over the peak displacement
_MAX_ANGLE_ERROR = 0.1  # degrees, of the peak friction angle
_MAX_DISPLACEMENT_ERROR = 0.1  # relative, of the peak displacement
_MAX_STIFFNESS_ERROR = 0.01  # relative, of the normal stiffness
_MIN_ROUGHNESS_ANGLE = 1.0  # degrees
_MAX_FRICTION_ANGLE = 80.0  # degrees


def assumptions(degradation: str = "work") -> str:
    """What `from_field` assumes with this degradation, and where its law holds: a sentence each."""
    return ASSUMED.format(*DEGRADATION[degradation])


def from_field(
    *,
    jrc: float,
    jcs: float,
    length: float,
    normal_stress: float,
    normal_stiffness: float,
    basic_friction: float = math.radians(30),
    degradation: str = "work",
) -> JointLaw:
    """The law with Barton's peak friction angle and peak displacement at one normal stress.

    The peak friction angle is met within 0.1 degrees, the peak displacement within 10 % and the
    stiffness within 1 %. `assumptions` lists the assumptions for all other parameters.

    Parameters
    ----------
    jrc: joint roughness coefficient of a joint of this length, > 0 (docs/field.md scales it).
    jcs: joint wall compressive strength in Pa at this length, above the normal stress.
    length: length of the joint in m.
    normal_stress: in Pa; the law is less accurate at other normal stresses (docs/field.md).
    normal_stiffness: tangent stiffness at this normal stress in Pa/m.
    basic_friction: friction angle of the flat rock surface in rad.
    degradation: "work" for asperities that degrade over 1.25 mating lengths of shear at the peak
        strength (`slope_wear`); "stress" for a `degradation_stress` of JCS/4 instead, by which the
        peak falls with the normal stress also where no work is counted, as in strength reduction.

    Returns the law. Raises ValueError if no such law has these values.

    Source: Barton & Choubey 1977 (peak angle), Barton & Bandis 1982 (peak displacement).

    >>> made = jl.from_field(jrc=10, jcs=100e6, length=0.1, normal_stress=1e6,
    ...                      normal_stiffness=30e9, basic_friction=np.radians(30))
    """
    arguments = {
        "jrc": jrc,
        "jcs": jcs,
        "length": length,
        "normal_stress": normal_stress,
        "normal_stiffness": normal_stiffness,
        "basic_friction": basic_friction,
    }
    for name, value in arguments.items():
        more_than(name, value, 0.0)
    one_of("degradation", degradation, tuple(DEGRADATION))
    basic_angle = math.degrees(basic_friction)
    roughness_angle = jrc * math.log10(jcs / normal_stress)
    max_roughness_angle = _MAX_FRICTION_ANGLE - basic_angle
    if not _MIN_ROUGHNESS_ANGLE <= roughness_angle <= max_roughness_angle:
        raise ValueError(
            f"jrc = {jrc:g} and jcs = {jcs:g} Pa at {normal_stress:g} Pa give a roughness angle of "
            f"{roughness_angle:.3g} degrees above {basic_angle:.3g}: it must be 1 to "
            f"{max_roughness_angle:.3g}; give a normal stress at which roughness matters, or check "
            "the units"
        )
    peak_angle = basic_angle + roughness_angle
    target_displacement = peak_displacement(jrc, length)
    law = _initial_law(basic_friction, roughness_angle, normal_stress, target_displacement)
    if degradation == "stress":
        stress = jcs / _JCS_OVER_DEGRADATION_STRESS
        law = replace(law, slope_wear=math.inf, degradation_stress=stress)
    try:
        for _ in range(_MAX_ITERATIONS):  # each parameter is scaled by target over result
            result = shear_past_peak(law, normal_stress, target_displacement)
            angle_error = result.record.peak_friction_angle - basic_angle - roughness_angle
            displacement_ratio = target_displacement / result.peak_displacement
            stiffness_ratio = normal_stiffness / result.normal_stiffness
            if (
                abs(angle_error) < _MAX_ANGLE_ERROR
                and abs(displacement_ratio - 1) < _MAX_DISPLACEMENT_ERROR
                and abs(stiffness_ratio - 1) < _MAX_STIFFNESS_ERROR
            ):
                return law
            law = replace(
                law,
                orientation=Orientation(law.orientation.a * (1 + angle_error / roughness_angle)),
                asperity_density=law.asperity_density * stiffness_ratio,
                mating_length=law.mating_length * displacement_ratio,
                # with the mating length, or degradation alone would cause the peak, too early
                slope_wear=law.slope_wear * displacement_ratio,
                closure_range=None,  # type: ignore[arg-type]
            )
        reason = (
            f"the nearest law misses the peak by {angle_error:+.2g} degrees, its displacement by "
            f"{100 / displacement_ratio - 100:+.2g} % and the stiffness by "
            f"{100 / stiffness_ratio - 100:+.2g} %"
        )
    except ValueError as error:
        reason = str(error)
    raise ValueError(
        f"normal_stiffness = {normal_stiffness:g} Pa/m, length = {length:g} m: no law has this "
        f"stiffness and a peak of {peak_angle:.3g} degrees at {1e3 * target_displacement:.3g} mm "
        f"({reason}); the closure of a joint that is too soft exceeds its peak displacement, a "
        "joint that is too stiff has its peak at a smaller displacement; check both values"
    )


def _initial_law(
    basic_friction: float, roughness_angle: float, normal_stress: float, displacement: float
) -> JointLaw:
    """The first guess: inclinations from the roughness angle, lengths from the displacement."""
    peak_angle = math.degrees(basic_friction) + roughness_angle
    mating_length = _SHEAR_PER_PEAK * displacement
    peak_friction = math.tan(math.radians(peak_angle))
    return JointLaw(
        orientation=Orientation(90 / roughness_angle),
        asperity=replace(ROCK, mu=math.tan(basic_friction)),
        heights=GammaHeights(4.0, 30e-6, formation="individual"),
        asperity_density=1e5,
        mating_length=mating_length,
        slope_wear=1.25 * mating_length * normal_stress * peak_friction,
    )


def peak_displacement(jrc: float, length: float) -> float:
    """Shear displacement (m) at the peak of a joint of this length (m): Barton & Bandis 1982."""
    return length / 500 * (jrc / length) ** 0.33


class PeakTest(NamedTuple):
    """A simulated direct shear test beyond its peak."""

    record: TestRecord
    peak_displacement: float  # m
    normal_stiffness: float  # Pa/m, tangent before shear


def shear_past_peak(law: JointLaw, normal_stress: float, displacement: float) -> PeakTest:
    """Shear a new joint of a law at constant normal stress, to four times an expected peak
    displacement.

    Parameters
    ----------
    law: the law.
    normal_stress: constant normal stress in Pa.
    displacement: expected shear displacement at the peak in m.

    Returns the `PeakTest`: the record of the test, the shear displacement (m) at its peak, and the
    normal stiffness (Pa/m) of a joint closed, but not sheared, to this stress.
    """
    _, C = law.joint().update([law.closure(normal_stress), 0.0, 0.0])
    assert C is not None
    record = direct_shear(law.joint(), _SHEAR_PER_PEAK * displacement, normal_stress)
    peak_row = np.argmax(record.shear_stress)
    return PeakTest(record, float(record.shear[peak_row]), float(C[0, 0]))
