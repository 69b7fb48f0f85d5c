"""A scene in memory: blocks, laws, drives, stress in the ground, and how to run them."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from .blocks import Block, usual_width
from .drives import Drive
from .keys import Tables
from .laws import Files, Law

SKIN, THIN = 0.02, 0.1  # of the usual width of the blocks that move; at most of a block's own


class Refused(RuntimeError):
    """A state that the method cannot carry; the run leaves a snapshot that replays it."""


@dataclass(frozen=True)
class Run:
    """How to run a scene; times in s, lengths in m."""

    end: float
    corner_length: float  # of joint at a corner on an edge
    soft: float  # over which the end of one edge gives way to that of another
    skin: float | None = None  # reach of the search for contacts; `Scene.skins` without it
    fraction: float | None = None  # time step as a share of the limit; None: by what can happen
    step: float | None = None  # or the time step itself
    seat: bool = True  # start at the gravity closure
    record: float = 0.05  # time between records
    dashpot_normal: float = 0.05  # shares of critical
    dashpot_shear: float = 0.05
    law_steps: int = 1  # steps of the law per time step; 2 for impacts
    max_overlap: float = 0.1  # share of the smaller block's width


@dataclass(frozen=True, eq=False)
class Stress:
    """Stress that is given in the ground: of water in joints, or of the rock before an excavation.

    A tensor times a number that grows with the depth below a line, at least 0; their product is
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


@dataclass(frozen=True, eq=False)
class Rock:
    """A rock mass of a scene, cut into blocks.

    blocks: their numbers in the scene; free: those that can move; told: what became of slivers
    and at inward corners, for a person.
    """

    name: str
    blocks: range
    free: list[int]
    told: list[str]


@dataclass(frozen=True, eq=False)
class Scene:
    """Everything that a simulation needs.

    pairs: laws by the blocks of [[joint]] tables; edge_laws: of each (block, edge) that lies on a
    joint of a rock, the law of its set.

    water: stress of water in joints and on faces; in_situ: stress before an excavation; pressure:
    of water (Pa) in the joints of laws, by their names. stages: of an excavation, `blocks` that are
    taken away `at` a time (s), or None when the rock is at rest, and `over` what time (s) their
    support goes; gone: blocks that are not there from the start.

    slip, shear: joints to report on, as (moving block, base); near: those nearest to points, as two
    blocks; pins: points, as (block, place in m); reduction: what the shear strength of all joints
    is divided by (see `Joints`).

    text: of the file that it was read from, empty for a scene made or changed in memory; files:
    what that file names.
    """

    title: str
    blocks: tuple[Block, ...]
    laws: dict[str, Law]
    run: Run
    default_law: str
    pairs: dict[frozenset, str] = field(default_factory=dict)
    rocks: tuple[Rock, ...] = ()
    edge_laws: dict[tuple[int, int], str] = field(default_factory=dict)
    drives: tuple[Drive, ...] = ()
    gravity: tuple[float, float] = (0.0, -9.81)
    thickness: float = 1.0
    water: Stress | None = None
    in_situ: Stress | None = None
    pressure: dict[str, float] = field(default_factory=dict)
    stages: tuple[Tables, ...] = ()
    gone: tuple[int, ...] = ()
    slip: tuple[tuple[int, int], ...] = ()
    shear: tuple[tuple[int, int], ...] = ()
    near: tuple[tuple[int, int], ...] = ()
    pins: tuple[tuple[int, tuple[float, float]], ...] = ()
    reduction: float = 1.0
    text: str = field(default="", init=False)  # `replace` leaves both out
    files: Files = field(default_factory=Files, init=False)

    @cached_property
    def skins(self) -> np.ndarray:
        """Reach (m) of the search for contacts of each block: of a sliver less than of others."""
        widths = np.array([block.width for block in self.blocks])
        skin = np.minimum(SKIN * usual_width(self.blocks), THIN * widths)
        return skin if self.run.skin is None else np.full(len(widths), self.run.skin)

    @property
    def wet(self) -> bool:
        """Is there water, so that the stresses of joints are effective ones?"""
        return self.water is not None or any(self.pressure.values())

    @property
    def excavated(self) -> "Scene":
        """The scene without what its excavation takes away, but with the stress of before."""
        gone = [i for stage in self.stages for i in stage["blocks"]]
        return replace(self, stages=(), gone=(*self.gone, *gone)) if gone else self

    @property
    def base(self) -> int | None:
        """The fixed block that displacements are measured from: of a shaken scene, one that moves
        with all fixed rock and not by a drive of its own."""
        gone = {*self.excavated.gone}
        fixed = [i for i, block in enumerate(self.blocks) if block.fixed and i not in gone]
        own = {d.blocks[0] for d in self.drives if len(d.times) > 1 and len(d.blocks) < len(fixed)}
        return min(fixed, key=lambda i: i in own, default=None)
