"""The history of a run, in memory and as tables; and the outcome of each rock mass."""

import csv
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..dynamics.blocks import pressure_forces
from ..dynamics.energy_balance import ENERGIES
from ..dynamics.search import vector_length
from ..dynamics.simulation import Simulation
from ..scene import Scene, median_size
from .monitors import base_displacement, law_between, read_monitors, start_slip_monitors

FAILURE_DISPLACEMENT = 0.1  # of the median size of a rock's blocks
CREEP_RATE = 1e-6  # m/s: slower blocks are at rest
CREEP_INTERVAL = 1.0  # s over which the creep rate is measured
MAX_LISTED_BLOCKS = 12


class RunRecord:
    """The history of a run, frame by frame.

    times (f,) in s. motion[f] (6, n): x, y (m), angle (rad) and their rates; NaN for removed
    blocks. energy[f] (9,): energies (J) and relative energy error. joints[f]: columns by name:
    "blocks" (k, 2), "ends" (k, 2, 2) of the segment of joint that a contact carries (m), "law" (k,)
    its number in the scene, and numbers (k,) with their unit in the name. stresses[f] (3, n): xx,
    yy, xy of the blocks (Pa). readings[f]: of `[monitor]` and of the bolts. bolts[f]: "ends"
    (b, 2, 2) in m, "tension_N" and "yielding_m" (b,).

    slips: entries of monitored slips; joint_laws: laws of monitored joints; last_state: state of
    the last frame; steps: of the run until then; unstable (n,): blocks without static equilibrium
    at step 0; verdict: on the equilibrium at step 0, see `Simulation`; initial (6, n): motion at
    step 0, also of a run that is resumed.
    """

    def __init__(self, sim: Simulation) -> None:
        self.scene = sim.scene
        self.slips = start_slip_monitors(sim)
        self.steps = 0
        self.unstable = sim.unstable
        self.verdict = sim.verdict
        self.initial = sim.initial
        pairs = (*sim.scene.slip, *sim.scene.shear)
        self.joint_laws = {pair: law_between(sim, *pair) for pair in pairs}
        self.times: list[float] = []
        self.motion: list[np.ndarray] = []
        self.energy: list[list[float]] = []
        self.joints: list[dict[str, np.ndarray]] = []
        self.stresses: list[np.ndarray] = []
        self.bolts: list[dict[str, np.ndarray]] = []
        self.readings: list[dict[str, float]] = []
        self.add_frame(sim)

    def add_frame(self, sim: Simulation) -> None:
        """Record the present state as a frame."""
        self.times.append(sim.time)
        self.motion.append(np.where(sim.blocks.is_removed, np.nan, sim.blocks.motion))
        self.energy.append([*sim.energy_balance.energy.tolist(), sim.energy_balance.error])
        self.joints.append(_read_joints(sim))
        self.stresses.append(block_stresses(sim))
        self.bolts.append(_read_bolts(sim))
        self.readings.append(read_monitors(sim))
        self.last_state = sim.state()

    def displacements(self, i: int) -> np.ndarray:
        """Displacements (n, 2) from step 0 to frame i, relative to the base (m)."""
        motion = self.motion[i]
        base = base_displacement(self.scene, motion) - base_displacement(self.scene, self.initial)
        return (motion[:2] - self.initial[:2]).T - base[:2]

    @property
    def distances(self) -> np.ndarray:
        """Length (n,) of the displacements from step 0 to the last frame (m)."""
        return vector_length(self.displacements(-1))

    @property
    def settlements(self) -> np.ndarray:
        """Length (n,) of the displacements from the scene as drawn to step 0 (m)."""
        drawn = base_displacement(self.scene, self.initial)[:2]
        centroids = [block.centroid + drawn for block in self.scene.blocks]
        return np.hypot(*(self.initial[:2].T - centroids).T)

    def median_size(self, blocks: Iterable[int]) -> float:
        """Median size (m) of blocks, by their numbers."""
        return median_size(self.scene.blocks[i] for i in blocks)

    def series(self, name: str) -> np.ndarray:
        """Reading of a monitor in all frames (f,)."""
        return np.array([reading[name] for reading in self.readings])

    def write_history(self, path: Path) -> None:
        """Write history.csv: times, energies and readings of the monitors."""
        energies = [f"{column}_J" for column in ENERGIES]
        header = ["time_s", *energies, "energy_error", *self.readings[0]]
        rows = zip(self.times, self.energy, self.readings, strict=True)
        write_csv(path, header, ([t, *e, *reading.values()] for t, e, reading in rows))

    def write_blocks(self, path: Path) -> None:
        """Write blocks.csv: position of each block at the end, and its motion since step 0."""
        motion = self.motion[-1].T
        displacement = self.displacements(-1)
        joints = self.joints[-1]
        largest_slip = np.zeros(len(motion))
        np.maximum.at(largest_slip, joints["blocks"], np.abs(joints["shear_m"])[:, None])
        columns = {
            "block": [block.name for block in self.scene.blocks],
            "x_m": motion[:, 0],
            "y_m": motion[:, 1],
            "displacement_m": np.hypot(*displacement.T),
            "displacement_x_m": displacement[:, 0],
            "displacement_y_m": displacement[:, 1],
            "rotation_deg": np.degrees(motion[:, 2] - self.initial[2]),
            "speed_m/s": np.hypot(*motion[:, 3:5].T),
            "largest_joint_slip_m": largest_slip,
            "unstable_at_start": self.unstable.astype(int),
        }
        write_csv(path, columns, zip(*columns.values(), strict=True))


def list_blocks(scene: Any, mask: np.ndarray) -> list[dict]:
    """List names and centroids as drawn (m) of the blocks of a mask (n,); in the plane or in
    space."""
    listed = []
    for block, is_listed in zip(scene.blocks, mask, strict=True):
        if is_listed:
            places = zip("xyz", block.centroid.tolist(), strict=False)
            listed.append({"block": block.name} | {f"{axis}_m": value for axis, value in places})
    return listed


def format_blocks(blocks: list[dict]) -> str:
    """Format names and centroids of some blocks for the terminal, "none" without blocks."""
    parts = []
    for block in blocks[:MAX_LISTED_BLOCKS]:
        places = (f"{block[key]:.2f}" for key in ("x_m", "y_m", "z_m") if key in block)
        parts.append(f"{block['block']} ({', '.join(places)})")
    if len(blocks) > MAX_LISTED_BLOCKS:
        parts.append(f"and {len(blocks) - MAX_LISTED_BLOCKS} more")
    return ", ".join(parts) or "none"


def _read_joints(sim: Simulation) -> dict[str, np.ndarray]:
    """Columns of `RunRecord.joints` for the present contacts with a length above zero.

    Each contact has the two ends of the part of the joint that it bears (n, 2, 2), in m.
    """
    contacts = sim.contacts
    joints = sim.joints
    # A contact carries a part of the joint on each side of its corner; a length that neither side
    # carries is shared equally.
    part = contacts.overlap_length + 0.5 * (contacts.length - contacts.overlap_length.sum(axis=0))
    forward = part[0] / np.maximum(part.sum(axis=0), 1e-300)
    offsets = np.stack([forward, forward - 1], axis=0) * contacts.length * contacts.edge_direction
    ends = contacts.position + offsets
    ends = np.stack([ends.real, ends.imag], axis=-1).swapaxes(0, 1)
    columns = {
        "blocks": np.column_stack([contacts.block_a, contacts.block_b]),
        "ends": ends,
        "law": sim.manager.law,
        "closure_m": contacts.closure,
        "shear_m": joints.delta[:, 1],
        "normal_stress_Pa": joints.traction[:, 0],
        "shear_stress_Pa": joints.traction[:, 1],
        "sliding": joints.sliding,
        "slipping": joints.slipping,
        "separated": joints.separated,
        "length_m": contacts.length,
        "slip_rate_m/s": contacts.rates[:, 1],
    }
    return {name: column[contacts.length > 0] for name, column in columns.items()}


def _read_bolts(sim: Simulation) -> dict[str, np.ndarray]:
    """Return the entries of `RunRecord.bolts`."""
    bolts = sim.blocks.bolts
    ends = bolts.ends(sim.blocks.motion)
    return {
        "ends": np.stack([ends.real, ends.imag], axis=-1),
        "tension_N": bolts.tension.copy(),
        "yielding_m": bolts.yielding.copy(),
    }


def block_stresses(sim: Simulation) -> np.ndarray:
    """Mean stress xx, yy, xy (3, n) in each block (Pa, compression positive).

    It is the sum of force times arm, of contacts, bolts and pressures on faces, over the volume of
    the block. NaN for blocks that other forces act on: fixed and driven ones, and blocks that
    in-situ stress loads from outside.
    """
    contacts = sim.contacts
    blocks = sim.scene.blocks
    normal, shear = (sim.joints.traction * contacts.length[:, None]).T
    force_on_b = (normal + 1j * shear) * contacts.normal
    bolts = sim.blocks.bolts
    start, end = bolts.ends(sim.blocks.motion).T
    pull = bolts.tension / sim.scene.thickness * np.exp(1j * np.angle(end - start))
    loaded = [contacts.block_a, contacts.block_b, bolts.block_a, bolts.block_b]
    places = [contacts.position, contacts.position, start, end]
    opposite = [force_on_b, -force_on_b, -pull, pull]  # of the forces on the blocks
    for pressure in sim.scene.face_pressures:
        block, place, force = pressure_forces(pressure, contacts.outlines)
        loaded.append(block)
        places.append(place)
        opposite.append(-force)
    block = np.concatenate(loaded)
    force = np.concatenate(opposite)
    arm = np.concatenate(places) - (sim.blocks.motion[0] + 1j * sim.blocks.motion[1])[block]
    xx = force.real * arm.real
    yy = force.imag * arm.imag
    xy = 0.5 * (force.real * arm.imag + force.imag * arm.real)
    sums = np.array([np.bincount(block, product, len(blocks)) for product in (xx, yy, xy)])
    is_loaded = np.array([block.fixed or bool(block.prescribed) for block in blocks])
    if stress := sim.scene.in_situ:
        is_loaded[contacts.outlines.block[stress.edges]] = True
    return np.where(is_loaded, np.nan, sums / [block.section.area for block in blocks])


def bolt_summary(record: RunRecord) -> list[dict]:
    """Describe each bolt: its ends as drawn (m), capacity, force at the end and largest force of
    all frames (N), and plastic elongation (m)."""
    largest = np.max([frame["tension_N"] for frame in record.bolts], axis=0)
    last = record.bolts[-1]
    return [
        {
            "from": list(bolt.ends[0]),
            "to": list(bolt.ends[1]),
            "capacity_N": bolt.capacity,
            "force_N": float(last["tension_N"][i]),
            "largest_force_N": float(largest[i]),
            "yielding_m": float(last["yielding_m"][i]),
        }
        for i, bolt in enumerate(record.scene.bolts)
    ]


def write_csv(path: Path, header: Iterable[str], rows: Iterable[Iterable]) -> None:
    """Write a table below the names of its columns."""
    with path.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(header)
        writer.writerows(rows)


def outcomes(record: RunRecord) -> list[dict]:
    """Describe the outcome of each `[[rock]]` of the scene, and of all other free blocks.

    `state`: "failed" if a block has moved by more than `failure_displacement_m`, a tenth of the
    median block size; "stable" if no block creeps, otherwise "displacing". In a test whose drives
    displace blocks, such as a tilt test, large displacements are no failure: "at rest" or
    "displacing". `displacement_m`: largest displacement since step 0, relative to the base;
    `settlement_m`: largest displacement from the scene as drawn to step 0; `failed_blocks`: number
    of blocks beyond the failure displacement; `creep_m_per_s`: largest mean speed over the last
    second (or the whole run, if shorter).
    """
    scene = record.scene
    distances = record.distances
    creep_rates = _creep_rates(record)
    settlements = record.settlements
    entries = []
    for name, group in _groups(scene).items():
        free = [i for i in group if np.isfinite(distances[i])]
        if not free:
            continue
        creep = float(creep_rates[free].max())
        limit = FAILURE_DISPLACEMENT * record.median_size(free)
        failed_blocks = int((distances[free] > limit).sum())
        is_test = not scene.rocks and _displaces_blocks(scene)
        entries.append(
            {
                "rock": name,
                "state": _state(failed_blocks, creep, is_test),
                "blocks": len(free),
                "settlement_m": float(settlements[free].max()),
                "displacement_m": float(distances[free].max()),
                "failed_blocks": failed_blocks,
                "failure_displacement_m": limit,
                "creep_m_per_s": creep,
            }
        )
    return entries


def _creep_rates(record: RunRecord) -> np.ndarray:
    """Mean speed (n,) of each block over the last CREEP_INTERVAL (m/s)."""
    times = np.array(record.times)
    first = int(np.searchsorted(times, times[-1] - CREEP_INTERVAL + 1e-9))
    first = max(min(first, len(times) - 2), 0)
    change = record.displacements(-1) - record.displacements(first)
    return vector_length(change) / max(times[-1] - times[first], 1e-300)


def _groups(scene: Scene) -> dict[str, list[int]]:
    """Numbers of free blocks by the name of their group.

    A group for each rock, and one for all other blocks that are neither fixed nor driven: "other
    blocks" beside rocks, "blocks" without any.
    """
    groups = {rock.name: rock.free for rock in scene.rocks}
    free = {i for i, block in enumerate(scene.blocks) if not (block.fixed or block.prescribed)}
    remaining = sorted(free.difference(*groups.values()))
    groups["other blocks" if groups else "blocks"] = remaining
    return groups


def _displaces_blocks(scene: Scene) -> bool:
    """Whether a drive moves blocks of a scene."""
    return any(len(drive.times) > 1 for drive in scene.drives)


def _state(failed_blocks: int, creep: float, is_test: bool) -> str:
    """State of a group of blocks at the end of a run, from failed blocks and creep rate (m/s).

    "failed" with any failed block (not in a laboratory test), "displacing" for a creep rate of
    CREEP_RATE and more, else "at rest" in a laboratory test and "stable" otherwise.
    """
    if failed_blocks and not is_test:
        return "failed"
    if creep >= CREEP_RATE:
        return "displacing"
    return "at rest" if is_test else "stable"


def report_lines(record: RunRecord) -> Iterator[str]:
    """Yield a line for each monitored slip and for each outcome, for the terminal."""
    for slip in record.slips.values():
        yield format_slip(slip, record)
    yield from map(format_outcome, outcomes(record))


def format_slip(slip: dict, record: RunRecord) -> str:
    """Format a monitored slip for the terminal."""
    if slip["slipped_before"]:
        event = "had slipped before this run"
    elif slip["slip_angle"] is None:
        event = "no slip"
    else:
        event = f"slipped at {slip['slip_angle']:.2f} degrees"
    predicted = slip["predicted_angle"]
    prediction = "" if predicted is None else f", the law alone predicts {predicted:.2f} degrees"
    total = abs(record.readings[-1][f"{slip['block']}: slip_m"])
    return f"{slip['block']}: {event}{prediction}; slip {total:.2g} m"


def format_outcome(entry: dict) -> str:
    """Format an outcome for the terminal."""
    displacement = f"largest displacement {entry['displacement_m']:.2g} m"
    creep = f"creep {entry['creep_m_per_s']:.1e} m/s"
    if entry["state"] == "at rest":
        return f"{entry['rock']}: at rest; {displacement}"
    if entry["state"] == "stable":
        return f"{entry['rock']}: stable; {displacement}, {creep}"
    return (
        f"{entry['rock']}: {entry['state']}; {entry['failed_blocks']} of {entry['blocks']} blocks "
        f"displaced by more than {entry['failure_displacement_m']:.2g} m, {displacement}, {creep}"
    )
