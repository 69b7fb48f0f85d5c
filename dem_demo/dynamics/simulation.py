"""A scene in motion: blocks, contacts and joints, one step after another."""

from operator import attrgetter
from pathlib import Path

import numpy as np

from ..contact import Contacts, Joints, Tracker
from ..errors import Refused
from ..scene import Scene
from . import saved_states
from .blocks import Blocks
from .energy import COLUMNS, Ledger
from .forces import forces
from .saved_states import STATE, Saved
from .seating import seat
from .timestep import StepLimit, impact_limit

NEAR = 0.4  # share of the step's limit below which no change of lever arms matters
MATCH = 1e-6  # relative: lengths that are equal but for rounding
LOOKS = 16  # steps between two looks at the drives


class Simulation:
    """A scene in motion. `step()` advances it; from a `state()` it goes on bit for bit.

    step: time step (s), instead of the scene's; saved: a state to go on from. blocks: where they
    are; tracker: their contacts; joints: the law; ledger: the energies; limit: of the time step dt
    (s); balanced: were the blocks in equilibrium at the start?
    Raises ValueError for a step that is no finite number > 0 and for a state of another scene,
    Refused for a start that the method cannot carry.
    """

    def __init__(self, scene: Scene, step: float | None = None, saved: Saved | None = None) -> None:
        if step is not None and not 0 < step < np.inf:
            raise ValueError(f"step = {step} s: must be a finite number > 0")
        self.scene, self.blocks = scene, Blocks(scene)
        self.tracker, self.joints = Tracker(scene, self.blocks.motion), Joints(scene)
        self.limit, self.balanced, self.t0, self.n = StepLimit(), True, 0.0, 0
        self.ledger = Ledger()
        if saved:
            self._unpack(saved, step)
        else:
            self._start(step)

    @property
    def time(self) -> float:
        """Model time (s)."""
        return self.t0 + self.n * self.dt

    @property
    def contacts(self) -> Contacts:
        """The contacts at the blocks' places of now."""
        return self.tracker.contacts

    def step(self) -> None:
        """One time step. Raises Refused for a state that the method cannot carry."""
        self.blocks.step(self.dt, self._advance)

    def _start(self, step: float | None) -> None:
        """From the drawing to step 0: equilibrium, a time step, velocities half a step on."""
        scene, blocks, tracker, joints = self.scene, self.blocks, self.tracker, self.joints
        tracker.renew(blocks.motion, blocks.near)
        joints.assign(tracker.identities)
        slid = np.zeros(joints.n)
        if scene.run.seat and joints.n:
            slid, self.balanced = seat(scene, blocks, tracker, joints)
        tracker.follow(blocks.motion)
        joints.update(self.contacts.closure, slid)
        self.limit.look(scene, blocks, self.contacts, joints)
        self.dt = step or scene.run.step or self._chosen_step()
        self.limit.require(self.dt)
        velocity = blocks.drives.velocity(0.0, self.dt)
        blocks.motion[3:][blocks.drives.axes, blocks.drives.rows] = velocity
        tracker.follow(blocks.motion)
        force = forces(scene, blocks, self.contacts, joints, velocity, 0.5 * self.dt)
        self.ledger.open(blocks, joints, force, self.dt, self.contacts.length * scene.thickness)
        blocks.motion[3:] += (0.5 * self.dt * force[0] / blocks.inertia * blocks.free).T
        blocks.place(blocks.motion, blocks.motion[3:])

    def _chosen_step(self) -> float:
        scene, limit = self.scene, self.limit.now
        if largest := scene.run.largest_stress:
            curves = self.joints.curves.values()
            stiffness = max(float(np.interp(largest, c["stress"], c["stiffness"])) for c in curves)
            limit = min(limit, impact_limit(scene, self.blocks, stiffness))
        if not np.isfinite(limit):
            raise Refused(
                "nothing touches at the start, so no time step follows: set run.largest_stress "
                "(Pa) to the normal stress expected in impacts, or run.step (s)"
            )
        return scene.run.fraction * limit

    def _advance(self) -> np.ndarray:
        """Forces (n, 3) at the places just reached.

        1. Follow the contacts to where they are by now; look for new ones if blocks have moved far.
        2. Closure is the depth from the geometry, sliding the velocity times the step: the joints
           say tractions.
        3. Tractions, dashpots, weight and drives make forces.
        4. Check the time step if a joint has stiffened, send back drives, book the energies.
        """
        scene, blocks, tracker, joints = self.scene, self.blocks, self.tracker, self.joints
        dt = self.dt
        blocks.require_slow(dt)
        self._follow()
        tracker.require_shallow()
        joints.update(tracker.closure, self.contacts.sliding * dt, scene.run.law_steps)
        self.n += 1
        velocity = blocks.drives.velocity(self.time, dt)
        force = forces(scene, blocks, self.contacts, joints, velocity, dt)
        area = self.contacts.length * scene.thickness
        if (joints.stiffness * area > self.limit.checked).any():
            self.limit.look(scene, blocks, self.contacts, joints)
            self.limit.require(dt)
        self.ledger.book(blocks, joints, force, dt, area)
        # Where a corner has opened another part of it touches next, with its whole depth.
        tracker.offset = np.where(self.contacts.closure <= 0, 0.0, tracker.offset)
        if self.n % LOOKS == 0:
            blocks.drives.reverse(self.time, self.slid)
        return force[0]

    def _follow(self) -> None:
        """Bring the contacts to where the blocks are, with joints and ledger for them."""
        tracker, blocks = self.tracker, self.blocks
        before = tracker.follow(blocks.motion)
        if before is not None:
            self._transfer(before)
        if not tracker.stale(blocks.motion):
            return
        if self.dt > NEAR * self.limit.now:  # lever arms have changed
            self.limit.checked = np.zeros(self.joints.n)
        known = tracker.identities
        if tracker.renew(blocks.motion, blocks.near, pressed=False):
            self._rearrange(known)

    def _transfer(self, before: np.ndarray) -> None:
        """Joints and ledger for the lengths of the contacts, `before` (k,) in m.

        Lengths match wherever an edge that lies on another, or a corner that stands on an edge,
        goes on to the same. Else a joint that became shorter drops what it stored on the rest. One
        that became longer would create energy: it starts anew instead, at a closure at which it
        holds what the shorter one held; the rest of the depth becomes its closure offset.
        """
        ledger, tracker, joints = self.ledger, self.tracker, self.joints
        thickness, length = self.scene.thickness, self.contacts.length
        held, ratio = joints.stored * before, length / np.maximum(before, 1e-300)
        changed = np.flatnonzero((np.abs(ratio - 1) > MATCH) & (held > 0))
        longer, kept = ratio[changed] > 1, joints.stored[changed]
        ledger.area[changed] = length[changed] * thickness
        if longer.any():
            fresh = changed[longer]
            anew, kept[longer] = joints.renew(fresh, held[fresh] / length[fresh], tracker.closure)
            tracker.offset[fresh] += tracker.closure[fresh] - anew
            ledger.lost[fresh] = 0.0
        lost = np.maximum(held[changed] - kept * length[changed], 0.0)
        ledger.value["dropped"] += float(lost.sum()) * thickness

    def _rearrange(self, known: list) -> None:
        """Joints, ledger and limit for a new list of contacts; `known`: the old one."""
        ledger, joints, limit = self.ledger, self.joints, self.limit
        held = np.stack([ledger.area, ledger.area * joints.stored, limit.checked], axis=1)
        gone, none = dict(zip(known, held.tolist(), strict=True)), [0.0, 0.0, 0.0]
        joints.assign(self.tracker.identities, started=True)
        kept = [gone.pop(who, none) for who in self.tracker.identities]
        ledger.area, _, limit.checked = np.array(kept).reshape(-1, 3).T
        ledger.value["dropped"] += sum(stored for _, stored, _ in gone.values())
        ledger.lost = joints.lost

    def slid(self, moving: int, base: int) -> float:
        """Shear displacement (m) of the joints between two blocks, mean over their area."""
        here = self.tracker.between(moving, base)
        area = self.ledger.area[here]
        if not area.any():
            return 0.0
        return abs(float(self.joints.delta[here, 1] @ area / area.sum()))

    def state(self) -> Saved:
        """A copy of everything that the future depends on."""
        arrays = {path: np.array(attrgetter(path)(self)) for path in STATE}
        arrays["ledger.value"] = np.array([*self.ledger.value.values()])
        arrays["velocity"] = self.blocks.read()[3:]  # that will carry the blocks on
        return arrays | self.joints.snapshot()

    def _unpack(self, saved: Saved, step: float | None) -> None:
        a = {name: array.copy() for name, array in saved.items()}
        for path in STATE:
            holder, _, name = path.rpartition(".")
            value = a[path] if a[path].ndim else a[path].item()
            setattr(attrgetter(holder)(self) if holder else self, name, value)
        self.ledger.value = dict(zip(COLUMNS, a["ledger.value"].tolist(), strict=True))
        self.tracker.place(self.blocks.motion)
        self.joints.restore(a, self.tracker.identities)
        velocity = a["velocity"]
        if step:  # velocities are half a step ahead of the places: of the new step
            change = 0.5 * (step - self.dt) * self.ledger.forces[0] / self.blocks.inertia
            velocity += (change * self.blocks.free).T
            self.t0, self.n, self.dt = self.time, 0, step
            self.limit.look(self.scene, self.blocks, self.contacts, self.joints)
            self.limit.require(step)
        self.blocks.place(self.blocks.motion, velocity)

    def save(self, folder: Path, saved: Saved | None = None) -> None:
        """Write a state (default: now) and its scene to a folder; what else is there stays.

        Raises ValueError for a scene that was changed or made in memory. A state in
        memory needs no text: `Simulation(scene, saved=sim.state())`.
        """
        saved_states.save(self.scene, saved or self.state(), Path(folder))

    @classmethod
    def load(cls, folder: Path, step: float | None = None) -> "Simulation":
        """Continue from a folder that `save` wrote; with `step`, with another time step (s).

        Raises ValueError if the file is missing, damaged or of another version.
        """
        scene, saved = saved_states.load(Path(folder))
        return cls(scene, step, saved)
