"""Stress that is given in the ground: of water in joints, and of the rock before an excavation."""

from dataclasses import dataclass, replace

import numpy as np

from .blocks import EXACT, Block
from .keys import Tables

UNIT_WEIGHT = 9810.0  # N/m3, of water
SIDES = {"left": (0, -1.0), "right": (0, 1.0), "bottom": (1, -1.0), "top": (1, 1.0)}


@dataclass(frozen=True, eq=False)
class Stress:
    """A tensor times a number that grows with the depth below a line, at least 0; their product is
    in Pa.

    tensor (2, 2), compression positive; line (m, 2): [x, y] (m) of the line, level beyond its ends;
    weight: growth of the number per m of depth; top: the number on the line; edges (c,): those of
    all blocks, one after the other, that the stress acts on from outside.
    """

    tensor: np.ndarray
    line: np.ndarray
    weight: float
    top: float
    edges: np.ndarray

    def signed(self, at: np.ndarray) -> np.ndarray:
        """The number at places x + iy (m), below zero where it counts as zero."""
        return self.top + self.weight * (np.interp(at.real, *self.line.T) - at.imag)

    def on(self, normal: np.ndarray) -> np.ndarray:
        """The tensor times vectors x + iy."""
        x, y = [1, 1j] @ self.tensor
        return x * normal.real + y * normal.imag


def read_stresses(
    top: Tables, blocks: list[Block], density: float, gravity: tuple[float, float], where: str
) -> tuple[Stress | None, Stress | None]:
    """The stresses of the tables `[water]` and `[in_situ]` of a scene.

    Blocks on its sides are fixed or held as `[in_situ]` says. On a side that the stress loads there
    is no water, which is part of the stress. Raises ValueError.
    """
    water, given = top.get("water"), top.get("in_situ", {})
    stress = np.ravel(given.get("stress", ()))
    if "in_situ" in top and ("k0" in given, len(stress)) not in ((True, 0), (False, 3)):
        raise ValueError(f"{where}: in_situ: give either k0 or stress = [sxx, syy, sxy]")
    if (water or "k0" in given) and (gravity[0] or gravity[1] > 0):
        raise ValueError(f"{where}: gravity = {list(gravity)} must point down, [0, -9.81], for a "
                         "water table and for k0")  # fmt: skip
    corners = np.concatenate([block.corners for block in blocks])
    loaded = _sides(given, blocks, corners)
    if water:
        weight = water.get("unit_weight", UNIT_WEIGHT)
        water = Stress(np.eye(2), water["table"], weight, 0.0, ~loaded)
    if not given:
        return water, None
    uniform, line = len(stress) > 0, given.get("surface", [[0.0, corners[:, 1].max()]])
    x, y, shear = stress if uniform else (given["k0"], 1.0, 0.0)
    weight, tensor = -density * gravity[1] * (not uniform), np.array([[x, shear], [shear, y]])
    return water, Stress(tensor, np.array(line), weight, float(uniform), loaded)


def _sides(given: Tables, blocks: list[Block], corners: np.ndarray) -> np.ndarray:
    """Hold the blocks on the sides of a scene as `[in_situ]` says; which edges (c,) are loaded."""
    number = np.repeat(np.arange(len(blocks)), [len(block.corners) for block in blocks])
    ends = np.concatenate([np.roll(block.corners, -1, axis=0) for block in blocks])
    loaded = np.zeros(len(corners), bool)
    for side, (axis, way) in SIDES.items():
        reach, kind = way * np.stack([corners, ends])[..., axis], given.get(side)
        on = (reach > reach.max() - EXACT * np.ptp(corners)).all(axis=0)
        loaded |= on & (kind == "loaded")
        for i in np.unique(number[on & (kind in ("held", "rollers"))]).tolist():
            fixed, held = blocks[i].fixed or kind == "held", {*blocks[i].held, "xy"[axis], "turn"}
            blocks[i] = replace(blocks[i], fixed=fixed, held=() if fixed else tuple(sorted(held)))
    return loaded
