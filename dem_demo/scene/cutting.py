"""Cut a rock outline into convex blocks along joint sets. shapely clips; nothing here knows a law.

A joint of a set is a straight line across the rock. In each block that it meets it either runs
right through, with the probability `persistence`, or leaves a bridge of whole rock: a joint that
would end inside a block does not weaken it. Sets cut in the order given, so the joints of a later
set may end at those of an earlier one.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np
from shapely import LineString, Polygon, STRtree, get_coordinates, get_exterior_ring, get_parts
from shapely.ops import split, unary_union

from jointlaw.support.progress import track

from .blocks import EXACT, smallest_width

Line = tuple[int, np.ndarray, float]  # a joint: number of its set, normal, distance n . x in m

CUT = 10**6  # in place of a set's number: of cuts through inward corners, no joints of the rock
LESS = 0.9  # share of a sliver that may be left when a neighbour takes a part of it
ROUNDING = 1e-6  # of the length below which a distance is zero: coordinates so small are zero


@dataclass(frozen=True)
class JointSet:
    """Parallel joints. dip in degrees below the horizontal, positive down to the right.

    spacing: mean distance (m) of neighbours; scatter: each distance is spacing (1 + scatter r)
    with r evenly spread over -1..1; persistence: share of the length that is a joint; through: a
    point (m) on one joint; law: name of its law.
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
        """Distances n . x (m) of the joints that may cross a body with these corners."""
        low, high = np.quantile(corners @ self.normal, [0.0, 1.0])
        start = float(np.dot(self.normal, self.through))
        sides = []
        for way, end in ((1.0, high), (-1.0, low)):
            most = int(np.ceil(max(way * (end - start), 0) / (1 - self.scatter) / self.spacing))
            steps = self.spacing * (1 + self.scatter * rng.uniform(-1, 1, most + 1))
            sides.append(start + way * np.cumsum(steps))
        offsets = np.sort(np.concatenate([[start], *sides]))
        return offsets[(offsets > low) & (offsets < high)]


def cut(
    outline: np.ndarray, sets: Sequence[JointSet], seed: int, least_width: float,
    holes: Sequence[np.ndarray] = (), regions: Sequence[np.ndarray] = (),
):  # fmt: skip
    """Cut a simple outline (m, 2) into convex blocks no narrower than `least_width` (m).

    holes: corners (m, 2) of openings, taken out before the sets cut; regions: of parts to be taken
    out later, along whose outlines the rock is cut first.
    Returns the corners (m, 2) of each block, counter-clockwise; for each block the numbers (m,) of
    the sets of its edges, -1 for the outline, or CUT; how many slivers became part of neighbours;
    and the shapes of those that could not. Raises ValueError.

    A piece that is still not convex (the outline bends inwards, or it holds an opening) is cut
    along the first set that runs through its inward corner. A sliver joins a neighbour with which
    it makes a convex block, across a joint of the last set if it can, so that joints of the first
    sets stay whole. Else both are cut through their inward corners, if this leaves less of the
    sliver; what no neighbour can take is dropped.
    """
    tiny, rock = EXACT * float(np.ptp(outline, axis=0).max()), Polygon(outline)
    for i, hole in enumerate(holes):
        before, rock = rock.area, rock.difference(Polygon(hole))
        if rock.is_empty or not rock.area < before:
            raise ValueError(f"hole[{i}] must take a part of the rock away and leave another")
    lines: list[Line] = [(-1, np.zeros(2), np.inf)]  # on the first one no edge lies
    parts, rims = [rock], unary_union([Polygon(region).exterior.buffer(tiny) for region in regions])
    for region in map(Polygon, regions):
        parts = [side for part in parts for side in (part - region, part & region)]
    pieces = [piece for part in parts for piece in get_parts(part) if piece.area]
    for number, joints in enumerate(sets):
        rng = np.random.default_rng([seed, number])
        for offset in track(joints.offsets(outline, rng), f"cutting, set {number + 1}"):
            lines.append((number, joints.normal, offset))
            pieces = _crossed(pieces, joints.normal, offset, tiny, joints.persistence, rng)
    pieces = [part for piece in pieces for part in _convex_parts(piece, sets, lines, tiny)]
    pieces, joined, dropped = _without_slivers(pieces, sets, lines, least_width, tiny, rims)
    shapes = [_corners(piece, tiny) for piece in pieces]
    for corners in shapes:  # of coordinates such as 1e-22 GEOS says overlaps that are not there
        corners[np.abs(corners) < ROUNDING * tiny] = 0.0
    shapes.sort(key=lambda c: tuple(np.round(c.mean(axis=0)[::-1], 6)))
    return shapes, [_sets_of(c, lines, tiny) for c in shapes], joined, dropped


@lru_cache(maxsize=100_000)  # asked for all pieces, for each sliver
def _width(piece: Polygon) -> float:
    return smallest_width(get_coordinates(piece.exterior))


def _crossed(pieces, normal, offset, tiny, persistence, rng) -> list[Polygon]:
    """Pieces: in place of each that the joint crosses its parts on both sides."""
    corners, of = get_coordinates(get_exterior_ring(pieces), return_index=True)
    away, first = corners @ normal - offset, np.flatnonzero(np.diff(of, prepend=-1))
    met = np.maximum.reduceat(away, first) >= tiny
    met &= np.minimum.reduceat(away, first) <= -tiny
    out = []
    for piece, meets in zip(pieces, met.tolist(), strict=True):
        cuts = meets and rng.random() < persistence
        out += _split(piece, normal, offset) if cuts else [piece]
    return out


def _split(piece: Polygon, normal: np.ndarray, offset: float) -> list[Polygon]:
    along = np.array([normal[1], -normal[0]])
    middle = normal * offset + along * (along @ np.array(piece.centroid.coords[0]))
    reach = 2 * piece.length
    return list(split(piece, LineString([middle - reach * along, middle + reach * along])).geoms)


def _convex_parts(piece: Polygon, sets, lines, tiny) -> list[Polygon]:
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
            lines.append((CUT, joints.normal, offset))
            return [p for part in parts for p in _convex_parts(part, sets, lines, tiny)]
    raise ValueError(f"no set runs through the inward corner {inward[0].round(3).tolist()} m")


def _without_slivers(pieces: list[Polygon], sets, lines, least: float, tiny: float, rims: Polygon):
    """Join or drop what is narrower than `least`, the narrowest first; nothing across `rims`."""
    joined, dropped = 0, []

    def slim(parts):
        return sum(part.area for part in parts if _width(part) < least)

    while pieces and _width(sliver := min(pieces, key=_width)) < least:
        pieces, shared = [piece for piece in pieces if piece is not sliver], []
        for j, joints in product(_neighbours(sliver, pieces, lines, tiny, rims), sets):
            whole, cuts = _union(sliver, pieces[j], tiny), list[Line]()
            with suppress(ValueError):
                parts = _convex_parts(whole, [joints], cuts, tiny)
                left = slim(parts) - slim([pieces[j]])
                if len(parts) == 1 or left < LESS * sliver.area:
                    shared.append((len(parts), left, j, parts, cuts))
        if shared:
            *_, j, parts, cuts = min(shared, key=lambda option: option[:2])
            pieces[j : j + 1] = parts
            lines += cuts
            joined += 1
        else:
            dropped.append(sliver)
    return pieces, joined, dropped


def _union(one: Polygon, other: Polygon, tiny: float) -> Polygon:
    """Both as one, without the slit that rounding leaves between them."""
    corner = {"join_style": "mitre", "mitre_limit": 1e3}
    return one.buffer(tiny, **corner).union(other.buffer(tiny, **corner)).buffer(-tiny, **corner)


def _neighbours(sliver: Polygon, pieces: list[Polygon], lines, tiny, rims) -> list[int]:
    """Those across a joint of the last set first, then those that share most boundary."""
    corners, found = _corners(sliver, tiny), []
    rings = get_exterior_ring(pieces)
    near = STRtree(rings)
    sides = zip(corners, np.roll(corners, -1, axis=0), _sets_of(corners, lines, tiny), strict=True)
    for start, end, number in sides:
        side = LineString([start, end]).buffer(tiny)
        for j in near.query(side).tolist():
            shared = side.intersection(rings[j]).length
            beside = shared > 10 * tiny and not rims.contains(LineString([start, end]))
            found += [(int(number), shared, j)] * beside
    return [j for *_, j in sorted(found, reverse=True)]


def _corners(piece: Polygon, tiny: float) -> np.ndarray:
    """Corners counter-clockwise, without those that bend nothing."""
    corners = get_coordinates(piece.exterior)[:-1]
    if not piece.exterior.is_ccw:
        corners = corners[::-1]
    corners = corners[np.hypot(*(corners - np.roll(corners, 1, axis=0)).T) > tiny]
    while (flat := np.abs(_bends(corners)) < tiny).any():
        corners = np.delete(corners, flat.argmax(), axis=0)
    return corners


def _bends(corners: np.ndarray) -> np.ndarray:
    """How far (m) each corner stands out from the line of its neighbours; negative inwards."""
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    chord, arm = after - before, corners - before
    return (arm[:, 1] * -chord[:, 0] + arm[:, 0] * chord[:, 1]) / np.hypot(*chord.T)


def _sets_of(corners: np.ndarray, lines, tiny: float) -> np.ndarray:
    """Number of the set on whose joint each edge (corner, next corner) lies, or -1."""
    numbers, normals, offsets = (np.array(part) for part in zip(*lines, strict=True))
    on = np.abs(corners @ normals.T - offsets) < 10 * tiny
    on &= np.roll(on, -1, axis=0)
    return np.where(on.any(axis=1), numbers[on.argmax(axis=1)], -1)  # the first that cut there
