"""Points of outlines and lines from files: CSV tables, and polylines of DXF drawings.

In a scene the name of a file may stand for a list of points. `fill_in_points` puts the points in
its place, so that the rest of the reader sees lists only. Contents of the files are kept with the
scene (`Files`), as a resumed run needs them again.
"""

import io
import re
from importlib.util import find_spec
from typing import Any

import numpy as np

from jointlaw.support.checks import finite

from .keys import Tables
from .laws import Files

OUTLINES = {"corners", "outline"}  # keys of closed polygons
LINES = {"table", "surface"}  # keys of open lines
SEPARATOR = r"\s*[,;]\s*|\s+"


def fill_in_points(tables: Any, files: Files, where: str) -> Any:
    """Return tables with points wherever a file is named for them.

    Polygons from files are counter-clockwise, and a last corner that repeats the first is left out.

    Raises ValueError naming the key, and the file and line that cannot be read.
    """
    if isinstance(tables, list):
        return [fill_in_points(table, files, f"{where}[{i}]") for i, table in enumerate(tables)]
    if not isinstance(tables, dict):
        return tables
    filled: Tables = {}
    for key, value in tables.items():
        name = f"{where}.{key}"
        if key in OUTLINES | LINES and isinstance(value, str):
            filled[key] = _read_points(files, name, value, key in OUTLINES)
        elif key == "laws":  # of parameter files, which have tables of their own
            filled[key] = value
        else:
            filled[key] = fill_in_points(value, files, name)
    return filled


def _read_points(files: Files, name: str, spec: str, is_closed: bool) -> list[list[float]]:
    """Return the points (m) of a file; spec: its name, of a DXF file with ":LAYER" after it."""
    file, _, layer = spec.partition(":")
    where = f"{name}: {file}"
    try:
        content = files[file]
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(
            f"{where} cannot be read ({error}); give a CSV file of x and y in m, or a DXF file "
            "(text, version R2007 or later)"
        ) from None
    if file.lower().endswith(".dxf"):
        points = _read_dxf(content, where, layer, is_closed)
    else:
        points = _read_csv(content, where)
    if is_closed and len(points) > 1 and np.allclose(points[0], points[-1], rtol=0.0, atol=1e-9):
        points = points[:-1]
    if is_closed and _signed_area(points) < 0.0:
        points = points[::-1]
    return points.tolist()


def _signed_area(points: np.ndarray) -> float:
    """Area (m2) of a polygon, above zero if its corners (m, 2) are counter-clockwise."""
    x, y = points.T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def _read_csv(content: str, where: str) -> np.ndarray:
    """Return the points (m, 2) of a table of x and y (m), below a line of titles or none."""
    points = []
    has_title = False
    for number, line in enumerate(content.splitlines(), 1):
        text = line.partition("#")[0].strip()
        if not text:
            continue
        try:
            values = finite("line", [float(part) for part in re.split(SEPARATOR, text)], "m")
            x, y = values
        except ValueError:
            if not points and not has_title:
                has_title = True
                continue
            raise ValueError(f"{where}, line {number}: {line!r} must be x and y in m") from None
        points.append((x, y))
    if not points:
        raise ValueError(f"{where}: has no points; give lines such as '1.5, 2.0', x and y in m")
    return np.array(points)


def _read_dxf(content: str, where: str, layer: str, is_closed: bool) -> np.ndarray:
    """Return the points (m, 2) of the one polyline of a drawing, on a layer if one is named.

    Lengths are in the unit of the drawing, m where it has none.
    """
    if not find_spec("ezdxf"):
        raise ValueError(f"{where}: DXF files need ezdxf: pip install ezdxf")
    import ezdxf
    from ezdxf import units

    try:
        drawing = ezdxf.read(io.StringIO(content))
    except (ezdxf.DXFError, ValueError) as error:
        raise ValueError(f"{where} is no DXF drawing ({error})") from None
    lines = [
        entity
        for entity in drawing.modelspace().query("LWPOLYLINE POLYLINE")
        if layer in ("", entity.dxf.layer)
    ]
    if len(lines) != 1:
        layers = ", ".join(sorted({entity.dxf.layer for entity in lines})) or "none"
        place = f"on layer {layer!r}" if layer else "in it"
        raise ValueError(
            f"{where}: must have one polyline {place}, it has {len(lines)} (layers: {layers}); "
            "name a layer of one polyline after a colon, as in 'section.dxf:LAYER'"
        )
    (line,) = lines
    if line.has_arc:
        raise ValueError(f"{where}: the polyline has arcs; draw it by straight segments")
    if line.is_closed != is_closed:
        expected = "closed" if is_closed else "open"
        raise ValueError(f"{where}: the polyline must be {expected}")
    factor = units.conversion_factor(drawing.units, units.M) if drawing.units else 1.0
    if line.dxftype() == "LWPOLYLINE":
        points = [point[:2] for point in line.get_points("xy")]
    else:
        points = [tuple(vertex.dxf.location)[:2] for vertex in line.vertices]
    return factor * np.array(points, float)
