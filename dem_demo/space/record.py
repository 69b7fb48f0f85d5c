"""The history of a run in space, and its files: tables, and VTK files for ParaView."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ElementTree, SubElement

import numpy as np
from scipy.spatial.transform import Rotation

from jointlaw.support.files import SUMMARY, write_json
from jointlaw.support.progress import track

from ..output.folder import BLOCKS, HISTORY
from ..output.record import RunRecord, write_csv
from ..output.run import OUTPUTS, Output
from .contacts import Surfaces
from .picture_files import run_drawings
from .simulation import SpaceSimulation

VTK = "vtk"
POINT_COLUMNS = ("x_m", "y_m", "z_m", "vx_m/s", "vy_m/s", "vz_m/s")


class SpaceRecord(RunRecord):
    """The history of a run in space, frame by frame.

    times (f,) in s. motion[f] (12, n): x, y, z (m), sums of the rotations about the principal axes
    (rad), and their rates; NaN for removed blocks. axes[f] (n, 3, 3): principal axes of the blocks,
    as columns. energy[f] (10,): energies (J) and relative energy error. joints[f]: columns by name
    over the k contact points, see `read_joints`. readings[f]: of `[monitor]`.

    initial (12, n), initial_axes (n, 3, 3): at step 0. unstable, verdict, steps, last_state as in
    the plane.
    """

    def __init__(self, sim: SpaceSimulation) -> None:
        self.scene = sim.scene
        self.surfaces = sim.blocks.surfaces
        self.slips = {}
        self.steps = 0
        self.unstable = sim.unstable
        self.verdict = sim.verdict
        self.initial = sim.initial
        self.initial_axes = sim.initial_axes
        self.times = []
        self.motion = []
        self.axes: list[np.ndarray] = []
        self.energy = []
        self.joints = []
        self.readings = []
        self.add_frame(sim)

    def add_frame(self, sim: SpaceSimulation) -> None:
        """Record the present state as a frame."""
        self.times.append(sim.time)
        self.motion.append(np.where(sim.blocks.is_removed, np.nan, sim.blocks.motion))
        self.axes.append(sim.blocks.axes.copy())
        self.energy.append([*sim.energy_balance.energy.tolist(), sim.energy_balance.error])
        self.joints.append(read_joints(sim))
        self.readings.append(read_monitors(sim))
        self.last_state = sim.state()

    def _base_displacement(self, motion: np.ndarray) -> np.ndarray:
        """Displacement (3,) of the base from the scene as drawn (m), zero without a base."""
        base = self.scene.base
        if base is None:
            return np.zeros(3)
        return motion[:3, base] - self.scene.blocks[base].centroid

    def displacements(self, i: int) -> np.ndarray:
        """Displacements (n, 3) from step 0 to frame i, relative to the base (m)."""
        motion = self.motion[i]
        base = self._base_displacement(motion) - self._base_displacement(self.initial)
        return (motion[:3] - self.initial[:3]).T - base

    def rotations(self, i: int) -> np.ndarray:
        """Rotation vectors (n, 3) from step 0 to frame i (rad)."""
        turned = self.axes[i] @ self.initial_axes.swapaxes(1, 2)
        return Rotation.from_matrix(turned).as_rotvec()

    def spins(self, i: int) -> np.ndarray:
        """Angular velocities (n, 3) about x, y and z in frame i (rad/s)."""
        return np.einsum("nij,nj->ni", self.axes[i], self.motion[i][9:].T)

    def vertices(self, i: int) -> np.ndarray:
        """Places (v, 3) in m of the vertices of all blocks in frame i (`Surfaces.first_vertex`)."""
        block = np.repeat(np.arange(len(self.scene.blocks)), np.diff(self.surfaces.first_vertex))
        arm = np.einsum("vij,vj->vi", self.axes[i][block], self.surfaces.local_vertex)
        return self.motion[i][:3].T[block] + arm

    @property
    def settlements(self) -> np.ndarray:
        """Length (n,) of the displacements from the scene as drawn to step 0 (m)."""
        drawn = np.array([block.centroid for block in self.scene.blocks])
        base = self._base_displacement(self.initial)
        return np.linalg.norm(self.initial[:3].T - drawn - base, axis=1)

    def median_size(self, blocks: Iterable[int]) -> float:
        """Side (m) of the cube with the median volume of blocks, by their numbers."""
        volumes = [self.scene.blocks[i].solid.volume for i in blocks]
        return float(np.cbrt(np.median(volumes)))

    def write_blocks(self, path: Path) -> None:
        """Write blocks.csv: position of each block at the end, and its motion since step 0."""
        motion = self.motion[-1].T
        displacement = self.displacements(-1)
        joints = self.joints[-1]
        largest_slip = np.zeros(len(motion))
        slip = np.linalg.norm(joints["shear_m"], axis=1)
        np.maximum.at(largest_slip, joints["blocks"], slip[:, None])
        columns: dict[str, Any] = {"block": [block.name for block in self.scene.blocks]}
        for name, values in (
            ("{}_m", motion[:, :3]),
            ("displacement_{}_m", displacement),
            ("rotation_{}_deg", np.degrees(self.rotations(-1))),
            ("velocity_{}_m/s", motion[:, 6:9]),
            ("spin_{}_rad/s", self.spins(-1)),
        ):
            columns |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
        columns["displacement_m"] = np.linalg.norm(displacement, axis=1)
        columns["largest_joint_slip_m"] = largest_slip
        columns["unstable_at_start"] = self.unstable.astype(int)
        write_csv(path, columns, zip(*columns.values(), strict=True))


def read_joints(sim: SpaceSimulation) -> dict[str, np.ndarray]:
    """Columns of `SpaceRecord.joints` for the present contact points.

    "blocks" (k, 2); "contact" (k,): number of the contact of two faces, whose points follow each
    other as the corners of its polygon; "at" (k, 3) in m; "normal" (k, 3): of block b; "axis_2"
    (k, 3): the rough direction; "law" (k,). "shear_m" (k, 2): along axes 2 and 3; "shear_stress_Pa"
    (k, 3): of block b on block a, a vector.
    """
    contacts = sim.contacts
    joints = sim.joints
    directions = contacts.directions
    return {
        "blocks": np.column_stack([contacts.block_a, contacts.block_b]),
        "contact": contacts.contact,
        "at": contacts.point,
        "normal": directions[:, 0],
        "axis_2": directions[:, 1],
        "law": sim.manager.law,
        "area_m2": contacts.area.copy(),
        "closure_m": contacts.closure.copy(),
        "shear_m": joints.delta[:, 1:].copy(),
        "normal_stress_Pa": joints.traction[:, 0].copy(),
        "shear_stress_Pa": -np.einsum("kc,kci->ki", joints.traction[:, 1:], directions[:, 1:]),
        "sliding": joints.sliding.copy(),
        "slipping": joints.slipping.copy(),
        "separated": joints.separated.copy(),
    }


def read_monitors(sim: SpaceSimulation) -> dict[str, float]:
    """Return the present readings of the history points by name; names end in their unit.

    Positions, velocities and displacements are relative to the base.
    """
    scene = sim.scene
    readings = {}
    base_motion = np.zeros(6)
    if scene.base is not None:
        motion = sim.blocks.motion[:, scene.base]
        base_motion[:3] = motion[:3] - scene.blocks[scene.base].centroid
        base_motion[3:] = motion[6:9]
    for i, (block, point) in enumerate(scene.points):
        motion = sim.blocks.motion[:, block]
        axes = sim.blocks.axes[block]
        drawn_axes = sim.manager.face_laws.drawn_rotation[block]
        arm = axes @ drawn_axes.T @ (np.array(point) - scene.blocks[block].centroid)
        velocity = motion[6:9] + np.cross(axes @ motion[9:], arm)
        place = np.concatenate([motion[:3] + arm, velocity]) - base_motion
        columns = dict(zip(POINT_COLUMNS, place.tolist(), strict=True))
        columns["displacement_m"] = float(np.linalg.norm(place[:3] - point))
        readings |= {f"point {i + 1}: {name}": value for name, value in columns.items()}
    return readings


def write(
    record: SpaceRecord, summary: dict, folder: Path, picture_format: str | None, vtk: bool
) -> None:
    """Write all files of a run: tables before pictures, which take longest.

    picture_format: None for neither pictures nor the page that turns. vtk: whether to write VTK
    files, which needs meshio.
    """
    drawings = run_drawings(record, picture_format) if picture_format else {}
    write_json(folder / SUMMARY, {**summary, "files": [HISTORY, BLOCKS, *drawings]})
    record.write_history(folder / HISTORY)
    record.write_blocks(folder / BLOCKS)
    for name, draw in drawings.items():
        draw(folder / name)
    if vtk:
        write_vtk(record, folder / VTK)


def write_vtk(record: SpaceRecord, folder: Path) -> None:
    """Write blocks_N.vtu and contacts_N.vtu of every frame N, in SI units; blocks.pvd and
    contacts.pvd list them with their times (s): open these.

    Blocks are polyhedra at their places, with number, displacement relative to the base, rotation,
    velocity, spin, and whether they are fixed or were unstable at the start. Contacts are the
    polygons of the overlaps, with the numbers of the record as data of their points.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for i in track(range(len(record.times)), "VTK files"):
        _block_mesh(record, i).write(folder / f"blocks_{i:04d}.vtu")
        contact_mesh(record.joints[i]).write(folder / f"contacts_{i:04d}.vtu")
    for kind in ("blocks", "contacts"):
        root = Element("VTKFile", type="Collection", version="0.1")
        files = SubElement(root, "Collection")
        for i, time in enumerate(record.times):
            SubElement(files, "DataSet", timestep=repr(time), part="0", file=f"{kind}_{i:04d}.vtu")
        ElementTree(root).write(folder / f"{kind}.pvd")


def block_cells(surfaces: Surfaces, blocks: Iterable[int]) -> list[tuple[str, list]]:
    """Cells of meshio for blocks, by their numbers: polyhedra of the vertices of all blocks."""
    cells = []
    for i in blocks:
        solid = surfaces.solids[i]
        faces = [np.array(face) + surfaces.first_vertex[i] for face in solid.faces]
        cells.append((f"polyhedron{len(solid.vertices)}", [faces]))
    return cells


def _block_mesh(record: SpaceRecord, i: int):
    """Blocks of frame i as polyhedra, without removed blocks."""
    import meshio

    motion = record.motion[i]
    is_present = np.isfinite(motion[0])
    present = np.flatnonzero(is_present)
    vertices = record.vertices(i)
    vertices[~np.isfinite(vertices)] = 0.0  # of removed blocks, which no cell uses
    columns = {
        "block": np.arange(len(is_present), dtype=float),
        "displacement_m": record.displacements(i),
        "rotation_rad": record.rotations(i),
        "velocity_m/s": motion[6:9].T,
        "spin_rad/s": record.spins(i),
        "fixed": np.array([float(block.fixed) for block in record.scene.blocks]),
        "unstable": record.unstable.astype(float),
    }
    data = {name: [row[None] for row in column[present]] for name, column in columns.items()}
    return meshio.Mesh(vertices, block_cells(record.surfaces, present.tolist()), cell_data=data)


def contact_mesh(joints: dict[str, np.ndarray]):
    """Contact points of a frame as polygons, one for each contact of two faces."""
    import meshio

    contact = joints["contact"]
    first = np.flatnonzero(np.diff(contact, prepend=-1))
    last = np.append(first[1:], len(contact))[: len(first)]
    cell_columns = {
        "block_a": joints["blocks"][first, 0].astype(float),
        "block_b": joints["blocks"][first, 1].astype(float),
        "law": joints["law"][first].astype(float),
        "contact_area_m2": np.bincount(contact, joints["area_m2"]),
    }
    of_points = {
        name: column
        for name, column in joints.items()
        if name not in ("blocks", "contact", "at", "law")
    }
    of_points["shear_m"] = np.linalg.norm(joints["shear_m"], axis=1)
    cells = [("polygon", np.arange(a, b)[None]) for a, b in zip(first, last, strict=True)]
    data = {name: [row[None] for row in column] for name, column in cell_columns.items()}
    if not cells:  # a file without any cells cannot be written
        cells = [("polygon", np.zeros((0, 3), int))]
        data = {name: [np.zeros(0)] for name in cell_columns}
    return meshio.Mesh(joints["at"], cells, point_data=of_points, cell_data=data)


OUTPUTS[SpaceSimulation] = Output(SpaceRecord, write)
