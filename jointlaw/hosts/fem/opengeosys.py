"""A direct shear test for OpenGeoSys: meshes and boundaries of two blocks with a layer between."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

HEIGHT, LENGTH = 0.05, 1.0  # m: of a block, and of the joint
HEXAHEDRON, QUAD, LINE = 12, 9, 3  # cells of VTK
VTU = """<?xml version="1.0"?>
<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian">
<UnstructuredGrid>
<Piece NumberOfPoints="{n}" NumberOfCells="{cells}">
<Points>
<DataArray type="Float64" NumberOfComponents="3" format="ascii">{points}</DataArray>
</Points>
<Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">{connectivity}</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">{ends}</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">{types}</DataArray>
</Cells>
<PointData>
<DataArray type="UInt64" Name="bulk_node_ids" format="ascii">{nodes}</DataArray>
</PointData>
<CellData>
<DataArray type="UInt64" Name="bulk_element_ids" format="ascii">{elements}</DataArray>
<DataArray type="Int32" Name="MaterialIDs" format="ascii">{materials}</DataArray>
</CellData>
</Piece>
</UnstructuredGrid>
</VTKFile>
"""


def meshes(dim: int, thickness: float) -> dict[str, str]:
    """Files of the mesh, of both blocks and of the top, by name; dim: 2 or 3."""
    levels = np.cumsum([0.0, HEIGHT, thickness, HEIGHT])
    ring = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])[: 2 ** (dim - 1), : dim - 1] * LENGTH
    points = np.zeros((4, len(ring), 3))
    points[:, :, : dim - 1] = ring
    points[:, :, dim - 1] = levels[:, None]
    cell, face = (HEXAHEDRON, QUAD) if dim == 3 else (QUAD, LINE)
    files = {
        "blocks": _vtu(points, cell, 0, 3),
        "lower": _vtu(points[:2], cell, 0, 1),
        "upper": _vtu(points[2:], cell, 2, 1),
        "top": _vtu(points[3:], face, 2, 1),
    }
    return {f"{name}_{dim}d.vtu": text for name, text in files.items()}


def boundaries(dim: int) -> str:
    """The lower block lies still, the upper one slides along x and is free along the normal."""
    lines = [_boundary("lower", dim, i, "fixed") for i in range(dim)]
    lines += [_boundary("upper", dim, i, "fixed" if i else "slide") for i in range(dim - 1)]
    lines += [_boundary("top", dim, dim - 1, "pressure", "Neumann")]
    return "\n".join(lines)


def _boundary(mesh: str, dim: int, component: int, value: str, kind: str = "Dirichlet") -> str:
    return (
        f"        <boundary_condition><mesh>{mesh}_{dim}d</mesh><type>{kind}</type>"
        f"<component>{component}</component><parameter>{value}</parameter></boundary_condition>"
    )


def _vtu(points: NDArray[Any], kind: int, element: int, several: int) -> str:
    """A pile of cells as a file of VTK.

    points: (levels, points of a level, 3), up to the top of the pile; element: number of the first
    cell in the pile of all, in which the one in the middle is the layer.
    """
    n, nodes = points.shape[1], points.size // 3
    begin = 4 * n - nodes if element else 0  # a pile ends at the top, or begins at the bottom
    level = np.arange(n)
    above = n + (level[::-1] if n == 2 else level)  # a quadrangle goes round
    first = level if len(points) == 1 else np.concatenate([level, above])
    elements = np.arange(element, element + several)
    return VTU.format(
        points=_words(points),
        n=nodes,
        cells=several,
        connectivity=_words(first + n * np.arange(several)[:, None]),
        ends=_words(first.size * np.arange(1, several + 1)),
        types=_words(np.full(several, kind)),
        nodes=_words(np.arange(begin, begin + nodes)),
        elements=_words(elements),
        materials=_words(np.where(elements == 1, 1, 0)),
    )


def _words(numbers: NDArray[Any]) -> str:
    return " ".join(map(repr, numbers.ravel().tolist()))
