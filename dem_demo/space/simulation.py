"""A scene in space in motion: the simulation of the plane with the contacts in space.

Time step, energy balance, excavation, drives and saved states are written once, for blocks with 3
motions and with 6 (`dynamics/simulation.py`). This module replaces what depends on the geometry.
"""

from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from jointlaw.kernels.threads import thread_count

from ..compiled import StepArrays, function_address
from ..contact import Joints
from ..dynamics.energy_balance import DISCARDED, EnergyBalance
from ..dynamics.equilibrium import start_under_stress
from ..dynamics.simulation import (
    CONTACT_KEYS,
    STATE,
    UPDATED_IN_PLACE,
    WIDE_MARGIN,
    SavedState,
    Simulation,
    find_state,
    read_arrays,
)
from ..dynamics.timestep import MAX_FRACTION_OF_LIMIT
from ..scene import read_tables
from ..scene.read import is_in_space
from .blocks import SpaceBlocks, apply_loads, impact_limit
from .in_situ import in_situ_traction
from .manager import POINT_ARRAYS, FaceContactManager, FacePoints
from .read import parse
from .scene import SpaceScene

MIN_POINTS_FOR_THREADS = 20_000  # at 12 000 a second thread costs as much as it saves
NOT_CHECKED = -1.0  # N/m: the step is checked in any case, as every stiffness is larger
MAX_LANDING_FRACTION = 0.1  # of the limit: longest step in which blocks land, see docs/space.md
OF_BOLTS = "blocks.bolts."  # paths of the state that only the plane has


class SpaceSimulation(Simulation):
    """A scene in space in motion; see `Simulation`.

    initial (12, n): motion at step 0; initial_axes (n, 3, 3): principal axes of the blocks then.

    Raises ValueError for a scene without a `[run]` table with an `end`.
    """

    updated_in_place: ClassVar = (
        *(path for path in UPDATED_IN_PLACE if not path.startswith(OF_BOLTS)),
        "blocks.axes",
    )
    state_paths: ClassVar = (
        *(path for path in STATE if not path.startswith(OF_BOLTS)),
        "blocks.axes",
        "initial_axes",
    )
    contact_paths: ClassVar = (CONTACT_KEYS, *(f"contacts.{name}" for name in POINT_ARRAYS))
    parse: ClassVar = staticmethod(parse)
    scene: SpaceScene
    blocks: SpaceBlocks
    manager: FaceContactManager

    def __init__(
        self, scene: SpaceScene, step: float | None = None, saved: SavedState | None = None
    ) -> None:
        if scene.run is None:
            raise ValueError("the blocks of this scene do not move: give end (s) in [run]")
        super().__init__(scene, step, saved)

    def _create_parts(self) -> None:
        scene = self.scene
        self.blocks = SpaceBlocks(scene)
        self.manager = FaceContactManager(scene, self.blocks)
        self.joints = Joints(scene)
        self.energy_balance = EnergyBalance(len(scene.blocks), dof=6)

    @property
    def contacts(self) -> FacePoints:
        """The contact points at the present places of the blocks."""
        return self.manager.contacts

    def _apply_loads(self, *_: Any) -> np.ndarray:
        manager = self.manager
        return apply_loads(self.scene, self.blocks, manager.contacts, manager.law, self.water_time)

    def _impact_limit(self, stiffness: float) -> float:
        return impact_limit(self.blocks, stiffness)

    def _create_joints(self) -> np.ndarray:
        blocks = self.blocks
        manager = self.manager
        old_row = manager.rebuild(blocks.motion, blocks.neighbour_pairs())
        self.joints.rearrange(old_row, manager.law, manager.face_pairs)
        self._apply_loads()
        if self.scene.in_situ is None or not self.joints.n:
            return np.zeros((self.joints.n, 2))
        contacts = manager.contacts
        stress = in_situ_traction(self.scene, contacts, contacts.directions)
        skin = float(manager.skins.min())
        offset, shears = start_under_stress(self.joints, stress, contacts.closure, skin)
        manager.closure_offset = offset
        return shears

    def _note_initial_places(self) -> None:
        super()._note_initial_places()
        self.initial_axes = self.blocks.axes.copy()

    def _add_gyroscopic_half_step(self, velocity: np.ndarray) -> None:
        acceleration = self.blocks.gyroscopic_acceleration()
        velocity[3:] += 0.5 * self.dt * acceleration * self.blocks.is_free[:, 3:].T

    def _bind_geometry(self, arrays: StepArrays) -> None:
        arrays.bind(self.blocks, "axes")
        arrays.bind(geometry=self.contacts.arrays)
        arrays.update_geometry = function_address("update_face_points")
        arrays.has_parts = 1

    def _count_threads(self) -> int:
        return thread_count() if self.joints.n > MIN_POINTS_FOR_THREADS else 1

    # ------------------------------------------------------------------ contacts that change

    def _update_contact_list(self) -> None:
        """Rebuild the list of points, and book the stored energy that is lost by it.

        The polygons of sliding blocks change, and points that continue a joint keep its energy per
        area. Where the stored energy of all points becomes smaller, the difference is discarded.
        Where it becomes larger, the balance shows an error.
        """
        balance = self.energy_balance
        energy_before = float(self.contacts.area @ self.joints.stored_energy)
        is_new = self._rebuild_contacts()
        self._continue_across_seams(is_new)
        balance.booked_area = self.contacts.area.copy()
        balance.booked_dissipation = self.joints.dissipated_energy.copy()
        energy_after = float(balance.booked_area @ self.joints.stored_energy)
        balance.energy[DISCARDED] += max(energy_before - energy_after, 0.0)
        self.bind()
        balance.change_loads(self.blocks, self._apply_loads(), self.dt)
        self.arrays.call("set_increments", self.dt)

    def _rebuild_contacts(self) -> np.ndarray:
        """Rebuild the list of points; returns the mask (k,) of the new ones."""
        blocks = self.blocks
        manager = self.manager
        limit = self.limit
        if self.dt > WIDE_MARGIN * limit.current:  # areas and lever arms have changed
            limit.checked_stiffness[:] = 0.0
        old_row = manager.rebuild(blocks.motion, blocks.neighbour_pairs(), keep_closure=False)
        limit.checked_stiffness = np.append(limit.checked_stiffness, 0.0)[old_row]
        self.joints.rearrange(old_row, manager.law, manager.face_pairs, started=True)
        if self.halvings_left:
            self._mark_landings()
        return old_row < 0

    def _mark_landings(self) -> None:
        """Have the time step checked at the end of this step if blocks are about to land.

        Contacts that are still open, and will be stiffer than the time step has been checked for:
        new ones, or wider ones, as where a face comes down on which only an edge has stood.
        """
        contacts = self.contacts
        closure = np.maximum(contacts.closure, 0.0)
        stiffness = contacts.area * self.joints.interpolate("stiffness", "closure", closure)
        checked = self.limit.checked_stiffness
        checked[(contacts.closure < 0) & (stiffness > checked)] = NOT_CHECKED

    def _check_time_step(self) -> None:
        """Halve the time step for landings, beyond what stability needs.

        A contact opens or closes within a step, but its force acts from the step in which it is
        closed to the one in which it is open. Of the energy of an impact this gains or loses up to
        (omega dt)^2/4, with the frequency omega of the block on the contact.
        """
        if self.halvings_left and (self.limit.checked_stiffness == NOT_CHECKED).any():
            longest = self.dt * MAX_FRACTION_OF_LIMIT / MAX_LANDING_FRACTION  # needs a bound there
            limit = self.limit
            limit.update(self.scene, self.blocks, self.contacts, self.joints, longest)
            while self.dt > MAX_LANDING_FRACTION * limit.current and self._halve_time_step():
                pass
        super()._check_time_step()

    def _continue_across_seams(self, is_new: np.ndarray) -> None:
        """Let new points on a coplanar block continue the joints across the seam."""
        manager = self.manager
        joints = self.joints
        rows = np.flatnonzero(is_new)
        sources = manager.find_neighbours(rows, joints.stored_energy > 0)
        rows, sources = rows[sources >= 0], sources[sources >= 0]
        if len(rows):
            manager.closure_offset[rows] = manager.closure_offset[sources]
            joints.continue_joints(rows, sources)

    # ------------------------------------------------------------------ saved states

    def _restore_contacts(self, saved: SavedState) -> None:
        arrays = {name: saved[f"contacts.{name}"] for name in POINT_ARRAYS}
        self.manager.contacts = FacePoints(self.blocks, saved[CONTACT_KEYS], **arrays)


def load_simulation(folder: Path, step: float | None = None) -> Simulation:
    """Continue from a folder that `Simulation.save` wrote, in the plane or in space.

    step: another time step (s). Raises ValueError as `Simulation.load`.
    """
    try:
        text = str(read_arrays(find_state(folder))["scene"])
        kind = SpaceSimulation if is_in_space(read_tables(text)) else Simulation
    except (OSError, EOFError, LookupError):
        kind = Simulation  # which names the damage
    return kind.load(folder, step)
