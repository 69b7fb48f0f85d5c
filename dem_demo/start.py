"""From the drawing to step 0: seated blocks, a time step, velocities half a step on."""

from __future__ import annotations

import numpy as np

from . import timestep
from .interfaces import Refused
from .seat import equilibrium

ATTEMPTS = 40  # most rounds of seating
SETTLED = 1e-10  # movement of a round, as a share of the first, that ends them


def begin(sim) -> None:
    """Seat the blocks, choose the time step, and take the first half step of the velocities."""
    sim.interfaces.renew(sim.motion, sim.world.near)
    sim.arrange()
    slid = np.zeros(sim.joints.n)
    if sim.scene.run.seat and sim.joints.n:
        slid = _seat(sim)
    for i, block in enumerate(sim.scene.blocks):
        if not block.fixed:
            sim.motion[3:, i] = [*block.velocity, block.spin]
    points = sim.evaluate(sim.motion)
    sim.traction = sim.joints.update(sim.joints.increments(points.closure, slid))
    sim.check_step(points)
    if not sim.dt:
        sim.dt = _choose_step(sim)
    sim.require_step()
    sim.motion[3:][sim.drives.axes, sim.drives.rows] = sim.drives.velocity(0.0, sim.dt)
    points = sim.evaluate(sim.motion)
    velocity = sim.motion[3:].T
    forces = sim.forces(points, 0.5 * sim.dt)
    sim.ledger.start(velocity, forces, sim.dt, *sim.joint_energies(points))
    sim.motion[3:] += (0.5 * sim.dt * forces[0] / sim.inertia * sim.free).T
    sim.world.place(sim.motion)


def _seat(sim) -> np.ndarray:
    """Move the blocks to where their joints carry them; the joints' first sliding (m)."""
    slid, free = np.zeros(sim.joints.n), sim.free.ravel()
    settle = np.ones(int(free.sum()), bool)
    for attempt in range(ATTEMPTS):  # each at the places just found: joints turn with the blocks
        points = sim.evaluate(sim.motion)
        if sim.interfaces.renew(sim.motion, sim.world.near):
            known = dict(zip(sim.identity, slid.tolist(), strict=True))
            sim.arrange()
            slid = np.array([known.get(who, 0.0) for who in sim.identity])
            points = sim.evaluate(sim.motion)
        force = sim.gravity + sim.loads + (_length_forces(sim, points, slid) if attempt else 0.0)
        force = (force.ravel() * sim.limit.root)[free]
        rows = sim.limit.rows(sim.contacts, points, sim.motion)
        area = points.length * sim.scene.thickness
        state = points.closure, slid, area, force, settle
        moved, balanced = equilibrium(sim.joints, rows, *state, near=attempt > 0)
        if attempt == 0:
            sim.balanced, first = bool(balanced.all()), np.abs(moved).max()
        else:  # what was found before is balanced but for the turning of the joints
            moved = np.where(balanced & settle, moved, 0.0)
        slid = slid + (rows @ moved)[len(slid) :]
        shift = np.zeros(sim.free.size)
        shift[free] = moved * sim.limit.root[free]
        sim.motion[:3] += shift.reshape(-1, 3).T
        settle &= balanced
        if not settle.any() or np.abs(moved).max() < SETTLED * first:
            break
    sim.interfaces.renewed_at = sim.motion[:3].copy()
    return slid


def _length_forces(sim, points, slid) -> np.ndarray:
    """Forces (n, 3) of joints whose length changes as the blocks move, after their first step."""
    before, none = sim.joints.snapshot(), np.zeros(sim.joints.n)
    sim.joints.update(sim.joints.increments(points.closure, slid))
    sim.assembly.move(sim.motion)
    forces = sim.assembly(points, none, none, sim.joints.now["stored"] * sim.scene.thickness)
    sim.joints.restore(before, sim.identity)
    return forces * sim.mobile


def _choose_step(sim) -> float:
    run, stiffness = sim.scene.run, 0.0
    for curve in sim.joints.curves.values():
        stiffness = max(stiffness, float(curve.at_stress(np.array([run.largest_stress]))[0]))
    limit = sim.step_limit
    if stiffness:
        blocks, thick = sim.scene.blocks, sim.scene.thickness
        whole = sim.inertia, sim.free, stiffness, sim.interfaces.corner_length
        limit = min(limit, timestep.impact_limit(blocks, thick, *whole))
    if not np.isfinite(limit):
        raise Refused(
            "nothing touches at the start, so no time step follows: set run.largest_stress "
            "(Pa) to the normal stress expected in impacts, or run.step (s)"
        )
    return run.fraction * limit
