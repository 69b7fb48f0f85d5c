"""Cut a rock outline into convex blocks along joint sets. shapely clips; nothing here knows a law.

A joint of a set is a straight line across the rock. In each block that it meets it either runs
through the whole block, with the probability `persistence`, or leaves a bridge of intact rock: a
joint that would end inside a block does not weaken it. Sets cut in the given order, so the joints
of a later set may end at joints of an earlier one.

A piece that is still not convex (the outline bends inwards, or the piece holds an opening) is cut
along the first set that runs through its inward corner; such a cut is no joint.

Pieces narrower than the smallest width are slivers. A sliver is merged with a neighbour with which
it forms a convex block, across a joint of the last set if possible, so that joints of the first
sets stay continuous. Otherwise the union of both is cut again through its inward corners, if less
of the sliver remains then. A sliver that no neighbour can take is dropped.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from shapely import LineString, Polygon, STRtree, get_coordinates, get_exterior_ring, get_parts
from shapely.ops import split, unary_union

from jointlaw.support.progress import track

from .blocks import LENGTH_TOLERANCE, smallest_width

Line = tuple[int, np.ndarray, float]  # a joint: number of its set, normal, distance n . x in m

INWARD_CUT = 10**6  # in place of the number of a set: cuts through inward corners are no joints
MAX_SLIVER_LEFT = 0.9  # fraction of a sliver that may remain when a neighbour takes a part of it
ROUNDING = 1e-6  # of the length tolerance: smaller coordinates are set to zero


@dataclass(frozen=True)
class JointSet:
    """Parallel joints.

    dip: angle below the horizontal (degrees), positive down to the right. spacing: mean distance
    (m) of neighbours. law: name of its law. persistence: fraction of the length that is a joint.
    scatter: each distance is spacing (1 + scatter r) with r uniformly distributed over -1..1.
    through: a point (m) on one joint.
    """

    dip: float
    spacing: float
    law: str
    persistence: float = 1.0
    scatter: float = 0.0
    through: tuple[float, float] = (0.0, 0.0)

    @property
    def normal(self) -> np.ndarray:
        """Unit normal, upwards."""
        dip = np.radians(self.dip)
        return np.array([np.sin(dip), np.cos(dip)])

    def offsets(self, corners: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Distances n . x (m), ascending, of the joints that may cross a body with these corners.

        From the joint through `through` on, spacings are random by up to `scatter` on both sides;
        only joints strictly between the extreme corners are returned.
        """
        low, high = np.quantile(corners @ self.normal, [0.0, 1.0])
        start = float(np.dot(self.normal, self.through))
        return joint_offsets(low, high, start, self.spacing, self.scatter, rng)


def joint_offsets(
    low: float, high: float, start: float, spacing: float, scatter: float, rng: np.random.Generator
) -> np.ndarray:
    """Positions (m), ascending, of the joints of a set strictly between `low` and `high`.

    The joint at `start` is one of them; from it on, each distance is spacing (1 + scatter r), with
    r uniformly distributed over -1..1.
    """
    sides = []
    for sign, end in ((1.0, high), (-1.0, low)):
        length = max(sign * (end - start), 0.0)
        count = int(np.ceil(length / (1 - scatter) / spacing))
        steps = spacing * (1 + scatter * rng.uniform(-1, 1, count + 1))
        sides.append(start + sign * np.cumsum(steps))
    offsets = np.sort(np.concatenate([[start], *sides]))
    return offsets[(offsets > low) & (offsets < high)]


class Pieces(NamedTuple):
    """Blocks that a rock is cut into.

    shapes: corners (m, 2) of each block, counter-clockwise (m). edge_sets: for each block the
    numbers (m,) of the sets of its edges, -1 for the outline, or INWARD_CUT. merged: number of
    slivers that became part of neighbours. dropped: shapes of slivers that did not.
    """

    shapes: list[np.ndarray]
    edge_sets: list[np.ndarray]
    merged: int
    dropped: list[Polygon]


def estimate_block_count(outline: np.ndarray, sets: Sequence[JointSet]) -> float:
    """Estimate the number of blocks of a rock before it is cut; at least the number of joints.

    Joints and their intersections, of which every one adds a block; an intersection adds one if
    both joints are there (`persistence`).
    """
    area = Polygon(outline).area
    joints = sum(float(np.ptp(outline @ one.normal)) / one.spacing for one in sets)
    intersections = 0.0
    for one, other in combinations(sets, 2):
        sine = abs(float(one.normal[0] * other.normal[1] - one.normal[1] * other.normal[0]))
        both = one.persistence * other.persistence
        intersections += both * area * sine / one.spacing / other.spacing
    return 1.0 + joints + intersections


def cut(
    outline: np.ndarray, sets: Sequence[JointSet], seed: int, min_width: float,
    holes: Sequence[np.ndarray] = (), regions: Sequence[np.ndarray] = (),
) -> Pieces:  # fmt: skip
    """Cut a simple outline (m, 2) into convex blocks no narrower than `min_width` (m).

    holes: corners (m, 2) of openings, removed before the sets cut. regions: corners of parts that
    are excavated later, along whose outlines the rock is cut first. seed: of the random spacing and
    persistence.

    Raises ValueError for a hole that removes nothing or everything, and for an inward corner that
    no set runs through.
    """
    tiny = LENGTH_TOLERANCE * float(np.ptp(outline, axis=0).max())
    rock = Polygon(outline)
    for i, hole in enumerate(holes):
        area = rock.area
        rock = rock.difference(Polygon(hole))
        if rock.is_empty or not rock.area < area:
            raise ValueError(f"hole[{i}] must take a part of the rock away and leave another")
    lines: list[Line] = [(-1, np.zeros(2), np.inf)]  # on the first one no edge lies
    parts = [rock]
    rims = unary_union([Polygon(region).exterior.buffer(tiny) for region in regions])
    for region in map(Polygon, regions):
        parts = [side for part in parts for side in (part - region, part & region)]
    pieces = [piece for part in parts for piece in get_parts(part) if piece.area]
    for number, joints in enumerate(sets):
        rng = np.random.default_rng([seed, number])
        for offset in track(joints.offsets(outline, rng), f"cutting, set {number + 1}"):
            lines.append((number, joints.normal, offset))
            pieces = _cut_pieces(pieces, joints.normal, offset, tiny, joints.persistence, rng)
    pieces = [part for piece in pieces for part in _convex_parts(piece, sets, lines, tiny)]
    pieces, merged, dropped = _merge_slivers(pieces, sets, lines, min_width, tiny, rims)
    shapes = [_corners(piece, tiny) for piece in pieces]
    for corners in shapes:  # with coordinates such as 1e-22 GEOS reports overlaps that do not exist
        corners[np.abs(corners) < ROUNDING * tiny] = 0.0
    shapes.sort(key=lambda c: tuple(np.round(c.mean(axis=0)[::-1], 6)))
    return Pieces(shapes, [_sets_of(c, lines, tiny) for c in shapes], merged, dropped)


@lru_cache(maxsize=100_000)  # called for all pieces, for each sliver
def _width(piece: Polygon) -> float:
    """Smallest width (m) of a piece."""
    return smallest_width(get_coordinates(piece.exterior))


def _cut_pieces(pieces, normal, offset, tiny, persistence, rng) -> list[Polygon]:
    """Replace each piece that the joint crosses by its parts, with probability `persistence`."""
    corners, owner = get_coordinates(get_exterior_ring(pieces), return_index=True)
    distance = corners @ normal - offset
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    is_crossed = np.maximum.reduceat(distance, first) >= tiny
    is_crossed &= np.minimum.reduceat(distance, first) <= -tiny
    parts = []
    for piece, crossed in zip(pieces, is_crossed.tolist(), strict=True):
        is_cut = crossed and rng.random() < persistence
        parts += _split(piece, normal, offset) if is_cut else [piece]
    return parts


def _split(piece: Polygon, normal: np.ndarray, offset: float) -> list[Polygon]:
    """Cut a piece along the line normal . x = offset (m)."""
    along = np.array([normal[1], -normal[0]])
    middle = normal * offset + along * (along @ np.array(piece.centroid.coords[0]))
    length = 2 * piece.length
    return list(split(piece, LineString([middle - length * along, middle + length * along])).geoms)


def _convex_parts(piece: Polygon, sets, lines, tiny) -> list[Polygon]:
    """Cut a piece through its inward corners, recursively, until its parts are convex.

    Each cut follows a joint set and is appended to `lines`. A piece narrower than `tiny` gives no
    part. Raises ValueError if no set runs through an inward corner.
    """
    if _width(piece) < tiny:
        return []
    corners = _corners(piece, tiny)
    inward = [*corners[_bends(corners) < 0], *get_coordinates([*piece.interiors])]
    if not inward:
        return [Polygon(corners)]
    for joints in sets:
        offset = float(joints.normal @ inward[0])
        parts = _split(piece, joints.normal, offset)
        if len(parts) > 1:
            lines.append((INWARD_CUT, joints.normal, offset))
            return [p for part in parts for p in _convex_parts(part, sets, lines, tiny)]
    raise ValueError(f"no set runs through the inward corner {inward[0].round(3).tolist()} m")


def _merge_slivers(
    pieces: list[Polygon], sets, lines, min_width: float, tiny: float, rims: Polygon
) -> tuple[list[Polygon], int, list[Polygon]]:
    """Merge or drop pieces narrower than `min_width` (m), the narrowest first; none is merged
    across the rim of an excavation. Returns pieces, number of merged slivers, dropped slivers."""
    merged = 0
    dropped = []

    def sliver_area(parts):
        return sum(part.area for part in parts if _width(part) < min_width)

    while pieces and _width(sliver := min(pieces, key=_width)) < min_width:
        pieces = [piece for piece in pieces if piece is not sliver]
        options = []
        for j, joints in product(_neighbours(sliver, pieces, lines, tiny, rims), sets):
            union = _union(sliver, pieces[j], tiny)
            cuts = list[Line]()
            with suppress(ValueError):
                parts = _convex_parts(union, [joints], cuts, tiny)
                remainder = sliver_area(parts) - sliver_area([pieces[j]])
                if len(parts) == 1 or remainder < MAX_SLIVER_LEFT * sliver.area:
                    options.append((len(parts), remainder, j, parts, cuts))
        if options:
            *_, j, parts, cuts = min(options, key=lambda option: option[:2])
            pieces[j : j + 1] = parts
            lines += cuts
            merged += 1
        else:
            dropped.append(sliver)
    return pieces, merged, dropped


def _union(one: Polygon, other: Polygon, tiny: float) -> Polygon:
    """Unite two pieces, without the slit that rounding leaves between them."""
    mitre = {"join_style": "mitre", "mitre_limit": 1e3}
    return one.buffer(tiny, **mitre).union(other.buffer(tiny, **mitre)).buffer(-tiny, **mitre)


def _neighbours(sliver: Polygon, pieces: list[Polygon], lines, tiny, rims) -> list[int]:
    """Return the neighbours of a sliver: across a joint of the last set first, then by the length
    of the common boundary."""
    corners = _corners(sliver, tiny)
    rings = get_exterior_ring(pieces)
    tree = STRtree(rings)
    ranked = []
    sides = zip(corners, np.roll(corners, -1, axis=0), _sets_of(corners, lines, tiny), strict=True)
    for start, end, number in sides:
        side = LineString([start, end])
        strip = side.buffer(tiny)
        is_rim = rims.contains(side)
        for j in tree.query(strip).tolist():
            length = strip.intersection(rings[j]).length
            if length > 10 * tiny and not is_rim:
                ranked.append((int(number), length, j))
    return [j for *_, j in sorted(ranked, reverse=True)]


def _corners(piece: Polygon, tiny: float) -> np.ndarray:
    """Corners (m, 2) of a piece, counter-clockwise, without corners on a straight side."""
    corners = get_coordinates(piece.exterior)[:-1]
    if not piece.exterior.is_ccw:
        corners = corners[::-1]
    corners = corners[np.hypot(*(corners - np.roll(corners, 1, axis=0)).T) > tiny]
    while (flat := np.abs(_bends(corners)) < tiny).any():
        corners = np.delete(corners, flat.argmax(), axis=0)
    return corners


def _bends(corners: np.ndarray) -> np.ndarray:
    """Distance (m) of each corner from the chord of its neighbours, negative for inward corners."""
    previous = np.roll(corners, 1, axis=0)
    chord = np.roll(corners, -1, axis=0) - previous
    arm = corners - previous
    return (arm[:, 1] * -chord[:, 0] + arm[:, 0] * chord[:, 1]) / np.hypot(*chord.T)


def _sets_of(corners: np.ndarray, lines, tiny: float) -> np.ndarray:
    """Number of the set on whose joint each edge (corner, next corner) lies, or -1."""
    numbers, normals, offsets = (np.array(part) for part in zip(*lines, strict=True))
    on_line = np.abs(corners @ normals.T - offsets) < 10 * tiny
    on_line &= np.roll(on_line, -1, axis=0)
    # an edge on several lines belongs to the joint that cut first
    return np.where(on_line.any(axis=1), numbers[on_line.argmax(axis=1)], -1)
