"""A scene in motion: blocks, contacts and joints, step by step; excavation; saved states.

`state.npz` holds its version, the text of the scene and of the files that the scene names, and the
arrays of the state.

Excavation. Blocks of a stage are removed at the time of the stage, or, if it has none, when the
rock is at rest. To remove a block at once would release its forces in one step, an impact that no
real excavation makes. The forces that the removed blocks exert on the others are therefore kept as
a load (`Blocks.support`), which is ramped to zero over the release time of the stage. A step in
which the blocks are removed changes no force on the rest. The joints of removed blocks end; their
stored energy and the kinetic energy of the blocks are entered as discarded, and the support does
work as any other load does. A stage waits until the support of the previous stage is zero. The step
that contains the given start time of a stage is divided there, so that the blocks are removed at
this time. The rock is at rest when the velocity and the acceleration of most blocks are small: not
of all, for a single loose stone that rattles must not delay an excavation for ever.
"""

import io
import json
from operator import attrgetter
from pathlib import Path
from typing import Any, ClassVar
from zipfile import BadZipFile

import numpy as np

from jointlaw.support.files import write_files

from ..compiled import StepArrays, address, function_address
from ..contact import STATE_PARTS, ContactManager, Contacts, Joints
from ..scene import Files, Scene, SceneError, parse
from .blocks import MAX_SKIN_PER_STEP, Blocks, apply_loads
from .energy_balance import BOLTS, DISCARDED, EnergyBalance
from .equilibrium import create_joints, find_unbalanced, settle
from .relaxation import Verdict
from .search import vector_length
from .timestep import MAX_FRACTION_OF_LIMIT, TimeStepLimit, impact_limit

WIDE_MARGIN = 0.4  # fraction of the limit: a step below it stays stable as lever arms change
TINY = 1e-300  # lower bound of a denominator
NO_ROWS = np.zeros(0, np.int64)
CHECK_INTERVAL = 16  # steps between two checks of drives and of excavation stages
TIME_ROUNDING = 1e-12  # relative: times that differ by rounding only
MIN_STEP_SHARE = 1e-4  # of the time step: shorter parts of a divided step lose digits of drives
RESTING_SPEED = 1e-4  # m/s
RESTING_ACCELERATION = 0.1  # m/s2
RESTING_FRACTION = 0.9  # of the blocks that must be at rest for the next stage
FRACTIONS_OF_LIMIT = {  # time step relative to its limit, by what can happen
    "blocks fall or have no equilibrium": 0.15,
    "drives move blocks or the water table changes": 0.4,
    "the blocks are in equilibrium": 0.7,
}
IMPACT_STRESS = 1e4  # Pa: normal stress of a first impact, where nothing touches at the start
IDLE_SHARE = 1e-6  # of it: the stress of faces drawn on each other, which touch by rounding
IDLE_AREA = 1e-9  # m2: of a corner that touches the end of an edge
MAX_HALVINGS = 8  # of a time step that was chosen automatically
FILE = "state.npz"
VERSION = 15
UPDATED_IN_PLACE = (  # arrays of the state that the compiled step, or views of them, refer to
    "blocks.motion",
    "blocks.velocity",
    "blocks.loads",
    "blocks.is_removed",
    "blocks.support",
    "blocks.bolts.yielding",
    "blocks.bolts.tension",
    "blocks.drives.reversed_at",
    "stage_start_times",
    "manager.rebuilt_at",
    "manager.needs_rebuild",
    "energy_balance.energy",
    "energy_balance.forces",
)
STATE = (
    *UPDATED_IN_PLACE,
    "time_of_last_change",
    "steps_since_change",
    "dt",
    "halvings_left",
    "water_time",
    "limit.current",
    "limit.lowest",
    "limit.lowest_bound",
    "limit.checked_stiffness",
    "manager.face_pairs",
    "manager.law",
    "manager.closure_offset",
    "energy_balance.start",
    "energy_balance.booked_area",
    "energy_balance.booked_dissipation",
    "unstable",
    "verdict",
    "initial",
)
CONTACT_KEYS = "contacts.keys"  # from which the contacts are made
SavedState = dict[str, np.ndarray]  # a copy of everything that later steps depend on


class Simulation:
    """A scene in motion. `step()` advances it; a run from a `state()` is bitwise reproducible.

    step: time step (s) instead of the scene's; saved: a state to continue from.

    blocks, manager (of contacts), joints, energy_balance: the parts of the simulation; limit: of
    the time step `dt` (s), which is chosen for the reason `fraction_reason`. unstable (blocks,):
    blocks without static equilibrium at step 0; verdict: value of the `Verdict` on the equilibrium
    at step 0, empty where the scene does not settle; initial (6, blocks): motion at step 0;
    stage_start_times (stages,): when the stages of the excavation began (s), infinite before.

    Where neither `step` nor the scene sets the time step, it is halved when joints close too far
    for it, or blocks become too fast. Raises ValueError unless the step is a finite number > 0
    and for a state of another scene, SceneError for an initial state that the method cannot treat.

    `space.SpaceSimulation` replaces what depends on the geometry: the parts, their state, how
    contacts begin and end, and the loads.
    """

    state_paths: ClassVar = STATE
    updated_in_place: ClassVar = UPDATED_IN_PLACE
    contact_paths: ClassVar = (CONTACT_KEYS,)  # from which `_restore_contacts` makes the contacts
    parse: ClassVar = staticmethod(parse)

    def __init__(
        self, scene: Scene, step: float | None = None, saved: SavedState | None = None
    ) -> None:
        if step is not None and not 0 < step < np.inf:
            raise ValueError(f"step = {step} s: must be a finite number > 0")
        self.scene = scene
        self._create_parts()
        self.limit = TimeStepLimit()
        self.time_of_last_change = 0.0  # of the time step (s)
        self.steps_since_change = 0
        self.fraction_reason = ""
        is_step_given = step or scene.run.step or scene.run.fraction
        self.halvings_left = 0 if is_step_given else MAX_HALVINGS
        self.stage_start_times = np.full(len(scene.stages), np.inf)
        self.water_time = 0.0  # s: of the water table in the present loads
        if saved:
            self._restore(saved, step)
        else:
            self._start(step)
        self._find_next_event()

    def _create_parts(self) -> None:
        """Create blocks, contact manager, joints and energy balance of the scene as drawn."""
        scene = self.scene
        self.blocks = Blocks(scene)
        self.manager = ContactManager(scene, self.blocks.motion)
        self.joints = Joints(scene)
        self.energy_balance = EnergyBalance(len(scene.blocks))

    def _apply_loads(self, *_: Any) -> np.ndarray:
        """Update the loads of the blocks at their present places; returns their change (n, dof)."""
        return apply_loads(self.scene, self.blocks, self.manager, self.water_time)

    @property
    def time(self) -> float:
        """Model time (s)."""
        return self.time_of_last_change + self.steps_since_change * self.dt

    @property
    def contacts(self) -> Contacts:
        """The contacts at the present places of the blocks."""
        return self.manager.contacts

    # ------------------------------------------------------------------ one time step

    def step(self) -> None:
        """Advance by one time step.

        A step in which an excavation stage has its start time, or `[[water.at]]` a time, is divided
        there.

        Raises SceneError for a state that the method cannot treat.
        """
        if self.next_event - self.time > (1 + MIN_STEP_SHARE) * self.dt:
            self._advance()
        else:
            self._advance_through_events()

    def _find_next_event(self) -> None:
        """Find `next_event` (s): the next start time of a stage or time of a water table."""
        times = [time for time, _ in self.scene.water_changes]
        begun = int(np.isfinite(self.stage_start_times).sum())
        times += [stage["start"] for stage in self.scene.stages[begun : begun + 1]]
        now = self.time * (1 + TIME_ROUNDING)
        future = [time for time in times if time is not None and time > now]
        self.next_event = min(future, default=np.inf)

    def _advance_through_events(self) -> None:
        """Take a time step in parts that end at the times of events.

        An event that differs from the end of the step by less than MIN_STEP_SHARE of it moves the
        end. Where the time step is halved on the way, the step ends with the part.
        """
        self._find_next_event()
        dt = self.dt
        end = self.time + dt
        if abs(self.next_event - end) < MIN_STEP_SHARE * dt:
            end = self.next_event
        halvings_left = self.halvings_left
        is_divided = False
        while end - self.time > MIN_STEP_SHARE * dt and self.halvings_left == halvings_left:
            part = min(self.next_event, end) - self.time
            if abs(part - self.dt) > TIME_ROUNDING * end:
                self._change_time_step(part)
                is_divided = True
            self._advance()
            self._find_next_event()
        if is_divided:
            self._change_time_step(dt * 0.5 ** (halvings_left - self.halvings_left))
            self._check_time_step()

    def _advance(self) -> None:
        """Advance by the time step `dt`.

        1. Blocks move; their contacts are updated, and searched again where blocks have moved far.
           An excavation removes blocks, or releases their support; the water table changes.
        2. The joints take a step: closure from the geometry, sliding from velocity times step.
        3. Tractions, dashpots, weight, loads and drives give forces, energies, new velocities.
        4. The time step is checked if a joint has stiffened; drives are reversed when due.

        Raises SceneError for a state that the method cannot treat.
        """
        self._move_blocks()
        if self.scene.stages:
            self._excavate()
        if self.scene.water_changes:
            self._change_water_table()
        if self.arrays.transferred or self.arrays.rebuild:
            self._update_contact_list()
        if self.arrays.too_deep >= 0:
            self._refuse_overlap(self.arrays.too_deep)
        self.joints.advance(self.scene.run.law_steps)
        self.steps_since_change += 1
        drives = self.blocks.drives
        if len(drives.rows):
            drives.aim[:] = drives.velocity(self.time, self.dt)
        self.energy_balance.energy[BOLTS] = self.blocks.bolts.pull()
        self.arrays.finish_step(self.dt)
        if self.arrays.stiffened:
            self._check_time_step()
        if self.steps_since_change % CHECK_INTERVAL == 0:
            drives.reverse(self.time, self.shear_displacement)

    def _move_blocks(self) -> None:
        """Move the blocks by one step and update the geometry of their contacts.

        While a block is too fast for the neighbour list, the time step is halved and the move
        repeated; raises SceneError when it may not be halved any more.
        """
        self.arrays.move_blocks(self.dt)
        while self.arrays.too_fast >= 0:
            if not self._halve_time_step():
                self.blocks.refuse_speed(self.arrays.too_fast, self.dt)
            self.arrays.move_blocks(self.dt)

    def _refuse_overlap(self, row: int) -> None:
        contacts = self.contacts
        pair = contacts.block_a[row], contacts.block_b[row]
        self.manager.refuse_overlap(pair, contacts.closure[row])

    # ------------------------------------------------------------------ excavation

    def _excavate(self) -> None:
        """Begin the next excavation stage when it is due, and reduce the support of removed blocks.

        A stage with a start time is due in the step that ends at this time, which the release of
        support is counted from. A stage without one is due when the blocks are at rest, which is
        checked every CHECK_INTERVAL steps. The support is reduced in every step.
        """
        stages = self.scene.stages
        now = self.time + self.dt  # to which the blocks have moved
        begun = int(np.isfinite(self.stage_start_times).sum())
        if begun < len(stages):
            start = stages[begun]["start"]
            if start is None:
                is_checked = self.steps_since_change % CHECK_INTERVAL == 0
                is_due = is_checked and self._is_at_rest()
                start = self.time
            else:
                is_due = now >= start * (1 - TIME_ROUNDING)
                start = max(start, self.time)  # a stage before this one may have begun late
            if is_due:
                self._remove_blocks(stages[begun]["blocks"])
                self.stage_start_times[begun] = start
                begun += 1
                self._find_next_event()
        if self.blocks.support.any():
            stage_start = self.stage_start_times[begun - 1]
            stage_end = stage_start + stages[begun - 1]["release_time"]
            self._release_support(stage_end - now, min(now - stage_start, self.dt))

    def _remove_blocks(self, removed: list[int]) -> None:
        """Remove blocks, and keep the forces that they exert on the others as support."""
        blocks = self.blocks
        contacts = self.contacts
        is_removed = np.isin(contacts.block_a, removed) | np.isin(contacts.block_b, removed)
        support = contacts.assemble_forces(
            len(blocks.support),
            (is_removed * contacts.area)[:, None] * self.joints.traction,
            is_removed * self.joints.stored_energy,
        )
        blocks.support += support
        self.energy_balance.discard_blocks(blocks, removed, support, self.dt)
        blocks.remove(removed)
        self.manager.needs_rebuild[removed] = True
        self.arrays.rebuild = 1

    def _release_support(self, time_left: float, elapsed: float) -> None:
        """Reduce the support linearly, to zero at the end of the time left (s).

        elapsed: time (s) by which the release has gone on in this step.
        """
        if time_left > TIME_ROUNDING * self.time:
            self.blocks.support *= time_left / (time_left + max(elapsed, 0.0))
        else:
            self.blocks.support[:] = 0.0
        self.energy_balance.change_loads(self.blocks, self._apply_loads(), self.dt)

    def _is_at_rest(self) -> bool:
        """Whether no support is being released, and most blocks are slow and balanced."""
        blocks = self.blocks
        dim = self.joints.dim
        speed = vector_length(blocks.velocity[:dim].T)
        force = vector_length(self.energy_balance.forces[0][:, :dim])
        acceleration = force / blocks.inertia[:, 0]
        motion = np.maximum(speed / RESTING_SPEED, acceleration / RESTING_ACCELERATION)
        is_resting = np.quantile(motion[blocks.is_mobile[:, 0]], RESTING_FRACTION) < 1
        return not blocks.support.any() and bool(is_resting)

    def _change_water_table(self) -> None:
        """Load the blocks by the water table of the end of the step, unless it is the last one.

        This is done in every CHECK_INTERVAL-th step, and at the times of the scene's tables.
        """
        now = self.time + self.dt  # to which the blocks have moved
        is_at_event = now >= self.next_event * (1 - TIME_ROUNDING)
        if not is_at_event and self.steps_since_change % CHECK_INTERVAL:
            return
        time = min(now, self.scene.water_changes[-1][0])
        if time > self.water_time:
            self.water_time = time
            self.energy_balance.change_loads(self.blocks, self._apply_loads(), self.dt)

    # ------------------------------------------------------------------ the time step

    def _check_time_step(self) -> None:
        """Compute the stability limit again, and halve the time step while it exceeds the limit.

        Raises SceneError if the step is still not stable when it may not be halved any more.
        """
        limit = self.limit
        limit.update(self.scene, self.blocks, self.contacts, self.joints, self.dt)
        if self.dt > MAX_FRACTION_OF_LIMIT * limit.current:
            while self.dt > WIDE_MARGIN * limit.current and self._halve_time_step():
                pass
        limit.require_stable(self.dt)
        self.arrays.bind(limit, "checked_stiffness")

    def _halve_time_step(self) -> bool:
        """Continue with half the time step; False if it may not be halved any more."""
        if not self.halvings_left:
            return False
        self.halvings_left -= 1
        self._change_time_step(0.5 * self.dt)
        return True

    def _change_time_step(self, dt: float) -> None:
        """Continue with the time step dt (s): velocities are half a step ahead of positions.

        Drives get the reactions that bring their blocks to the prescribed velocities of the new
        step.
        """
        blocks = self.blocks
        drives = blocks.drives
        balance = self.energy_balance
        now = self.time
        half_change = 0.5 * (dt - self.dt) * balance.forces[0] / blocks.inertia
        blocks.velocity += (half_change * blocks.is_free).T
        blocks.velocity[drives.axes, drives.rows] = drives.velocity(now, dt)
        balance.change_time_step(blocks, self.dt, dt)
        self.time_of_last_change = now
        self.steps_since_change = 0
        self.dt = dt

    def _choose_time_step(self) -> float:
        """Time step (s): the scene's fraction of the limit, or a fraction for what can happen."""
        scene = self.scene
        limit = self.limit.current
        impact_stiffness = max(
            float(np.interp(IMPACT_STRESS, joints.curve["stress"], joints.curve["stiffness"]))
            for joints in self.joints.by_law
        )
        if not np.isfinite(limit) or self._is_untouched(impact_stiffness):
            limit = min(limit, self._impact_limit(impact_stiffness))
        if not np.isfinite(limit):
            raise SceneError("forces move no block, so no time step follows: set run.step (s)")
        if scene.run.fraction:
            return scene.run.fraction * limit
        can_fall = not scene.run.settle or self.unstable.any() or self.blocks.velocity.any()
        is_driven = scene.water_changes or any(len(drive.times) > 1 for drive in scene.drives)
        falling, driven, resting = FRACTIONS_OF_LIMIT
        if can_fall:
            self.fraction_reason = falling
        else:
            self.fraction_reason = driven if is_driven else resting
        return FRACTIONS_OF_LIMIT[self.fraction_reason] * limit

    def _is_untouched(self, impact_stiffness: float) -> bool:
        """Whether no joint bears a load yet, and all are softer than in an impact (Pa/m).

        A corner that is drawn on the end of an edge has no area yet, so its joint is soft.
        """
        joints = self.joints
        has_area = self.contacts.area > IDLE_AREA
        stiffness = has_area * joints.interpolate("stiffness", "closure", self.contacts.closure)
        largest_stress = np.abs(joints.traction).max(initial=0.0)
        is_idle = largest_stress < IDLE_SHARE * IMPACT_STRESS
        return is_idle and stiffness.max(initial=0.0) < impact_stiffness

    def _impact_limit(self, stiffness: float) -> float:
        """Step limit (s) if every block were touched all around; stiffness (Pa/m): of joints."""
        return impact_limit(self.scene, self.blocks, self.manager.outlines, stiffness)

    # ------------------------------------------------------------------ start

    def _start(self, step: float | None) -> None:
        """Initialise at step 0: equilibrium, time step, velocities half a step ahead."""
        scene = self.scene
        blocks = self.blocks
        manager = self.manager
        joints = self.joints
        try:
            sliding = self._create_joints()
        except SceneError as error:
            raise SceneError(f"blocks are drawn in each other: {error}") from None
        verdict = Verdict.NO_EQUILIBRIUM  # of blocks that touch nothing
        if scene.run.settle and joints.n and blocks.is_free.any():
            sliding, verdict = settle(scene, blocks, manager, joints, sliding, self._apply_loads)
        manager.update(blocks.motion)
        self._note_initial_places()
        joints.update(manager.closure, sliding)
        blocks.bolts.pull()
        self.unstable = find_unbalanced(blocks, self.contacts, joints)
        if not self.unstable.any():
            verdict = Verdict.EQUILIBRIUM
        elif verdict is Verdict.EQUILIBRIUM:  # a search that ended before forces balance
            verdict = Verdict.NOT_DECIDED
        self.verdict = verdict.value if scene.run.settle else ""
        self.limit.update(scene, blocks, self.contacts, joints)
        self.dt = step or scene.run.step or self._choose_time_step()
        self.limit.require_stable(self.dt)
        drives = blocks.drives
        drives.aim[:] = drives.velocity(0.0, self.dt)
        velocity = blocks.motion[len(blocks.velocity) :]
        velocity[drives.axes, drives.rows] = drives.aim
        manager.update(blocks.motion)
        balance = self.energy_balance
        balance.booked_area = self.contacts.area.copy()
        balance.booked_dissipation = joints.dissipated_energy.copy()
        self.bind()
        self.arrays.call("compute_forces", 0.5 * self.dt)
        self._add_gyroscopic_half_step(velocity)
        balance.open(blocks, joints, self.dt)
        half_step = 0.5 * self.dt * balance.forces[0] / blocks.inertia
        velocity += (half_step * blocks.is_free).T
        blocks.velocity[:] = velocity

    def _create_joints(self) -> np.ndarray:
        """Find the contacts of the scene as drawn and give them virgin joints; returns the sliding
        (k, dim - 1) in m with which they start."""
        return create_joints(self.scene, self.blocks, self.manager, self.joints)

    def _add_gyroscopic_half_step(self, velocity: np.ndarray) -> None:
        """Add the change of angular velocities by gyroscopic moments in half a step, none here."""

    def _note_initial_places(self) -> None:
        """Keep the places of the blocks at step 0."""
        self.initial = self.blocks.motion.copy()

    def bind(self) -> None:
        """Bind all arrays to the compiled step, after each change of the list of contacts."""
        run = self.scene.run
        blocks = self.blocks
        drives = blocks.drives
        manager = self.manager
        balance = self.energy_balance
        joints = self.joints
        arrays = StepArrays(
            n_blocks=len(blocks.names),
            n_contacts=joints.n,
            dim=joints.dim,
            dof=len(blocks.velocity),
        )
        arrays.law_steps = run.law_steps
        arrays.dashpot_normal = run.dashpot_normal
        arrays.dashpot_shear = run.dashpot_shear
        arrays.max_skin_per_step = MAX_SKIN_PER_STEP
        arrays.max_skin_until_rebuild = manager.max_skin_until_rebuild
        arrays.n_driven = len(drives.rows)
        arrays.bind(
            blocks, "motion", "velocity", "inertia", "gravity", "loads", "inverse_mass", "radius",
            "is_mobile", skin=blocks.skins, bolt_forces=blocks.bolts.forces,
        )  # fmt: skip
        arrays.bind(driven_block=drives.rows, driven_axis=drives.axes, driven_velocity=drives.aim)
        arrays.bind(manager, "max_overlap", "closure_offset", "needs_rebuild", "rebuilt_at")
        arrays.bind(
            balance, "forces", "previous_forces", "booked_area", "booked_dissipation", "energy"
        )
        arrays.bind(self.limit, "checked_stiffness")
        arrays.bind(
            self.contacts, "block_a", "block_b", "closure", "area", "kinematics", "area_gradient",
            "rates",
        )  # fmt: skip
        self._bind_geometry(arrays)
        joints.bind(arrays)
        arrays.divide(self.contacts.block_a, self.contacts.block_b, self._count_threads())
        arrays.call("compute_rates")
        self.arrays = arrays

    def _count_threads(self) -> int:
        """Number of threads that share a step around the law: one in the plane, where a contact may
        take the place of another."""
        return 1

    def _bind_geometry(self, arrays: StepArrays) -> None:
        """Bind the geometry of the contacts, and the function that updates it."""
        corner_arrays = self.contacts.corner_arrays
        corner_arrays.bind(motion=self.blocks.motion, needs_rebuild=self.manager.needs_rebuild)
        arrays.bind(geometry=corner_arrays)
        self.manager.bind_joints(self.joints.stored_energy, self.joints.traction)
        arrays.update_geometry = function_address("update_contacts")

    # ------------------------------------------------------------------ contacts that change

    def _update_contact_list(self) -> None:
        """Bring joints, energies and limit up to date with transferred and new contacts."""
        arrays = self.arrays
        is_new = None
        restarted = NO_ROWS
        if arrays.transferred:
            restarted = self._transfer_joints()
        if arrays.rebuild:
            is_new = self._rebuild_contacts()
        continued = self._continue_across_seams(is_new)
        if self.arrays is not arrays:
            self.arrays.call("set_increments", self.dt)
            return
        changed = np.concatenate([restarted, continued])
        if len(changed):
            self.arrays.call("set_increments_of", self.dt, len(changed), address(changed))

    def _rebuild_contacts(self) -> np.ndarray:
        """Rebuild the list of contacts; drop the energy of the joints that end.

        Returns the mask (k,) of the contacts that are new.
        """
        blocks = self.blocks
        manager = self.manager
        joints = self.joints
        balance = self.energy_balance
        limit = self.limit
        if self.dt > WIDE_MARGIN * limit.current:  # lever arms have changed
            limit.checked_stiffness[:] = 0.0
        pairs = blocks.neighbour_pairs()
        old_row = manager.rebuild(blocks.motion, pairs, keep_closure=False)
        stored_energy = balance.booked_area * joints.stored_energy
        stored_energy[old_row[old_row >= 0]] = 0.0
        balance.energy[DISCARDED] += stored_energy.sum()
        balance.booked_area = np.append(balance.booked_area, 0.0)[old_row]
        limit.checked_stiffness = np.append(limit.checked_stiffness, 0.0)[old_row]
        joints.rearrange(old_row, manager.law, manager.face_pairs, started=True)
        balance.booked_dissipation = joints.dissipated_energy.copy()
        self.bind()
        balance.change_loads(blocks, self._apply_loads(), self.dt)
        return old_row < 0

    def _continue_across_seams(self, is_new: np.ndarray | None) -> np.ndarray:
        """Let contacts that have reached a coplanar block continue the joints of their neighbours.

        These contacts bear nothing yet. They are new (is_new (k,)), or have gone on to other edges
        than the ones between which the manager found them. Returns these contacts (m,).
        """
        manager = self.manager
        joints = self.joints
        rows, sources = manager.find_neighbours(is_new)
        if not len(rows):
            return rows
        law = manager.law[sources]
        has_other_laws = (manager.law[rows] != law).any()
        manager.law[rows] = law
        manager.closure_offset[rows] = manager.closure_offset[sources]
        has_new_arrays = joints.continue_joints(rows, sources)
        balance = self.energy_balance
        balance.booked_dissipation[rows] = balance.booked_dissipation[sources]
        if has_new_arrays:
            self.bind()
        if has_other_laws:  # laws have water pressures
            balance.change_loads(self.blocks, self._apply_loads(), self.dt)
        return rows

    def _transfer_joints(self) -> np.ndarray:
        """Update joints and energies of contacts whose corners went on to other edges.

        The length of joint is the same before and after where an edge that lies on another, or a
        corner that stands on an edge, goes on to one that does the same. Otherwise a joint that has
        become shorter drops the energy stored on the rest. One that has become longer would create
        energy: it starts as new instead, at the closure at which it stores the energy of the
        shorter one, and the remaining depth becomes its closure offset.

        Returns the contacts (m,) whose joints start as new.
        """
        balance = self.energy_balance
        manager = self.manager
        joints = self.joints
        thickness = self.scene.thickness
        changed = self.contacts.changed_lengths(joints.stored_energy)
        if not len(changed):
            return changed
        length = self.contacts.length
        old_length = self.contacts.previous_length[changed]
        old_energy = joints.stored_energy[changed] * old_length  # J/m
        is_longer = length[changed] > old_length
        new_energy = joints.stored_energy[changed]  # J/m2
        balance.booked_area[changed] = self.contacts.area[changed]
        restarted = changed[is_longer]
        if len(restarted):
            closure = manager.closure[restarted]
            new_closure, new_energy[is_longer] = joints.restart(
                restarted, old_energy[is_longer] / length[restarted], closure
            )
            manager.closure_offset[restarted] += closure - new_closure
            balance.booked_dissipation[restarted] = 0.0
        discarded = old_energy - new_energy * length[changed]
        balance.energy[DISCARDED] += np.maximum(discarded, 0.0).sum() * thickness
        return restarted

    # ------------------------------------------------------------------ means over a joint

    def area_fractions(self, moving: int, base: int) -> np.ndarray:
        """Fraction (k,) of each contact in the area of the joint between two blocks."""
        area = self.energy_balance.booked_area * self.manager.between(moving, base)
        return area / max(area.sum(), TINY)

    def shear_displacement(self, moving: int, base: int) -> float:
        """Shear displacement (m) of the joint between two blocks, mean over its area."""
        mean = self.area_fractions(moving, base) @ self.joints.delta[:, 1:]
        return float(vector_length(mean[None])[0])

    # ------------------------------------------------------------------ saved states

    def state(self) -> SavedState:
        """A copy of everything that later steps depend on."""
        paths = (*self.state_paths, *self.contact_paths)
        arrays = {path: np.array(attrgetter(path)(self)) for path in paths}
        return self.joints.snapshot() | arrays

    def _restore(self, saved: SavedState, step: float | None) -> None:
        """Return to a saved state; with `step`, continue with this time step (s)."""
        for path in self.state_paths:
            holder_path, _, name = path.rpartition(".")
            holder = attrgetter(holder_path)(self) if holder_path else self
            value = saved[path]
            if path in self.updated_in_place:
                getattr(holder, name)[:] = value
            else:
                setattr(holder, name, value.copy() if value.ndim else value.item())
        manager = self.manager
        blocks = self.blocks
        blocks.remove(np.flatnonzero(blocks.is_removed).tolist())
        self._restore_contacts(saved)
        self.joints.restore(saved, manager.law, manager.face_pairs)
        if step:
            self._change_time_step(step)
            self.limit.update(self.scene, blocks, self.contacts, self.joints)
            self.limit.require_stable(step)
        self.bind()

    def _restore_contacts(self, saved: SavedState) -> None:
        """Make the contacts of a saved state again."""
        manager = self.manager
        corner, edge = saved[CONTACT_KEYS]
        manager.contacts = Contacts(manager.outlines, corner, edge, self.blocks.motion)

    def save(self, folder: Path, saved: SavedState | None = None) -> None:
        """Write a state (default: the present one) and its scene into a folder; its other files
        stay.

        Raises ValueError for a scene that was changed or made in memory. A state in memory needs no
        text: `Simulation(scene, saved=sim.state())`.
        """
        require_text(self.scene)
        buffer = io.BytesIO()
        np.savez(
            buffer,
            version=VERSION,
            scene=self.scene.text,
            files=json.dumps(self.scene.files),
            **(saved or self.state()),
        )
        write_files(folder, {FILE: buffer.getvalue()})

    @classmethod
    def load(cls, folder: Path, step: float | None = None) -> "Simulation":
        """Continue from a folder that `save` wrote; with `step`, with another time step (s).

        Raises ValueError if the file is missing, damaged or of another version.
        """
        file = find_state(folder)
        try:
            version, scene, saved = cls._read_state(file)
        except (OSError, EOFError, LookupError, ValueError, AttributeError, BadZipFile) as error:
            raise ValueError(f"{file} is damaged ({error}): run the scene again") from None
        if scene is None:
            raise ValueError(
                f"{file} has version {version}, this demo reads {VERSION}: go on with the version "
                "of the demo that wrote it, or run the scene again"
            )
        return cls(scene, step, saved)

    @classmethod
    def _read_state(cls, file: Path) -> tuple[int, Scene | None, SavedState]:
        """Version, scene and state of a file; no scene for another version than `VERSION`."""
        data = read_arrays(file)
        version = int(data["version"])
        if version != VERSION:
            return version, None, {}
        files = Files(known=json.loads(str(data["files"])))
        scene = cls.parse(str(data["scene"]), str(file), files)
        joints = [f"{part}-{i}" for part in STATE_PARTS for i in range(len(scene.laws))]
        names = (*cls.state_paths, *cls.contact_paths, "first_touch", *joints)
        return version, scene, {name: data[name] for name in names}


def find_state(folder: Path) -> Path:
    """Return the file of the state in the folder of a run, or in the state folder in it.

    Raises ValueError if there is none.
    """
    places = [Path(folder) / part / FILE for part in ("", "state", "last_valid_state")]
    file = next((place for place in places if place.is_file()), None)
    if not file:
        raise ValueError(f"{str(folder)!r} holds no saved state: {FILE} is missing")
    return file


def read_arrays(file: Path) -> SavedState:
    """Read all arrays of a file of a state."""
    # ZIP files have checksums. Opened here, because numpy leaves a damaged file open.
    with file.open("rb") as stream, np.load(stream, allow_pickle=False) as stored:
        return {name: stored[name] for name in stored.files}


def require_text(scene: Scene) -> None:
    """Raise ValueError for a scene without a text, from which no file can continue."""
    if not scene.text:
        raise ValueError(
            "the scene was made or changed in memory, so it has no text to go on from: write the "
            "change into the TOML text and parse that, or go on in memory with "
            "Simulation(scene, saved=state)"
        )
