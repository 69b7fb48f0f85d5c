"""Scanned surfaces in files: CSV, NPY, and what the library SurfaceTopography reads."""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from ..support.checks import Array

_TEXT = {".csv", ".txt", ".dat", ".asc"}


def read_scan(
    path: str | Path, spacing: float | None = None, factor: float | None = None
) -> tuple[Array, float]:
    """Heights (ny, nx) or (nx,) in m and their spacing in m.

    Parameters
    ----------
    path: CSV or text (a matrix of heights, or one column for a profile; commas, semicolons, tabs
        or blanks), NPY, or any of the profilometer formats that SurfaceTopography reads (extra
        `scan`), which bring their own spacing and unit.
    spacing: of the points in m; needed for CSV and NPY.
    factor: m per unit of the heights, such as 1e-6 for micrometres; needed for CSV, NPY and files
        of instruments that give no unit, refused for those that do.

    Raises ValueError naming the file and the remedy, ImportError when SurfaceTopography is needed.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if not path.is_file():
        raise ValueError(f"{path}: does not exist; give a file of heights")
    try:
        z = np.load(path) if suffix == ".npy" else _text(path) if suffix in _TEXT else None
    except UnicodeDecodeError:
        z = None  # some instruments give such names to files of their own
    if z is None:
        return _topography(path, spacing, factor)
    if spacing is None:
        raise ValueError(f"{path}: spacing is missing; give it in m, for example --spacing 20um")
    if factor is None:
        raise ValueError(f"{path}: gives no unit of its heights; name it, such as --height-unit um")
    return np.squeeze(z) * factor, spacing


def _text(path: Path) -> Array:
    text = path.read_text(encoding="utf-8-sig").splitlines()
    lines = [line for line in text if line.strip() and not line.lstrip().startswith("#")]
    if not lines:
        raise ValueError(f"{path}: holds no heights")
    delimiter = next((d for d in (";", "\t", ",") if d in lines[-1]), None)
    try:
        float(lines[0].split(delimiter)[0])
    except ValueError:
        lines = lines[1:]  # a row of names
    try:
        return np.loadtxt(lines, delimiter=delimiter)
    except ValueError as error:
        raise ValueError(f"{path}: is not a matrix of heights ({error})") from None


def _topography(path: Path, spacing: float | None, factor: float | None) -> tuple[Array, float]:
    try:
        read_topography = import_module("SurfaceTopography").read_topography
    except ImportError as error:
        raise ImportError(
            f"{path}: formats of instruments need SurfaceTopography: pip install 'jointlaw[scan]'"
        ) from error
    surface: Any = read_topography(str(path))
    if surface.unit is not None:
        if factor is not None:
            raise ValueError(f"{path}: gives its own unit, {surface.unit}; leave --height-unit out")
        surface = surface.to_unit("m")
    elif spacing is None or factor is None:
        raise ValueError(f"{path}: the file gives no unit; give --spacing and --height-unit")
    z = np.asarray(np.ma.filled(surface.heights(), np.nan), float)
    pixel = np.atleast_1d(np.asarray(surface.pixel_size, float))
    if pixel.size == 2 and abs(pixel[0] / pixel[1] - 1) > 1e-3:
        raise ValueError(
            f"{path}: its points are {pixel[0]:g} x {pixel[1]:g} apart; resample it to squares"
        )
    z = z if factor is None else z * factor
    return z.T, float(pixel[0]) if spacing is None else spacing  # its first axis is x
