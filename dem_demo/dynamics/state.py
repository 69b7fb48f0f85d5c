"""What stays the same during a run, the `System`, and what changes, its `State`.

A step makes a new state and leaves the old one alone.

Two things that change are not in here, because others own them: what pymunk holds (`World`), and
the batches of joints (`Joints`).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..contact import Assembly, Contacts, Identity, Joints, LawPoints, Points, Tracker
from ..scene import Drives, Scene
from .energy import Ledger
from .timestep import StepLimit

CORNER = 0.1  # contact length of a corner as a share of the least block width, by default
SKIN = 0.02  # of the least block width, by default


class System:
    """A scene made ready. Arrays (n, 3) run over blocks and motions x, y, turn.

    inertia: mass, mass, moment; mobile: motions of blocks that are not fixed; free: those that
    forces move; gravity, loads, steady (their sum): forces in N.
    """

    def __init__(self, scene: Scene) -> None:
        run, blocks = scene.run, scene.blocks
        self.scene = scene
        width = min(b.width for b in blocks)
        self.skin = run.skin or SKIN * width
        self.tracker = Tracker(
            blocks, self.skin, run.point_spacing, run.max_overlap,
            run.corner_length or CORNER * width, scene.law_of,
        )  # fmt: skip
        self.drives = Drives(scene.drives)
        mass = np.array([b.density * b.area * scene.thickness for b in blocks])
        moment = np.array([b.density * b.polar * scene.thickness for b in blocks])
        self.inertia = np.stack([mass, mass, moment], axis=1)
        self.mobile = np.array([[not b.fixed] * 3 for b in blocks])
        self.free = self.mobile.copy()
        self.free[self.drives.rows, self.drives.axes] = False
        self.reach = np.array([b.reach for b in blocks])
        self.gravity = self.mobile * self.inertia * [*scene.gravity, 0.0]
        self.loads = np.array([[*b.load, 0.0] for b in blocks]) * self.mobile
        self.steady = self.gravity + self.loads
        self.damped = bool(run.dashpot_normal or run.dashpot_shear)
        self.limit = StepLimit(self.inertia, self.free)
        self.lightness = self.free[:, :2].any(axis=1) / mass  # 1/kg, of blocks that can give way


@dataclass(frozen=True, eq=False)
class Layout:
    """What follows from the list of law points alone, while it stays the same.

    identities: of the law points; mass (k,): reduced mass of the two blocks, times the share of
    their joint that the point carries (kg).
    """

    identities: list[Identity]
    assembly: Assembly
    mass: np.ndarray

    @classmethod
    def of(cls, system: System, law_points: LawPoints) -> "Layout":
        """The layout of law points."""
        c = law_points.contacts
        light = system.lightness[c.a] + system.lightness[c.b]
        mass = c.weight / np.where(light > 0, light, np.inf)
        assembly = Assembly(c.a, c.b, len(system.scene.blocks))
        return cls(law_points.identities, assembly, mass)


class Moment(NamedTuple):
    """Law points and their tractions (k, 2) in Pa at a motion (6, blocks): what forces need."""

    layout: Layout
    contacts: Contacts
    motion: np.ndarray
    points: Points
    traction: np.ndarray


@dataclass(frozen=True, eq=False)
class Limit:
    """Largest stable step (s): when last looked at, and the least so far.

    checked (k,): stiffness times area (N/m) of the law points up to which the time step is good.
    """

    now: float
    least: float
    checked: np.ndarray


@dataclass(frozen=True, eq=False)
class State:
    """A moment of a run.

    Time is t0 + n dt (s). motion (6, blocks): positions, angles, velocities, spins; velocities are
    those that led to the positions. traction (k, 2) of the law points in Pa.
    reversed_at: when each drive was sent back (s).
    """

    t0: float
    n: int
    dt: float
    motion: np.ndarray
    law_points: LawPoints
    points: Points
    layout: Layout
    traction: np.ndarray
    reversed_at: np.ndarray
    ledger: Ledger
    limit: Limit

    @property
    def time(self) -> float:
        """Model time (s)."""
        return self.t0 + self.n * self.dt

    @property
    def area(self) -> np.ndarray:
        """Area of joint (k,) that each law point stands for (m2)."""
        return self.ledger.area

    def between(self, one: int, other: int) -> np.ndarray:
        """Mask (k,) of the law points between two blocks."""
        a, b = self.law_points.contacts.a, self.law_points.contacts.b
        return ((a == one) & (b == other)) | ((a == other) & (b == one))

    def slid(self, joints: Joints, moving: int, base: int) -> float:
        """Shear displacement (m) of the joints between two blocks, mean over their area."""
        here = self.between(moving, base)
        area = self.area[here]
        if not area.any():
            return 0.0
        return abs(float(joints.read("delta")[here, 1] @ area / area.sum()))
