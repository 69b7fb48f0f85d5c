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
    "wear over 1.25 mating lengths, no direction. JRC and JCS are taken as those of a joint of "
    "this length: scale those of a laboratory sample first (docs/field.md). Dilation is not fitted "
    "to Barton's: asperities of the law climb and do not break, so most of the peak above the "
    "basic friction is dilation, where he takes half. The law holds near this normal stress; a "
    "closure and a shear test tell more (jointlaw fit)."
)
_ROUNDS, _WAY = 30, 4.0  # of correction; peak displacements that a joint is sheared by
# what may be missed: degrees of the peak, shares of its displacement and of the stiffness
_ANGLE, _SLIP, _STIFFNESS = 0.1, 0.1, 0.01


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
    jrc: joint roughness coefficient of a joint of this length, > 0 (docs/field.md scales it).
    jcs: strength of the joint wall in Pa, of this length too, above the normal stress.
    length: of the joint in m.
    normal_stress: in Pa; the law is right there, and less so at others (docs/field.md).
    normal_stiffness: tangent stiffness at that stress in Pa/m.
    basic_friction: friction angle of the flat rock in rad.

    The peak is within 0.1 degrees, its displacement within 10 % and the stiffness within 1 %;
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
        slope_wear=1.25 * _WAY * slip * normal_stress * math.tan(math.radians(basic + climb)),
    )
    try:
        for _ in range(_ROUNDS):  # each number by the ratio of what is wanted to what it gives
            record, reached, stiffness = tested(law, normal_stress, slip)
            missed = record.peak_friction_angle - basic - climb
            slips, stiff = slip / reached, normal_stiffness / stiffness
            if abs(missed) < _ANGLE and abs(slips - 1) < _SLIP and abs(stiff - 1) < _STIFFNESS:
                return law
            law = replace(
                law,
                orientation=Orientation(law.orientation.a * (1 + missed / climb)),
                asperity_density=law.asperity_density * stiff,
                mating_length=law.mating_length * slips,
                slope_wear=law.slope_wear * slips,  # or wear alone would make the peak, too early
                closure_range=None,  # type: ignore[arg-type]
            )
        nearest = (
            f"the nearest misses the peak by {missed:+.2g} degrees, its displacement by "
            f"{100 / slips - 100:+.2g} % and the stiffness by {100 / stiff - 100:+.2g} %"
        )
    except ValueError as error:
        nearest = str(error)
    raise ValueError(
        f"normal_stiffness = {normal_stiffness:g} Pa/m, length = {length:g} m: no law has them and "
        f"a peak of {basic + climb:.3g} degrees at {1e3 * slip:.3g} mm ({nearest}); a joint "
        "too soft closes by more than its peak displacement, one too stiff has its peak before it"
    )


def peak_displacement(jrc: float, length: float) -> float:
    """Shear displacement (m) at the peak of a joint of this length (m): Barton & Bandis 1982."""
    return length / 500 * (jrc / length) ** 0.33


def tested(law: JointLaw, normal_stress: float, slip: float) -> tuple[Record, float, float]:
    """Shear to `_WAY` peak displacements `slip` (m), the displacement at the peak (m), and the
    normal stiffness (Pa/m) before.
    """
    _, C = law.joint().update([law.closure(normal_stress), 0.0, 0.0])
    assert C is not None
    record = direct_shear(law.joint(), _WAY * slip, normal_stress)
    return record, float(record.shear[np.argmax(record.shear_stress)]), float(C[0, 0])
