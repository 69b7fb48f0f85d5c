"""The energy balance of a run: where every joule went.

In every step

    kinetic + potential + stored + friction + dashpots + discarded + bolts - external_work = start

holds to rounding for everything that the blocks do, so an error of the balance measures only what
the joint law gains or loses in a finite step, and contacts that begin or end. It is the check that
the time step is small enough, and that no contact is missed.

Time levels. In symplectic Euler, positions x_i are at full steps and velocities v_(i+1/2) between
them: v_(i+1/2) = v_(i-1/2) + dt F_i/m and x_(i+1) = x_i + dt v_(i+1/2). The kinetic energy at a
full step is half of the mass times the product of the velocities before and after it, not a square.
Its change over a step is then exactly the displacement dt v_(i+1/2) times the mean of the forces at
both ends, the trapezoidal rule. Every other entry is summed by the same rule: the work of drives
and dashpots from the mean of their forces before and after the step, gravity and loads from their
constant values. Joints have a potential of their own, the stored energy, and dissipate on the area
that they have at the end of the step.

In space, moments and angular velocities are about the principal axes of a block, so a gyroscopic
moment acts too. It is taken at the mean of both angular velocities, where it does no work.

"bolts" is the energy that rock bolts store and have dissipated by yielding, a function of their
elongations. What leaves the balance for good. "friction": energy dissipated by the joints;
"dashpots": by viscous damping; "discarded": stored energy of contacts that were removed while they
still carried load, or became shorter, and kinetic energy of blocks that an excavation removed.

`native/blocks.c` adds the entries of each step; this module opens the balance and reads it.
"""

import numpy as np

from ..contact import Joints
from ..native.layout import ENERGIES
from .blocks import Blocks

KINETIC, STORED, DISCARDED, BOLTS, EXTERNAL_WORK, TURNOVER = (
    ENERGIES.index(name)
    for name in ("kinetic", "stored", "discarded", "bolts", "external_work", "turnover")
)


class EnergyBalance:
    """Energies (J) of a run; their sum, external work subtracted, is `start`.

    energy (9,): in the order of `ENERGIES`. external_work: of drives, loads and water; turnover:
    sum of the absolute work of gravity, drives and loads, plus the energy at the start, to which
    errors are related. start: the balance at time 0. forces (3, n, dof) in N: total, dashpots and
    drives at the end of the last step; previous_forces (2, n, dof): dashpots and drives one step
    before. booked_area (k,) in m2: of the joints at the end of the last step; booked_dissipation
    (k,) in J/m2: their dissipated energy, as entered in the balance. The compiled step writes all
    of these.
    """

    def __init__(self, blocks: int, dof: int = 3) -> None:
        self.energy = np.zeros(len(ENERGIES))
        self.start = 0.0
        self.forces = np.zeros((3, blocks, dof))
        self.previous_forces = np.zeros((2, blocks, dof))
        self.booked_area = np.zeros(0)
        self.booked_dissipation = np.zeros(0)

    def open(self, blocks: Blocks, joints: Joints, dt: float) -> None:
        """Set the energies at time 0, the time of the velocities in the blocks' motion."""
        half_step = 0.5 * dt * self.forces[0] / blocks.inertia
        v = blocks.motion[len(blocks.motion) // 2 :].T
        self.energy[KINETIC] = (0.5 * blocks.inertia * (v**2 - half_step**2)).sum()
        self.energy[STORED] = self.booked_area @ joints.stored_energy
        self.energy[BOLTS] = blocks.bolts.pull()
        self.start = float(self.energy[KINETIC] + self.energy[STORED] + self.energy[BOLTS])
        self.energy[TURNOVER] = self.start

    def change_time_step(self, blocks: Blocks, old_dt: float, dt: float) -> None:
        """Continue with the time step dt (s), where the velocities of the next step are known.

        The reactions of drives become the ones that lead to these velocities, and the change of
        kinetic energy that they bring is external work. The kinetic energy of motions that forces
        move changes by m (F/m)^2 (old_dt^2 - dt^2)/8, because the integration in time conserves it
        in this form. This is an error of the integration and stays in the balance.
        """
        driven = (blocks.drives.rows, blocks.drives.axes)
        inertia = blocks.inertia * blocks.is_mobile
        before = blocks.motion[len(blocks.velocity) :].T
        after = blocks.velocity.T
        total, _, drives = self.forces
        planned = before[driven] + old_dt * total[driven] / blocks.inertia[driven]
        reaction = blocks.inertia[driven] * (after[driven] - before[driven]) / dt - total[driven]
        drives[driven] += reaction
        total[driven] += reaction
        self.energy[KINETIC] = (0.5 * inertia * after * (after - dt * total / blocks.inertia)).sum()
        work = 0.5 * inertia[driven] * before[driven] * (after[driven] - planned)
        self.energy[EXTERNAL_WORK] += work.sum()

    def change_loads(self, blocks: Blocks, change: np.ndarray, dt: float) -> None:
        """Correct the work of loads that change by `change` (n, dof) within a step dt (s).

        The step adds the work of the new loads; the trapezoidal rule takes their mean.
        """
        self.energy[EXTERNAL_WORK] -= (
            0.5 * dt * (change * blocks.motion[len(blocks.motion) // 2 :].T).sum()
        )

    def discard_blocks(
        self, blocks: Blocks, removed: list[int], support: np.ndarray, dt: float
    ) -> None:
        """Enter the kinetic energy of blocks that are about to be removed as discarded.

        The blocks have moved by a step dt (s) since the last entries, at which they are removed.
        Since then, the forces `support` (n, dof) of their joints have done work on the other
        blocks for half a step, by the trapezoidal rule, at the expense of the stored energy that
        leaves with the joints.
        """
        of_blocks = np.zeros(len(support), bool)
        of_blocks[removed] = True
        v = blocks.velocity.T * blocks.is_mobile
        momentum = blocks.inertia * v - dt * self.forces[0]  # half a step before the last entries
        kinetic = 0.5 * (v * momentum)[of_blocks].sum()
        work = 0.5 * dt * (v * support)[~of_blocks].sum()
        self.energy[DISCARDED] += kinetic - work

    @property
    def value(self) -> dict[str, float]:
        """The energies (J) by name."""
        return dict(zip(ENERGIES, self.energy.tolist(), strict=True))

    @property
    def total(self) -> float:
        """The sum (J) that the balance states to be constant."""
        return float(self.energy[:EXTERNAL_WORK].sum() - self.energy[EXTERNAL_WORK])

    @property
    def error(self) -> float:
        """Imbalance as a fraction of the energy turnover."""
        return (self.total - self.start) / max(float(self.energy[TURNOVER]), 1e-300)
