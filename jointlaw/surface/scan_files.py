"""Scanned surfaces in files: a matrix of heights, an .asc grid, or a list of x, y, z.

All three are read into one matrix. Two kinds of errors are detected, because they would change the
result without notice: a first row or column that holds coordinates, and a value that stands for
points without a measurement (-9999, 0) but is not declared as such.
"""

from pathlib import Path

import numpy as np

from ..support.checks import Array
from ..support.text_numbers import (
    AMBIGUITY_REMEDY,
    AMBIGUOUS_NUMBER,
    SWAP_MARKS,
    detect_format,
    find_separator,
    read_lines,
    split_cells,
)

_SUFFIXES = {".csv", ".txt", ".dat", ".asc", ".xyz"}
_LIST_COLUMNS = 3  # x, y, z
_MAX_GRID_DEVIATION = 0.1  # of a spacing, of the points of a list
_MAX_GRID_POINTS = 2  # points of the grid per point of the list
_MAX_STEP = 5  # median steps between neighbours: a repeated value beyond is not a height
_MAX_UNEVENNESS = 0.01  # of a step, between coordinates that are written with few digits
_SPACING_KEYS = ("cellsize", "dx", "dy", "xdim", "ydim")  # of an .asc header
_SAMPLE_LINES = 200  # in which the decimal mark is looked for


def read_scan(path: str | Path, factor: float, spacing: float, decimal: str | None = None) -> Array:
    """Read the heights of a scan.

    Parameters
    ----------
    path: NPY file or text file with one of
        - a matrix of heights, below comments (#) or a row of names;
        - an .asc grid: ncols, nrows, cellsize or equal dx and dy above the matrix;
        - three columns x, y, z of the points of a square grid in any order; missing points are NaN.
    factor: m per unit of all lengths in the file, such as 1e-6 for micrometres.
    spacing: spacing of the points in m.
    decimal: as in `datasets.read_closure`.

    Returns the heights (ny, nx) in m. Raises ValueError naming the file and the remedy.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in {*_SUFFIXES, ".npy"}:
        raise ValueError(
            f"{path}: is no matrix of heights; convert it, for example "
            "numpy.save('scan.npy', SurfaceTopography.read_topography(file).to_unit('m')"
            ".heights().T), for --height-unit m"
        )
    try:
        z, cell_size = (np.load(path), None) if suffix == ".npy" else _read_text(path, decimal)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"{path}: is no matrix of heights, .asc grid or list of x, y, z ({error})"
        ) from None
    if cell_size is not None and abs(cell_size * factor - spacing) > 1e-3 * spacing:
        raise ValueError(
            f"{path}: its cellsize {cell_size:g} is {cell_size * factor:g} m in the unit of the "
            f"heights, but --spacing is {spacing:g} m; correct one, or remove the line with the "
            "cellsize"
        )
    if z.ndim == 2 and z.shape[1] == _LIST_COLUMNS and len(z) > _LIST_COLUMNS:
        z = _grid_from_points(path, z, spacing / factor)
    # `from_surface` reports other shapes
    if z.ndim == 2 and min(z.shape) > _LIST_COLUMNS and np.isfinite(z).any():
        for what, lines in (("row", z), ("column", z.T)):
            if _is_evenly_spaced(lines[0]) and not _is_evenly_spaced(lines[1]):
                raise ValueError(
                    f"{path}: its first {what} counts, in steps of {lines[0, 2] - lines[0, 1]:g}: "
                    "these are coordinates, not heights; remove it"
                )
        _require_heights(path, z)
    return factor * z


def _is_evenly_spaced(line: Array) -> bool:
    """Whether numbers (n,) increase by equal steps; the first may be the corner of a table."""
    steps = np.diff(line[1:])
    return bool(np.all(np.abs(steps - steps[0]) <= _MAX_UNEVENNESS * np.abs(steps[0])) and steps[0])


def _require_heights(path: Path, z: Array) -> None:
    """Raise ValueError for a repeated value that differs from its neighbours by much more than the
    other heights do.

    The lowest, the highest and the most frequent value may stand for points without a measurement.
    """
    steps = [np.abs(np.diff(z, axis=axis)) for axis in (0, 1)]
    median_step = np.median(np.concatenate([[np.inf], *(step[step > 0] for step in steps)]))
    values, counts = np.unique(z[np.isfinite(z)], return_counts=True)
    for k in {0, values.size - 1, int(counts.argmax())}:
        edges = [step[np.diff(z == values[k], axis=axis)] for axis, step in enumerate(steps)]
        edge_step = np.nanmedian(np.concatenate([[0.0], *edges]))
        if counts[k] > 1 and edge_step > _MAX_STEP * median_step:
            raise ValueError(
                f"{path}: {values[k]:g} occurs {counts[k]} times, far above or below the "
                "neighbouring points, as where nothing was measured: fill these points, or cut "
                "them off"
            )


def _read_text(path: Path, decimal: str | None) -> tuple[Array, float | None]:
    """Read the numbers (rows, columns) of a text file and the cell size of an .asc grid.

    Points without a height (NODATA_value) are NaN.
    """
    lines = list(read_lines(path).values())
    mark = find_separator(lines[-1] if lines else "")
    header = {}
    while lines and _is_name(lines[0].replace(mark or " ", " ").split()[0].strip('"')):
        name, *value = lines.pop(0).replace(mark or " ", " ").split()
        header[name.lower()] = value
    sample = [cell for row in split_cells(lines[:_SAMPLE_LINES], mark) for cell in row]
    marks = detect_format(sample, decimal)
    ambiguous = [cell for cell in sample if AMBIGUOUS_NUMBER.fullmatch(cell)]
    if marks.decimal is None and ambiguous:
        raise ValueError(f"{ambiguous[0]!r} {AMBIGUITY_REMEDY}")
    if marks.decimal == ",":
        lines = [line.translate(SWAP_MARKS) for line in lines]
    z = np.loadtxt(lines, delimiter=mark, ndmin=2)
    for name, size in zip(("nrows", "ncols"), z.shape, strict=True):
        stated = marks.value(header[name][0]) if header.get(name) else size
        if stated != size:
            raise ValueError(
                f"it has {size} {name[1:]}, its header says {stated:g}: it is not whole"
            )
    if "nodata_value" in header:
        z[z == marks.value(header["nodata_value"][0])] = np.nan
    spacings = {name: marks.value(header[name][0]) for name in _SPACING_KEYS if name in header}
    if len(set(spacings.values())) > 1:
        listed = ", ".join(f"{name} {spacing:g}" for name, spacing in spacings.items())
        raise ValueError(f"its points are no square grid: {listed}; interpolate to one")
    return z, next(iter(spacings.values()), None)


def _is_name(cell: str) -> bool:
    return cell[:1].isalpha() and cell.lower() != "nan"


def _grid_from_points(path: Path, points: Array, spacing: float) -> Array:
    """Heights (ny, nx) of points on a square grid.

    points: x, y, z (n, 3), all in the unit of `spacing`.
    """
    position = (points[:, :2] - np.nanmin(points[:, :2], axis=0)) / spacing
    indices = np.rint(position)
    size = np.rint(position.max(axis=0)) + 1
    has_duplicates = len(np.unique(indices, axis=0)) < len(indices)
    gaps = np.diff(np.sort(position, axis=0), axis=0).T
    spacings = [_median_gap(gap) for gap in gaps]
    is_uneven = (
        np.abs(np.array(spacings) - 1).max() > _MAX_GRID_DEVIATION
        or np.abs(position - indices).max() > _MAX_GRID_DEVIATION
    )
    if has_duplicates or is_uneven or size.prod() > _MAX_GRID_POINTS * len(indices):
        x_spacing, y_spacing = (f"{spacing * one:.4g}" for one in spacings)
        raise ValueError(
            f"{path}: its x and y are no square grid of --spacing, {spacing:g} in the unit of the "
            f"heights: the points are {x_spacing} apart along x and {y_spacing} along y. Correct "
            "the spacing, or interpolate to a grid with scipy.interpolate.griddata"
        )
    z = np.full(size[::-1].astype(int), np.nan)
    z[*indices[:, ::-1].T.astype(int)] = points[:, 2]
    return z


def _median_gap(gap: Array) -> float:
    """The median of the gaps (n,) between different coordinates, in spacings; 1 without any."""
    is_step = gap > _MAX_GRID_DEVIATION
    return float(np.median(gap[is_step])) if is_step.any() else 1.0
