"""The energy energy_balance: where every joule went, consistent with the leapfrog's half steps.

Velocities live between positions, so the kinetic energy at a position is half of mass times the
product of the velocities before and after it; its change over a step is then exactly the trapezoid
of forces times displacement, and that is how every other entry is summed (`book` in blocks.c).
"""

import numpy as np

from ..contact import Joints
from .blocks import Blocks

COLUMNS = ("kinetic", "potential", "stored", "friction", "dashpots", "dropped", "work", "turned")
KINETIC, STORED, DROPPED, WORK, TURNED = (
    COLUMNS.index(name) for name in ("kinetic", "stored", "dropped", "work", "turned")
)


class EnergyBalance:
    """Energies in J: kinetic + potential + stored + friction + dashpots + dropped = start + work.

    energy (8,): by COLUMNS. friction: dissipated in the joints; dropped: stored in contacts that
    were given up while they still carried; work: done by drives, loads and water; turned:
    gravity's, the drives' and the loads' power summed in absolute value, plus what was there at
    the start. start: the balance at time 0. Of the end of the last step: forces (3, n, 3) in N:
    all, dashpots, drives; last (2, n, 3): dashpots and drives before it; area (k,) in m2 and
    dissipated energy `lost` (k,) in J/m2 of the joints. The compiled step writes all of them.
    """

    def __init__(self, blocks: int) -> None:
        self.energy, self.start = np.zeros(len(COLUMNS)), 0.0
        self.forces, self.last = np.zeros((3, blocks, 3)), np.zeros((2, blocks, 3))
        self.area, self.lost = np.zeros(0), np.zeros(0)

    def open(self, blocks: Blocks, joints: Joints, dt: float) -> None:
        """Begin at time 0, when the velocities of the blocks' motion hold."""
        kick, v = 0.5 * dt * self.forces[0] / blocks.inertia, blocks.motion[3:].T
        self.energy[KINETIC] = (0.5 * blocks.inertia * (v**2 - kick**2)).sum()
        self.energy[STORED] = self.area @ joints.stored_energy
        self.start = float(self.energy[KINETIC] + self.energy[STORED])
        self.energy[TURNED] = self.start

    def load(self, blocks: Blocks, more: np.ndarray, dt: float) -> None:
        """Loads have changed by `more` (n, 3) within a step dt (s): it books the whole of the new
        ones, and is to have the mean."""
        self.energy[WORK] -= 0.5 * dt * (more * blocks.motion[3:].T).sum()

    @property
    def value(self) -> dict[str, float]:
        """The energies by name."""
        return dict(zip(COLUMNS, self.energy.tolist(), strict=True))

    @property
    def total(self) -> float:
        """What the balance says is constant (J)."""
        return float(self.energy[:WORK].sum() - self.energy[WORK])

    @property
    def error(self) -> float:
        """Imbalance as a share of the energy turned over."""
        return (self.total - self.start) / max(float(self.energy[TURNED]), 1e-300)
