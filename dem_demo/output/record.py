"""The history of a run, in memory and as files."""

import csv
from pathlib import Path

import numpy as np

from ..contact import Contacts, Points, raised
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

    joints[f]: "who" (k, 5) block, edge, block, edge, point; "ends" (k, 2, 2) the segment of joint
    that a law point carries; "values" (k, 9) as JOINT_COLUMNS. monitored[f]: what the scene's
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
        ledger = sim.now.ledger
        self.times.append(sim.time)
        self.motion.append(sim.now.motion.copy())
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

    def write(self, folder: Path) -> None:
        """history.csv, blocks.csv, joints.csv and history.npz."""
        names = [block.name for block in self.scene.blocks]
        header = ["time_s", *(f"{c}_J" for c in COLUMNS), "energy_error", *self.monitored[0]]
        write_csv(
            folder / "history.csv",
            header,
            (
                [t, *e, *w.values()]
                for t, e, w in zip(self.times, self.energy, self.monitored, strict=True)
            ),
        )
        write_csv(
            folder / "blocks.csv",
            ["time_s", "block", "x_m", "y_m", "angle_rad", "vx_m/s", "vy_m/s", "spin_rad/s"],
            (
                [t, name, *state]
                for t, motion in zip(self.times, self.motion, strict=True)
                for name, state in zip(names, motion.T.tolist(), strict=True)
            ),
        )
        write_csv(
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
            version=VERSION,
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


def _joints(sim: Simulation) -> dict[str, np.ndarray]:
    """Joints that touch or almost touch."""
    now, measured = sim.now, sim.joints.now
    points, contacts = now.points, now.law_points.contacts
    keep = points.length > 0
    who = _who(contacts, points, [number for _, number in now.layout.identities])
    values = np.column_stack(
        [points.closure, sim.joints.read("delta")[:, 1], *now.traction.T, measured["sliding"],
         measured["slipping"], measured["separated"], points.length, points.sliding]
    )  # fmt: skip
    return {
        "who": who[keep],
        "ends": _segments(contacts, points, now.motion)[keep],
        "values": values[keep],
    }


def _segments(contacts: Contacts, points: Points, motion: np.ndarray) -> np.ndarray:
    """Ends (n, 2, 2) of the segment of joint that each law point stands for: [point, end, x y]."""
    c, k = contacts, len(contacts.corner)
    lies = 1 - raised(points.rise, np.ones_like(points.rise))[0]
    part = c.share * lies * np.maximum(points.overlap, 0.0)
    part += 0.5 * (points.length[:k] - part.sum(axis=0))
    way = c.outlines.place(motion)[1][c.edge]
    ahead = np.full(len(c), 0.5)
    ahead[:k] = part[0] / np.maximum(part.sum(axis=0), 1e-300)
    if c.along is not None:
        way = np.concatenate([way, 1j * points.normal[k:]])
    ends = points.at + np.stack([ahead, ahead - 1], axis=0) * points.length * way
    return np.stack([ends.real, ends.imag], axis=-1).swapaxes(0, 1)


def _who(contacts: Contacts, points: Points, numbers: list[int]) -> np.ndarray:
    """Who meets at every law point: (n, 5) block, edge, block, edge and the point's number.

    Of the two edges at a corner the flatter one counts. Points along an edge have numbers below 0.
    """
    o, one, other = contacts.outlines, contacts.corner, contacts.edge
    one = o.flatter(one, points.rise)
    if (u := contacts.along) is not None:
        one = np.concatenate([one, u.first[u.of]])
        other = np.concatenate([other, u.second[u.of]])
    return np.column_stack([o.interfaces(one, other), numbers])


def write_csv(path: Path, header, rows) -> None:
    """A table with the names of its columns."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(rows)
