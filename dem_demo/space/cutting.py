"""Cut a convex rock into convex blocks along joint sets in space; nothing here knows a law.

A joint of a set is a plane across the rock. In each block that it meets it either runs through the
whole block, with the probability `persistence`, or leaves a bridge of intact rock. Sets cut in the
given order, so the joints of a later set may end at joints of an earlier one.

Pieces narrower than the smallest width are slivers. A sliver is merged with a neighbour with which
it forms a convex block, across a joint of the last set if possible. A sliver that no neighbour can
take is left out.

Before all sets, the rock is cut along the faces of regions that are excavated later. As blocks are
convex, these cuts go on beyond the region, where they separate intact rock (`excavation_cuts`). No
piece is merged across the outline of a region.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np
from shapely import Polygon

from jointlaw.support.progress import track

from ..scene.cutting import joint_offsets
from .solids import EXCAVATION, LENGTH_TOLERANCE, OUTLINE, Solid, convex_hull

MERGE_TOLERANCE = 1e-6  # of the volume that a convex hull may add to two merged pieces


@dataclass(frozen=True)
class PlaneSet:
    """Parallel joint planes.

    dip: angle of the steepest line below the horizontal (degrees, 0 to 90); dip_direction: azimuth
    of this line, clockwise from y (north) to x (east), degrees. spacing: mean distance (m) of
    neighbours. law: name of its law. persistence: fraction of the area that is a joint. scatter:
    each distance is spacing (1 + scatter r) with r uniformly distributed over -1..1. through: a
    point (m) on one joint. rough: angle of the law's axis 2 from the dip line, in the plane,
    counter-clockwise seen from above (degrees); None for an isotropic law.
    """

    dip: float
    dip_direction: float
    spacing: float
    law: str
    persistence: float = 1.0
    scatter: float = 0.0
    through: tuple[float, float, float] = (0.0, 0.0, 0.0)
    rough: float | None = None

    @property
    def normal(self) -> np.ndarray:
        """Unit normal (3,), upwards."""
        return plane_normal(self.dip, self.dip_direction)

    @property
    def rough_direction(self) -> np.ndarray:
        """Unit vector (3,) of the law's axis 2."""
        return direction_in_plane(self.dip, self.dip_direction, self.rough or 0.0)

    def offsets(self, vertices: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """Return distances n . x (m) of the joints that may cross a body with vertices (v, 3)."""
        heights = vertices @ self.normal
        low, high = float(heights.min()), float(heights.max())
        start = float(np.dot(self.normal, self.through))
        return joint_offsets(low, high, start, self.spacing, self.scatter, rng)


def plane_normal(dip: float, dip_direction: float) -> np.ndarray:
    """Upward unit normal (3,) of a plane; angles in degrees, see `PlaneSet`."""
    dip, azimuth = np.radians([dip, dip_direction])
    return np.array([np.sin(dip) * np.sin(azimuth), np.sin(dip) * np.cos(azimuth), np.cos(dip)])


def direction_in_plane(dip: float, dip_direction: float, angle: float) -> np.ndarray:
    """Unit vector (3,) in a plane, at an angle from its dip line; degrees, see `PlaneSet`."""
    tilt, azimuth, turn = np.radians([dip, dip_direction, angle])
    down = np.array([np.cos(tilt) * np.sin(azimuth), np.cos(tilt) * np.cos(azimuth), -np.sin(tilt)])
    across = np.cross(plane_normal(dip, dip_direction), down)
    return np.cos(turn) * down + np.sin(turn) * across


class Pieces(NamedTuple):
    """Blocks that a rock is cut into.

    solids: their shapes. merged: number of slivers that became part of neighbours. dropped: slivers
    that did not.
    """

    solids: list[Solid]
    merged: int
    dropped: list[Solid]


def estimate_block_count(rock: Solid, sets: Sequence[PlaneSet]) -> float:
    """Estimate the number of blocks of a rock before it is cut; at least the number of joints.

    Every joint adds a block, and so does every line in which two joints meet and every point in
    which three do, if they are all there (`persistence`). Lines are counted by the area of the rock
    across them, points by its volume.
    """
    heights = rock.vertices - rock.vertices[0]
    joints = sum(float(np.ptp(heights @ one.normal)) / one.spacing for one in sets)
    lines = 0.0
    for one, other in combinations(sets, 2):
        line = np.cross(one.normal, other.normal)
        across = 0.5 * np.abs(rock.face_vectors @ line).sum()  # area across, times the sine
        both = one.persistence * other.persistence
        lines += both * across / one.spacing / other.spacing
    points = 0.0
    for three in combinations(sets, 3):
        triple = abs(float(np.linalg.det([one.normal for one in three])))
        density = np.prod([one.persistence / one.spacing for one in three])
        points += rock.volume * triple * float(density)
    return 1.0 + joints + lines + points


def cut_rock(
    rock: Solid,
    sets: Sequence[PlaneSet],
    seed: int,
    min_width: float,
    regions: Sequence[Solid] = (),
) -> Pieces:
    """Cut a convex rock into convex blocks no narrower than `min_width` (m).

    seed: of the random spacing and persistence. regions: that are excavated later. The rock is cut
    in coordinates relative to its first vertex, so a distant rock loses no digits.
    """
    origin = rock.vertices[0]
    tolerance = LENGTH_TOLERANCE * rock.size
    pieces = [rock.moved(-origin)]
    regions = [region.moved(-origin) for region in regions]
    for region in regions:
        pieces = [part for piece in pieces for part in _cut_along(piece, region, tolerance)]
    for number, joints in enumerate(sets):
        rng = np.random.default_rng([seed, number])
        shift = float(joints.normal @ origin)
        for offset in track(joints.offsets(rock.vertices, rng), f"cutting, set {number + 1}"):
            pieces = _cut_pieces(pieces, joints, number, offset - shift, tolerance, rng)
    pieces, merged, dropped = _merge_slivers(pieces, min_width, tolerance, regions)
    pieces.sort(key=lambda piece: tuple(np.round(piece.centroid[::-1] / tolerance).tolist()))
    return Pieces(
        [piece.moved(origin) for piece in pieces], merged, [d.moved(origin) for d in dropped]
    )


def _cut_pieces(pieces: list[Solid], joints: PlaneSet, number, offset, tolerance, rng):
    """Replace each piece that the joint crosses by its parts, with probability `persistence`."""
    normal = joints.normal
    vertices = np.concatenate([piece.vertices for piece in pieces])
    first = np.cumsum([0, *(len(piece.vertices) for piece in pieces[:-1])])
    heights = vertices @ normal - offset
    is_crossed = np.maximum.reduceat(heights, first) > tolerance
    is_crossed &= np.minimum.reduceat(heights, first) < -tolerance
    parts = []
    for piece, crossed in zip(pieces, is_crossed.tolist(), strict=True):
        if crossed and rng.random() < joints.persistence:
            below, above = piece.split(normal, offset, number, tolerance)
            parts += [part for part in (below, above) if part is not None]
        else:
            parts.append(piece)
    return parts


def _cut_along(piece: Solid, region: Solid, tolerance: float) -> list[Solid]:
    """Parts of a piece outside and inside a region, all of them convex."""
    parts: list[Solid] = []
    cuts = list(zip(region.faces, region.face_normals, strict=True))
    heights = [piece.vertices @ n - region.vertices[face[0]] @ n for face, n in cuts]
    if any(height.min() > -tolerance for height in heights):
        return [piece]  # beside the region
    inside: Solid | None = piece
    for face, normal in cuts:
        offset = float(normal @ region.vertices[face[0]])
        inside, outside = inside.split(normal, offset, EXCAVATION, tolerance)
        if outside is not None:
            parts.append(outside)
        if inside is None:  # in the corner between two faces of the region
            return [piece]
    return [*parts, inside]


def _regions_of(piece: Solid, regions: Sequence[Solid]) -> tuple[bool, ...]:
    """Whether a piece lies in each of the regions along which it was cut."""
    return tuple(region.contains(piece.centroid) for region in regions)


def excavation_cuts(pieces: Sequence[Solid], regions: Sequence[Solid]) -> list[tuple[int, int]]:
    """Pairs of pieces that only a cut along the faces of a region separates, not its outline.

    Both lie outside all the same regions, or inside them.
    """
    cut = [i for i, piece in enumerate(pieces) if EXCAVATION in piece.face_sets]
    inside = {i: _regions_of(pieces[i], regions) for i in cut}
    pairs = []
    for i, j in combinations(cut, 2):
        one, other = pieces[i], pieces[j]
        tolerance = 10 * LENGTH_TOLERANCE * max(one.size, other.size)
        low = np.maximum(one.vertices.min(axis=0), other.vertices.min(axis=0))
        high = np.minimum(one.vertices.max(axis=0), other.vertices.max(axis=0))
        if inside[i] == inside[j] and (low < high + tolerance).all():
            is_common = [
                one.face_sets[k] == EXCAVATION and _faces_overlap(one, k, other, tolerance)
                for k in _faces_on(one, other, tolerance)
            ]
            if any(is_common):
                pairs.append((i, j))
    return pairs


def _faces_overlap(one: Solid, face: int, other: Solid, tolerance: float) -> bool:
    """Whether a face of one solid has an area in common with a face of another in its plane."""
    normal = one.face_normals[face]
    first = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    plane = np.stack([first, np.cross(normal, first)], axis=1)
    ring = one.vertices[list(one.faces[face])]
    outline = Polygon((ring - ring[0]) @ plane)
    for number in _faces_on(other, one, tolerance):
        if other.face_normals[number] @ normal < -0.5:
            opposite = Polygon((other.vertices[list(other.faces[number])] - ring[0]) @ plane)
            if outline.intersection(opposite).area > tolerance * outline.length:
                return True
    return False


def _faces_on(one: Solid, other: Solid, tolerance: float) -> list[int]:
    """Numbers of the faces of one solid that lie in the plane of a face of another, opposite to
    it."""
    cosine = one.face_normals @ other.face_normals.T
    start = other.vertices[[face[0] for face in other.faces]]
    faces = []
    for i, face in enumerate(one.faces):
        gap = np.abs((one.vertices[face[0]] - start) @ one.face_normals[i])
        if ((cosine[i] < -1 + LENGTH_TOLERANCE) & (gap < tolerance)).any():
            faces.append(i)
    return faces


def _merge_slivers(
    pieces: list[Solid], min_width: float, tolerance: float, regions: Sequence[Solid] = ()
) -> tuple[list[Solid], int, list[Solid]]:
    """Merge or leave out pieces narrower than `min_width` (m), the narrowest first.

    No piece is merged with one that lies in other regions.

    Returns pieces, number of merged slivers, slivers left out.
    """
    merged = 0
    dropped: list[Solid] = []
    while pieces and min(piece.width for piece in pieces) < min_width:
        sliver = min(pieces, key=lambda piece: piece.width)
        pieces = [piece for piece in pieces if piece is not sliver]
        for neighbour in _neighbours(sliver, pieces, tolerance):
            if _regions_of(sliver, regions) != _regions_of(neighbour, regions):
                continue
            union = _convex_union(sliver, neighbour, tolerance)
            if union is not None:
                pieces = [union if piece is neighbour else piece for piece in pieces]
                merged += 1
                break
        else:
            dropped.append(sliver)
    return pieces, merged, dropped


def _neighbours(sliver: Solid, pieces: list[Solid], tolerance: float) -> list[Solid]:
    """Pieces on the other side of a joint of a sliver: last set first, then the largest face."""
    low = sliver.vertices.min(axis=0) - tolerance
    high = sliver.vertices.max(axis=0) + tolerance
    ranked = []
    for i, piece in enumerate(pieces):
        if (piece.vertices.max(axis=0) < low).any() or (piece.vertices.min(axis=0) > high).any():
            continue
        for j in _faces_on(sliver, piece, 10 * tolerance):
            if sliver.face_sets[j] != OUTLINE:
                ranked.append((sliver.face_sets[j], float(sliver.face_areas[j]), i))
    return [pieces[i] for *_, i in sorted(ranked, reverse=True)]


def _convex_union(one: Solid, other: Solid, tolerance: float) -> Solid | None:
    """The union of two pieces, None if it is not convex; faces keep the sets of their planes."""
    hull = convex_hull(np.concatenate([one.vertices, other.vertices]))
    if hull.volume > (1 + MERGE_TOLERANCE) * (one.volume + other.volume):
        return None
    sets = []
    for face, normal in zip(hull.faces, hull.face_normals, strict=True):
        numbers = [
            number
            for piece in (one, other)
            for own, own_normal, number in zip(
                piece.faces, piece.face_normals, piece.face_sets, strict=True
            )
            if own_normal @ normal > 1 - LENGTH_TOLERANCE
            and abs((piece.vertices[own[0]] - hull.vertices[face[0]]) @ normal) < 10 * tolerance
        ]
        if not numbers:
            return None
        sets.append(numbers[0])
    return Solid(hull.vertices, hull.faces, tuple(sets))
