"""Frames of a run as VTK files, for ParaView: blocks as polygons, joints as lines."""

from itertools import pairwise
from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree, SubElement

import meshio
import numpy as np

from jointlaw.support.progress import track

from .pictures import JOINT_STATES, Pictures, outlines
from .record import RunRecord


def write(record: RunRecord, folder: Path) -> None:
    """Write blocks_N.vtu and joints_N.vtu of every frame N, in SI units; blocks.pvd and joints.pvd
    list them with their times (s): open these.

    Blocks carry their number, displacement relative to the base, velocity, spin, whether they were
    unstable at the start, the principal values of their mean stress (compression positive; the
    second is the smaller one) and the first as a vector along its direction. Joints carry the
    numbers of the record and `state`: 0 stuck, 1 partly sliding, 2 sliding, 3 open. Of a scene with
    bolts also bolts_N.vtu and bolts.pvd, with tension and plastic elongation.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pictures = Pictures(record)
    names = list(JOINT_STATES)
    for i in track(range(len(record.times)), "VTK files"):
        _block_mesh(record, i).write(folder / f"blocks_{i:04d}.vtu")
        states = np.array([names.index(name) for name in pictures.states(i)], float)
        _joint_mesh(record.joints[i], states).write(folder / f"joints_{i:04d}.vtu")
        if record.scene.bolts:
            _lines(record.bolts[i]).write(folder / f"bolts_{i:04d}.vtu")
    for kind in ("blocks", "joints", "bolts")[: 3 if record.scene.bolts else 2]:
        root = Element("VTKFile", type="Collection", version="0.1")
        files = SubElement(root, "Collection")
        for i, time in enumerate(record.times):
            SubElement(files, "DataSet", timestep=repr(time), part="0", file=f"{kind}_{i:04d}.vtu")
        ElementTree(root).write(folder / f"{kind}.pvd")


def _block_mesh(record: RunRecord, i: int) -> meshio.Mesh:
    """Blocks of frame i as polygons, without removed blocks."""
    motion = record.motion[i]
    shapes = [shape for shape in outlines(record, i) if np.isfinite(shape).all()]
    first = np.cumsum([0, *map(len, shapes)])
    cells = [("polygon", np.arange(a, b)[None]) for a, b in pairwise(first)]
    xx, yy, xy = record.stresses[i]
    mean = 0.5 * (xx + yy)
    radius = np.hypot(0.5 * (xx - yy), xy)
    angle = 0.5 * np.arctan2(2 * xy, xx - yy)  # of the larger principal stress
    columns = {
        "block": np.arange(len(motion.T), dtype=float),
        "displacement_m": _in_space(record.displacements(i)),
        "rotation_rad": motion[2] - record.initial[2],
        "velocity_m/s": _in_space(motion[3:5].T),
        "spin_rad/s": motion[5],
        "stress_1_Pa": mean + radius,
        "stress_2_Pa": mean - radius,
        "along_stress_1_Pa": _in_space(((mean + radius) * [np.cos(angle), np.sin(angle)]).T),
        "unstable": record.unstable.astype(float),
    }
    is_present = np.isfinite(motion[0])
    data = {name: [row[None] for row in values[is_present]] for name, values in columns.items()}
    return meshio.Mesh(_in_space(np.concatenate(shapes)), cells, cell_data=data)


def _joint_mesh(joints: dict[str, np.ndarray], states: np.ndarray) -> meshio.Mesh:
    """Joints of a frame as lines."""
    columns = {name: column for name, column in joints.items() if name != "blocks"}
    return _lines(columns | {"state": states})


def _lines(columns: dict[str, np.ndarray]) -> meshio.Mesh:
    """Lines between the column "ends" (k, 2, 2) in m, with the numbers (k,) of the other ones."""
    ends = columns["ends"].reshape(-1, 2)
    cells = [("line", np.arange(len(ends)).reshape(-1, 2))]
    data = {name: [column] for name, column in columns.items() if name != "ends"}
    return meshio.Mesh(_in_space(ends), cells, cell_data=data)


def _in_space(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of the section as (n, 3)."""
    return np.column_stack([points, np.zeros(len(points))])
