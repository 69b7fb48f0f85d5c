"""A scene in memory: blocks, laws, drives, stress in the ground, and settings of a run."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

import jointlaw as jl

from .blocks import Block, median_width
from .drives import Drive
from .keys import Tables
from .laws import Files
from .supports import Bolt, FacePressure

SKIN_PER_MEDIAN_WIDTH = 0.02  # of the blocks that move
MAX_SKIN_PER_WIDTH = 0.1  # of a block's own width


class SceneError(RuntimeError):
    """A state that the method cannot continue from, such as a block that moves too far in a step.

    The last valid state is saved, so that the run can be resumed with a smaller time step.
    """


@dataclass(frozen=True)
class Run:
    """Settings of a run; times in s, lengths in m."""

    end: float
    corner_length: float  # of the joint at a corner that lies on an edge; 0 in space
    soft: float  # over which a contact passes from the end of one edge to the next; 0 in space
    skin: float | None = None  # range of contact detection; None: `Scene.skins` has a default
    fraction: float | None = None  # time step over the stability limit; None: chosen by the scene
    step: float | None = None  # or the time step itself
    settle: bool = True  # start in static equilibrium
    record: float = 0.05  # time between records
    dashpot_normal: float = 0.05  # fractions of critical damping
    dashpot_shear: float = 0.05
    law_steps: int = 1  # steps of the law per time step; 2 for impacts
    max_overlap: float = 0.1  # fraction of the smaller block's width


@dataclass(frozen=True, eq=False)
class Stress:
    """A given stress: of the water in joints, or of the rock before an excavation.

    The stress is a tensor times a scalar profile that grows linearly with the depth below a line.
    The profile counts as zero where it is negative.

    tensor (2, 2): compression positive. line (m, 2): points [x, y] (m), level beyond its ends.
    weight: growth of the profile per m of depth. top: profile on the line. Tensor times profile is
    in Pa. edges (c,): whether the stress loads each edge of all blocks from outside.
    """

    tensor: np.ndarray
    line: np.ndarray
    weight: float
    top: float
    edges: np.ndarray

    def signed(self, at: np.ndarray) -> np.ndarray:
        """Return the profile at points x + iy (m), negative values included."""
        return self.top + self.weight * (np.interp(at.real, *self.line.T) - at.imag)

    def on(self, normal: np.ndarray) -> np.ndarray:
        """Return the tensor times vectors x + iy."""
        x, y = [1, 1j] @ self.tensor
        return x * normal.real + y * normal.imag


@dataclass(frozen=True, eq=False)
class Rock:
    """A rock mass of a scene, cut into blocks.

    blocks: their numbers in the scene; free: numbers of the blocks that can move; messages: what
    was done with slivers and at inward corners, one line each.
    """

    name: str
    blocks: range
    free: list[int]
    messages: list[str]


@dataclass(frozen=True, eq=False)
class Scene:
    """All input of a simulation.

    default_law: name of the law of joints that nothing else names. pairs: laws of `[[joint]]`
    tables, by one or two blocks. edge_laws: law of each (block, edge) that lies on a joint of a
    rock mass.

    gravity: acceleration (m/s2). seismic: pseudo-static forces along x and y, as shares of the
    weight of every block; they load blocks only, water and in-situ stress follow from `gravity`.

    water: pore pressure in joints and on faces, at time 0; water_changes: later water tables, each
    a time (s) and a line (m, 2) as in `Stress`; in_situ: stress before an excavation; pressure:
    water pressure (Pa) in the joints of a law, by its name. stages: excavation stages, each with
    its `blocks`, its `start` (s; None: once the rock is at rest) and its `release_time` (s).
    removed: blocks that are absent from the beginning. bolts, face_pressures: rock bolts, and
    pressures on faces of blocks.

    slip, shear: monitored joints, as (moving block, base); point_joints: monitored joints nearest
    to given points, as two blocks; points: history points, as (block, position in m);
    convergences: pairs of such points. reduction:
    strength reduction factor of all joints (see `Joints`).

    text: of the file that the scene was read from, empty for a scene made or changed in memory;
    files: contents of the files that it names.
    """

    title: str
    blocks: tuple[Block, ...]
    laws: dict[str, jl.Law]
    run: Run
    default_law: str
    pairs: dict[frozenset, str] = field(default_factory=dict)
    rocks: tuple[Rock, ...] = ()
    edge_laws: dict[tuple[int, int], str] = field(default_factory=dict)
    drives: tuple[Drive, ...] = ()
    gravity: tuple[float, float] = (0.0, -9.81)
    seismic: tuple[float, float] = (0.0, 0.0)
    thickness: float = 1.0
    water: Stress | None = None
    in_situ: Stress | None = None
    pressure: dict[str, float] = field(default_factory=dict)
    stages: tuple[Tables, ...] = ()
    removed: tuple[int, ...] = ()
    water_changes: tuple[tuple[float, np.ndarray], ...] = ()
    bolts: tuple[Bolt, ...] = ()
    face_pressures: tuple[FacePressure, ...] = ()
    slip: tuple[tuple[int, int], ...] = ()
    shear: tuple[tuple[int, int], ...] = ()
    point_joints: tuple[tuple[int, int], ...] = ()
    points: tuple[tuple[int, tuple[float, float]], ...] = ()
    convergences: tuple[tuple[tuple[int, tuple[float, float]], ...], ...] = ()
    reduction: float = 1.0
    text: str = field(default="", init=False)  # `replace` leaves both out
    files: Files = field(default_factory=Files, init=False)

    @cached_property
    def skins(self) -> np.ndarray:
        """Range (m) of contact detection of each block, smaller for slivers."""
        widths = np.array([block.width for block in self.blocks])
        skin = np.minimum(
            SKIN_PER_MEDIAN_WIDTH * median_width(self.blocks), MAX_SKIN_PER_WIDTH * widths
        )
        return skin if self.run.skin is None else np.full(len(widths), self.run.skin)

    @property
    def acceleration(self) -> np.ndarray:
        """Gravity and pseudo-static acceleration (2,) in m/s2 that load the blocks."""
        return np.array(self.gravity) + np.hypot(*self.gravity) * np.array(self.seismic)

    @property
    def wet(self) -> bool:
        """Whether there is water, so that stresses of joints are effective stresses."""
        return self.water is not None or any(self.pressure.values())

    @property
    def excavated(self) -> "Scene":
        """The scene after all excavation stages, under the same in-situ stress, with its last water
        table."""
        blocks = [i for stage in self.stages for i in stage["blocks"]]
        scene = self.with_water_at(np.inf)
        return replace(scene, stages=(), removed=(*self.removed, *blocks)) if blocks else scene

    def with_water_at(self, time: float) -> "Scene":
        """The scene with its water table at a time (s) as the only one."""
        if not self.water_changes:
            return self
        return replace(self, water=self.water_at(time), water_changes=())

    def water_at(self, time: float) -> Stress | None:
        """The pore pressure at a time (s); the water table changes linearly between its times."""
        if self.water is None or not self.water_changes or time <= 0.0:
            return self.water
        times = [0.0, *(time for time, _ in self.water_changes)]
        lines = [self.water.line, *(line for _, line in self.water_changes)]
        if time >= times[-1]:
            return replace(self.water, line=lines[-1])
        i = int(np.searchsorted(times, time, side="right"))
        before, after = lines[i - 1 : i + 1]
        share = (time - times[i - 1]) / (times[i] - times[i - 1])
        x = np.union1d(before[:, 0], after[:, 0])
        y = (1.0 - share) * np.interp(x, *before.T) + share * np.interp(x, *after.T)
        return replace(self.water, line=np.stack([x, y], axis=1))

    @property
    def base(self) -> int | None:
        """The fixed block that displacements are relative to, None without fixed blocks.

        In a shaken scene it is a block that moves with all fixed rock, not by a drive of its own.
        """
        return base_of(self.blocks, self.drives, {*self.excavated.removed})


def base_of(blocks: Sequence[Any], drives: Sequence[Drive], removed: set[int]) -> int | None:
    """Number of the fixed block that displacements are relative to, see `Scene.base`.

    removed: numbers of blocks that are absent at the end.
    """
    fixed = [i for i, block in enumerate(blocks) if block.fixed and i not in removed]
    own_drive = {
        drive.blocks[0]
        for drive in drives
        if len(drive.times) > 1 and len(drive.blocks) < len(fixed)
    }
    return min(fixed, key=lambda i: i in own_drive, default=None)
