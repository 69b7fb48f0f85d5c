"""Stress that is given in the ground: of water in joints, and of the rock before an excavation."""

from dataclasses import dataclass, field, replace

import numpy as np

from jointlaw.support.checks import at_least, number, one_of

from .blocks import Block, next_of
from .keys import Tables

UNIT_WEIGHT = 9810.0  # N/m3, of water
SIDES = {"left": (0, -1.0), "right": (0, 1.0), "bottom": (1, -1.0), "top": (1, 1.0)}
EXACT = 1e-7  # share of the size of a scene below which a distance from its side is zero
ROLLERS = ("x", "turn"), ("y", "turn")  # what they hold on a side across x, and across y


@dataclass(frozen=True, eq=False)
class Stress:
    """A tensor times a number that grows with the depth below a line, at least 0.

    tensor (2, 2), compression positive; line (m, 2): [x, y] (m) of the line, level beyond its ends;
    weight: growth of the number per m of depth; top: the number on the line. The product is in Pa.
    """

    tensor: np.ndarray
    line: np.ndarray
    weight: float
    top: float = 0.0

    def signed(self, at: np.ndarray) -> np.ndarray:
        """The number at places x + iy (m), below zero where it counts as zero."""
        return self.top + self.weight * (np.interp(at.real, *self.line.T) - at.imag)

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


@dataclass(frozen=True, eq=False)
class InSitu:
    """Stress before an excavation, water included; loaded (c,): the edges of all blocks, one after
    the other, that it acts on from outside."""

    stress: Stress
    loaded: np.ndarray


def read_water(table: Tables, gravity: tuple[float, float], laws: Tables, where: str) -> Water:
    """The water of a `[water]` table. Raises ValueError."""
    pressure = table.get("pressure", {})
    for name, value in pressure.items():
        one_of(f"{where}.pressure", name, tuple(laws))
        at_least(f"{where}.pressure.{name}", number(f"{where}.pressure.{name}", value), 0)
    if "table" not in table:
        return Water(None, pressure)
    _require_down(f"{where}.table", gravity)
    weight = table.get("unit_weight", UNIT_WEIGHT)
    return Water(Stress(np.eye(2), table["table"], weight), pressure)


def read_in_situ(
    table: Tables, blocks: list[Block], density: float, gravity: tuple[float, float], where: str
) -> InSitu:
    """The stress of an `[in_situ]` table; blocks on the sides of the scene that it holds are fixed
    or held. Raises ValueError."""
    if ("k0" in table) == ("stress" in table):
        raise ValueError(f"{where}: give k0 or stress, one of them")
    corners = np.concatenate([block.corners for block in blocks])
    number = np.repeat(np.arange(len(blocks)), [len(block.corners) for block in blocks])
    ends = np.concatenate([next_of(block.corners) for block in blocks])
    loaded = np.zeros(len(corners), bool)
    for side, (axis, way) in SIDES.items():
        reach = way * np.stack([corners, ends])[..., axis]
        on = (reach > reach.max() - EXACT * np.ptp(corners)).all(axis=0)
        loaded |= on & (table.get(side) == "loaded")
        for i in np.unique(number[on]).tolist():
            if table.get(side) == "held":
                blocks[i] = replace(blocks[i], fixed=True)
            elif table.get(side) == "rollers" and not blocks[i].fixed:
                held = {*blocks[i].held, *ROLLERS[axis]}
                blocks[i] = replace(blocks[i], held=tuple(sorted(held)))
    if "stress" in table:
        x, y, shear = table["stress"]
        whole = Stress(np.array([[x, shear], [shear, y]]), np.zeros((1, 2)), 0.0, 1.0)
        return InSitu(whole, loaded)
    _require_down(f"{where}.k0", gravity)
    surface = table.get("surface", [[0.0, corners[:, 1].max()]])
    weight = -density * gravity[1]
    return InSitu(Stress(np.diag([table["k0"], 1.0]), np.array(surface), weight), loaded)


def _require_down(name: str, gravity: tuple[float, float]) -> None:
    if gravity[0] or gravity[1] > 0:
        raise ValueError(f"{name}: gravity = {list(gravity)} must point down, [0, -9.81]")
