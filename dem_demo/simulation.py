"""Blocks, joints and time: one step of the whole, and the states it can return to."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import geometry, states, timestep
from .drives import Drives
from .energy import Ledger
from .handover import hand_over
from .interfaces import ROUNDING, Interfaces, Refused
from .joints import Joints
from .scene import Scene
from .start import begin
from .world import World

NEAR = 0.4  # share of the step's limit below which no change of lever arms matters
HEADROOM = 1.25  # most growth of a joint's stiffness between two checks of the time step
SAFE = 0.98  # largest time step as a share of the limit
CORNER = 0.1  # contact length of a corner as a share of the least block width, by default


class Simulation:
    """A scene in motion. `step()` advances it; `state()` and `restore()` are bit-exact."""

    def __init__(self, scene: Scene, step: float | None = None, fresh: bool = True) -> None:
        timestep.require_positive(step)
        self.scene, run, blocks = scene, scene.run, scene.blocks
        width = min(b.width for b in blocks)
        self.skin = run.skin or 0.02 * width
        self.world = World(blocks, scene.thickness, self.skin)
        self.interfaces = Interfaces(
            blocks, self.skin, run.point_spacing, run.max_overlap,
            run.corner_length or CORNER * width, scene.law_of,
        )  # fmt: skip
        self._least_depth = self.interfaces.search.depth_limit.min()
        self.joints = Joints(scene.laws, scene.law_of)
        self.drives = Drives(scene.drives)
        self.inertia = np.stack([self.world.mass, self.world.mass, self.world.moment], axis=1)
        self.mobile = np.array([[not b.fixed] * 3 for b in blocks])
        self.free = self.mobile.copy()
        self.free[self.drives.rows, self.drives.axes] = False
        self.reach = np.array([b.reach for b in blocks])
        self.gravity = self.mobile * self.inertia * [*scene.gravity, 0.0]
        self.loads = np.array([[*b.load, 0.0] for b in blocks]) * self.mobile
        self._steady = self.gravity + self.loads
        self._damped = bool(run.dashpot_normal or run.dashpot_shear)
        self.ledger = Ledger(self.inertia, self.gravity, self.loads)
        self.limit = timestep.StepLimit(self.inertia, self.free)
        held = self.free[:, :2].any(axis=1)
        self._lightness = held / self.world.mass
        self.t0, self.n, self.dt = 0.0, 0, step or run.step or 0.0
        self.step_limit = self.least_limit = np.inf
        self.balanced, self.motion = True, self.world.motion()
        if fresh:
            begin(self)

    # ------------------------------------------------------------------- step

    @property
    def time(self) -> float:
        """Model time (s)."""
        return self.t0 + self.n * self.dt

    def step(self) -> None:
        """One time step. Raises Refused for a state that the method cannot carry."""
        self.world.step(self.dt, self._at_new_positions)

    def _at_new_positions(self, motion: np.ndarray) -> np.ndarray:
        """Forces (n, 3) at the positions just reached; velocities are those that led there."""
        self._require_slow(motion)
        self.motion, self.n = motion, self.n + 1
        points = self.evaluate(motion, moving=True)
        if self.interfaces.stale(motion):
            if self.dt > NEAR * self.step_limit:
                self._checked[:] = 0.0  # lever arms have changed
            if self.interfaces.renew(motion, self.world.near, pressed=False):
                self.arrange()
            points = self.evaluate(motion)
        self._require_carried(points)
        closure = self.interfaces.closure(points)
        d = self.joints.increments(closure, points.sliding * self.dt)
        self.traction = self.joints.update(d, self.scene.run.law_steps)
        forces = self.forces(points, self.dt)
        if (self._stiffness * self.area > self._checked).any():
            self.check_step(points)
            self.require_step()
        if self.drives.waiting and self.n % 16 == 0:
            self.drives.watch(self.time, self.slid)
        self.ledger.step(motion[3:].T, forces, self.dt, *self.joint_energies(points))
        return forces[0]

    def evaluate(self, motion: np.ndarray, moving: bool = False) -> geometry.Points:
        """Law points at a motion (6, n), each at the corner and edge where it is by then."""
        points = geometry.evaluate(self.interfaces.contacts, motion)
        if points.inside.min(initial=0.0) < -ROUNDING:
            before, points = points, self.interfaces.follow(points, motion)
            if moving:
                hand_over(self, before.length, points)
        self.contacts = self.interfaces.contacts
        return points

    def forces(self, points: geometry.Points, dt: float) -> np.ndarray:
        """(3, n, 3): all forces, those of the dashpots, those of the drives."""
        self.points = points
        self.area = area = points.length * self.scene.thickness
        stress, shear = self.traction.T
        self._stiffness = self.joints.stiffness(stress)
        push, drag = self._dashpots(points, area * stress)
        self.assembly.move(self.motion)
        forces = np.empty((3, *self.mobile.shape))
        damped = self.assembly(points, push, drag) if self._damped else 0.0
        forces[1] = damped * self.mobile
        forces[0] = self.assembly(points, area * stress, -area * shear, self._energy()) + damped
        forces[0] = (forces[0] + self._steady) * self.mobile
        forces[2] = 0.0
        if len(self.drives.rows):
            at = self.drives.rows, self.drives.axes
            wanted = self.drives.velocity(self.time, self.dt)
            needed = self.inertia[at] * (wanted - self.motion[3:].T[at]) / dt - forces[0][at]
            forces[2][at] = needed
            forces[0][at] += needed
        return forces

    def _dashpots(self, points: geometry.Points, pressed: np.ndarray):
        """Forces of the dashpots along normal and tangent, (k,) each; never a pull."""
        run = self.scene.run
        damping = self._damping()
        push = np.maximum(-run.dashpot_normal * damping * points.opening, -pressed)
        if not run.dashpot_shear:
            return push, np.zeros(len(push))
        stick = 1.0 - self.joints.now["separated"] - self.joints.now["slipping"]
        return push, -run.dashpot_shear * damping * np.maximum(stick, 0.0) * points.sliding

    def _damping(self) -> np.ndarray:
        """Critical damping (k,) in N s/m: 2 sqrt(stiffness times reduced mass), by share."""
        return 2.0 * np.sqrt(self.area * self._stiffness * self._share)

    def slid(self, moving: int, base: int) -> float:
        """Shear displacement (m) of the joints between two blocks, mean over their area."""
        here = self.points_between(moving, base)
        area = self.area[here]
        if not area.any():
            return 0.0
        return abs(float(self.joints.read("delta")[here, 1] @ area / area.sum()))

    def _energy(self) -> np.ndarray:
        """Stored energy (k,) per contact length in J/m: what a change of that length costs."""
        return self.joints.now["stored"] * self.scene.thickness

    def points_between(self, one: int, other: int) -> np.ndarray:
        """Mask (k,) of the law points between two blocks."""
        a, b = self.contacts.a, self.contacts.b
        return ((a == one) & (b == other)) | ((a == other) & (b == one))

    def joint_energies(self, points: geometry.Points):
        """Area (m2), stored and dissipated energy (J/m2) of the law points."""
        return self.area, self.joints.now["stored"], self.joints.now["lost"]

    def arrange(self) -> None:
        """Joints, masses and books for a new list of law points."""
        before = None
        if getattr(self, "points", None) is not None:
            held = np.stack([self.area, self.area * self.joints.now["stored"], self._checked], 1)
            before = dict(zip(self.identity, held.tolist(), strict=True))
        self.contacts = c = self.interfaces.contacts
        self.identity = self.interfaces.of_points
        self.joints.assign(self.identity)
        self.assembly = geometry.Assembly(c.a, c.b, len(self.scene.blocks))
        light = self._lightness[c.a] + self._lightness[c.b]
        self._share = c.weight / np.where(light > 0, light, np.inf)
        self._checked = np.zeros(self.joints.n)
        if before is not None:
            none = [0.0, 0.0, 0.0]
            kept = np.array([before.pop(who, none) for who in self.identity]).reshape(-1, 3)
            self.ledger.value["dropped"] += sum(held for _, held, _ in before.values())
            self._checked = kept[:, 2]
            self.ledger.remember(self.ledger.forces, kept[:, 0], self.joints.now["lost"])

    # ----------------------------------------------------------------- guards

    def check_step(self, points: geometry.Points) -> None:
        """Find the step limit (s) of this moment from stiffness, dashpots and lever arms."""
        area = points.length * self.scene.thickness
        stress = self.traction[:, 0]
        now = np.maximum(self.joints.stiffness(stress), self.joints.stiffness_at(points.closure))
        # Joints that barely touch count as touching well, or each touch would ask again.
        self._stiffness = np.maximum(now, 0.2 * now.max(initial=0.0))
        self.area = np.maximum(area, 0.02 * area.max(initial=0.0))
        self._known = self._stiffness * self.area
        rows = self.limit.rows(self.contacts, points, self.motion)
        run, damping = self.scene.run, self._damping()
        self.step_limit = self.limit(
            rows,
            np.tile(self._known, 2),
            np.concatenate([run.dashpot_normal * damping, run.dashpot_shear * damping]),
        )
        self.least_limit = min(self.least_limit, self.step_limit)
        self.area = area

    def require_step(self) -> None:
        """Refuse a time step beyond the limit, and note by how much joints may stiffen until then.

        The limit falls at most as the square root of the largest growth of any joint's stiffness.
        """
        if self.dt > SAFE * self.step_limit:
            raise Refused(
                f"time step {self.dt:.3g} s: must stay below {SAFE} of the limit, which has fallen "
                f"to {self.step_limit:.3g} s as the joints closed; resume with a smaller step or "
                "set run.largest_stress (Pa)"
            )
        self._checked = min(HEADROOM, (SAFE * self.step_limit / self.dt) ** 2) * self._known

    def _require_slow(self, motion: np.ndarray) -> None:
        way = np.abs(motion[3]) + np.abs(motion[4]) + np.abs(motion[5]) * self.reach
        fastest = int(way.argmax())
        if not way[fastest] * self.dt < 0.25 * self.skin:  # also true for NaN
            raise Refused(
                f"block {self.scene.blocks[fastest].name!r} moves {way[fastest] * self.dt:.3g} m "
                f"in one step: must stay below {0.25 * self.skin:.3g} m (a quarter of run.skin); "
                "resume with a smaller step"
            )

    def _require_carried(self, points: geometry.Points) -> None:
        pressed = points.closure * (points.length > 0)
        if pressed.max(initial=0.0) > self._least_depth:
            a, b, depth = self.contacts.a, self.contacts.b, self.interfaces.search.depth_limit
            limit = np.minimum(depth[a], depth[b])
            i = int((pressed - limit).argmax())
            if pressed[i] > limit[i]:
                self.interfaces.search.refuse_overlap((a[i], b[i]), pressed[i], limit[i])

    # ------------------------------------------------------------------ states

    def state(self) -> dict:
        """A copy of everything that the future depends on."""
        return states.state(self)

    def restore(self, state: dict, step: float | None = None) -> None:
        """Return to a state; with `step`, go on from there with another time step (s).

        Raises ValueError for a step that is no finite number > 0, Refused beyond the limit.
        """
        states.restore(self, state, step)

    def save(self, folder: Path, state: dict | None = None) -> None:
        """Write a state (default: now) and its scene to a folder; what else is there stays.

        Raises ValueError for a scene that its own text does not give: one that was changed or made
        in memory. `state` and `restore` need no text.
        """
        states.save(self, Path(folder), state or self.state())

    @classmethod
    def load(cls, folder: Path, step: float | None = None) -> Simulation:
        """Continue from a folder that `save` wrote, with `step` as in `restore`.

        Raises ValueError if a file is missing, damaged or of another state, or the scene another.
        """
        scene, state = states.load(Path(folder))
        sim = cls(scene, fresh=False)
        sim.restore(state, step)
        return sim
