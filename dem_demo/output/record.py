"""The history of a run, in memory and as files."""

import csv
from pathlib import Path

import numpy as np

from ..dynamics.energy import COLUMNS
from ..dynamics.simulation import Simulation
from .monitors import SlipMonitor, law_between, readings

JOINT_COLUMNS = (
    "closure_m", "shear_m", "normal_stress_Pa", "shear_stress_Pa",
    "sliding", "slipping", "separated", "length_m", "sliding_m/s",
)  # fmt: skip
VERSION = 1  # of history.npz


class Record:
    """Frames of a run: times (f,), motion (f, 6, n), energies (f, 9), joints as lists of arrays.

    joints[f]: "who" (k, 5) block, edge, block, edge, contact; "ends" (k, 2, 2) the segment of joint
    that a contact carries; "values" (k, 9) as JOINT_COLUMNS. monitored[f]: what the scene's
    [watch] asks for; slips: its slip angles; laws: of the sheared joints; state: that of the last
    frame, to return to.
    """

    def __init__(self, sim: Simulation) -> None:
        self.scene, self.slips = sim.scene, SlipMonitor(sim)
        self.laws = {pair: law_between(sim, *pair) for pair in sim.scene.monitors.shear}
        self.times: list[float] = []
        self.motion: list[np.ndarray] = []
        self.energy: list[list[float]] = []
        self.joints: list[dict[str, np.ndarray]] = []
        self.monitored: list[dict[str, float]] = []
        self.take(sim)

    def take(self, sim: Simulation) -> None:
        """Add the present as a frame."""
        ledger = sim.ledger
        self.times.append(sim.time)
        self.motion.append(sim.blocks.motion.copy())
        self.energy.append([*(ledger.value[c] for c in COLUMNS), ledger.error])
        self.joints.append(_joints(sim))
        self.monitored.append(readings(sim))
        self.state = sim.state()

    @property
    def largest_error(self) -> float:
        """Largest imbalance of the energies since the first frame."""
        return max((abs(row[-1]) for row in self.energy[1:]), default=0.0)

    @property
    def moved(self) -> np.ndarray:
        """Distance (n,) that the blocks have moved since the first frame (m)."""
        return np.hypot(*(self.motion[-1] - self.motion[0])[:2])

    def column(self, name: str) -> np.ndarray:
        """A monitored quantity over all frames."""
        return np.array([row[name] for row in self.monitored])

    def joint(self, i: int, name: str) -> np.ndarray:
        """One of JOINT_COLUMNS of the joints of frame i."""
        return self.joints[i]["values"][:, JOINT_COLUMNS.index(name)]

    def write(self, folder: Path) -> None:
        """history.csv, blocks.csv, joints.csv and history.npz."""
        names = [block.name for block in self.scene.blocks]
        header = ["time_s", *(f"{c}_J" for c in COLUMNS), "energy_error", *self.monitored[0]]
        rows = zip(self.times, self.energy, self.monitored, strict=True)
        write_csv(folder / "history.csv", header, ([t, *e, *w.values()] for t, e, w in rows))
        header = ["time_s", "block", "x_m", "y_m", "angle_rad", "vx_m/s", "vy_m/s", "spin_rad/s"]
        rows = []
        for t, motion in zip(self.times, self.motion, strict=True):
            rows += [[t, name, *b] for name, b in zip(names, motion.T.tolist(), strict=True)]
        write_csv(folder / "blocks.csv", header, rows)
        header = ["time_s", "block_a", "edge_a", "block_b", "edge_b", "point", *JOINT_COLUMNS]
        rows = []
        for t, frame in zip(self.times, self.joints, strict=True):
            who, values = frame["who"].tolist(), frame["values"].tolist()
            for (a, edge_a, b, *rest), numbers in zip(who, values, strict=True):
                rows.append([t, names[a], edge_a, names[b], *rest, *numbers])
        write_csv(folder / "joints.csv", header, rows)
        counts, keys = [len(frame["who"]) for frame in self.joints], ("who", "ends", "values")
        np.savez_compressed(
            folder / "history.npz",
            version=VERSION,
            time=self.times,
            motion=np.array(self.motion),
            energy=np.array(self.energy),
            energy_columns=[*COLUMNS, "error"],
            block_names=names,
            joint_frame=np.repeat(np.arange(len(counts)), counts),
            joint_columns=JOINT_COLUMNS,
            **{f"joint_{key}": np.concatenate([f[key] for f in self.joints]) for key in keys},
        )


def _joints(sim: Simulation) -> dict[str, np.ndarray]:
    """Joints that touch or almost touch."""
    c, joints = sim.contacts, sim.joints
    keep = c.length > 0
    values = [
        c.closure, joints.delta[:, 1], *joints.traction.T, joints.sliding, joints.slipping,
        joints.separated, c.length, c.sliding,
    ]  # fmt: skip
    # The segment: what each side of the corner carries of it, the rest half and half.
    part = c.carried + 0.5 * (c.length - c.carried.sum(axis=0))
    ahead = part[0] / np.maximum(part.sum(axis=0), 1e-300)
    along = np.where(c.outlines.block[c.edge] == c.a, 1j, -1j) * c.normal
    ends = c.at + np.stack([ahead, ahead - 1], axis=0) * c.length * along
    ends = np.stack([ends.real, ends.imag], axis=-1).swapaxes(0, 1)
    who = np.column_stack([c.interfaces, sim.tracker.numbers])
    return {"who": who[keep], "ends": ends[keep], "values": np.column_stack(values)[keep]}


def write_csv(path: Path, header, rows) -> None:
    """A table with the names of its columns."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(rows)
