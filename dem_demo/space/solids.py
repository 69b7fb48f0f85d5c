"""Convex solids: polyhedra whose faces remember the joint set that cut them.

A solid is a list of vertices and of faces, and each face lists its vertices counter-clockwise seen
from outside. Faces share their vertices, so a cut creates every new vertex once, and the two parts
of a cut fit each other without a gap.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import ConvexHull, QhullError

LENGTH_TOLERANCE = 1e-7  # of the size of a solid: shorter distances count as zero
COPLANAR_TOLERANCE = 1e-7  # of unit normals of facets that belong to one face
MAX_FLATNESS = 1e-9  # thickness over length of points that span no volume
EXCAVATION = -2  # in place of the number of a set: cuts along an excavation are no joints
OUTLINE = -1  # in place of the number of a set: faces of the outline are no joints


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex polyhedron.

    vertices (v, 3) in m. faces: numbers of the vertices of each face, counter-clockwise seen from
    outside. face_sets: number of the joint set that cut each face, or OUTLINE.
    """

    vertices: np.ndarray
    faces: tuple[tuple[int, ...], ...]
    face_sets: tuple[int, ...]

    @cached_property
    def triangles(self) -> np.ndarray:
        """Vertex numbers (t, 3) of triangles that cover the faces."""
        fans = [(f[0], f[i], f[i + 1]) for f in self.faces for i in range(1, len(f) - 1)]
        return np.array(fans)

    @cached_property
    def face_vectors(self) -> np.ndarray:
        """Outward area vectors (faces, 3) of the faces, m2."""
        corners = self.vertices[self.triangles]
        vectors = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        counts = [len(face) - 2 for face in self.faces]
        return np.add.reduceat(vectors, np.cumsum([0, *counts[:-1]]))

    @property
    def face_areas(self) -> np.ndarray:
        """Areas (faces,) in m2."""
        return np.linalg.norm(self.face_vectors, axis=1)

    @property
    def face_normals(self) -> np.ndarray:
        """Outward unit normals (faces, 3)."""
        return self.face_vectors / self.face_areas[:, None]

    @cached_property
    def _moments(self) -> tuple[float, np.ndarray, np.ndarray]:
        """Volume, first moments (3,) and second moments (3, 3) about vertex 0.

        Sums over the tetrahedra between vertex 0 and the triangles of the faces, so that a distant
        solid loses no digits.
        """
        corners = self.vertices[self.triangles] - self.vertices[0]
        volumes = np.linalg.det(corners) / 6.0
        sums = corners.sum(axis=1)
        first = volumes @ sums / 4.0
        second = np.einsum("t,tci,tcj->ij", volumes, corners, corners)
        second += np.einsum("t,ti,tj->ij", volumes, sums, sums)
        return float(volumes.sum()), first, second / 20.0

    @property
    def volume(self) -> float:
        """Volume (m3)."""
        return self._moments[0]

    @property
    def centroid(self) -> np.ndarray:
        """Centroid (3,) in m."""
        volume, first, _ = self._moments
        return self.vertices[0] + first / volume

    @property
    def inertia(self) -> np.ndarray:
        """Moments of inertia (3, 3) about the centroid at a density of 1 kg/m3, kg m2."""
        volume, first, second = self._moments
        second = second - np.outer(first, first) / volume
        return np.trace(second) * np.eye(3) - second

    @cached_property
    def width(self) -> float:
        """Smallest width (m) along the normals of the faces."""
        return float(np.ptp(self.vertices @ self.face_normals.T, axis=0).min())

    @property
    def size(self) -> float:
        """Longest side (m) of the bounding box."""
        return float(np.ptp(self.vertices, axis=0).max())

    def moved(self, by: np.ndarray) -> "Solid":
        """The solid displaced by a vector (3,) in m."""
        return Solid(self.vertices + by, self.faces, self.face_sets)

    def rotated(self, rotation: np.ndarray) -> "Solid":
        """The solid rotated about the origin by a matrix (3, 3), a mirror included."""
        faces = self.faces
        if np.linalg.det(rotation) < 0:  # a mirror turns the order of the vertices round
            faces = tuple(face[::-1] for face in faces)
        return Solid(self.vertices @ rotation.T, faces, self.face_sets)

    def contains(self, point: np.ndarray) -> bool:
        """Whether a point (3,) in m lies inside or on the surface."""
        starts = self.vertices[[face[0] for face in self.faces]]
        heights = np.einsum("fi,fi->f", point - starts, self.face_normals)
        return bool(heights.max() <= LENGTH_TOLERANCE * self.size)

    def split(
        self, normal: np.ndarray, offset: float, number: int, tolerance: float
    ) -> tuple["Solid | None", "Solid | None"]:
        """Cut along the plane normal . x = offset (m).

        normal (3,): unit vector; number: of the joint set, for the new faces; tolerance (m):
        vertices nearer to the plane lie on it.

        Returns the parts below and above the plane, along the normal; None where there is none.
        """
        heights = self.vertices @ normal - offset
        signs = np.sign(heights) * (np.abs(heights) > tolerance)
        if signs.max() <= 0:
            return self, None
        if signs.min() >= 0:
            return None, self
        side = signs.astype(int).tolist()
        height = heights.tolist()
        crossings: dict[tuple[int, int], int] = {}  # number of the new vertex on each edge
        parts: tuple[list, list] = [], []
        sets: tuple[list, list] = [], []
        for face, face_set in zip(self.faces, self.face_sets, strict=True):
            rings: tuple[list, list] = [], []
            for start, end in zip(face, face[1:] + face[:1], strict=True):
                if side[start] <= 0:
                    rings[0].append(start)
                if side[start] >= 0:
                    rings[1].append(start)
                if side[start] * side[end] < 0:
                    edge = (start, end) if start < end else (end, start)
                    vertex = crossings.setdefault(edge, len(side) + len(crossings))
                    rings[0].append(vertex)
                    rings[1].append(vertex)
            for part, ring in enumerate(rings):
                if any(v < len(side) and side[v] for v in ring):  # not a point or line of the plane
                    parts[part].append(tuple(ring))
                    sets[part].append(face_set)
        edges = np.array(list(crossings), int).reshape(-1, 2)
        low, high = heights[edges].T
        start, end = self.vertices[edges[:, 0]], self.vertices[edges[:, 1]]
        new = start + (end - start) * (low / (low - high))[:, None]
        vertices = np.concatenate([self.vertices, new])
        rim = [v for v, sign in enumerate(side) if not sign] + list(crossings.values())
        if len(rim) < 3:  # a plane that meets a sliver at its tip
            return (self, None) if -min(height) > max(height) else (None, self)
        rim = _order_around(vertices, rim, normal)
        below = _compressed(vertices, [*parts[0], rim], [*sets[0], number])
        above = _compressed(vertices, [*parts[1], rim[::-1]], [*sets[1], number])
        return below, above


def _order_around(vertices: np.ndarray, ring: Sequence[int], normal: np.ndarray) -> tuple[int, ...]:
    """Numbers of vertices of a plane convex ring, counter-clockwise seen against its normal."""
    across = np.cross(normal, np.eye(3)[np.abs(normal).argmin()])
    points = vertices[list(ring)]
    points = points - points.mean(axis=0)
    angles = np.arctan2(points @ np.cross(normal, across), points @ across)
    return tuple(ring[i] for i in np.argsort(angles).tolist())


def _compressed(vertices: np.ndarray, faces: Sequence[tuple[int, ...]], sets: Sequence[int]):
    """A solid with the vertices that its faces use."""
    used = sorted({vertex for face in faces for vertex in face})
    number = {vertex: i for i, vertex in enumerate(used)}
    renumbered = tuple(tuple(number[vertex] for vertex in face) for face in faces)
    return Solid(vertices[used], renumbered, tuple(sets))


def box(size: Sequence[float], center: Sequence[float] = (0.0, 0.0, 0.0)) -> Solid:
    """A box (m) with edges along the axes."""
    signs = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)])
    vertices = 0.5 * signs * np.asarray(size, float) + np.asarray(center, float)
    faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
    return Solid(vertices, faces, (OUTLINE,) * 6)


def convex_hull(points: np.ndarray) -> Solid:
    """Convex hull of points (p, 3) in m. Raises ValueError for points that span no volume."""
    middle = points.mean(axis=0)
    relative = points - middle
    extent = np.linalg.svd(relative, compute_uv=False) if len(points) > 3 else np.zeros(3)
    if not extent[2] > MAX_FLATNESS * extent[0]:
        raise ValueError("its corners lie in one plane, so the volume is zero")
    try:
        hull = ConvexHull(relative)
    except QhullError as error:
        raise ValueError(f"no convex hull of its corners: {str(error).splitlines()[0]}") from None
    normals = list[np.ndarray]()
    members = list[set[int]]()
    for equation, simplex in zip(hull.equations, hull.simplices.tolist(), strict=True):
        for normal, vertices in zip(normals, members, strict=True):
            if np.abs(normal - equation[:3]).max() < COPLANAR_TOLERANCE:
                vertices |= {*simplex}
                break
        else:
            normals.append(equation[:3])
            members.append({*simplex})
    tolerance = LENGTH_TOLERANCE * float(np.ptp(points, axis=0).max())
    faces = [
        _without_straight_corners(points, _order_around(relative, [*vertices], normal), tolerance)
        for normal, vertices in zip(normals, members, strict=True)
    ]
    return _compressed(points, faces, [OUTLINE] * len(faces))


def _without_straight_corners(points, ring: tuple[int, ...], tolerance: float) -> tuple[int, ...]:
    """The ring without vertices that lie on the line between their neighbours, up to `tolerance`
    (m)."""
    at = points[[*ring]]
    before = np.roll(at, 1, axis=0)
    chords = np.roll(at, -1, axis=0) - before
    areas = np.linalg.norm(np.cross(chords, at - before), axis=1)
    if (areas > tolerance * np.linalg.norm(chords, axis=1)).all():
        return ring
    kept = [*ring]
    i = 0
    while i < len(kept):
        before, at, after = (points[kept[(i + j) % len(kept)]] for j in (-1, 0, 1))
        chord = after - before
        distance = np.linalg.norm(np.cross(chord, at - before)) / np.linalg.norm(chord)
        if distance <= tolerance:
            del kept[i]
            i = max(i - 1, 0)
        else:
            i += 1
    return tuple(kept)


def convex_solid(points: np.ndarray) -> Solid:
    """Convex solid with corners (p, 3) in m, in any order.

    Raises ValueError for corners that span no volume, for two corners at one place, and for a
    corner that is no vertex of the convex hull.
    """
    solid = convex_hull(points)
    tolerance = LENGTH_TOLERANCE * solid.size
    distances = np.linalg.norm(points[:, None] - solid.vertices, axis=2)
    if len(points) > len(solid.vertices):
        inner = distances.min(axis=1).argmax()
        if distances[inner].min() > tolerance:
            raise ValueError(
                f"corner {points[inner].round(6).tolist()} lies in the convex hull of the others: "
                "a block must be convex; cut it into convex blocks"
            )
        raise ValueError("has two corners (almost) at the same place")
    return solid


def extruded(corners: np.ndarray, y: float, depth: float) -> Solid:
    """A convex polygon (m, 2) of the x-z plane, extruded along y from `y` by `depth` (m).

    corners: x and z in m, counter-clockwise seen along y.
    """
    front = np.column_stack([corners[:, 0], np.full(len(corners), y), corners[:, 1]])
    back = front + np.array([0.0, depth, 0.0])
    m = len(corners)
    sides = [((i + 1) % m, i, m + i, m + (i + 1) % m) for i in range(m)]
    faces = (tuple(range(m)), tuple(range(2 * m - 1, m - 1, -1)), *sides)
    return Solid(np.concatenate([front, back]), faces, (OUTLINE,) * len(faces))


def solid_of_mesh(vertices: np.ndarray, faces: Sequence[Sequence[int]]) -> Solid:
    """Convex solid that a closed surface (vertices (v, 3) in m, faces counter-clockwise) encloses.

    Raises ValueError for a surface that is open or whose faces have no common sense of rotation,
    and for a solid that is not convex.
    """
    edges = Counter(edge for face in faces for edge in zip(face, [*face[1:], face[0]], strict=True))
    if any(count > 1 for count in edges.values()):
        raise ValueError("an edge belongs to more than two faces, or faces turn different ways")
    if any((end, start) not in edges for start, end in edges):
        raise ValueError("its surface is not closed: an edge belongs to one face only")
    surface = Solid(vertices, tuple(map(tuple, faces)), (OUTLINE,) * len(faces))
    hull = convex_hull(vertices)
    volume = surface.volume
    if volume < 0:
        raise ValueError("its faces are listed clockwise: list them counter-clockwise from outside")
    if abs(hull.volume - volume) > LENGTH_TOLERANCE * hull.volume:
        raise ValueError(
            f"encloses {volume:.6g} m3, its convex hull {hull.volume:.6g} m3: it is not convex, or "
            "its faces cross; cut it into convex blocks"
        )
    return hull
