"""From the drawing to step 0: blocks in equilibrium, a time step, velocities half a step on."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..contact import Joints, LawPoints, StiffnessCurve
from ..errors import Refused
from . import guards, timestep
from .energy import opened
from .forces import forces
from .initial_equilibrium import equilibrium
from .state import Layout, Moment, State, System

ATTEMPTS = 40  # most rounds of the initial equilibrium
SETTLED = 1e-10  # movement of a round, as a share of the first, that ends them

Pairs = Iterable[tuple[int, int]]


def begin(
    system: System, joints: Joints, drawn: np.ndarray, near: Pairs, step: float | None
) -> tuple[State, bool]:
    """The state at time 0 of a motion (6, n) as drawn; and: are the blocks in equilibrium?

    near: pairs of blocks that pymunk reports; step: time step (s), or None for the scene's.
    """
    scene, motion, balanced = system.scene, drawn.copy(), True
    law_points, _ = system.tracker.renew(system.tracker.none(motion), motion, near)
    layout = Layout.of(system, law_points)
    joints.assign(layout.identities)
    slid = np.zeros(joints.n)
    if scene.run.seat and joints.n:
        motion, law_points, slid, balanced = _settled(system, joints, motion, law_points, near)
        layout = Layout.of(system, law_points)
    for i, block in enumerate(scene.blocks):
        if not block.fixed:
            motion[3:, i] = [*block.velocity, block.spin]
    law_points, points, _ = system.tracker.evaluate(law_points, motion)
    traction = joints.update(joints.increments(points.closure, slid))
    at = Moment(layout, law_points.contacts, motion, points, traction)
    limit = guards.step_limit(system, joints, at, np.inf)
    dt = step or scene.run.step or _choose_step(system, joints, limit.now)
    limit = guards.require_step(limit, dt)
    reversed_at = np.full(len(scene.drives), np.inf)
    velocity = system.drives.velocity(0.0, dt, reversed_at)
    motion[3:][system.drives.axes, system.drives.rows] = velocity
    law_points, points, _ = system.tracker.evaluate(law_points, motion)
    area = points.length * scene.thickness
    stiffness = joints.virgin(StiffnessCurve.at_stress, traction[:, 0]) * area
    at = Moment(layout, law_points.contacts, motion, points, traction)
    force = forces(system, joints, at, stiffness, velocity, 0.5 * dt)
    books = area, joints.now["stored"], joints.now["lost"]
    ledger = opened(system.inertia, motion[3:].T, force, dt, *books)
    motion[3:] += (0.5 * dt * force[0] / system.inertia * system.free).T
    return State(
        0.0, 0, dt, motion, law_points, points, layout, traction, reversed_at, ledger, limit
    ), balanced


def _settled(
    system: System, joints: Joints, drawn: np.ndarray, law_points: LawPoints, near: Pairs
) -> tuple[np.ndarray, LawPoints, np.ndarray, bool]:
    """Motion of the blocks where their joints carry them, the law points there, the joints' first
    sliding (m), and whether all blocks can be held."""
    motion, layout = drawn.copy(), Layout.of(system, law_points)
    slid, free = np.zeros(joints.n), system.free.ravel()
    still = np.ones(int(free.sum()), bool)
    all_balanced, first = True, 0.0
    for attempt in range(ATTEMPTS):  # each at the places just found: joints turn with the blocks
        law_points, points, _ = system.tracker.evaluate(law_points, motion)
        law_points, changed = system.tracker.renew(law_points, motion, near)
        if changed:
            known = dict(zip(layout.identities, slid.tolist(), strict=True))
            layout = Layout.of(system, law_points)
            joints.assign(layout.identities)
            slid = np.array([known.get(who, 0.0) for who in layout.identities])
            law_points, points, _ = system.tracker.evaluate(law_points, motion)
        force = system.steady
        if attempt:
            force = force + _length_forces(system, joints, layout, motion, points, slid)
        force = (force.ravel() * system.limit.root)[free]
        rows = system.limit.rows(law_points.contacts, points, motion)
        area = points.length * system.scene.thickness
        state = points.closure, slid, area, force, still
        moved, balanced = equilibrium(joints, rows, *state, near=attempt > 0)
        if attempt == 0:
            all_balanced, first = bool(balanced.all()), np.abs(moved).max()
        else:  # what was found before is balanced but for the turning of the joints
            moved = np.where(balanced & still, moved, 0.0)
        slid = slid + (rows @ moved)[len(slid) :]
        shift = np.zeros(system.free.size)
        shift[free] = moved * system.limit.root[free]
        motion[:3] += shift.reshape(-1, 3).T
        still &= balanced
        if not still.any() or np.abs(moved).max() < SETTLED * first:
            break
    return motion, replace(law_points, renewed_at=motion[:3].copy()), slid, all_balanced


def _length_forces(system, joints, layout, motion, points, slid) -> np.ndarray:
    """Forces (n, 3) of joints whose length changes as the blocks move, after their first step."""
    before, none = joints.snapshot(), np.zeros(joints.n)
    joints.update(joints.increments(points.closure, slid))
    stored = joints.now["stored"] * system.scene.thickness
    force = layout.assembly(motion, points, none, none, stored)
    joints.restore(before, layout.identities)
    return force * system.mobile


def _choose_step(system: System, joints: Joints, limit: float) -> float:
    scene, largest = system.scene, np.array([system.scene.run.largest_stress])
    stiffness = max(float(curve.at_stress(largest)[0]) for curve in joints.curves.values())
    if stiffness:
        whole = system.inertia, system.free, stiffness, system.tracker.corner_length
        limit = min(limit, timestep.impact_limit(scene.blocks, scene.thickness, *whole))
    if not np.isfinite(limit):
        raise Refused(
            "nothing touches at the start, so no time step follows: set run.largest_stress "
            "(Pa) to the normal stress expected in impacts, or run.step (s)"
        )
    return scene.run.fraction * limit
