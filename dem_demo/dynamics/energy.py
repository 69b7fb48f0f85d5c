"""The energy ledger: where every joule went, consistent with the leapfrog's half steps.

Velocities live between positions, so the kinetic energy at a position is half of mass times the
product of the velocities before and after it; its change over a step is then exactly the trapezoid
of forces times displacement, and that is how every other entry is summed.
"""

import numpy as np

from ..contact import Joints
from .blocks import Blocks

COLUMNS = ("kinetic", "potential", "stored", "friction", "dashpots", "dropped", "work", "turned")


class Ledger:
    """Energies in J: kinetic + potential + stored + friction + dashpots + dropped = start + work.

    value: by COLUMNS. friction: dissipated in the joints; dropped: stored in contacts that were
    given up while they still carried; work: done by drives and loads; turned: gravity's, the
    drives' and the loads' power summed in absolute value, plus what was there at the start.
    start: the balance at time 0. Of the end of the last step: forces (3, n, 3) in N: all,
    dashpots, drives; area (k,) in m2 and dissipated energy `lost` (k,) in J/m2 of the joints.
    """

    def __init__(self) -> None:
        self.value, self.start = dict.fromkeys(COLUMNS, 0.0), 0.0
        self.forces, self.area, self.lost = np.zeros((3, 0, 3)), np.zeros(0), np.zeros(0)

    def open(self, blocks: Blocks, joints: Joints, forces, dt: float, area) -> None:
        """Begin at time 0, when the velocities of the blocks' motion hold."""
        v, kick = self.value, 0.5 * dt * forces[0] / blocks.inertia
        v["kinetic"] = float((0.5 * blocks.inertia * (blocks.motion[3:].T ** 2 - kick**2)).sum())
        v["stored"] = float(area @ joints.stored)
        self.start = v["turned"] = v["kinetic"] + v["stored"]
        self.forces, self.area, self.lost = forces, area, joints.lost.copy()

    def book(self, blocks: Blocks, joints: Joints, forces, dt: float, area) -> None:
        """Add a step in which the blocks moved with the velocities of their motion."""
        v, velocity = self.value, blocks.motion[3:].T
        _, damped, driven = 0.5 * dt * ((self.forces + forces) * velocity).sum(axis=(1, 2))
        fall = dt * (blocks.gravity * velocity).sum(axis=1)
        v["kinetic"] = 0.5 * float((velocity * (blocks.inertia * velocity + dt * forces[0])).sum())
        v["potential"] -= float(fall.sum())
        v["dashpots"] -= float(damped)
        v["work"] += float(driven)
        v["turned"] += float(np.abs(fall).sum() + abs(driven))
        push = dt * (blocks.loads * velocity).sum(axis=1)
        v["work"] += float(push.sum())
        v["turned"] += float(np.abs(push).sum())
        v["stored"] = float(area @ joints.stored)
        # a joint loses its traction at the end of the step, which acts on the area of then
        v["friction"] += float(area @ (joints.lost - self.lost))
        self.forces, self.area, self.lost = forces, area, joints.lost.copy()

    @property
    def total(self) -> float:
        """What the balance says is constant (J)."""
        v = self.value
        return sum(v[name] for name in COLUMNS[:6]) - v["work"]

    @property
    def error(self) -> float:
        """Imbalance as a share of the energy turned over."""
        return (self.total - self.start) / self.value["turned"] if self.value["turned"] else 0.0
