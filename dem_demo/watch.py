"""What a run reports on while it goes: slip in a tilt test, stress and dilation in shear."""

from __future__ import annotations

import numpy as np

from .predict import slip_angle, slip_distance
from .shapes import turn
from .simulation import Simulation

EVERY = 8  # steps between two looks


class Watch:
    """Looks at the joints that the scene's [watch] table names."""

    def __init__(self, sim: Simulation) -> None:
        self.scene = scene = sim.scene
        self.slips = {}
        for moving, base in scene.watch.get("slip", []):
            law = scene.laws[scene.law_of((moving, 0, base, 0))]
            self.slips[moving, base] = {
                "block": scene.blocks[moving].name,
                "base": scene.blocks[base].name,
                "law": scene.law_of((moving, 0, base, 0)),
                "slip_distance": slip_distance(law),
                "slip_angle": None,
                "slip_time": None,
                "slipped_before": sim.slid(moving, base) > slip_distance(law),
            }
        self.lengths = {
            pair: float(sim.points.length[sim.points_between(*pair)].sum()) for pair in self.slips
        }

    def look(self, sim: Simulation) -> None:
        """Note the base angle at which a joint passes its slip distance."""
        for (moving, base), entry in self.slips.items():
            if _waits(entry) and sim.slid(moving, base) > entry["slip_distance"]:
                entry["slip_angle"] = base_angle(sim, moving, base)
                entry["slip_time"] = sim.time

    @property
    def waiting(self) -> bool:
        """Is there a slip still to come?"""
        return any(_waits(entry) for entry in self.slips.values())

    def report(self) -> list[dict]:
        """Measured and predicted slip angles (degrees)."""
        out = []
        for pair, entry in self.slips.items():
            law = slip_angle(self.scene, *pair, self.lengths[pair])
            out.append({**entry, **law})
        return out


def _waits(entry: dict) -> bool:
    return entry["slip_angle"] is None and not entry["slipped_before"]


def base_angle(sim: Simulation, moving: int, base: int) -> float:
    """Angle (degrees, 0 to 90) of a base against the horizontal that gravity defines; 0 without it.

    Of the base's face that `moving` lies on: the one that its centroid is farthest outside of.
    """
    x, y, angle = sim.motion[:3, base]
    corners = sim.scene.blocks[base].local @ turn(angle).T + [x, y]
    along = np.roll(corners, -1, axis=0) - corners
    along /= np.hypot(*along.T)[:, None]
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1)
    face = ((sim.motion[:2, moving] - corners) * outward).sum(axis=1).argmax()
    down = np.array(sim.scene.gravity)
    return float(np.degrees(np.arctan2(abs(along[face] @ down), abs(outward[face] @ down))))


def joint_state(sim: Simulation, moving: int, base: int) -> dict[str, float]:
    """Mean over the joint between two blocks: stresses (Pa), closure, sliding, sliding share."""
    here = sim.points_between(moving, base)
    area = sim.area[here]
    if not area.any():
        return dict.fromkeys(("normal", "shear", "closure", "slid", "sliding"), 0.0)
    share = area / area.sum()
    F, delta = sim.traction[here], sim.joints.read("delta")[here]
    return {
        "normal": float(share @ F[:, 0]),
        "shear": float(share @ F[:, 1]),
        "closure": float(share @ delta[:, 0]),
        "slid": float(share @ delta[:, 1]),
        "sliding": float(share @ sim.joints.now["sliding"][here]),
    }
