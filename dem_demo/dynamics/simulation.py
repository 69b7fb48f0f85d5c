"""A scene in motion: blocks, contacts and joints, one step after another; and its states.

`state.npz` holds its version, the text of the scene and of the files that this names, and arrays.
"""

import io
import json
from operator import attrgetter
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from jointlaw.support.files import write_files

from ..contact import PARTS, STALE, ContactManager, Contacts, Joints
from ..scene import Files, Scene, SceneError, parse
from .blocks import MOVED, Blocks, apply_loads
from .energy_balance import DROPPED, EnergyBalance
from .equilibrium import begin, out_of_balance, seat
from .timestep import SAFE, StepLimit, impact_limit

NEAR = 0.4  # share of the limit below which no lever arm matters; to which a step is halved
MATCH = 1e-6  # relative: lengths that are equal but for rounding
TINY = 1e-300  # in place of nothing, below a line
LOOKS = 16  # steps between two looks at the drives and at excavations
SLOW, EVEN, RESTING = 1e-4, 0.1, 0.9  # m/s, m/s2: below which a block rests; share that must
FRACTIONS = {  # of the limit that a time step is, by what can happen
    "blocks fall or have no equilibrium": 0.15,
    "drives move blocks": 0.4,
    "the blocks are in equilibrium": 0.7,
}
IMPACT = 1e4  # Pa: normal stress of a first impact, for a time step before anything touches
HALVINGS = 8  # of a time step that was chosen, until a run is refused
FILE, VERSION = "state.npz", 9
KEPT = (  # of what changes in a run, but for the joints: arrays that stay in their place
    "blocks.motion", "blocks.velocity", "blocks.loads", "blocks.gone", "blocks.support",
    "blocks.drives.reversed_at", "stage_start_times",
    "manager.renewed_at", "manager.urgent", "energy_balance.energy", "energy_balance.forces",
)  # fmt: skip
STATE = (
    *KEPT, "t0", "n", "dt", "halvings",
    "limit.current", "limit.lowest", "limit.bound", "limit.checked_stiffness",
    "manager.keys", "manager.law", "manager.offset",
    "energy_balance.start", "energy_balance.area", "energy_balance.lost", "unstable", "initial",
)  # fmt: skip
PLACES = "contacts.corner", "contacts.edge"  # from which the contacts are made anew
Saved = dict[str, np.ndarray]  # a copy of everything that the future depends on


class Simulation:
    """A scene in motion. `step()` advances it; from a `state()` it goes on bit for bit.

    step: time step (s), instead of the scene's; saved: a state to go on from. blocks: where they
    are; manager: their contacts; joints: the law; energy_balance: the energies; limit: of the time
    step dt (s), chosen for the reason `fraction_reason`; unstable (blocks,): without static
    equilibrium at step 0; initial (6, blocks): motion there; stage_start_times (stages,): when
    stages of the excavation began, inf before (s). Where neither `step` nor the scene sets the time
    step, it is halved when joints close too far for it, or blocks become too fast.
    Raises ValueError for a step that is no finite number > 0 and for a state of another scene,
    SceneError for a start that the method cannot carry.
    """

    def __init__(self, scene: Scene, step: float | None = None, saved: Saved | None = None) -> None:
        if step is not None and not 0 < step < np.inf:
            raise ValueError(f"step = {step} s: must be a finite number > 0")
        self.scene, self.blocks = scene, Blocks(scene)
        self.manager, self.joints = ContactManager(scene, self.blocks.motion), Joints(scene)
        self.limit, self.t0, self.n, self.fraction_reason = StepLimit(), 0.0, 0, ""
        self.halvings = 0 if step or scene.run.step or scene.run.fraction else HALVINGS
        self.energy_balance, self.stage_start_times = (
            EnergyBalance(len(scene.blocks)),
            np.full(len(scene.stages), np.inf),
        )
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
        return self.manager.contacts

    def step(self) -> None:
        """One time step. Raises SceneError for a state that the method cannot carry.

        1. The blocks move. Their contacts follow to where they are by now; new ones are looked for
           if blocks have moved far. An excavation takes blocks away, or lets their support go.
        2. Closure is the depth from the geometry, sliding the velocity times the step: the joints
           say tractions.
        3. Tractions, dashpots, weight and drives make forces, and these the next velocities; the
           energies are booked.
        4. Check the time step if a joint has stiffened; send back drives.
        """
        world, drives = self.world, self.blocks.drives
        world.call("before", self.dt)
        while world.fast >= 0:
            if not self._halve():
                self.blocks.refuse(world.fast, self.dt)
            world.call("before", self.dt)
        if self.scene.stages:
            self._dig()
        if world.moved or world.stale:
            self._renew()
            world = self.world
        if world.deep >= 0:
            pair = self.contacts.a[world.deep], self.contacts.b[world.deep]
            self.manager.refuse(pair, self.contacts.closure[world.deep])
        self.joints.advance(self.scene.run.law_steps)
        self.n += 1
        drives.aim[:] = drives.velocity(self.time, self.dt)
        world.call("after", self.dt)
        if world.stiffer:
            self.limit.look(self.scene, self.blocks, self.contacts, self.joints, self.dt)
            if self.dt > SAFE * self.limit.current:
                while self.dt > NEAR * self.limit.current and self._halve():
                    pass
            self.limit.require(self.dt)
            world.bind(checked=self.limit.checked_stiffness)
        if self.n % LOOKS == 0:
            drives.reverse(self.time, self.shear_displacement)

    def _dig(self) -> None:
        """Take away the blocks of a stage when its time has come, or, if it has none, when the rock
        is at rest; then let go what they bore."""
        blocks, stages, n = (
            self.blocks,
            self.scene.stages,
            int(np.isfinite(self.stage_start_times).sum()),
        )
        due = self.n % LOOKS == 0 and n < len(stages)
        if due and (self._rests() if (at := stages[n]["start"]) is None else self.time >= at):
            taken, c, joints = stages[n]["blocks"], self.contacts, self.joints
            mine = (np.isin(c.a, taken) | np.isin(c.b, taken)) * self.scene.thickness
            stress, shear = mine * c.length * joints.traction.T
            blocks.support += c.assemble(blocks.motion, stress, -shear, mine * joints.stored_energy)
            blocks.remove(taken)
            self.manager.urgent[taken], self.world.stale = True, 1
            self.stage_start_times[n], n = self.time, n + 1
        if blocks.support.any():
            left = self.stage_start_times[n - 1] + stages[n - 1]["release_time"] - self.time
            blocks.support *= max(left, 0.0) / max(left + self.dt, self.dt)
            self.energy_balance.load(blocks, apply_loads(self.scene, blocks, self.manager), self.dt)

    def _rests(self) -> bool:
        """Is no support going, and are almost all blocks slow and in balance?"""
        blocks, force = self.blocks, self.energy_balance.forces[0].T[:2]
        speed, pull = np.hypot(*blocks.velocity[:2]), np.hypot(*force) / blocks.inertia[:, 0]
        moves = np.maximum(speed / SLOW, pull / EVEN)[blocks.mobile[:, 0]]
        return not blocks.support.any() and bool(np.quantile(moves, RESTING) < 1)

    def _halve(self) -> bool:
        """Go on with half the time step, if it may be halved once more."""
        if not self.halvings:
            return False
        self.halvings -= 1
        self._change_step(0.5 * self.dt)
        return True

    def _change_step(self, dt: float) -> None:
        """Velocities are half a step ahead of the places: bring them to half of a step dt (s)."""
        blocks, drives, now = self.blocks, self.blocks.drives, self.time
        blocks.velocity += (
            0.5 * (dt - self.dt) * self.energy_balance.forces[0] / blocks.inertia * blocks.free
        ).T
        blocks.velocity[drives.axes, drives.rows] = drives.velocity(now, dt)
        self.t0, self.n, self.dt = now, 0, dt

    def bind(self) -> None:
        """Tell the compiled step where all arrays lie, after each change of the contacts."""
        run, blocks, manager, energy_balance = (
            self.scene.run,
            self.blocks,
            self.manager,
            self.energy_balance,
        )
        self.world = world = self.contacts.world
        world.thickness, world.parts = self.scene.thickness, run.law_steps
        world.dashpot_normal, world.dashpot_shear = run.dashpot_normal, run.dashpot_shear
        world.max_path, world.max_stale, world.driven = MOVED, STALE, len(blocks.drives.rows)
        world.bind(blocks, "motion", "velocity", "inertia", "gravity", "loads", "lightness",
                   "reach", "mobile", skin=blocks.skins)  # fmt: skip
        world.bind(blocks.drives, "rows", "axes", "aim")
        world.bind(manager, "deepest", "offset", "urgent", renewed=manager.renewed_at)
        world.bind(energy_balance, "last", "area", "lost", "energy", force=energy_balance.forces)
        world.bind(checked=self.limit.checked_stiffness)
        self.joints.bind(world)

    def _start(self, step: float | None) -> None:
        """From the drawing to step 0: equilibrium, a time step, velocities half a step on."""
        scene, blocks, manager, joints = self.scene, self.blocks, self.manager, self.joints
        slid = begin(scene, blocks, manager, joints)
        if scene.run.settle and joints.n and blocks.free.any():
            slid = seat(scene, blocks, manager, joints, slid)
        manager.follow(blocks.motion)
        self.initial = blocks.motion.copy()
        joints.update(manager.closure, slid)
        self.unstable = out_of_balance(scene, blocks, self.contacts, joints)
        self.limit.look(scene, blocks, self.contacts, joints)
        self.dt = step or scene.run.step or self._chosen_step()
        self.limit.require(self.dt)
        blocks.drives.aim[:] = blocks.drives.velocity(0.0, self.dt)
        blocks.motion[3:][blocks.drives.axes, blocks.drives.rows] = blocks.drives.aim
        manager.follow(blocks.motion)
        self.energy_balance.area = self.contacts.length * scene.thickness
        self.energy_balance.lost = joints.lost.copy()
        self.bind()
        self.world.call("forces", 0.5 * self.dt)
        self.energy_balance.open(blocks, joints, self.dt)
        blocks.motion[3:] += (
            0.5 * self.dt * self.energy_balance.forces[0] / blocks.inertia * blocks.free
        ).T
        blocks.velocity[:] = blocks.motion[3:]

    def _chosen_step(self) -> float:
        """By the scene's fraction of the limit, or else by one for what can happen."""
        scene, limit = self.scene, self.limit.current
        if not np.isfinite(limit):  # nothing touches yet
            stiffness = max(
                float(np.interp(IMPACT, held.curve["stress"], held.curve["stiffness"]))
                for held in self.joints.by_law
            )
            limit = impact_limit(scene, self.blocks, self.manager.outlines, stiffness)
        if not np.isfinite(limit):
            raise SceneError("forces move no block, so no time step follows: set run.step (s)")
        if scene.run.fraction:
            return scene.run.fraction * limit
        falls = not scene.run.settle or self.unstable.any() or self.blocks.velocity.any()
        driven = any(len(drive.times) > 1 for drive in scene.drives)
        self.fraction_reason = [*FRACTIONS][0 if falls else 1 if driven else 2]
        return FRACTIONS[self.fraction_reason] * limit

    def _renew(self) -> None:
        """Update joints, energies and limit for transferred and new contacts."""
        blocks, manager, joints = self.blocks, self.manager, self.joints
        energy_balance, limit = self.energy_balance, self.limit
        if self.world.moved:
            self._transfer()
        if self.world.stale:
            if self.dt > NEAR * limit.current:  # lever arms have changed
                limit.checked_stiffness[:] = 0.0
            before = manager.renew(blocks.motion, blocks.near(), pressed=False)
            stored = energy_balance.area * joints.stored_energy
            stored[before[before >= 0]] = 0.0
            energy_balance.energy[DROPPED] += stored.sum()
            energy_balance.area = np.append(energy_balance.area, 0.0)[before]
            limit.checked_stiffness = np.append(limit.checked_stiffness, 0.0)[before]
            joints.rearrange(before, manager.law, manager.keys, started=True)
            energy_balance.lost = joints.lost.copy()
            self.bind()
            energy_balance.load(blocks, apply_loads(self.scene, blocks, manager), self.dt)
        self.world.call("press", self.dt)

    def _transfer(self) -> None:
        """Joints and energy_balance for contacts whose corners went on to other edges.

        Lengths match wherever an edge that lies on another, or a corner that stands on an edge,
        goes on to the same. Else a joint that became shorter drops what it stored on the rest. One
        that became longer would create energy: it starts anew instead, at a closure at which it
        holds what the shorter one held; the rest of the depth becomes its closure offset.
        """
        energy_balance, manager, joints = self.energy_balance, self.manager, self.joints
        thickness, length, before = self.scene.thickness, self.contacts.length, self.contacts.was
        held, ratio = joints.stored_energy * before, length / np.maximum(before, TINY)
        changed = np.flatnonzero((np.abs(ratio - 1) > MATCH) & (held > 0))
        longer, kept = ratio[changed] > 1, joints.stored_energy[changed]
        energy_balance.area[changed] = length[changed] * thickness
        if longer.any():
            fresh, closure = changed[longer], manager.closure[changed[longer]]
            anew, kept[longer] = joints.renew(fresh, held[fresh] / length[fresh], closure)
            manager.offset[fresh] += closure - anew
            energy_balance.lost[fresh] = 0.0
        lost = held[changed] - kept * length[changed]
        energy_balance.energy[DROPPED] += np.maximum(lost, 0.0).sum() * thickness

    def area_fractions(self, moving: int, base: int) -> np.ndarray:
        """Share (k,) of each contact in the area of the joint between two blocks; zeros without."""
        area = self.energy_balance.area * self.manager.between(moving, base)
        return area / max(area.sum(), TINY)

    def shear_displacement(self, moving: int, base: int) -> float:
        """Shear displacement (m) of the joint between two blocks, mean over its area."""
        return abs(float(self.area_fractions(moving, base) @ self.joints.delta[:, 1]))

    def state(self) -> Saved:
        """A copy of everything that the future depends on."""
        return self.joints.snapshot() | {
            path: np.array(attrgetter(path)(self)) for path in (*STATE, *PLACES)
        }

    def _unpack(self, saved: Saved, step: float | None) -> None:
        for path in STATE:
            holder, _, name = path.rpartition(".")
            of, value = attrgetter(holder)(self) if holder else self, saved[path]
            if path in KEPT:
                getattr(of, name)[:] = value
            else:
                setattr(of, name, value.copy() if value.ndim else value.item())
        manager, blocks = self.manager, self.blocks
        blocks.remove(np.flatnonzero(blocks.gone).tolist())
        places = (saved[path] for path in PLACES)
        manager.contacts = Contacts(manager.outlines, *places, blocks.motion)
        self.joints.restore(saved, manager.law, manager.keys)
        if step:
            self._change_step(step)
            self.limit.look(self.scene, blocks, self.contacts, self.joints)
            self.limit.require(step)
        self.bind()

    def save(self, folder: Path, saved: Saved | None = None) -> None:
        """Write a state (default: now) and its scene to a folder; what else is there stays.

        Raises ValueError for a scene that was changed or made in memory. A state in
        memory needs no text: `Simulation(scene, saved=sim.state())`.
        """
        require_text(self.scene)
        scene, buffer, files = self.scene.text, io.BytesIO(), json.dumps(self.scene.files)
        np.savez(buffer, version=VERSION, scene=scene, files=files, **(saved or self.state()))
        write_files(folder, {FILE: buffer.getvalue()})

    @classmethod
    def load(cls, folder: Path, step: float | None = None) -> "Simulation":
        """Continue from a folder that `save` wrote; with `step`, with another time step (s).

        Raises ValueError if the file is missing, damaged or of another version.
        """
        places = (Path(folder) / part / FILE for part in ("", "state", "refused"))
        file = next((place for place in places if place.is_file()), None)
        if not file:
            raise ValueError(f"{str(folder)!r} holds no saved state: {FILE} is missing")
        try:
            # a ZIP file: it checks its sums; opened here, for numpy leaves a damaged one open
            with file.open("rb") as opened, np.load(opened, allow_pickle=False) as stored:
                data = {name: stored[name] for name in stored.files}
            if (version := int(data["version"])) == VERSION:
                scene = parse(
                    str(data["scene"]), str(file), Files(known=json.loads(str(data["files"])))
                )
                joints = [f"{part}-{i}" for part in PARTS for i in range(len(scene.laws))]
                saved = {name: data[name] for name in (*STATE, *PLACES, "touch", *joints)}
        except (OSError, EOFError, LookupError, ValueError, AttributeError, BadZipFile) as error:
            raise ValueError(f"{file} is damaged ({error}): run the scene again") from None
        if version != VERSION:
            raise ValueError(
                f"{file} has version {version}, this demo reads {VERSION}: go on with the version "
                "of the demo that wrote it, or run the scene again"
            )
        return cls(scene, step, saved)


def require_text(scene: Scene) -> None:
    """Refuse a scene without a text. Raises ValueError."""
    if not scene.text:
        raise ValueError(
            "the scene was made or changed in memory, so it has no text to go on from: write the "
            "change into the TOML text and parse that, or go on in memory with "
            "Simulation(scene, saved=state)"
        )
