"""Monitors of a run: slip in a tilt test, stress and dilation in shear, points of a rock."""

import numpy as np

from ..dynamics.simulation import Simulation
from ..scene import turn
from .law_alone import slip_angle, slip_distance


class SlipMonitor:
    """Looks for the slip of the joints that the scene's [watch] table names."""

    def __init__(self, sim: Simulation) -> None:
        self.scene, self.slips, self.lengths = sim.scene, {}, {}
        for moving, base in self.scene.monitors.slip:
            name = law_between(sim, moving, base)
            distance = slip_distance(self.scene.laws[name])
            self.slips[moving, base] = {
                "block": self.scene.blocks[moving].name,
                "base": self.scene.blocks[base].name,
                "law": name,
                "slip_distance": distance,
                "slip_angle": None,
                "slip_time": None,
                "slipped_before": sim.slid(moving, base) > distance,
            }
            here = sim.tracker.between(moving, base)
            self.lengths[moving, base] = float(sim.contacts.length[here].sum())

    def look(self, sim: Simulation) -> None:
        """Note the base angle at which a joint passes its slip distance."""
        for (moving, base), entry in self.slips.items():
            waits = entry["slip_angle"] is None and not entry["slipped_before"]
            if waits and sim.slid(moving, base) > entry["slip_distance"]:
                entry["slip_angle"] = base_angle(sim, moving, base)
                entry["slip_time"] = sim.time

    def report(self) -> list[dict]:
        """Measured and predicted slip angles (degrees)."""
        return [
            entry | slip_angle(self.scene, entry["law"], pair[0], self.lengths[pair])
            for pair, entry in self.slips.items()
        ]


def base_angle(sim: Simulation, moving: int, base: int) -> float:
    """Angle (degrees, 0 to 90) of a base against the horizontal that gravity defines; 0 without it.

    Of the base's face that `moving` lies on: the one that its centroid is farthest outside of.
    """
    _, outward = _face(sim, base, moving)
    across, down = np.array([-outward[1], outward[0]]), np.array(sim.scene.gravity)
    return float(np.degrees(np.arctan2(abs(across @ down), abs(outward @ down))))


def law_between(sim: Simulation, moving: int, base: int) -> str:
    """Name of the law of the joint between the faces with which two blocks face each other."""
    faces = _face(sim, moving, base)[0], _face(sim, base, moving)[0]
    return sim.scene.law_of((moving, faces[0], base, faces[1]))


def _face(sim: Simulation, block: int, other: int) -> tuple[int, np.ndarray]:
    """Number and outward normal of a block's face that another's centroid is farthest outside."""
    x, y, angle = sim.blocks.motion[:3, block]
    corners = sim.scene.blocks[block].local @ turn(angle).T + [x, y]
    along = np.roll(corners, -1, axis=0) - corners
    outward = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.hypot(*along.T)[:, None]
    face = int(((sim.blocks.motion[:2, other] - corners) * outward).sum(axis=1).argmax())
    return face, outward[face]


def readings(sim: Simulation) -> dict[str, float]:
    """What the scene's [watch] table asks for, now; the unit ends the name."""
    row, blocks = {}, sim.scene.blocks
    for moving, base in (*sim.scene.monitors.slip, *sim.scene.monitors.shear):
        name = blocks[moving].name
        row[f"{name}: base angle_deg"] = base_angle(sim, moving, base)
        row |= {f"{name}: {key}": value for key, value in _joint(sim, moving, base).items()}
    for i, (block, point) in enumerate(sim.scene.monitors.pins):
        x, y, angle = sim.blocks.motion[:3, block]
        arm = np.asarray(point) - blocks[block].centroid
        row[f"pin {i + 1}: moved_m"] = float(np.hypot(*(turn(angle) @ arm + [x, y] - point)))
    return row


def _joint(sim: Simulation, moving: int, base: int) -> dict[str, float]:
    """Mean over the joint between two blocks: stresses, closure, sliding, sliding share."""
    here, joints = sim.tracker.between(moving, base), sim.joints
    area = sim.ledger.area[here]
    columns = [*joints.traction[here].T, *joints.delta[here].T, joints.sliding[here]]
    keys = "normal_Pa", "shear_Pa", "closure_m", "slid_m", "sliding_share"
    share = area / area.sum() if area.any() else 0.0 * area
    return {key: float(share @ column) for key, column in zip(keys, columns, strict=True)}
