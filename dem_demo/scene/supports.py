"""Rock bolts and pressures on faces: their tables, and the blocks on which they act."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from shapely import LineString, Point, Polygon

from .blocks import LENGTH_TOLERANCE, Block
from .keys import Tables

LINE_TOLERANCE = 1e-3  # of its length: how far a line of pressure may be drawn from a face
PARALLEL_SINE = 1e-2  # between a line of pressure and a face that it lies on


@dataclass(frozen=True)
class Bolt:
    """A rock bolt: a bar that is anchored in two blocks at its ends.

    It bears tension only, is elastic up to its capacity and perfectly plastic there; unloading is
    elastic. All numbers are of the scene's thickness.

    blocks: in which its ends are anchored; ends: these points (m), as drawn; stiffness in N/m;
    capacity: largest force (N); pretension: force (N) as drawn.
    """

    blocks: tuple[int, int]
    ends: tuple[tuple[float, float], tuple[float, float]]
    stiffness: float
    capacity: float
    pretension: float


@dataclass(frozen=True)
class FacePressure:
    """A uniform pressure (Pa) on faces of blocks, perpendicular to them as they move.

    parts: (block, edge of the block, start, end) of each part; start and end in m along the edge.
    """

    value: float
    parts: tuple[tuple[int, int, float, float], ...]


def read_bolts(
    tables: Sequence[Tables], blocks: Sequence[Block], stages: Sequence[Tables], where: str
) -> Iterator[Bolt]:
    """Yield the bolts of the `[[bolt]]` tables.

    stages: of excavation; they must not remove a block that holds a bolt.

    Raises ValueError for a bolt that is not anchored in two blocks, one of which can move.
    """
    shapes = [Polygon(block.corners) for block in blocks]
    for i, table in enumerate(tables):
        name = f"{where}: bolt[{i}]"
        ends = table["from"], table["to"]
        numbers = tuple(
            _anchor_block(f"{name}.{key}", table[key], blocks, shapes) for key in ("from", "to")
        )
        if numbers[0] == numbers[1]:
            raise ValueError(
                f"{name}: both ends are anchored in block {blocks[numbers[0]].name!r}: a bolt must "
                "cross a joint; move `from` or `to` into another block"
            )
        if not any(blocks[number].moves for number in numbers):
            raise ValueError(f"{name}: neither of its blocks can move, so it bears nothing")
        if ends[0] == ends[1]:
            raise ValueError(f"{name}: from and to are the same point; a bolt has a length")
        for number in numbers:
            for j, stage in enumerate(stages):
                if number in stage["blocks"]:
                    raise ValueError(
                        f"{name}: excavate[{j}] removes block {blocks[number].name!r}, in which an "
                        "end is anchored; anchor it in rock that stays"
                    )
        pretension = table.get("pretension", 0.0)
        if pretension > table["capacity"]:
            raise ValueError(
                f"{name}.pretension = {pretension:g} N: must not exceed the capacity, "
                f"{table['capacity']:g} N"
            )
        yield Bolt(numbers, ends, table["stiffness"], table["capacity"], pretension)


def _anchor_block(
    name: str, point: tuple[float, float], blocks: Sequence[Block], shapes: Sequence[Polygon]
) -> int:
    """Return the number of the block that contains a point (m), or whose outline it lies on.

    Raises ValueError where there is no such block, or more than one.
    """
    extent = max(np.ptp(block.corners) for block in blocks)
    place = Point(point)
    near = [i for i, s in enumerate(shapes) if s.distance(place) <= LENGTH_TOLERANCE * extent]
    inside = [i for i in near if shapes[i].contains(place)]
    found = inside or near
    if not found:
        raise ValueError(f"{name} = {list(point)}: lies in no block; give a point in a block")
    if len(found) > 1:
        names = ", ".join(repr(blocks[i].name) for i in found)
        raise ValueError(
            f"{name} = {list(point)}: lies in or between blocks {names}; give a point in one block"
        )
    return found[0]


def read_pressures(
    tables: Sequence[Tables], blocks: Sequence[Block], where: str
) -> Iterator[FacePressure]:
    """Yield the pressures of the `[[pressure]]` tables.

    Where the line is a joint, the pressure acts on both faces of it.

    Raises ValueError for a line that is not covered by faces, or by faces of fixed rock alone.
    """
    for i, table in enumerate(tables):
        name = f"{where}: pressure[{i}]"
        line = np.array([table["from"], table["to"]])
        length = float(np.hypot(*(line[1] - line[0])))
        if not length:
            raise ValueError(f"{name}: from and to are the same point; give both ends of the faces")
        parts = [*_parts_on_line(line, blocks)]
        covered = LineString(line).intersection(_near_parts(parts, blocks, LINE_TOLERANCE * length))
        missing = length - covered.length
        if missing > 2 * LINE_TOLERANCE * length:
            at_all = "no face of a block" if not parts else f"faces on {covered.length:.3g} m only"
            raise ValueError(
                f"{name}: the line from {line[0].tolist()} to {line[1].tolist()} ({length:.3g} m) "
                f"meets {at_all}; it must lie on faces within {LINE_TOLERANCE * length:.2g} m; "
                "give a table for each straight part of the outline"
            )
        if not any(blocks[part[0]].moves for part in parts):
            raise ValueError(f"{name}: acts on fixed blocks only, which it cannot move")
        yield FacePressure(table["value"], tuple(parts))


def _parts_on_line(
    line: np.ndarray, blocks: Sequence[Block]
) -> Iterator[tuple[int, int, float, float]]:
    """Yield the parts of edges that lie on a line (2, 2) in m: block, edge, start and end (m)."""
    tolerance = LINE_TOLERANCE * np.hypot(*(line[1] - line[0]))
    for number, block in enumerate(blocks):
        ends = np.roll(block.corners, -1, axis=0)
        for edge, (start, end) in enumerate(zip(block.corners, ends, strict=True)):
            edge_length = float(np.hypot(*(end - start)))
            along = (end - start) / edge_length
            across = np.array([-along[1], along[0]])
            distance = (line - start) @ across
            if abs(distance[1] - distance[0]) > PARALLEL_SINE * np.hypot(*(line[1] - line[0])):
                continue
            first, last = np.clip(np.sort((line - start) @ along), 0.0, edge_length)
            middle = start + 0.5 * (first + last) * along
            if last - first > tolerance and _distance_to_line(middle, line) <= tolerance:
                yield number, edge, float(first), float(last)


def _distance_to_line(point: np.ndarray, line: np.ndarray) -> float:
    """Distance (m) of a point from the line through two points (2, 2)."""
    along = (line[1] - line[0]) / np.hypot(*(line[1] - line[0]))
    x, y = point - line[0]
    return abs(along[0] * y - along[1] * x)


def _near_parts(
    parts: Sequence[tuple[int, int, float, float]], blocks: Sequence[Block], tolerance: float
) -> Polygon:
    """The region within a tolerance (m) of parts of edges."""
    region = Polygon()
    for number, edge, first, last in parts:
        corners = blocks[number].corners
        start = corners[edge]
        side = corners[(edge + 1) % len(corners)] - start
        along = side / np.hypot(*side)
        ends = [start + first * along, start + last * along]
        region = region.union(LineString(ends).buffer(tolerance))
    return region
