"""Ranges of rock joints: commands and scenes refuse numbers far outside as mistakes of units.

The law itself accepts any number.
"""

import math
from collections.abc import Mapping

from .asperity import Asperity

# Contacts of an unknown rock: shear modulus 20 GPa, Poisson's ratio 0.25, asperities of 1 mm radius
# (Eq. 34), friction 0.6 (Byerlee 1978)
ROCK = Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6)
_UNIT = "is it in the unit that was read or given?"
_SCALE = "are the columns in the units that were read or given?"
#: Highest coefficient of friction: 79 degrees, beyond any rock
STEEPEST = 5.0
# from soft infill under paper to lapped granite under a mountain
_STIFFNESS = (1e6, 1e15, " Pa/m", "1 GPa/m is 1e9 Pa/m")
_FRICTION = (0.0, STEEPEST, "", "it is a coefficient, tan(angle): tan(35 degrees) = 0.7")
# lowest value, highest value, unit, and the likely cause of a number outside
RANGES = {
    "mu": _FRICTION,
    "friction": _FRICTION,
    "normal_stiffness": _STIFFNESS,
    "shear_stiffness": _STIFFNESS,
    "stiffness at 1 MPa": _STIFFNESS,
    # asperities of 1 nm are rougher than a polish; 5 cm is a step in the rock, no asperity
    "beta": (1e-10, 0.05, " m", _SCALE),
    "overlap": (0.0, 0.2, " m", _SCALE),
    # Hertz, Eq. 34: from soft rock and radii of 1 nm to corundum and radii of 1 km
    "K": (1e3, 1e14, " Pa m^(1-eta)", _SCALE),
    # one asperity in 30 m to one every 0.1 um
    "asperity_density": (1e-3, 1e14, " /m2", "heights and spacing in the same unit?"),
    # 90/a degrees is the steepest inclination
    "a": (1.05, 1e3, "", "are the heights and the spacing in the units that were given?"),
    "closure": (1e-9, 0.02, " m", _UNIT),
    "shear displacement": (1e-8, 2.0, " m", _UNIT),
    # beyond the strength of any rock, or below the weight of a sheet of paper on it
    "shear stress": (10.0, 5e9, " Pa", _UNIT),
    "stress": (10.0, 5e9, " Pa", _UNIT),
    "normal stress": (10.0, 5e9, " Pa", _UNIT),
    # joints at 10 kPa have reached 10
    "peak shear stress over normal stress": (
        0.02,
        30.0,
        "",
        "are both in the units that were read or given?",
    ),
    # dilation at 79 degrees throughout
    "opening over shear displacement": (
        0.0,
        STEEPEST,
        "",
        "are both in the units that were read or given?",
    ),
    "plane": (-2 * math.pi, 2 * math.pi, " rad", "90 degrees is 1.571 rad"),
}


def require_rock(
    values: Mapping[str, float], where: str = "", remedies: Mapping[str, str] | None = None
) -> None:
    """Refuse numbers outside `RANGES`. Names without a range, NaN and infinite numbers pass.

    values: numbers by the name of their range, in SI units.
    where: begins the message; it names the file or the option.
    remedies: by name, what to write instead of the cause in `RANGES`.

    Raises ValueError naming the value, the bounds and the likely cause.
    """
    for name, value in values.items():
        if name not in RANGES or not math.isfinite(value):
            continue
        low, high, unit, cause = RANGES[name]
        if not low <= value <= high:
            raise ValueError(
                f"{where}{name} = {value:.6g}{unit} is outside the range of rock joints "
                f"({low:.4g} to {high:.4g}{unit}): {(remedies or {}).get(name, cause)}"
            )
