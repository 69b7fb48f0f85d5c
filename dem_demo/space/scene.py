"""A scene in space in memory: blocks, laws, and which law and rough direction each joint has."""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

import jointlaw as jl

from ..scene import Bolt, Drive, Files, Run, Tables
from ..scene.read import CORNER_LENGTH_PER_WIDTH, SLIVER_PER_WIDTH
from ..scene.scene import MAX_SKIN_PER_WIDTH, SKIN_PER_MEDIAN_WIDTH, base_of
from .loads import SpaceStress
from .solids import Solid

MAX_OVERLAP = 0.1  # of the width of the narrower block: deepest contact


@dataclass(frozen=True, eq=False)
class SpaceBlock:
    """A rigid convex block, as drawn.

    density in kg/m3; load (3,) in N at the centroid. prescribed: motions ("x", "y", "z", "turn",
    which is any rotation) that are fixed or follow a drive; of a fixed block none, or all.
    face_laws: name of the law of each face on a joint of a rock, None for other faces; face_axes
    (faces, 3): direction of the law's axis 2 on these faces. velocity (3,) in m/s and spin (3,) in
    rad/s, about x, y and z.
    """

    name: str
    solid: Solid
    density: float
    fixed: bool = False
    load: np.ndarray = field(default_factory=lambda: np.zeros(3))
    prescribed: tuple[str, ...] = ()
    face_laws: tuple[str | None, ...] = ()
    face_axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    velocity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    spin: np.ndarray = field(default_factory=lambda: np.zeros(3))

    @property
    def moves(self) -> bool:
        """Whether the block moves: freely, or as fixed rock that a drive moves."""
        return not self.fixed or bool(self.prescribed)

    @property
    def centroid(self) -> np.ndarray:
        """Centre of gravity (3,) in m."""
        return self.solid.centroid

    @property
    def free_motions(self) -> np.ndarray:
        """Mask (6,) of the motions that forces move: along x, y, z, and the three rotations."""
        names = ("x", "y", "z", "turn", "turn", "turn")
        return np.array([not self.fixed and name not in self.prescribed for name in names])

    @property
    def mass(self) -> float:
        """Mass (kg)."""
        return self.density * self.solid.volume


@dataclass(frozen=True, eq=False)
class SpaceRock:
    """A rock mass of a scene, cut into blocks.

    blocks: their numbers in the scene; free: numbers of the blocks that can move; messages: what
    was done with slivers, one line each. intact_pairs: pairs of blocks that only a cut at an
    excavation separates, which is no joint.
    """

    name: str
    blocks: range
    free: list[int]
    messages: list[str]
    intact_pairs: list[frozenset] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class SpaceScene:
    """All input of the statics and the motion of blocks in space; z is up.

    default_law: name of the law of joints that nothing else names. rough: angle (degrees) of the
    law's axis 2 from the dip line on joints in no set (see `contacts.turned_from_dip`). pairs: law
    and angle of `[[joint]]` tables, by the numbers of two blocks.

    gravity (3,): acceleration (m/s2). seismic (3,): pseudo-static forces, as shares of the weight
    of every block; they load blocks only, water and in-situ stress follow from `gravity`.

    water: pore pressure in joints and on faces, at time 0; water_changes: later levels of the water
    table, each a time (s) and a level (3,) as in `SpaceStress`; in_situ: stress before an
    excavation; pressure: water pressure (Pa) in the joints of a law, by its name. stages:
    excavation stages, each with its `blocks`, its `start` (s; None: once the rock is at rest) and
    its `release_time` (s). removed: blocks that are absent from the beginning.

    skin: range (m) of contact detection, None for the default. corner_length: width (m) of the
    joint along an edge that a block stands on, None for the default. max_overlap: deepest
    contact, as a fraction of the width of the narrower block. reduction: strength reduction factor
    of all joints. run: settings of a run, None for a scene whose blocks do not move. drives:
    prescribed motions. points: history points, as (block, position in m).

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
    water: SpaceStress | None = None
    in_situ: SpaceStress | None = None
    pressure: dict[str, float] = field(default_factory=dict)
    stages: tuple[Tables, ...] = ()
    removed: tuple[int, ...] = ()
    water_changes: tuple[tuple[float, np.ndarray], ...] = ()
    skin: float | None = None
    corner_length: float | None = None
    max_overlap: float = MAX_OVERLAP
    reduction: float = 1.0
    run: Run | None = None
    drives: tuple[Drive, ...] = ()
    points: tuple[tuple[int, tuple[float, float, float]], ...] = ()
    text: str = field(default="", init=False)  # `replace` leaves both out
    files: Files = field(default_factory=Files, init=False)

    # Of a scene in the plane only, as the simulation reads them
    bolts: ClassVar[tuple[Bolt, ...]] = ()
    slip: ClassVar[tuple[tuple[int, int], ...]] = ()
    shear: ClassVar[tuple[tuple[int, int], ...]] = ()

    @cached_property
    def skins(self) -> np.ndarray:
        """Range (m) of contact detection of each block, smaller for slivers."""
        widths = np.array([block.solid.width for block in self.blocks])
        if self.skin is not None:
            return np.full(len(widths), self.skin)
        median = np.median([block.solid.width for block in self.blocks if not block.fixed])
        return np.minimum(SKIN_PER_MEDIAN_WIDTH * median, MAX_SKIN_PER_WIDTH * widths)

    @property
    def base(self) -> int | None:
        """The fixed block that displacements are relative to, None without fixed blocks.

        In a shaken scene it is a block that moves with all fixed rock, not by a drive of its own.
        """
        return base_of(self.blocks, self.drives, {*self.removed})

    @property
    def strip_width(self) -> float:
        """Width (m) of the joint along an edge that a block stands on.

        By default a tenth of the narrowest block, or of 0.7 of the median width of the blocks that
        are not fixed, if that is more.
        """
        if self.corner_length is not None:
            return self.corner_length
        widths = [block.solid.width for block in self.blocks]
        median = np.median([block.solid.width for block in self.blocks if not block.fixed])
        return CORNER_LENGTH_PER_WIDTH * max(min(widths), SLIVER_PER_WIDTH * float(median))

    @property
    def acceleration(self) -> np.ndarray:
        """Gravity and pseudo-static acceleration (3,) in m/s2."""
        return self.gravity + np.linalg.norm(self.gravity) * self.seismic

    @property
    def wet(self) -> bool:
        """Whether there is water, so that stresses of joints are effective stresses."""
        return self.water is not None or any(self.pressure.values())

    @property
    def is_removed(self) -> np.ndarray:
        """Mask (n,) of the blocks that are absent from the beginning."""
        mask = np.zeros(len(self.blocks), bool)
        mask[list(self.removed)] = True
        return mask

    @property
    def excavated(self) -> "SpaceScene":
        """The scene after all excavation stages, under the same in-situ stress, with its last water
        table."""
        return self.after_stages(len(self.stages)).with_water_at(np.inf)

    def after_stages(self, count: int) -> "SpaceScene":
        """The scene without the blocks of its first `count` excavation stages, and without later
        stages."""
        if not self.stages:
            return self
        blocks = [i for stage in self.stages[:count] for i in stage["blocks"]]
        return replace(self, stages=(), removed=(*self.removed, *blocks))

    def with_water_at(self, time: float) -> "SpaceScene":
        """The scene with its water table at a time (s) as the only one."""
        if not self.water_changes:
            return self
        return replace(self, water=self.water_at(time), water_changes=())

    def water_at(self, time: float) -> SpaceStress | None:
        """The pore pressure at a time (s); the water table changes linearly between its times."""
        if self.water is None or not self.water_changes or time <= 0.0:
            return self.water
        times = [0.0, *(time for time, _ in self.water_changes)]
        levels = np.array([self.water.level, *(level for _, level in self.water_changes)])
        return replace(
            self.water, level=np.array([np.interp(time, times, part) for part in levels.T])
        )

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
