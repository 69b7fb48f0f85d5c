"""Stress that is given in the ground: of water in the joints."""

from dataclasses import dataclass, field

import numpy as np

from jointlaw.support.checks import at_least, number, one_of

from .keys import Tables

UNIT_WEIGHT = 9810.0  # N/m3, of water


@dataclass(frozen=True, eq=False)
class Stress:
    """A stress, compression positive: weight times the depth below a line times a tensor.

    tensor (2, 2); line (m, 2): [x, y] (m) of the line, level beyond its ends; weight: Pa per m of
    depth. Above the line, and where there is none, the stress is zero.
    """

    tensor: np.ndarray
    line: np.ndarray
    weight: float

    def depth(self, at: np.ndarray) -> np.ndarray:
        """Depth (m) below the line of places x + iy (m); negative above it."""
        return np.interp(at.real, *self.line.T) - at.imag

    def size(self, at: np.ndarray) -> np.ndarray:
        """What the tensor is multiplied by (Pa) at places x + iy (m)."""
        return self.weight * np.maximum(self.depth(at), 0.0)

    def on(self, normal: np.ndarray) -> np.ndarray:
        """The tensor times vectors x + iy."""
        x, y = [1, 1j] @ self.tensor
        return x * normal.real + y * normal.imag


@dataclass(frozen=True, eq=False)
class Water:
    """Water in the ground: its stress below the table; pressure (Pa) given for the joints of laws,
    by their names."""

    table: Stress | None = None
    pressure: dict[str, float] = field(default_factory=dict)


def read_water(table: Tables, gravity: tuple[float, float], laws: Tables, where: str) -> Water:
    """The water of a `[water]` table. Raises ValueError."""
    pressure = table.get("pressure", {})
    for name, value in pressure.items():
        one_of(f"{where}.pressure", name, tuple(laws))
        at_least(f"{where}.pressure.{name}", number(f"{where}.pressure.{name}", value), 0)
    if "table" not in table:
        return Water(None, pressure)
    if gravity[0] or gravity[1] > 0:
        raise ValueError(f"{where}.table: gravity = {list(gravity)} must point down, [0, -9.81]")
    weight = table.get("unit_weight", UNIT_WEIGHT)
    return Water(Stress(np.eye(2), table["table"], weight), pressure)
