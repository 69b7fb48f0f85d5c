"""What stays the same during a run: masses, steady forces, and how contacts are followed."""

import numpy as np

from ..contact import Tracker
from ..scene import Drives, Scene
from .timestep import StepLimit

CORNER = 0.1  # contact length of a corner as a share of the least block width, by default
SKIN = 0.02  # of the least block width, by default


class System:
    """A scene made ready. Arrays (n, 3) run over blocks and motions x, y, turn.

    inertia: mass, mass, moment; mobile: motions of blocks that are not fixed; free: those that
    forces move; gravity, loads, steady (their sum): forces in N.
    """

    def __init__(self, scene: Scene) -> None:
        run, blocks = scene.run, scene.blocks
        self.scene = scene
        width = min(b.width for b in blocks)
        self.skin = run.skin or SKIN * width
        self.tracker = Tracker(
            blocks, self.skin, run.point_spacing, run.max_overlap,
            run.corner_length or CORNER * width, scene.law_of,
        )  # fmt: skip
        self.drives = Drives(scene.drives)
        mass = np.array([b.density * b.area * scene.thickness for b in blocks])
        moment = np.array([b.density * b.polar * scene.thickness for b in blocks])
        self.inertia = np.stack([mass, mass, moment], axis=1)
        self.mobile = np.array([[not b.fixed] * 3 for b in blocks])
        self.free = self.mobile.copy()
        self.free[self.drives.rows, self.drives.axes] = False
        self.reach = np.array([b.reach for b in blocks])
        self.gravity = self.mobile * self.inertia * [*scene.gravity, 0.0]
        self.loads = np.array([[*b.load, 0.0] for b in blocks]) * self.mobile
        self.steady = self.gravity + self.loads
        self.damped = bool(run.dashpot_normal or run.dashpot_shear)
        self.limit = StepLimit(self.inertia, self.free)
        self.lightness = self.free[:, :2].any(axis=1) / mass  # 1/kg, of blocks that can give way
