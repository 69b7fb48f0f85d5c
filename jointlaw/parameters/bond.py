"""The bond beside the asperities: cohesion and tension, which break for good."""

from dataclasses import dataclass

import numpy as np

from ..support.checks import Array
from ..support.thresholds import ROUNDING_TOLERANCE
from .declared import check, declared, parameter

LARGEST = 1e100  # of stiffness and strength: squares of forces and displacements stay finite
LONGEST = 1e30  # an energy of fracture over the elastic energy at the peak
LEAST = 1e-50  # m: where a mode without strength breaks
MODES = (
    ("normal_stiffness", "tension", "energy_I"),
    ("shear_stiffness", "cohesion", "energy_II"),
)


@declared
@dataclass(frozen=True)
class Bond:
    """Bridges of rock or cement across a joint: docs/theory-incremental.md, "The bond".

    It is made at mate, without load, and acts beside the asperities: in opening and in shear, for
    closing is theirs. It begins to break where (normal stress/tension)^2 + (shear
    stress/cohesion)^2 = 1, softens linearly in each mode, and never heals.

    Raises ValueError when a parameter is out of bounds.

    >>> bond = jl.Bond(normal_stiffness=1e12, shear_stiffness=1e12, tension=1e6, cohesion=2e6)
    """

    normal_stiffness: float = parameter(
        "stiffness in opening, > 0 with a tension", "Pa/m", low=0.0, high=LARGEST
    )
    shear_stiffness: float = parameter(
        "stiffness in shear, > 0 with a cohesion", "Pa/m", low=0.0, high=LARGEST
    )
    tension: float = parameter(
        "strength in pure opening; a bond without breaks at the first motion in that mode",
        "Pa", low=0.0, high=LARGEST, fit=(1.0, 1e12),
    )  # fmt: skip
    cohesion: float = parameter(
        "strength in pure shear; a bond without breaks at the first motion in that mode",
        "Pa", low=0.0, high=LARGEST, fit=(1.0, 1e12),
    )  # fmt: skip
    energy_I: float | None = parameter(
        "energy of fracture in opening, at least the elastic energy at the peak, tension^2/(2 "
        "normal_stiffness); None takes that: brittle", "J/m2", None, low=0.0,
    )  # fmt: skip
    energy_II: float | None = parameter(
        "the same in shear, at least cohesion^2/(2 shear_stiffness)", "J/m2", None, low=0.0
    )

    def __post_init__(self) -> None:
        check(self, "bond")
        for stiffness, strength, energy in MODES:
            k, most = getattr(self, stiffness), getattr(self, strength)
            if most > 0.0 and k == 0.0:
                raise ValueError(
                    f"bond.{stiffness} = {k!r} Pa/m is out of bounds: it must be > 0, for "
                    f"bond.{strength} = {most!r} Pa"
                )
            value, elastic = getattr(self, energy), 0.5 * most * (most / k) if most else 0.0
            least = elastic * (1.0 - ROUNDING_TOLERANCE)
            if value is not None and not least <= value <= LONGEST * elastic:
                raise ValueError(
                    f"bond.{energy} = {value!r} J/m2 is out of bounds: it must be >= {elastic:g}, "
                    f"the elastic energy at the peak, {strength}^2/(2 {stiffness}), and <= "
                    f"{LONGEST * elastic:g}; leave it out for a brittle bond"
                )

    @property
    def limits(self) -> tuple[Array, Array]:
        """One over the opening and one over the slip at which the bond begins to break, and at
        which nothing of it is left, each (2,) in 1/m."""
        begin, end = [], []
        for stiffness, strength, energy in MODES:
            k, most, fracture = (getattr(self, name) for name in (stiffness, strength, energy))
            begin.append(min(k / most if most else 1.0 / LEAST, 1.0 / LEAST))
            end.append(begin[-1] if not fracture else min(0.5 * most / fracture, begin[-1]))
        return np.array(begin), np.array(end)
