"""The energy ledger: where every joule went, consistent with the leapfrog's half steps.

Velocities live between positions, so the kinetic energy at a position is half of mass times the
product of the velocities before and after it; its change over a step is then exactly the trapezoid
of forces times displacement, and that is how every other entry is summed.
"""

from __future__ import annotations

import numpy as np

COLUMNS = ("kinetic", "potential", "stored", "friction", "dashpots", "dropped", "work", "turned")


class Ledger:
    """Energies in J: kinetic + potential + stored + friction + dashpots + dropped = start + work.

    friction: dissipated in the joints; dropped: stored in law points that were given up while they
    still carried; work: done by drives and loads; turned: gravity's, the drives' and the loads'
    power summed in absolute value, plus what was there at the start.
    """

    def __init__(self, inertia: np.ndarray, gravity: np.ndarray, loads: np.ndarray) -> None:
        self.inertia, self.gravity, self.loads = inertia, gravity, loads
        self.loaded = bool(loads.any())
        self.value = dict.fromkeys(COLUMNS, 0.0)
        self.total0 = 0.0

    def start(self, velocity, forces, dt: float, area, stored, dissipated) -> None:
        """Open at time 0; velocity (n, 3) at time 0, forces (3, n, 3): all, dashpots, drives."""
        kick = 0.5 * dt * forces[0] / self.inertia
        self.value["kinetic"] = float((0.5 * self.inertia * (velocity**2 - kick**2)).sum())
        self.value["stored"] = float(area @ stored)
        self.value["turned"] = self.value["kinetic"] + self.value["stored"]
        self.total0 = self.total
        self.remember(forces, area, dissipated)

    def remember(self, forces, area, dissipated) -> None:
        """Keep the end of this step as the start of the next; also after joints came or went."""
        self.forces, self.area = forces, area
        self.e_lost = dissipated

    def step(self, velocity, forces, dt: float, area, stored, dissipated) -> None:
        """Book a step in which the blocks moved with `velocity` (n, 3)."""
        v = self.value
        _, damped, driven = 0.5 * dt * ((self.forces + forces) * velocity).sum(axis=(1, 2))
        middle = 0.5 * (area + self.area)
        fall = dt * (self.gravity * velocity).sum(axis=1)
        v["kinetic"] = 0.5 * float((velocity * (self.inertia * velocity + dt * forces[0])).sum())
        v["potential"] -= float(fall.sum())
        v["dashpots"] -= float(damped)
        v["work"] += float(driven)
        v["turned"] += float(np.abs(fall).sum() + abs(driven))
        if self.loaded:
            push = dt * (self.loads * velocity).sum(axis=1)
            v["work"] += float(push.sum())
            v["turned"] += float(np.abs(push).sum())
        v["stored"] = float(area @ stored)
        v["friction"] += float(middle @ (dissipated - self.e_lost))
        self.remember(forces, area, dissipated)

    @property
    def total(self) -> float:
        """What the balance says is constant (J)."""
        v = self.value
        held = v["kinetic"] + v["potential"] + v["stored"]
        return held + v["friction"] + v["dashpots"] + v["dropped"] - v["work"]

    @property
    def error(self) -> float:
        """Imbalance as a share of the energy turned over."""
        return (self.total - self.total0) / self.value["turned"] if self.value["turned"] else 0.0
