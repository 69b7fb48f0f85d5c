"""Frames of a run as VTK files, for ParaView: blocks as polygons, joints as lines."""

from itertools import pairwise
from pathlib import Path
from xml.etree.ElementTree import Element, ElementTree, SubElement

import meshio
import numpy as np

from jointlaw.support.progress import track

from .pictures import STATES, Pictures, outlines
from .record import Record


def write(record: Record, folder: Path) -> None:
    """blocks_N.vtu and joints_N.vtu of every frame N, in SI units; blocks.pvd and joints.pvd list
    them with their times (s): open these.

    Blocks carry their number, displacement relative to the base, velocity, spin, whether they were
    loose at the start, the principal values of their mean stress (compression positive; the second
    is the smaller one) and the first as a vector along its direction. Joints carry the numbers of
    the record and `state`: 0 stuck, 1 partly sliding, 2 sliding, 3 open.
    """
    folder.mkdir(parents=True, exist_ok=True)
    pictures, names = Pictures(record), list(STATES)
    for i in track(range(len(record.times)), "VTK files"):
        _blocks(record, i).write(folder / f"blocks_{i:04d}.vtu")
        state = np.array([names.index(name) for name in pictures.states(i)], float)
        _joints(record.joints[i], state).write(folder / f"joints_{i:04d}.vtu")
    for kind in ("blocks", "joints"):
        root = Element("VTKFile", type="Collection", version="0.1")
        files = SubElement(root, "Collection")
        for i, time in enumerate(record.times):
            SubElement(files, "DataSet", timestep=repr(time), part="0", file=f"{kind}_{i:04d}.vtu")
        ElementTree(root).write(folder / f"{kind}.pvd")


def _blocks(record: Record, i: int) -> meshio.Mesh:
    motion, shapes = record.motion[i], [s for s in outlines(record, i) if np.isfinite(s).all()]
    first = np.cumsum([0, *map(len, shapes)])
    cells = [("polygon", np.arange(a, b)[None]) for a, b in pairwise(first)]
    xx, yy, xy = record.stresses[i]
    mean, half = 0.5 * (xx + yy), np.hypot(0.5 * (xx - yy), xy)
    turn = 0.5 * np.arctan2(2 * xy, xx - yy)  # of the larger principal stress
    columns = {
        "block": np.arange(len(motion.T), dtype=float),
        "displacement_m": _in_space(record.displaced(i)),
        "turn_rad": motion[2] - record.initial[2],
        "velocity_m/s": _in_space(motion[3:5].T),
        "spin_rad/s": motion[5],
        "stress_1_Pa": mean + half,
        "stress_2_Pa": mean - half,
        "along_stress_1_Pa": _in_space(((mean + half) * [np.cos(turn), np.sin(turn)]).T),
        "loose": record.loose.astype(float),
    }
    data = {
        name: [row[None] for row in values[np.isfinite(motion[0])]]
        for name, values in columns.items()
    }
    return meshio.Mesh(_in_space(np.concatenate(shapes)), cells, cell_data=data)


def _joints(joints: dict[str, np.ndarray], state: np.ndarray) -> meshio.Mesh:
    columns = {k: [v] for k, v in joints.items() if k not in ("who", "ends")} | {"state": [state]}
    ends = joints["ends"].reshape(-1, 2)
    cells = [("line", np.arange(len(ends)).reshape(-1, 2))]
    return meshio.Mesh(_in_space(ends), cells, cell_data=columns)


def _in_space(points: np.ndarray) -> np.ndarray:
    """Points (n, 2) of the section as (n, 3)."""
    return np.column_stack([points, np.zeros(len(points))])
