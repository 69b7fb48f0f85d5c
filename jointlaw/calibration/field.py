"""A law from field values: JRC, JCS, a friction angle and a stiffness at one normal stress."""

import math
from dataclasses import replace

import numpy as np

from ..laboratory.experiments import direct_shear
from ..laboratory.record import Record
from ..laws.joint_law import JointLaw
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..parameters.rock import ROCK
from ..support.checks import more_than

ASSUMED = (
    "Assumed, for no field value tells them: contacts of asperities of 1 mm radius in rock of "
    "G = 20 GPa and nu = 0.25, heights of a gamma density (alpha = 4, beta = 30 um), slopes that "
    "wear over ten peak displacements, no direction. The law holds near this normal stress; a "
    "closure and a shear test tell more (jointlaw fit)."
)
_ROUNDS, _WAY = 15, 4.0  # of correction; peak displacements that a joint is sheared by
_CLOSE = 0.5  # degrees that the peak may miss


def from_field(
    *,
    jrc: float,
    jcs: float,
    length: float,
    normal_stress: float,
    normal_stiffness: float,
    basic_friction: float = math.radians(30),
) -> JointLaw:
    """The law with Barton's peak friction angle and peak displacement at one normal stress.

    Parameters
    ----------
    jrc: joint roughness coefficient, > 0.
    jcs: strength of the joint wall in Pa, above the normal stress.
    length: of the joint in m.
    normal_stress: in Pa; the law is right there, and less so at others (docs/field.md).
    normal_stiffness: tangent stiffness at that stress in Pa/m.
    basic_friction: friction angle of the flat rock in rad.

    `ASSUMED` says what else is in it. Raises ValueError for values that no such law has.

    Source: Barton & Choubey 1977 (peak angle), Barton & Bandis 1982 (its displacement).

    >>> made = jl.from_field(jrc=10, jcs=100e6, length=0.1, normal_stress=1e6,
    ...                      normal_stiffness=30e9, basic_friction=np.radians(30))
    """
    for name, value in (("jrc", jrc), ("jcs", jcs), ("length", length),
                        ("normal_stress", normal_stress), ("normal_stiffness", normal_stiffness),
                        ("basic_friction", basic_friction)):  # fmt: skip
        more_than(name, value, 0.0)
    basic, climb = math.degrees(basic_friction), jrc * math.log10(jcs / normal_stress)
    if not 1.0 <= climb <= 80 - basic:
        raise ValueError(
            f"jrc = {jrc:g} and jcs = {jcs:g} Pa at {normal_stress:g} Pa make joints climb by "
            f"{climb:.3g} degrees above {basic:.3g}: it must be 1 to {80 - basic:.3g}; give a "
            "normal stress at which roughness matters, or check the units"
        )
    slip = peak_displacement(jrc, length)
    law = JointLaw(
        orientation=Orientation(90 / climb),
        asperity=replace(ROCK, mu=math.tan(basic_friction)),
        heights=GammaHeights(4.0, 30e-6, formation="individual"),
        asperity_density=1e5,
        mating_length=_WAY * slip,
        slope_wear=10 * normal_stress * slip,
    )
    try:
        for _ in range(_ROUNDS):  # each number by the ratio of what is wanted to what it gives
            record, stiffness = tested(law, normal_stress, slip)
            reached = record.shear[np.argmax(record.shear_stress)]
            missed = record.peak_friction_angle - basic - climb
            law = replace(
                law,
                orientation=Orientation(law.orientation.a * (1 + missed / climb)),
                asperity_density=law.asperity_density * normal_stiffness / stiffness,
                mating_length=law.mating_length * slip / reached,
                closure_range=None,  # type: ignore[arg-type]
            )
        if abs(missed) > _CLOSE:
            raise ValueError(f"the nearest misses the peak by {missed:+.2g} degrees")
    except ValueError as error:
        raise ValueError(
            f"normal_stiffness = {normal_stiffness:g} Pa/m, length = {length:g} m: no law has them "
            f"and a peak of {basic + climb:.3g} degrees ({error}); a joint so soft or short closes "
            "by more than its peak displacement"
        ) from None
    return law


def peak_displacement(jrc: float, length: float) -> float:
    """Shear displacement (m) at the peak of a joint of this length (m): Barton & Bandis 1982."""
    return length / 500 * (jrc / length) ** 0.33


def tested(law: JointLaw, normal_stress: float, slip: float) -> tuple[Record, float]:
    """Shear to `_WAY` peak displacements `slip` (m), and the normal stiffness (Pa/m) before."""
    _, C = law.joint().update([law.closure(normal_stress), 0.0, 0.0])
    assert C is not None
    return direct_shear(law.joint(), _WAY * slip, normal_stress), float(C[0, 0])
