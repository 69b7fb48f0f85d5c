"""Hydraulic aperture of a joint as a function of its closure.

The heights of a law do not give the flow through its joint (docs/water.md), so this map is not a
property of a law: it has two parameters of its own, measured in a flow test.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from ..support.checks import finite
from .declared import check, declared, parameter, parameters_of
from .keys import keys_of, read, validate_table

APERTURE_TABLE = "aperture"  # in the TOML file of a law
_MAX_CLOSURE = 1e100  # m: the cube of a larger aperture overflows


class ApertureResponse(NamedTuple):
    """Values of an `Aperture` at closures: numbers or arrays of their shape.

    hydraulic: hydraulic aperture e in m.
    slope: de/dclosure, from -1 to 0.
    transmissivity: e^3/12 in m3; the flow per width is transmissivity/viscosity times the pressure
        gradient (cubic law).
    """

    hydraulic: Any
    slope: Any
    transmissivity: Any


@declared
@dataclass(frozen=True)
class Aperture:
    """Hydraulic aperture against the closure of a law: exponential, with slope -1 when wide open.

    With e_r = `hydraulic`, c_r = `at` and L = `length`

        e = e_r exp(-(c - c_r)/L)    where e <= L,
        e = L + (c_L - c)            where e > L, with e = L at the closure c_L.

    Value and slope are continuous. The slope is never below -1: opening a joint by 1 um opens the
    hydraulic aperture by 1 um at most.

    Raises ValueError for a value out of bounds.

    Source: fitted form; flow and closure of Vogler et al. 2018, J. Geophys. Res. Solid Earth 123.

    >>> aperture = jl.Aperture(hydraulic=30e-6, at=60e-6, length=120e-6)
    >>> e, slope, transmissivity = aperture(np.array([60e-6, 180e-6]))
    """

    hydraulic: float = parameter("hydraulic aperture at the closure `at`", "m", above=0.0)
    at: float = parameter("closure of the law at which it is given", "m")
    length: float = parameter(
        "increase of closure that divides the hydraulic aperture by e = 2.718", "m", above=0.0
    )

    def __post_init__(self) -> None:
        check(self, APERTURE_TABLE)

    def __call__(self, closure: ArrayLike) -> ApertureResponse:
        """Hydraulic aperture, its slope and the transmissivity at closures in m, of any shape.

        Raises ValueError for closures that are not finite, or so large that e^3 overflows.
        """
        u = finite("closure", closure, "m")
        if not (np.abs(u) <= _MAX_CLOSURE).all():
            raise ValueError(
                f"closure = {closure!r} m is out of bounds: it must be within +-{_MAX_CLOSURE:g} m"
            )
        decay = np.minimum((self._transition - u) / self.length, 0.0)
        ratio = np.exp(decay)  # e over L in the exponential branch, 1 in the linear one
        e = self.length * ratio + np.maximum(self._transition - u, 0.0)
        return ApertureResponse(e[()], -ratio[()], (e**3 / 12.0)[()])

    @property
    def _transition(self) -> float:
        """Closure (m) beyond which the hydraulic aperture decreases exponentially.

        There the aperture equals `length`; at smaller closure it decreases by the closure itself.
        """
        if self.hydraulic <= self.length:
            return self.at + self.length * math.log(self.hydraulic / self.length)
        return self.at + (self.hydraulic - self.length)

    def to_toml(self) -> str:
        """The table [aperture] for the TOML file of a law."""
        lines = [
            f"{name} = {getattr(self, name)!r}  # {declaration.unit}"
            for name, declaration in parameters_of(self).items()
        ]
        return "\n".join([f"[{APERTURE_TABLE}]", *lines, ""])

    @classmethod
    def from_toml(cls, path: str | Path) -> Self:
        """The aperture in the TOML file of a law.

        path: of the file. Raises ValueError naming file and key, also for a file without
        [aperture].
        """
        tables = read(Path(path), "law file")
        if APERTURE_TABLE not in tables:
            raise ValueError(
                f"{str(path)!r} has no table [{APERTURE_TABLE}] with "
                f"{', '.join(parameters_of(cls))}; jointlaw fit --flow writes one"
            )
        return cls.from_table(tables[APERTURE_TABLE], str(path))

    @classmethod
    def from_table(cls, table: Mapping[str, Any], where: str) -> Self:
        """The aperture in a table [aperture]; `where` names the file in errors.

        Raises ValueError naming file and key.
        """
        values = validate_table(table, keys_of(cls), where, APERTURE_TABLE)
        try:
            return cls(**values)
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from None
