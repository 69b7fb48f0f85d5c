"""What a law means for a joint: spacing of asperities, closure, stiffness, share in contact.

A fit may reproduce all tests with asperities that no joint has, because few points determine few
combinations of parameters. The figures here can be compared with the specimen and with experience.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..laws.joint_law import JointLaw
from ..support.markdown import table

SPECIMEN_SIZE = 0.1  # m, of a laboratory specimen, if it is not known
MAX_SPACING = 0.05  # of the specimen: with more, fewer than 400 asperities bear its load
ONLY_PRODUCT = (
    "The closure test determines the product of asperity_density and K; with a smaller K, of "
    "smaller asperities, the same joint has more of them."
)
NO_CLOSURE = (
    "No closure was measured: do not use the closure and the stiffness of this law. Give a closure "
    "test, or fix asperity_density."
)
ASSUMED = (
    "No closure was measured: density of asperities, closure and stiffness follow from an assumed "
    "normal stiffness of {:.3g} GPa/m at {:.3g} MPa. Joints in laboratories have 15 to 200 GPa/m; "
    "give a closure test, or --set asperity_density."
)
DIFFERENCE_STEP = 1e-4  # of the closure, of the slope of the first-loading curve
_COLUMNS = (
    "normal stress (MPa) | closure (mm) | normal stiffness (GPa/m) | elastic shear stiffness "
    "(GPa/m) | asperities in contact (%)"
)


class Response(NamedTuple):
    """A joint in first loading at a normal stress, in SI units.

    normal_stress: in Pa. closure: in m, from first contact.
    normal_stiffness: slope of the first-loading curve in Pa/m.
    shear_stiffness: elastic, without slip, in Pa/m.
    contact_fraction: of the asperities.
    """

    normal_stress: float
    closure: float
    normal_stiffness: float
    shear_stiffness: float
    contact_fraction: float


def respond(law: JointLaw, normal_stress: float) -> Response:
    """The response of a law at a normal stress (Pa, > 0).

    Raises ValueError for a stress that yielding asperities never reach.
    """
    closure = float(law.closure(normal_stress))
    step = DIFFERENCE_STEP * closure
    rise = float(law.normal_stress(closure + step)) - float(law.normal_stress(closure - step))
    _, shear_stiffness = law.secant_stiffness(normal_stress)
    return Response(
        normal_stress,
        closure,
        rise / (2 * step),
        shear_stiffness,
        law.contact_fraction(closure),
    )


def spacing(law: JointLaw) -> float:
    """Mean spacing (m) of the asperities: the edge of the square that each of them has."""
    return 1 / math.sqrt(law.asperity_density)


def describe(
    law: JointLaw,
    stresses: Sequence[float],
    specimen_size: float | None = None,
    has_closure: bool = False,
    assumed_stiffness: tuple[float, float] | None = None,
) -> list[str]:
    """The meaning of a law in sentences and a table (Markdown lines).

    Parameters
    ----------
    law: the law.
    stresses: normal stresses in Pa, > 0.
    specimen_size: edge of the specimen in m; None takes 100 mm for the warning.
    has_closure: whether the closure was measured.
    assumed_stiffness: normal stiffness (Pa/m) at a normal stress (Pa) that was assumed instead.
    """
    rows = []
    for stress in stresses:
        try:
            one = respond(law, stress)
        except ValueError as error:
            rows.append(f"{stress / 1e6:.3g} | {error} | | | ")
            continue
        cells = (
            one.normal_stress / 1e6,
            1e3 * one.closure,
            one.normal_stiffness / 1e9,
            one.shear_stiffness / 1e9,
            100 * one.contact_fraction,
        )
        rows.append(" | ".join(f"{cell:.3g}" for cell in cells))
    distance = spacing(law)
    lines = [
        f"One asperity per {1e3 * distance:.3g} mm x {1e3 * distance:.3g} mm. Unsheared, in first "
        "loading, from first contact on:",
        "",
        *table(_COLUMNS, rows),
    ]
    if assumed_stiffness is not None:
        stiffness, stress = assumed_stiffness
        lines += ["", ASSUMED.format(stiffness / 1e9, stress / 1e6)]
    remedy = ONLY_PRODUCT if has_closure else NO_CLOSURE
    size = SPECIMEN_SIZE if specimen_size is None else specimen_size
    if distance > MAX_SPACING * size:
        assumed = "" if specimen_size is not None else ", if it has 100 mm"
        lines += [
            "",
            f"**The spacing of the asperities is {100 * distance / size:.0f} % of the "
            f"specimen{assumed}:** it would have about {(size / distance) ** 2:.0f}, and the law "
            f"averages over many. {remedy}",
        ]
    return lines
