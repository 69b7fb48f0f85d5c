"""The history of a run, in memory and as files."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from .energy import COLUMNS
from .shapes import turn
from .simulation import Simulation
from .stretches import names, stretches
from .watch import base_angle, joint_state

JOINT_COLUMNS = (
    "closure_m", "shear_m", "normal_stress_Pa", "shear_stress_Pa",
    "sliding", "slipping", "separated", "length_m", "sliding_m/s",
)  # fmt: skip


class Record:
    """Frames of a run: times (f,), motion (f, 6, n), energies (f, 9), joints as lists of arrays.

    joints[f]: "who" (k, 5) block, edge, block, edge, point; "ends" (k, 2, 2) the stretch of joint
    that a law point carries; "values" (k, 9) as JOINT_COLUMNS.
    """

    def __init__(self, sim: Simulation) -> None:
        self.scene = sim.scene
        self.times: list[float] = []
        self.motion: list[np.ndarray] = []
        self.energy: list[list[float]] = []
        self.joints: list[dict[str, np.ndarray]] = []
        self.watched: list[dict[str, float]] = []

    def take(self, sim: Simulation) -> None:
        """Add the present as a frame."""
        self.times.append(sim.time)
        self.motion.append(sim.motion.copy())
        self.energy.append([*(sim.ledger.value[c] for c in COLUMNS), sim.ledger.error])
        self.joints.append(_joints(sim))
        row = {}
        for kind in ("slip", "shear"):
            for moving, base in self.scene.watch.get(kind, []):
                name = self.scene.blocks[moving].name
                row[f"{name}: base angle_deg"] = base_angle(sim, moving, base)
                for key, value in joint_state(sim, moving, base).items():
                    row[f"{name}: {key}_{UNITS[key]}"] = value
        for i, pin in enumerate(self.scene.watch.get("pins", [])):
            row[f"pin {i + 1}: moved_m"] = float(np.hypot(*_moved(sim, *pin)))
        self.watched.append(row)

    def column(self, name: str) -> np.ndarray:
        """A watched quantity over all frames."""
        return np.array([row[name] for row in self.watched])

    def write(self, folder: Path) -> None:
        """history.csv, blocks.csv, joints.csv and history.npz."""
        names = [block.name for block in self.scene.blocks]
        header = ["time_s", *(f"{c}_J" for c in COLUMNS), "energy_error", *self.watched[0]]
        _csv(
            folder / "history.csv",
            header,
            (
                [t, *e, *w.values()]
                for t, e, w in zip(self.times, self.energy, self.watched, strict=True)
            ),
        )
        _csv(
            folder / "blocks.csv",
            ["time_s", "block", "x_m", "y_m", "angle_rad", "vx_m/s", "vy_m/s", "spin_rad/s"],
            (
                [t, name, *state]
                for t, motion in zip(self.times, self.motion, strict=True)
                for name, state in zip(names, motion.T.tolist(), strict=True)
            ),
        )
        _csv(
            folder / "joints.csv",
            ["time_s", "block_a", "edge_a", "block_b", "edge_b", "point", *JOINT_COLUMNS],
            (
                [t, names[who[0]], who[1], names[who[2]], who[3], who[4], *values]
                for t, frame in zip(self.times, self.joints, strict=True)
                for who, values in zip(frame["who"].tolist(), frame["values"].tolist(), strict=True)
            ),
        )
        counts = [len(frame["who"]) for frame in self.joints]
        np.savez_compressed(
            folder / "history.npz",
            time=self.times,
            motion=np.array(self.motion),
            energy=np.array(self.energy),
            energy_columns=[*COLUMNS, "error"],
            block_names=names,
            joint_frame=np.repeat(np.arange(len(counts)), counts),
            joint_columns=JOINT_COLUMNS,
            **{
                f"joint_{key}": np.concatenate([frame[key] for frame in self.joints])
                for key in ("who", "ends", "values")
            },
        )


UNITS = {"normal": "Pa", "shear": "Pa", "closure": "m", "slid": "m", "sliding": "share"}


def _moved(sim: Simulation, block: int, point: tuple[float, float]) -> np.ndarray:
    """Displacement (m) of a point of a block since it was drawn."""
    x, y, angle = sim.motion[:3, block]
    arm = np.asarray(point) - sim.scene.blocks[block].centroid
    return turn(angle) @ arm + [x, y] - point


def _joints(sim: Simulation) -> dict[str, np.ndarray]:
    """Joints that touch or almost touch."""
    points, keep = sim.points, sim.points.length > 0
    delta, now = sim.joints.read("delta"), sim.joints.now
    who = names(sim.contacts, points, [number for _, number in sim.identity])
    values = np.column_stack(
        [points.closure, delta[:, 1], *sim.traction.T, now["sliding"], now["slipping"],
         now["separated"], points.length, points.sliding]
    )  # fmt: skip
    return {
        "who": who[keep],
        "ends": stretches(sim.contacts, points, sim.motion)[keep],
        "values": values[keep],
    }


def _csv(path: Path, header, rows) -> None:
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(rows)
