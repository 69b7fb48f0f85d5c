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
CLIFF = 5  # times the usual step between points: more around the same number is no height
EVEN = 0.01  # of a step: coordinates with few digits differ by so much
_PITCHES = ("cellsize", "dx", "dy", "xdim", "ydim")  # lines of an .asc grid that give its spacing
_SAMPLE = 200  # lines that show the decimal mark


def read_scan(path: str | Path, factor: float, spacing: float, decimal: str | None = None) -> Array:
    """Heights (ny, nx) in m.

    path: NPY or text, a matrix of heights (below # or a row of names), an .asc grid (ncols, nrows,
    cellsize or equal dx and dy, and further names above the matrix), or three columns x, y, z of a
    square grid in any order; points without a height are NaN. factor: m per unit of all lengths in
    the file, such as 1e-6 for micrometres; spacing: of the points in m; decimal: as in
    `datasets.read_closure`.

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
            f"--spacing is {spacing:g} m; correct one, or remove the line that gives it"
        )
    if z.ndim == 2 and z.shape[1] == _LIST and len(z) > _LIST:
        z = _grid(path, z, spacing / factor)
    if z.ndim == 2 and min(z.shape) > _LIST and np.isfinite(z).any():  # else `from_surface` tells
        for what, lines in (("row", z), ("column", z.T)):
            if _counts(lines[0]) and not _counts(lines[1]):
                raise ValueError(
                    f"{path}: its first {what} counts, in steps of {lines[0, 2] - lines[0, 1]:g}: "
                    "these are places and no heights; remove it"
                )
        _require_heights(path, z)
    return factor * z


def _counts(line: Array) -> bool:
    """Whether numbers (n,) grow by one step, besides the first, which may stand in a corner."""
    steps = np.diff(line[1:])
    return bool(np.all(np.abs(steps - steps[0]) <= EVEN * np.abs(steps[0])) and steps[0])


def _require_heights(path: Path, z: Array) -> None:
    """Refuse a number that comes again and differs from what is beside it as heights do not.

    The lowest, the highest and the most frequent one may stand for points without a height.
    """
    steps = [np.abs(np.diff(z, axis=axis)) for axis in (0, 1)]
    usual = np.median(np.concatenate([[np.inf], *(step[step > 0] for step in steps)]))
    values, times = np.unique(z[np.isfinite(z)], return_counts=True)
    for k in {0, values.size - 1, int(times.argmax())}:
        beside = [step[np.diff(z == values[k], axis=axis)] for axis, step in enumerate(steps)]
        if times[k] > 1 and np.nanmedian(np.concatenate([[0.0], *beside])) > CLIFF * usual:
            raise ValueError(
                f"{path}: {values[k]:g} stands {times[k]} times, far above or below the points "
                "beside it, as where nothing was measured: fill these points, or cut them off"
            )


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
    pitches = {name: marks.value(header[name][0]) for name in _PITCHES if name in header}
    if len(set(pitches.values())) > 1:
        told = ", ".join(f"{name} {pitch:g}" for name, pitch in pitches.items())
        raise ValueError(f"its points are no square grid: {told}; interpolate to one")
    return z, next(iter(pitches.values()), None)


def _is_name(cell: str) -> bool:
    return cell[:1].isalpha() and cell.lower() != "nan"


def _grid(path: Path, points: Array, spacing: float) -> Array:
    """Heights (ny, nx) of points x, y, z (n, 3), all in one unit, that lie on a square grid."""
    at = (points[:, :2] - np.nanmin(points[:, :2], axis=0)) / spacing
    places, size = np.rint(at), np.rint(at.max(axis=0)) + 1
    several = len(np.unique(places, axis=0)) < len(places)
    gaps = np.diff(np.sort(at, axis=0), axis=0).T
    pitches = [float(np.median(one[one > OFF])) if (one > OFF).any() else 1.0 for one in gaps]
    uneven = np.abs(np.array(pitches) - 1).max() > OFF or np.abs(at - places).max() > OFF
    if several or uneven or size.prod() > SPARSE * len(places):
        x, y = (f"{spacing * pitch:.4g}" for pitch in pitches)
        raise ValueError(
            f"{path}: its x and y are no square grid of --spacing, {spacing:g} in the unit of the "
            f"heights: along x the points are {x} apart, along y {y}. Correct the spacing, or "
            "interpolate to a grid with scipy.interpolate.griddata"
        )
    z = np.full(size[::-1].astype(int), np.nan)
    z[*places[:, ::-1].T.astype(int)] = points[:, 2]
    return z
