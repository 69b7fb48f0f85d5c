"""One step: from a state to the next one, at positions that pymunk has just reached."""

from collections.abc import Iterable
from dataclasses import replace
from functools import partial

import numpy as np

from ..contact import Joints, LawPoints, Points, StiffnessCurve
from . import guards
from .energy import booked
from .forces import forces
from .state import Layout, Moment, State, System

NEAR = 0.4  # share of the step's limit below which no change of lever arms matters
MATCH = 1e-6  # relative: lengths that are equal but for rounding
LOOKS = 16  # steps between two looks at the drives


def advance(
    system: System, joints: Joints, now: State, motion: np.ndarray, near: Iterable[tuple[int, int]]
) -> State:
    """The state at a motion (6, n): positions just reached, velocities that led there.

    near: pairs of blocks that pymunk reports. Joints move along. Raises Refused for a state that
    the method cannot carry.

    1. Follow the law points to where they are by now; look for new ones if blocks have moved far.
    2. Closure is the depth from the geometry, sliding the velocity times the step: the joints say
       tractions.
    3. Tractions, dashpots, weight and drives make forces.
    4. Check the time step if a joint has stiffened, send back drives, book the energies.
    """
    guards.require_slow(system, motion, now.dt)
    now, points = _followed(system, joints, now, motion, near)
    law_points, run, dt = now.law_points, system.scene.run, now.dt
    guards.require_shallow(system, law_points.contacts, points)
    d = joints.increments(law_points.closure(points), points.sliding * dt)
    traction = joints.update(d, run.law_steps)
    area = points.length * system.scene.thickness
    stiffness = joints.virgin(StiffnessCurve.at_stress, traction[:, 0]) * area
    n, limit = now.n + 1, now.limit
    velocity = system.drives.velocity(now.t0 + n * dt, dt, now.reversed_at)
    at = Moment(now.layout, law_points.contacts, motion, points, traction)
    force = forces(system, joints, at, stiffness, velocity, dt)
    if (stiffness > limit.checked).any():
        limit = guards.require_step(guards.step_limit(system, joints, at, limit.least), dt)
    ledger = booked(
        now.ledger, system.inertia, system.gravity, system.loads, motion[3:].T, force, dt,
        area, joints.now["stored"], joints.now["lost"],
    )  # fmt: skip
    after = replace(
        now, n=n, motion=motion, law_points=law_points.reopened(points), points=points,
        traction=traction, ledger=ledger, limit=limit,
    )  # fmt: skip
    if n % LOOKS:
        return after
    slid = partial(after.slid, joints)
    return replace(after, reversed_at=system.drives.reverse(after.time, now.reversed_at, slid))


def _followed(
    system: System, joints: Joints, now: State, motion: np.ndarray, near: Iterable[tuple[int, int]]
) -> tuple[State, Points]:
    """The state with the law points of a motion, and these at that motion."""
    tracker = system.tracker
    law_points, points, before = tracker.evaluate(now.law_points, motion)
    if law_points is not now.law_points:
        now = _transferred(joints, now, law_points, points, before, system.scene.thickness)
    if not tracker.stale(now.law_points, motion):
        return now, points
    if now.dt > NEAR * now.limit.now:  # lever arms have changed
        now = replace(now, limit=replace(now.limit, checked=np.zeros(joints.n)))
    law_points, changed = tracker.renew(now.law_points, motion, near, pressed=False)
    if changed:
        now = _rearranged(system, joints, now, law_points)
    law_points, points, _ = tracker.evaluate(law_points, motion)
    return replace(now, law_points=law_points), points


def _transferred(
    joints: Joints, now: State, law_points: LawPoints, points: Points, before: np.ndarray,
    thickness: float,
) -> State:  # fmt: skip
    """The state with joints and ledger for the lengths of `points`, `before` (n,) in m.

    Lengths match wherever an edge that lies on another, or a corner that stands on an edge, goes
    on to the same. Else a joint that became shorter drops what it stored on the rest. One that
    became longer would create energy: it starts anew instead, at a closure at which it holds what
    the shorter one held; the rest of the depth becomes its closure offset.
    """
    stored = joints.now["stored"]
    held, ratio = stored * before, points.length / np.maximum(before, 1e-300)
    changed = np.flatnonzero((np.abs(ratio - 1) > MATCH) & (held > 0)).tolist()
    ledger = now.ledger
    area, lost = ledger.area.copy(), ledger.lost.copy()
    offset = law_points.closure_offset.copy()
    for i in changed:
        length, kept = points.length[i], stored[i]
        if ratio[i] > 1:
            point = now.layout.identities[i]
            curve, depth = joints.curve(point), law_points.closure(points)[i]
            closure = min(np.interp(held[i] / length, curve.work, curve.closure), depth)
            offset[i] += depth - closure
            kept = np.interp(closure, curve.closure, curve.work)
            joints.renew(point)
            lost[i] = 0.0
        ledger = ledger.dropping(max(float(held[i] - kept * length), 0.0) * thickness)
        area[i] = length * thickness
    law_points = replace(law_points, closure_offset=offset)
    return replace(now, law_points=law_points, ledger=replace(ledger, area=area, lost=lost))


def _rearranged(system: System, joints: Joints, now: State, law_points: LawPoints) -> State:
    """The state with joints and ledger for a new list of law points."""
    held = np.stack([now.area, now.area * joints.now["stored"], now.limit.checked], axis=1)
    gone = dict(zip(now.layout.identities, held.tolist(), strict=True))
    layout, none = Layout.of(system, law_points), [0.0, 0.0, 0.0]
    joints.assign(layout.identities)
    kept = np.array([gone.pop(who, none) for who in layout.identities]).reshape(-1, 3)
    ledger = now.ledger.dropping(sum(stored for _, stored, _ in gone.values()))
    return replace(
        now,
        law_points=law_points,
        layout=layout,
        limit=replace(now.limit, checked=kept[:, 2]),
        ledger=replace(ledger, area=kept[:, 0], lost=joints.now["lost"]),
    )
