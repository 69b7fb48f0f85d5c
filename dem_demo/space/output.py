"""Files of an equilibrium in space: summary.json, blocks.csv, pictures, and VTK files for
ParaView."""

from pathlib import Path
from typing import Any

import numpy as np

from jointlaw.support.files import SUMMARY, write_json

from ..output.folder import BLOCKS, clear_run
from ..output.record import list_blocks, write_csv
from .picture_files import equilibrium_drawings
from .statics import Equilibrium, Statics

SUMMARY_VERSION = 1
VTK = "vtk"


def count_contacts(statics: Statics) -> int:
    """Number of contacts of two faces."""
    return int(statics.points.contact.max(initial=-1)) + 1


def summarise(statics: Statics, result: Equilibrium) -> dict[str, Any]:
    """Return the content of summary.json (docs/space.md)."""
    is_stable = statics.is_free & ~result.unstable
    distance = np.linalg.norm(result.displacement, axis=1)
    return {
        "version": SUMMARY_VERSION,
        "scene": statics.scene.title,
        "equilibrium": result.verdict.value,
        "unstable": list_blocks(statics.scene, result.unstable),
        "free_blocks": int(statics.is_free.sum()),
        "contacts": count_contacts(statics),
        "contact_points": len(statics.points.area),
        "max_unbalanced_ratio": result.unbalanced_ratio,
        "max_settlement_m": float(distance[is_stable].max(initial=0.0)),
        "max_normal_stress_Pa": float(result.traction[:, 0].max(initial=0.0)),
        "files": [BLOCKS],
    }


def write(
    statics: Statics, result: Equilibrium, folder: Path, vtk: bool, picture_format: str | None
) -> dict[str, Any]:
    """Write the files of an equilibrium, and return the content of summary.json.

    Results of another run in the folder are replaced. vtk: whether to write VTK files, which needs
    meshio. picture_format: of the pictures; None for neither pictures nor the page that turns.
    """
    clear_run(folder)
    summary = summarise(statics, result)
    write_blocks(statics, result, folder / BLOCKS)
    if picture_format:
        verdict = result.verdict.value
        drawings = equilibrium_drawings(statics, result.unstable, verdict, picture_format)
        for name, draw in drawings.items():
            draw(folder / name)
        summary["files"] += drawings
    if vtk:
        write_vtk(statics, result, folder / VTK)
        summary["files"] += [f"{VTK}/blocks.vtu", f"{VTK}/contacts.vtu"]
    write_json(folder / SUMMARY, summary)
    return summary


def write_blocks(statics: Statics, result: Equilibrium, path: Path) -> None:
    """Write blocks.csv: centroid as drawn, displacement and rotation vector of each block."""
    blocks = statics.scene.blocks
    columns: dict[str, Any] = {"block": [block.name for block in blocks]}
    for name, values in (
        ("{}_m", statics.surfaces.position),
        ("displacement_{}_m", result.displacement),
        ("rotation_{}_deg", np.degrees(result.rotation)),
    ):
        columns |= {name.format(axis): values[:, i] for i, axis in enumerate("xyz")}
    columns["volume_m3"] = statics.surfaces.volume
    columns["fixed"] = (~statics.is_free).astype(int)
    columns["unstable"] = result.unstable.astype(int)
    write_csv(path, columns, zip(*columns.values(), strict=True))


def write_vtk(statics: Statics, result: Equilibrium, folder: Path) -> None:
    """Write blocks.vtu and contacts.vtu, in SI units, at the places as drawn.

    Blocks are polyhedra with their number, displacement, rotation, and whether they are fixed or
    unstable; their vertices have displacements, to warp the blocks by. Contacts are polygons with
    blocks, law and area; their points have closure, normal stress, the shear stress of block b on
    block a as a vector, and the direction of the law's axis 2, the rough direction.
    """
    import meshio

    folder.mkdir(parents=True, exist_ok=True)
    surfaces = statics.surfaces
    n = len(statics.scene.blocks)
    cells = []
    for solid, start in zip(surfaces.solids, surfaces.first_vertex.tolist(), strict=False):
        faces = [np.array(face) + start for face in solid.faces]
        cells.append((f"polyhedron{len(solid.vertices)}", [faces]))
    block_of_vertex = np.repeat(np.arange(n), np.diff(surfaces.first_vertex))
    arm = surfaces.vertex - surfaces.position[block_of_vertex]
    turning = np.cross(result.rotation[block_of_vertex], arm)
    columns = {
        "block": np.arange(n, dtype=float),
        "displacement_m": result.displacement,
        "rotation_rad": result.rotation,
        "fixed": (~statics.is_free).astype(float),
        "unstable": result.unstable.astype(float),
    }
    meshio.Mesh(
        surfaces.vertex,
        cells,
        point_data={"displacement_m": result.displacement[block_of_vertex] + turning},
        cell_data={name: [row[None] for row in column] for name, column in columns.items()},
    ).write(folder / "blocks.vtu")
    points, axes = statics.points, statics.axes
    first = np.flatnonzero(np.diff(points.contact, prepend=-1))
    last = np.append(first[1:], len(points.contact))[: len(first)]
    columns = {
        "block_a": points.block_a[first].astype(float),
        "block_b": points.block_b[first].astype(float),
        "law": statics.law[first].astype(float),
        "area_m2": np.bincount(points.contact, points.area),
    }
    meshio.Mesh(
        points.point,
        [("polygon", np.arange(a, b)[None]) for a, b in zip(first, last, strict=True)],
        point_data={
            "closure_m": result.d[:, 0],
            "normal_stress_Pa": result.traction[:, 0],
            "shear_stress_Pa": -np.einsum("kc,kci->ki", result.traction[:, 1:], axes[:, 1:]),
            "rough_direction": axes[:, 1],
        },
        cell_data={name: [row[None] for row in column] for name, column in columns.items()},
    ).write(folder / "contacts.vtu")
