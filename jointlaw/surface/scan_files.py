"""Scanned surfaces in files: a matrix of heights, an .asc grid, or a list of x, y, z."""

from pathlib import Path

import numpy as np

from ..support.checks import Array
from ..support.text_numbers import (
    AMBIGUOUS,
    EITHER,
    SWAPPED,
    cells_of,
    lines_of,
    marks_of,
    separator,
)

_TEXT = {".csv", ".txt", ".dat", ".asc", ".xyz"}
_LIST = 3  # columns of a list of points
OFF, SPARSE = 0.1, 2  # of a spacing; points of the grid for one in the list
_SAMPLE = 200  # lines that show the decimal mark


def read_scan(path: str | Path, factor: float, spacing: float, decimal: str | None = None) -> Array:
    """Heights (ny, nx) in m.

    path: NPY or text, a matrix of heights (below # or a row of names), an .asc grid (ncols, nrows,
    cellsize and further names above the matrix), or three columns x, y, z of a square grid in any
    order; points without a height are NaN. factor: m per unit of all lengths in the file, such as
    1e-6 for micrometres; spacing: of the points in m; decimal: as in `datasets.read_closure`.

    Raises ValueError naming the file and the remedy.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in {*_TEXT, ".npy"}:
        raise ValueError(
            f"{path}: is no matrix of heights; convert it, for example "
            "numpy.save('scan.npy', SurfaceTopography.read_topography(file).to_unit('m')"
            ".heights().T), for --height-unit m"
        )
    try:
        z, cell = (np.load(path), None) if suffix == ".npy" else _text(path, decimal)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"{path}: is no matrix of heights, .asc grid or list of x, y, z ({error})"
        ) from None
    if cell is not None and abs(cell * factor - spacing) > 1e-3 * spacing:
        raise ValueError(
            f"{path}: its cellsize {cell:g} is {cell * factor:g} m in the unit of the heights, but "
            f"--spacing is {spacing:g} m; correct one, or remove the line cellsize"
        )
    if z.ndim == 2 and z.shape[1] > _LIST and len(z) > 1 and (np.diff(z[:, 0]) == 1.0).all():
        raise ValueError(f"{path}: its first column counts the rows; remove it")
    if z.ndim == 2 and z.shape[1] == _LIST and len(z) > _LIST:
        return _grid(path, factor * z, spacing)
    return factor * z


def _text(path: Path, decimal: str | None) -> tuple[Array, float | None]:
    """The numbers (rows, columns) of a text file, NaN where an .asc grid has none; its cellsize."""
    lines = list(lines_of(path).values())
    mark, header = separator(lines[-1] if lines else ""), {}
    while lines and _is_name(lines[0].replace(mark or " ", " ").split()[0].strip('"')):
        name, *value = lines.pop(0).replace(mark or " ", " ").split()
        header[name.lower()] = value
    sample = [cell for row in cells_of(lines[:_SAMPLE], mark) for cell in row]
    marks = marks_of(sample, decimal)
    if marks.decimal is None and (doubtful := [cell for cell in sample if EITHER.fullmatch(cell)]):
        raise ValueError(f"{doubtful[0]!r} {AMBIGUOUS}")
    if marks.decimal == ",":
        lines = [line.translate(SWAPPED) for line in lines]
    z = np.loadtxt(lines, delimiter=mark, ndmin=2)
    if "nodata_value" in header:
        z[z == marks.value(header["nodata_value"][0])] = np.nan
    return z, marks.value(header["cellsize"][0]) if "cellsize" in header else None


def _is_name(cell: str) -> bool:
    return cell[:1].isalpha() and cell.lower() != "nan"


def _grid(path: Path, points: Array, spacing: float) -> Array:
    """Heights (ny, nx) of points x, y, z (n, 3) in m that lie on a square grid."""
    at = (points[:, :2] - np.nanmin(points[:, :2], axis=0)) / spacing
    places, size = np.rint(at), np.rint(at.max(axis=0)) + 1
    several = len(np.unique(places, axis=0)) < len(places)
    if several or np.abs(at - places).max() > OFF or size.prod() > SPARSE * len(places):
        raise ValueError(
            f"{path}: its x and y are no square grid of --spacing {spacing:g} m in the unit of the "
            "heights; correct the spacing, or interpolate to a grid with scipy.interpolate.griddata"
        )
    z = np.full(size[::-1].astype(int), np.nan)
    z[*places[:, ::-1].T.astype(int)] = points[:, 2]
    return z
