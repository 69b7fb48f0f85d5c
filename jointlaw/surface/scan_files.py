"""Scanned surfaces in files: a matrix of heights as text or NPY."""

from pathlib import Path

import numpy as np

from ..support.checks import Array

_TEXT = {".csv", ".txt", ".dat", ".asc"}


def read_scan(path: str | Path, factor: float) -> Array:
    """Heights (ny, nx) in m.

    path: text (a matrix of heights, with commas, semicolons, tabs or blanks between them, and # or
    a row of names above) or NPY; factor: m per unit of the heights, such as 1e-6 for micrometres.

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
        return factor * (np.load(path) if suffix == ".npy" else _text(path))
    except (OSError, ValueError) as error:  # of decoding too
        raise ValueError(
            f"{path}: is no matrix of heights in a text or NPY file ({error})"
        ) from None


def _text(path: Path) -> Array:
    text = path.read_text(encoding="utf-8-sig").splitlines()
    lines = [line for line in text if line.strip() and not line.lstrip().startswith("#")]
    mark = next((mark for mark in ";\t," if lines and mark in lines[-1]), None)
    names = not lines or lines[0].split(mark)[0].strip().strip('"').isidentifier()
    return np.loadtxt(lines[names:], delimiter=mark, ndmin=2)
