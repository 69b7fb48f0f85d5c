"""The bond beside the asperities: cohesion and tension, which break for good."""

from dataclasses import dataclass

import numpy as np

from ..support.checks import Array, number
from ..support.thresholds import ROUNDED

LARGEST = 1e100  # of stiffness and strength: squares of forces and displacements stay finite
LONGEST = 1e30  # an energy of fracture over the elastic energy at the peak
LEAST = 1e-50  # m: where a mode without strength breaks
MODES = (
    ("normal_stiffness", "tension", "energy_I"),
    ("shear_stiffness", "cohesion", "energy_II"),
)


@dataclass(frozen=True)
class Bond:
    """Bridges of rock or cement across a joint: docs/theory-incremental.md, "The bond".

    It is made at mate, without load, and acts beside the asperities: in opening and in shear, for
    closing is theirs. It begins to break where (normal stress/tension)^2 + (shear
    stress/cohesion)^2 = 1, softens linearly in each mode, and never heals.

    Parameters
    ----------
    normal_stiffness, shear_stiffness: in Pa/m, >= 0, and > 0 where there is a strength.
    tension, cohesion: strength in pure opening and in pure shear, in Pa, >= 0. A bond with a
        strength of 0 breaks at the first motion in that mode.
    energy_I, energy_II: energy of fracture in opening and in shear, in J/m2, at least the elastic
        energy at the peak, strength^2/(2 stiffness). None, the default, takes that: brittle.

    Raises ValueError when a parameter is out of bounds.
    """

    normal_stiffness: float
    shear_stiffness: float
    tension: float
    cohesion: float
    energy_I: float | None = None
    energy_II: float | None = None

    def __post_init__(self) -> None:
        for stiffness, strength, energy in MODES:
            k, most = self._within(stiffness, "Pa/m"), self._within(strength, "Pa")
            if most > 0.0 and k == 0.0:
                raise ValueError(
                    f"bond.{stiffness} = {k!r} Pa/m is out of bounds: it must be > 0, for "
                    f"bond.{strength} = {most!r} Pa"
                )
            if getattr(self, energy) is not None:
                self._require_energy(energy, strength, stiffness)

    def _within(self, name: str, unit: str) -> float:
        """A stiffness or a strength, checked."""
        value = number(f"bond.{name}", getattr(self, name))
        if not 0.0 <= value <= LARGEST:
            raise ValueError(
                f"bond.{name} = {value!r} {unit} is out of bounds: it must be >= 0 and <= "
                f"{LARGEST:g}"
            )
        object.__setattr__(self, name, value)
        return value

    def _require_energy(self, name: str, strength: str, stiffness: str) -> None:
        """Check an energy of fracture that was given."""
        value, most = number(f"bond.{name}", getattr(self, name)), getattr(self, strength)
        elastic = 0.5 * most * (most / getattr(self, stiffness)) if most else 0.0
        if not elastic * (1.0 - ROUNDED) <= value <= LONGEST * elastic:
            raise ValueError(
                f"bond.{name} = {value!r} J/m2 is out of bounds: it must be >= {elastic:g}, the "
                f"elastic energy at the peak, {strength}^2/(2 {stiffness}), and <= "
                f"{LONGEST * elastic:g}; leave it out for a brittle bond"
            )
        object.__setattr__(self, name, value)

    @property
    def largest_stiffness(self) -> float:
        """Bound of the stiffness that it adds (Pa/m); softening, which lowers it, is left out."""
        return max(self.normal_stiffness, self.shear_stiffness)

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
