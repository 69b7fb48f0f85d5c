"""A scene in motion, for a user: steps, and states to return to."""

from pathlib import Path

import numpy as np

from ..contact import Joints
from ..scene import Scene
from . import guards, saved_states
from .start import begin
from .state import State, System
from .step import advance
from .world import World

Saved = saved_states.Saved


class Simulation:
    """A scene in motion. `step()` advances it; `state()` and `restore()` are bit-exact.

    step: time step (s), instead of the scene's. now: the state; joints: theirs; balanced: were the
    blocks in equilibrium at the start? Raises Refused for a start that the method cannot carry.
    """

    def __init__(self, scene: Scene, step: float | None = None, saved: Saved | None = None) -> None:
        guards.require_positive(step)
        self.scene, self.system, self.balanced = scene, System(scene), True
        self.world = World(scene.blocks, self.system.inertia, self.system.skin)
        self.joints = Joints(scene.laws, scene.law_of)
        self.now: State
        if saved:
            self.now = saved_states.unpack(self.system, self.joints, saved, step)
        else:
            drawn, near = self.world.motion(), self.world.near
            self.now, self.balanced = begin(self.system, self.joints, drawn, near, step)
        self.world.place(self.now.motion)

    @property
    def time(self) -> float:
        """Model time (s)."""
        return self.now.time

    def step(self) -> None:
        """One time step. Raises Refused for a state that the method cannot carry."""
        self.world.step(self.now.dt, self._forces)

    def _forces(self, motion: np.ndarray) -> np.ndarray:
        """Forces (n, 3) at the positions just reached."""
        self.now = advance(self.system, self.joints, self.now, motion, self.world.near)
        return self.now.ledger.forces[0]

    def state(self) -> Saved:
        """A copy of everything that the future depends on."""
        return saved_states.pack(self.now, self.joints, self.world.motion())

    def restore(self, saved: Saved, step: float | None = None) -> None:
        """Return to a state; with `step`, go on from there with another time step (s).

        Raises ValueError for a step that is no finite number > 0, Refused beyond the limit; all is
        then as it was.
        """
        before = self.joints.snapshot()
        try:
            self.now = saved_states.unpack(self.system, self.joints, saved, step)
        except Exception:
            self.joints.restore(before, self.now.layout.identities)
            raise
        self.world.place(self.now.motion)

    def save(self, folder: Path, saved: Saved | None = None) -> None:
        """Write a state (default: now) and its scene to a folder; what else is there stays.

        Raises ValueError for a scene that its own text does not give: one that was changed or made
        in memory. `state` and `restore` need no text.
        """
        saved_states.save(self.scene, saved or self.state(), Path(folder))

    @classmethod
    def load(cls, folder: Path, step: float | None = None) -> "Simulation":
        """Continue from a folder that `save` wrote, with `step` as in `restore`.

        Raises ValueError if a file is missing, damaged or of another state, or the scene another.
        """
        scene, saved = saved_states.load(Path(folder))
        return cls(scene, step, saved)
