"""The energy ledger: where every joule went, consistent with the leapfrog's half steps.

Velocities live between positions, so the kinetic energy at a position is half of mass times the
product of the velocities before and after it; its change over a step is then exactly the trapezoid
of forces times displacement, and that is how every other entry is summed.
"""

from dataclasses import dataclass, replace

import numpy as np

COLUMNS = ("kinetic", "potential", "stored", "friction", "dashpots", "dropped", "work", "turned")


@dataclass(frozen=True, eq=False)
class Ledger:
    """Energies in J: kinetic + potential + stored + friction + dashpots + dropped = start + work.

    value: by COLUMNS. friction: dissipated in the joints; dropped: stored in law points that were
    given up while they still carried; work: done by drives and loads; turned: gravity's, the
    drives' and the loads' power summed in absolute value, plus what was there at the start.
    start: the balance at time 0. Of the end of the last step: forces (3, n, 3) in N: all,
    dashpots, drives; area (k,) in m2 and dissipated energy (k,) in J/m2 of the law points.
    """

    value: dict[str, float]
    start: float
    forces: np.ndarray
    area: np.ndarray
    lost: np.ndarray

    def dropping(self, energy: float) -> "Ledger":
        """With energy (J) given up by law points."""
        return replace(self, value=self.value | {"dropped": self.value["dropped"] + energy})

    @property
    def total(self) -> float:
        """What the balance says is constant (J)."""
        v = self.value
        held = v["kinetic"] + v["potential"] + v["stored"]
        return held + v["friction"] + v["dashpots"] + v["dropped"] - v["work"]

    @property
    def error(self) -> float:
        """Imbalance as a share of the energy turned over."""
        return (self.total - self.start) / self.value["turned"] if self.value["turned"] else 0.0


def opened(inertia, velocity, forces, dt: float, area, stored, lost) -> Ledger:
    """The ledger at time 0. velocity (n, 3) at time 0; stored, lost (k,) in J/m2."""
    v = dict.fromkeys(COLUMNS, 0.0)
    kick = 0.5 * dt * forces[0] / inertia
    v["kinetic"] = float((0.5 * inertia * (velocity**2 - kick**2)).sum())
    v["stored"] = float(area @ stored)
    v["turned"] = v["kinetic"] + v["stored"]
    return Ledger(v, v["turned"], forces, area, lost)


def booked(
    ledger: Ledger, inertia, gravity, loads, velocity, forces, dt: float, area, stored, lost
) -> Ledger:
    """The ledger after a step in which the blocks moved with `velocity` (n, 3).

    gravity, loads (n, 3): steady forces in N; the others as in `opened`.
    """
    v = dict(ledger.value)
    _, damped, driven = 0.5 * dt * ((ledger.forces + forces) * velocity).sum(axis=(1, 2))
    fall = dt * (gravity * velocity).sum(axis=1)
    v["kinetic"] = 0.5 * float((velocity * (inertia * velocity + dt * forces[0])).sum())
    v["potential"] -= float(fall.sum())
    v["dashpots"] -= float(damped)
    v["work"] += float(driven)
    v["turned"] += float(np.abs(fall).sum() + abs(driven))
    if loads.any():
        push = dt * (loads * velocity).sum(axis=1)
        v["work"] += float(push.sum())
        v["turned"] += float(np.abs(push).sum())
    v["stored"] = float(area @ stored)
    v["friction"] += float(0.5 * (area + ledger.area) @ (lost - ledger.lost))
    return Ledger(v, ledger.start, forces, area, lost)
