"""Loads on blocks in space: water on faces and in joints, stress from outside, constant forces.

A stress is a tensor times a profile that grows linearly with the depth below a level, a plane in
space, and that is zero above it. Along a face the profile is linear below the level, so force and
moment of each triangle of a face are exact, also where the level crosses it.

As in the plane, water acts on all faces of all blocks, whether they lie in a joint or not, and the
joints carry the rest, the effective stress.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..contact import ContactRows

if TYPE_CHECKING:
    from .contacts import Surfaces
    from .scene import SpaceScene

FLOATING_SHARE = 1e-6  # of the weight: a smaller rest of buoyancy is rounding


@dataclass(frozen=True, eq=False)
class SpaceStress:
    """A given stress: of the water in joints, or of the rock before an excavation.

    tensor (3, 3): compression positive. level (3,): the level is at z = level . (1, x, y), in m.
    weight: growth of the profile per m of depth. top: profile on the level. Tensor times profile is
    in Pa. faces (f,): whether the stress loads each face of all blocks from outside.
    """

    tensor: np.ndarray
    level: np.ndarray
    weight: float
    top: float
    faces: np.ndarray

    def signed(self, at: np.ndarray) -> np.ndarray:
        """Return the profile (...,) at points (..., 3) in m, negative values included."""
        height = self.level[0] + at[..., :2] @ self.level[1:]
        return self.top + self.weight * (height - at[..., 2])


def _positive_part(value: np.ndarray, corner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Integrals of max(u, 0) and of max(u, 0) x over triangles, divided by their areas.

    u varies linearly between values (t, 3) at corners (t, 3, 3) in m. Returns (t,) and (t, 3).

    Where the signs of u differ, one corner is alone on its side of the line u = 0, which cuts the
    triangle at that corner. Over the other part, u is the difference of the whole triangle and of
    this one.
    """
    is_positive = value > 0
    count = is_positive.sum(axis=1)
    mean = value.mean(axis=1)
    moment = (3 * mean[:, None] * corner.sum(axis=1) + np.einsum("tc,tci->ti", value, corner)) / 12
    mean, moment = mean * (count > 1), moment * (count > 1)[:, None]
    mixed = np.flatnonzero((count == 1) | (count == 2))
    lone = np.where(count == 1, is_positive.argmax(axis=1), is_positive.argmin(axis=1))[mixed]
    order = (lone[:, None] + np.arange(3)) % 3
    u = np.take_along_axis(value[mixed], order, axis=1)
    x = np.take_along_axis(corner[mixed], order[:, :, None], axis=1)
    part = u[:, :1] / (u[:, :1] - u[:, 1:])  # of both sides from the lone corner to u = 0
    share = part.prod(axis=1) * np.abs(u[:, 0])
    crossings = x[:, :1] + part[:, :, None] * (x[:, 1:] - x[:, :1])
    mean[mixed] += share / 3
    moment[mixed] += share[:, None] * (2 * x[:, 0] + crossings.sum(axis=1)) / 12
    return mean, moment


def stress_on_faces(stress: SpaceStress, surfaces: "Surfaces") -> np.ndarray:
    """Forces and moments (n, 6) of a stress on the faces of blocks at their present places.

    In N along x, y, z and N m about the principal axes.
    """
    triangles, face = surfaces.triangles
    block = surfaces.block_of_face[face]
    center = surfaces.position[block]
    corner = surfaces.vertex[triangles]
    value, moment = _positive_part(stress.signed(corner), corner - center[:, None])
    side = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    push = -0.5 * side @ stress.tensor * stress.faces[face, None]
    parts = np.concatenate([push * value[:, None], np.cross(moment, push)], axis=1)
    n = len(surfaces.position)
    total = np.stack([np.bincount(block, part, n) for part in parts.T], axis=1)
    total[:, 3:] = np.einsum("ni,nij->nj", total[:, 3:], surfaces.rotation)
    return total


def water_in_joints(
    pressure: Mapping[str, float], law: np.ndarray, names: list[str], rows: ContactRows, n: int
) -> np.ndarray:
    """Forces and moments (n, 6) of the water pressures (Pa) in the joints of laws, by their names.

    law (k,): number of the law of each contact point among `names`.
    """
    value = np.array([pressure.get(name, 0.0) for name in names])[law]
    push = np.zeros((len(law), 3))
    push[:, 0] = value * rows.area
    return rows.assemble_forces(n, push)


def applied_loads(
    scene: "SpaceScene",
    surfaces: "Surfaces",
    rows: ContactRows,
    law: np.ndarray,
    time: float = 0.0,
) -> np.ndarray:
    """Forces and moments (n, 6) on the blocks at their present places, without gravity.

    In N along x, y, z and N m about the principal axes: loads of blocks, water at a time (s),
    in-situ stress from outside, and water pressures in joints. rows, law (k,): contact points and
    the numbers of their laws. Fixed blocks have loads too, which move nothing.
    """
    n = len(scene.blocks)
    loads = np.zeros((n, 6))
    loads[:, :3] = [block.load for block in scene.blocks]
    for stress in (scene.water_at(time), scene.in_situ):
        if stress is not None:
            loads += stress_on_faces(stress, surfaces)
    if any(scene.pressure.values()):
        loads += water_in_joints(scene.pressure, law, [*scene.laws], rows, n)
    return loads


def floating_blocks(scene: "SpaceScene", surfaces: "Surfaces", mass: np.ndarray) -> np.ndarray:
    """Mask (n,) of free blocks that the water table lifts with more than their weight and load.

    mass (n,) in kg.
    """
    if scene.water is None:
        return np.zeros(len(mass), bool)
    lift = stress_on_faces(scene.water, surfaces)[:, 2]
    weight = mass * scene.gravity[2] + np.array([block.load[2] for block in scene.blocks])
    can_float = np.array([not block.fixed for block in scene.blocks]) & ~scene.is_removed
    return can_float & (lift + weight > FLOATING_SHARE * np.abs(weight))
