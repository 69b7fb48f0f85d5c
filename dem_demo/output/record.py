"""The history of a run, in memory and as files; and what became of each rock mass."""

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..dynamics.energy_balance import ENERGIES
from ..dynamics.simulation import Simulation
from ..scene import Scene, median_size
from .monitors import base_of, law_between, readings, watched_slips

FAILED = 0.1  # of the usual size of a rock's blocks: one that has moved farther has failed
CREEP, LOOK_BACK = 1e-6, 1.0  # m/s: faster is not at rest; s over which it is measured
TOLD = 12  # most blocks that a sentence names


class Record:
    """Frames of a run: times (f,), motion (f, 6, n), NaN for blocks that were taken away, energies
    (f, 9), joints.

    joints[f]: by name, "who" (k, 2) the two blocks; "ends" (k, 2, 2) the segment of joint that a
    contact carries; "law" (k,) its number in the scene; and numbers (k,) with their unit in the
    name. stresses[f] (3, n): xx, yy, xy of the blocks (Pa). monitored[f]: readings of
    [monitor]; slips: of its joints; laws: of these joints; state: of the last frame, to return to;
    steps: of the run; loose (n,): blocks that nothing held at step 0; initial (6, n):
    motion there, also of a run that is resumed.
    """

    def __init__(self, sim: Simulation) -> None:
        self.scene, self.slips, self.steps = sim.scene, watched_slips(sim), 0
        self.loose, self.initial = sim.unstable, sim.initial
        self.laws = {pair: law_between(sim, *pair) for pair in (*sim.scene.slip, *sim.scene.shear)}
        self.times, self.motion, self.energy = [], [], []
        self.joints, self.stresses, self.monitored = [], [], []
        self.take(sim)

    def take(self, sim: Simulation) -> None:
        """Add the present as a frame."""
        self.times.append(sim.time)
        self.motion.append(np.where(sim.blocks.is_removed, np.nan, sim.blocks.motion))
        self.energy.append([*sim.energy_balance.energy.tolist(), sim.energy_balance.error])
        self.joints.append(_joints(sim))
        self.stresses.append(block_stresses(sim))
        self.monitored.append(readings(sim))
        self.state = sim.state()

    def displaced(self, i: int) -> np.ndarray:
        """Displacements (n, 2) from step 0 to frame i, relative to the base (m)."""
        base = base_of(self.scene, self.motion[i]) - base_of(self.scene, self.initial)
        return (self.motion[i][:2] - self.initial[:2]).T - base[:2]

    @property
    def moved(self) -> np.ndarray:
        """Distance (n,) that the blocks have moved since step 0 (m)."""
        return np.hypot(*self.displaced(-1).T)

    def column(self, name: str) -> np.ndarray:
        """A monitored quantity over all frames."""
        return np.array([row[name] for row in self.monitored])

    def write(self, path: Path) -> None:
        """history.csv: times, energies and what the scene's [monitor] asks for."""
        header = ["time_s", *(f"{c}_J" for c in ENERGIES), "energy_error", *self.monitored[0]]
        rows = zip(self.times, self.energy, self.monitored, strict=True)
        write_csv(path, header, ([t, *e, *w.values()] for t, e, w in rows))

    def write_blocks(self, path: Path) -> None:
        """blocks.csv: where each block is at the end, and how it moved since step 0."""
        last, away = self.motion[-1].T, self.displaced(-1)
        slip, joints = np.zeros(len(last)), self.joints[-1]
        np.maximum.at(slip, joints["who"], np.abs(joints["shear_m"])[:, None])
        columns = {
            "block": [block.name for block in self.scene.blocks], "x_m": last[:, 0],
            "y_m": last[:, 1], "displacement_m": np.hypot(*away.T), "displacement_x_m": away[:, 0],
            "displacement_y_m": away[:, 1],
            "rotation_deg": np.degrees(last[:, 2] - self.initial[2]),
            "speed_m/s": np.hypot(*last[:, 3:5].T), "largest_joint_slip_m": slip,
            "loose_at_start": self.loose.astype(int),
        }  # fmt: skip
        write_csv(path, columns, zip(*columns.values(), strict=True))


def named(scene: Scene, which: np.ndarray) -> list[dict]:
    """The blocks of a mask (n,): names and centroids as drawn (m)."""
    return [dict(zip(("block", "x_m", "y_m"), (block.name, *block.centroid.tolist()), strict=True))
            for block, meant in zip(scene.blocks, which, strict=True) if meant]  # fmt: skip


def told(blocks: list[dict]) -> str:
    """Names and centroids of some blocks, for a person."""
    said = [f"{one['block']} ({one['x_m']:.2f}, {one['y_m']:.2f})" for one in blocks[:TOLD]]
    return ", ".join(said + [f"and {len(blocks) - TOLD} more"] * (len(blocks) > TOLD)) or "none"


def _joints(sim: Simulation) -> dict[str, np.ndarray]:
    """Joints that touch or almost touch."""
    c, joints = sim.contacts, sim.joints
    # The segment: what each side of the corner carries of it, the rest half and half.
    part = c.overlap_length + 0.5 * (c.length - c.overlap_length.sum(axis=0))
    ahead = part[0] / np.maximum(part.sum(axis=0), 1e-300)
    ends = c.position + np.stack([ahead, ahead - 1], axis=0) * c.length * c.edge_direction
    ends = np.stack([ends.real, ends.imag], axis=-1).swapaxes(0, 1)
    columns = {
        "who": np.column_stack([c.block_a, c.block_b]), "ends": ends, "law": sim.manager.law,
        "closure_m": c.closure, "shear_m": joints.delta[:, 1],
        "normal_stress_Pa": joints.traction[:, 0], "shear_stress_Pa": joints.traction[:, 1],
        "sliding": joints.sliding, "slipping": joints.slipping, "separated": joints.separated,
        "length_m": c.length, "sliding_m/s": c.sliding_rate,
    }  # fmt: skip
    return {name: column[c.length > 0] for name, column in columns.items()}


def block_stresses(sim: Simulation) -> np.ndarray:
    """Mean stress xx, yy, xy (3, n) in each block (Pa, compression positive): force times arm of
    its joints, over its volume. NaN where other forces hold or load a block."""
    c, blocks = sim.contacts, sim.scene.blocks
    push, shear = (sim.joints.traction * c.length[:, None]).T
    on_b, block = (push + 1j * shear) * c.normal, np.concatenate([c.block_a, c.block_b])
    fx, fy = (part := np.concatenate([on_b, -on_b])).real, part.imag
    arm = np.tile(c.position, 2) - (sim.blocks.motion[0] + 1j * sim.blocks.motion[1])[block]
    parts = fx * arm.real, fy * arm.imag, 0.5 * (fx * arm.imag + fy * arm.real)
    sums = np.array([np.bincount(block, part, len(blocks)) for part in parts])
    other = np.array([block.fixed or bool(block.prescribed) for block in blocks])
    if stress := sim.scene.in_situ:
        other[c.outlines.block[stress.edges]] = True
    return np.where(other, np.nan, sums / [one.section.area for one in blocks])


def write_csv(path: Path, header, rows) -> None:
    """A table with the names of its columns."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(rows)


def outcomes(record: Record) -> list[dict]:
    """One entry for each `[[rock]]` of the scene, and one for other blocks that nothing drives.

    Displacements are relative to the base. settled_m: largest from the drawing to step 0;
    moved_m: largest since then; failed: blocks that moved more than failed_beyond_m;
    creep_m_per_s: largest mean speed over the last second (or the whole run, if shorter).
    """
    out, times = [], np.array(record.times)
    since = int(np.searchsorted(times, times[-1] - LOOK_BACK + 1e-9))
    before = max(min(since, len(times) - 2), 0)
    then, last = (record.displaced(i) for i in (before, -1))
    crept = np.hypot(*(last - then).T) / max(times[-1] - times[before], 1e-300)
    groups, blocks = {rock.name: rock.free for rock in record.scene.rocks}, record.scene.blocks
    drawn = [block.centroid + base_of(record.scene, record.initial)[:2] for block in blocks]
    settled = np.hypot(*(record.initial[:2].T - drawn).T)
    rest = {i for i, block in enumerate(blocks) if not (block.fixed or block.prescribed)}
    groups |= {"other blocks" if groups else "blocks": sorted(rest.difference(*groups.values()))}
    for name, group in groups.items():
        free = [i for i in group if np.isfinite(last[i, 0])]
        if not free:
            continue
        moved, creep = record.moved[free], float(crept[free].max())
        limit = FAILED * median_size(blocks[i] for i in free)
        failed = int((moved > limit).sum())
        out.append(
            {
                "rock": name,
                "state": "fails" if failed else "stands" if creep < CREEP else "moves",
                "blocks": len(free),
                "settled_m": float(settled[free].max()),
                "moved_m": float(moved.max()),
                "failed": failed,
                "failed_beyond_m": limit,
                "creep_m_per_s": creep,
            }
        )
    return out


def sentences(record: Record) -> Iterator[str]:
    """What a person wants to know at the end: a line for each watched slip and each rock."""
    for slip in record.slips.values():
        angle, alone = slip["slip_angle"], slip["predicted_angle"]
        said = f"slipped at {angle:.2f} degrees" if angle is not None else "no slip"
        said = "had slipped before this run" if slip["slipped_before"] else said
        law = "nothing" if alone is None else f"{alone:.2f} degrees"
        yield f"{slip['block']}: {said}, the law alone says {law}"
    yield from map(sentence, outcomes(record))


def sentence(entry: dict) -> str:
    """One line for a person."""
    return (
        f"{entry['rock']}: {entry['state']}; {entry['failed']} of {entry['blocks']} blocks moved "
        f"more than {entry['failed_beyond_m']:.2g} m, the farthest {entry['moved_m']:.2g} m; "
        f"creep {entry['creep_m_per_s']:.1e} m/s"
    )
