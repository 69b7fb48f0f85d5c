"""Solids from files: OBJ and STL, the formats that every drawing program writes.

Both list a surface; `solid_of_mesh` requires that it encloses a convex solid. An STL file lists its
triangles without shared vertices, so vertices that agree to a millionth of the size are one.
"""

import struct
from pathlib import Path

import numpy as np

from ..scene import Files
from .solids import Solid, solid_of_mesh

STL_VERTEX_TOLERANCE = 1e-6  # of the size: binary STL has 4-byte numbers
STL_HEADER = 80  # bytes, then the number of triangles
STL_TRIANGLE = 50  # bytes: normal, three vertices, two bytes of attributes


def read_solid(name: str, files: Files) -> Solid:
    """Convex solid of an OBJ or STL file; lengths in m.

    Raises ValueError naming the file for another format and for a surface that encloses no convex
    solid.
    """
    kind = Path(name).suffix.lower()
    try:
        if kind == ".stl":
            vertices, faces = _stl_surface(name, files)
        elif kind == ".obj":
            vertices, faces = _obj_surface(files[name])
        else:
            raise ValueError("must be an OBJ or STL file, ending in .obj or .stl")
        if len(vertices) < 4 or len(faces) < 4:
            raise ValueError(f"{len(vertices)} vertices and {len(faces)} faces enclose no solid")
        return solid_of_mesh(vertices, faces)
    except OSError as error:
        raise ValueError(f"file {name!r}: {error.strerror or error}") from None
    except ValueError as error:
        raise ValueError(f"file {name!r}: {error}") from None


def _obj_surface(text: str) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices (v, 3) and faces of an OBJ file; negative numbers count back from the last vertex.

    Raises ValueError for a number of no vertex.
    """
    vertices: list[list[float]] = []
    faces: list[list[int]] = []
    for line in text.splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append([float(word) for word in words[1:4]])
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([n - 1 if n > 0 else len(vertices) + n for n in numbers])
    if any(not 0 <= number < len(vertices) for face in faces for number in face):
        raise ValueError("a face names a vertex that is not there")
    return np.array(vertices, float).reshape(-1, 3), faces


def _stl_surface(name: str, files: Files) -> tuple[np.ndarray, list[list[int]]]:
    """Vertices (v, 3) and triangles of an STL file.

    The text of a binary file is replaced by the same triangles as ASCII, so a saved state keeps it.
    """
    if name not in files:
        data = (files.folder / name).read_bytes()
        count = struct.unpack_from("<I", data, STL_HEADER)[0] if len(data) > STL_HEADER + 4 else -1
        if len(data) == STL_HEADER + 4 + STL_TRIANGLE * count:
            numbers = np.frombuffer(data, np.uint8, offset=STL_HEADER + 4)
            triangles = numbers.reshape(count, STL_TRIANGLE)[:, 12:48].copy().view("<f4")
            lines = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangles.reshape(-1, 3).tolist()]
            files[name] = "\n".join(lines)
    lines = [line.split() for line in files[name].splitlines()]
    corners = np.array([line[1:4] for line in lines if line[:1] == ["vertex"]], float)
    if not len(corners) or len(corners) % 3:
        raise ValueError("no triangles")
    unit = STL_VERTEX_TOLERANCE * float(np.ptp(corners, axis=0).max())
    number = _merge(corners, unit)
    first = np.unique(number, return_index=True)[1]
    return corners[first], number.reshape(-1, 3).tolist()


def _merge(points: np.ndarray, tolerance: float) -> np.ndarray:
    """Numbers (p,) of points (p, 3), equal for points nearer than `tolerance` (m)."""
    number = np.full(len(points), -1)
    count = 0
    for i, point in enumerate(points):
        if number[i] < 0:
            is_same = (number < 0) & (np.abs(points - point).max(axis=1) <= tolerance)
            number[is_same] = count
            count += 1
    return number
