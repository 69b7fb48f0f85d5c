"""The cohesive bond of a joint: cohesion and tensile strength with irreversible damage."""

from dataclasses import dataclass

import numpy as np

from ..support.checks import Array
from ..support.thresholds import ROUNDING_TOLERANCE
from .declared import check, declared, parameter

MAX_PARAMETER = 1e100  # of stiffness and strength: squares of larger forces overflow
MAX_DUCTILITY = 1e30  # fracture energy over the elastic energy at the peak
MIN_FAILURE_DISPLACEMENT = 1e-50  # m: at which a mode without strength fails
MODES = (
    ("normal_stiffness", "tension", "energy_I"),
    ("shear_stiffness", "cohesion", "energy_II"),
)


@declared
@dataclass(frozen=True)
class Bond:
    """Bridges of rock or cement across a joint: docs/theory-incremental.md, "Cohesive bond".

    It is stress-free at the interlocked position and acts in parallel with the asperities, in
    opening and in shear; closure acts on the asperities alone. Damage begins where (normal
    stress/tension)^2 + (shear stress/cohesion)^2 = 1. The bond softens linearly in each mode, and
    damage is irreversible.

    Raises ValueError when a parameter is out of bounds.

    >>> bond = jl.Bond(normal_stiffness=1e12, shear_stiffness=1e12, tension=1e6, cohesion=2e6)
    """

    normal_stiffness: float = parameter(
        "stiffness in opening, > 0 with a tension", "Pa/m", low=0.0, high=MAX_PARAMETER
    )
    shear_stiffness: float = parameter(
        "stiffness in shear, > 0 with a cohesion", "Pa/m", low=0.0, high=MAX_PARAMETER
    )
    tension: float = parameter(
        "tensile strength, in pure opening; at 0 the bond breaks at the first motion in that mode",
        "Pa",
        low=0.0,
        high=MAX_PARAMETER,
        fit=(1.0, 1e12),
    )
    cohesion: float = parameter(
        "strength in pure shear; at 0 the bond breaks at the first motion in that mode",
        "Pa",
        low=0.0,
        high=MAX_PARAMETER,
        fit=(1.0, 1e12),
    )
    energy_I: float | None = parameter(
        "fracture energy in opening, at least the elastic energy at the peak, tension^2/(2 "
        "normal_stiffness); None: this energy, brittle",
        "J/m2",
        None,
        low=0.0,
    )
    energy_II: float | None = parameter(
        "fracture energy in shear, at least cohesion^2/(2 shear_stiffness); None: this energy",
        "J/m2",
        None,
        low=0.0,
    )

    def __post_init__(self) -> None:
        check(self, "bond")
        for stiffness, strength, energy in MODES:
            k = getattr(self, stiffness)
            peak = getattr(self, strength)
            if peak > 0.0 and k == 0.0:
                raise ValueError(
                    f"bond.{stiffness} = {k!r} Pa/m is out of bounds: it must be > 0, for "
                    f"bond.{strength} = {peak!r} Pa"
                )
            value = getattr(self, energy)
            elastic = 0.5 * peak * (peak / k) if peak else 0.0
            lower = elastic * (1.0 - ROUNDING_TOLERANCE)
            upper = MAX_DUCTILITY * elastic
            if value is not None and not lower <= value <= upper:
                raise ValueError(
                    f"bond.{energy} = {value!r} J/m2 is out of bounds: it must be >= {elastic:g}, "
                    f"the elastic energy at the peak, {strength}^2/(2 {stiffness}), and <= "
                    f"{upper:g}; leave it out for a brittle bond"
                )

    @property
    def limits(self) -> tuple[Array, Array]:
        """1/(opening) and 1/(slip) at the onset of damage, and at failure, each (2,) in 1/m."""
        largest = 1.0 / MIN_FAILURE_DISPLACEMENT
        onset = []
        failure = []
        for names in MODES:
            k, peak, energy = (getattr(self, name) for name in names)
            onset.append(min(k / peak if peak else largest, largest))
            failure.append(min(0.5 * peak / energy, onset[-1]) if energy else onset[-1])
        return np.array(onset), np.array(failure)
