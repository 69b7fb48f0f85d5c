"""A scene in space in memory: blocks, laws, and which law and rough direction each joint has."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

import jointlaw as jl

from ..scene import Files
from ..scene.scene import MAX_SKIN_PER_WIDTH, SKIN_PER_MEDIAN_WIDTH
from .solids import Solid

MAX_OVERLAP = 0.1  # of the width of the narrower block: deepest contact


@dataclass(frozen=True, eq=False)
class SpaceBlock:
    """A rigid convex block, as drawn.

    density in kg/m3; load (3,) in N at the centroid. face_laws: name of the law of each face on a
    joint of a rock, None for other faces; face_axes (faces, 3): direction of the law's axis 2 on
    these faces.
    """

    name: str
    solid: Solid
    density: float
    fixed: bool = False
    load: np.ndarray = field(default_factory=lambda: np.zeros(3))
    face_laws: tuple[str | None, ...] = ()
    face_axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def centroid(self) -> np.ndarray:
        """Centre of gravity (3,) in m."""
        return self.solid.centroid

    @property
    def mass(self) -> float:
        """Mass (kg)."""
        return self.density * self.solid.volume


@dataclass(frozen=True, eq=False)
class SpaceRock:
    """A rock mass of a scene, cut into blocks.

    blocks: their numbers in the scene; free: numbers of the blocks that can move; messages: what
    was done with slivers, one line each.
    """

    name: str
    blocks: range
    free: list[int]
    messages: list[str]


@dataclass(frozen=True, eq=False)
class SpaceScene:
    """All input of the statics of blocks in space; z is up.

    default_law: name of the law of joints that nothing else names. rough: angle (degrees) of the
    law's axis 2 from the dip line on joints in no set (see `contacts.turned_from_dip`). pairs: law
    and angle of `[[joint]]` tables, by the numbers of two blocks.

    gravity (3,): acceleration (m/s2). seismic (3,): pseudo-static forces, as shares of the weight
    of every block. skin: range (m) of contact detection, None for the default. max_overlap: deepest
    contact, as a fraction of the width of the narrower block. reduction: strength reduction factor
    of all joints.

    text: of the file that the scene was read from; files: contents of the files that it names.
    """

    title: str
    blocks: tuple[SpaceBlock, ...]
    laws: dict[str, jl.Law]
    default_law: str
    rough: float = 0.0
    pairs: dict[frozenset, tuple[str, float]] = field(default_factory=dict)
    rocks: tuple[SpaceRock, ...] = ()
    gravity: np.ndarray = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    seismic: np.ndarray = field(default_factory=lambda: np.zeros(3))
    skin: float | None = None
    max_overlap: float = MAX_OVERLAP
    reduction: float = 1.0
    text: str = field(default="", init=False)  # `replace` leaves both out
    files: Files = field(default_factory=Files, init=False)

    @cached_property
    def skins(self) -> np.ndarray:
        """Range (m) of contact detection of each block, smaller for slivers."""
        widths = np.array([block.solid.width for block in self.blocks])
        if self.skin is not None:
            return np.full(len(widths), self.skin)
        median = np.median([block.solid.width for block in self.blocks if not block.fixed])
        return np.minimum(SKIN_PER_MEDIAN_WIDTH * median, MAX_SKIN_PER_WIDTH * widths)

    @property
    def acceleration(self) -> np.ndarray:
        """Gravity and pseudo-static acceleration (3,) in m/s2."""
        return self.gravity + np.linalg.norm(self.gravity) * self.seismic

    def weakened(self, factor: float) -> "SpaceScene":
        """The scene with the strength of all joints divided by a factor, their stiffness kept.

        As `studies.strength.weakened`.
        """
        laws = {name: law.strength_reduced(factor) for name, law in self.laws.items()}
        return replace(self, laws=laws, reduction=self.reduction * factor)


def is_anisotropic(law: jl.Law) -> bool:
    """Whether a law distinguishes directions in the plane of the joint."""
    orientation = getattr(law, "orientation", None)
    return bool(getattr(orientation, "c", 0.0))
