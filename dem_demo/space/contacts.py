"""Contacts of blocks in space: points of faces that lie on each other.

Two faces that look at each other are in contact over their overlap, a convex polygon. Its corners
are the contact points, and each carries the area of its share of the polygon, so force and moment
of a closure that varies linearly over the overlap are exact. As in the plane, the stiffness against
rocking of a rectangular contact is three times that of a bed of springs; the limit of toppling, at
which the resultant reaches the edge, is exact.

A point lies on the face of block a, the block with the lower number, and its closure is its depth
below the plane of the face of block b. The directions of the law are fixed to block b: the normal
of its face, axis 2 (the rough direction of the joint) and axis 3, so the history of a joint rotates
with the rock. Where the point is a corner of the face of b, it belongs to b, and plane and
directions to a: a corner keeps its depth when its block slides, also where the faces are tilted.
The roles never change; they follow from the numbers of the blocks alone.

Blocks whose faces are tilted by more than 2 degrees against each other stand on an edge or a
corner, or two of their edges cross. Then the point belongs to the block that stands on the other
one, and the plane and the directions of the law to the other one, whichever of them is a. The joint
along an edge is a strip whose width is given. Areas, and closures of points that slide along the
border of a face, have derivatives by the motions of the blocks, which are forces in a run.

The geometry is computed by `native/face_contacts.c`, which knows no Python and no law, so another
code can carry it.
"""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..compiled import PointArrays, SolidArrays, address
from ..contact import ContactRows
from ..native.layout import CONSTANTS
from .solids import Solid

MAX_TILT = np.arcsin(CONSTANTS["FLUSH_SINE"].value)  # of two faces that lie on each other, rad
TIE_PER_WIDTH = 1e-5  # of the narrower block: distances below it count as zero
POINTS_PER_PAIR = 8  # room for points at first
MIN_AXIS_SINE = 0.1  # between a rough direction and the normal of the plane that it lies in
MAX_STRIP_PER_WIDTH = 0.5  # of the narrower block: widest joint along an edge
MAX_FACE_CORNERS = 128  # of two faces, as in face_contacts.c
MAX_FACE_PAIRS = 64  # of two blocks, as in face_contacts.c


class Surfaces:
    """Vertices and faces of all blocks, and where they are.

    Arrays run over n blocks, v vertices and f faces of all of them. position (n, 3) in m: of the
    centroids; rotation (n, 3, 3): its columns are the principal axes of a block. volume (n,) in m3;
    moments (n, 3): principal moments of inertia at a density of 1 kg/m3. radius, width (n,) in m:
    distance of the farthest vertex from the centroid; smallest width. is_mobile (n,).
    first_vertex, first_face (n + 1,), first_corner (f + 1,), corner: numbers of the vertices of
    face i are corner[first_corner[i] : first_corner[i + 1]]. vertex (v, 3), normal (f, 3),
    box (n, 2, 3): at the present places, written by `place`.
    """

    def __init__(self, solids: Sequence[Solid], is_mobile: np.ndarray) -> None:
        n = len(solids)
        self.solids = tuple(solids)
        self.is_mobile = np.array(is_mobile, np.uint8)
        self.position = np.array([solid.centroid for solid in solids]).reshape(n, 3)
        self.volume = np.array([solid.volume for solid in solids])
        self.width = np.array([solid.width for solid in solids])
        self.moments, axes = np.linalg.eigh(np.array([solid.inertia for solid in solids]))
        axes[:, :, 2] *= np.sign(np.linalg.det(axes))[:, None]
        self.rotation = np.ascontiguousarray(axes)
        self.first_vertex = _starts(len(solid.vertices) for solid in solids)
        self.first_face = _starts(len(solid.faces) for solid in solids)
        faces = [
            [start + vertex for vertex in face]
            for solid, start in zip(solids, self.first_vertex.tolist(), strict=False)
            for face in solid.faces
        ]
        self.first_corner = _starts(map(len, faces))
        self.corner = np.array([vertex for face in faces for vertex in face], np.int64)
        self.block_of_face = np.repeat(np.arange(n), np.diff(self.first_face))
        self.face_sets = np.concatenate([solid.face_sets for solid in solids]).astype(int)
        relative = [solid.vertices - solid.centroid for solid in solids]
        self.radius = np.array([np.linalg.norm(arms, axis=1).max() for arms in relative])
        local = zip(relative, axes, strict=True)
        self.local_vertex = np.concatenate([arms @ axis for arms, axis in local])
        normals = zip((solid.face_normals for solid in solids), axes, strict=True)
        self.local_normal = np.concatenate([normal @ axis for normal, axis in normals])
        self.vertex = np.empty_like(self.local_vertex)
        self.normal = np.empty_like(self.local_normal)
        self.box = np.empty((n, 2, 3))
        self.arrays = SolidArrays(n_blocks=n)
        self.arrays.bind(
            self, "first_vertex", "first_face", "first_corner", "corner", "local_vertex",
            "local_normal", "position", "rotation", "is_mobile", "vertex", "normal", "box",
        )  # fmt: skip
        self.place()

    @cached_property
    def triangles(self) -> tuple[np.ndarray, np.ndarray]:
        """Triangles that cover the faces: their vertices (t, 3), counter-clockwise from outside,
        and the face (t,) of each."""
        counts = np.diff(self.first_corner) - 2
        face = np.repeat(np.arange(len(counts)), counts)
        second = np.arange(len(face)) - np.repeat(np.cumsum(counts) - counts, counts) + 1
        start = self.first_corner[face]
        corners = np.stack([start, start + second, start + second + 1], axis=1)
        return self.corner[corners], face

    def place(self) -> None:
        """Compute vertices, normals and boxes at the present positions and rotations."""
        self.arrays.call("place_solids")

    def ring(self, face: int) -> np.ndarray:
        """Vertices (m, 3) of a face now, in m."""
        return self.vertex[self.corner[self.first_corner[face] : self.first_corner[face + 1]]]

    def near_pairs(self, reach: np.ndarray) -> np.ndarray:
        """Pairs (p, 2) of blocks, the lower number first, whose boxes are nearer than the sum of
        their reaches (n,) in m, and of which one can move."""
        order = np.argsort(self.box[:, 0, 0] - reach, kind="stable")
        room = 16 * len(reach)
        while True:
            pairs = np.empty((room, 2), np.int64)
            places = address(order), address(reach)
            count = self.arrays.call("near_pairs", *places, room, address(pairs))
            if count <= room:
                pairs = pairs[:count]
                return np.ascontiguousarray(pairs[np.lexsort(pairs.T[::-1])])
            room = count

    def separations(self, pairs: np.ndarray, tolerance: float) -> np.ndarray:
        """Separations (p,) in m of pairs (p, 2) of blocks: below -`tolerance` (m) where they
        overlap, and then minus the depth of the overlap."""
        separation = np.empty(len(pairs))
        self.arrays.call("separations", len(pairs), address(pairs), tolerance, address(separation))
        return separation


def _starts(counts) -> np.ndarray:
    """Number of the first member of each group, and of all members."""
    return np.concatenate([[0], np.cumsum([*counts])]).astype(np.int64)


class ContactPoints(NamedTuple):
    """k contact points; all points of a contact of two faces follow each other.

    block_a, block_b, face_a, face_b (k,): numbers of blocks and faces, block_a < block_b.
    plane_is_of_a (k,): whether the plane of the contact belongs to block a; else to b. point
    (k, 3) in m: on the other block. normal (k, 3): of the plane, out of its block; base (k, 3): a
    point of it, in m. area (k,) in m2; area_rate (k, 6): its derivatives by displacements of the
    block of the point against the block of the plane (m), and by rotations about axes x, y, z
    through `base` (m2); zero for faces that lie on each other. closure_rate (k, 6): derivatives of
    the closure beyond those of a point fixed to its block, as the point slides on it. contact (k,):
    number of the contact of two faces.
    """

    block_a: np.ndarray
    block_b: np.ndarray
    face_a: np.ndarray
    face_b: np.ndarray
    plane_is_of_a: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    base: np.ndarray
    area: np.ndarray
    area_rate: np.ndarray
    closure_rate: np.ndarray
    contact: np.ndarray

    @property
    def closure(self) -> np.ndarray:
        """Depth (k,) in m below the plane; below zero a gap."""
        return np.einsum("ki,ki->k", self.base - self.point, self.normal)

    @property
    def normal_to_a(self) -> np.ndarray:
        """Normals (k, 3) from block b to block a."""
        return np.where(self.plane_is_of_a[:, None], -self.normal, self.normal)


def require_apart(
    surfaces: Surfaces, names: Sequence[str], skins: np.ndarray, is_removed: np.ndarray
) -> None:
    """Require that no blocks overlap as drawn by more than their ranges of contact detection.

    names (n,) of the blocks; skins (n,) in m; is_removed (n,): blocks that are absent. Raises
    ValueError.
    """
    pairs = surfaces.near_pairs(np.zeros(len(skins)))
    pairs = pairs[~is_removed[pairs].any(axis=1)]
    allowed = skins[pairs].min(axis=1)
    depth = -surfaces.separations(pairs, float(allowed.min(initial=np.inf)))
    for i in np.flatnonzero(depth > allowed)[:1]:
        first, second = (names[block] for block in pairs[i])
        raise ValueError(
            f"blocks {first!r} and {second!r} overlap by {depth[i]:.3g} m as drawn, more "
            "than the range of contact detection: move one, or set a larger run.skin"
        )


def find_contacts(
    surfaces: Surfaces,
    reach: np.ndarray,
    max_overlap: float,
    pairs: np.ndarray | None = None,
    corner_length: float = np.inf,
) -> ContactPoints:
    """Find all contacts at the present places of the blocks.

    reach (n,) in m: two faces are in contact where their gap is below the sum of the reaches.
    max_overlap: largest depth of a contact, as a fraction of the width of the narrower block.
    pairs (p, 2): of blocks to be searched, the lower number first; by default all near ones.
    corner_length (m): width of the joint along an edge, at most half of the narrower block.

    Raises ValueError for faces of too many corners, and too many faces of two blocks in contact.
    """
    if pairs is None:
        pairs = surfaces.near_pairs(reach)
    pairs = np.ascontiguousarray(pairs)
    width = surfaces.width[pairs].min(axis=1)
    max_gap = reach[pairs].sum(axis=1)
    max_depth = max_overlap * width
    tie = TIE_PER_WIDTH * width
    strip = np.minimum(corner_length, MAX_STRIP_PER_WIDTH * width)
    room = POINTS_PER_PAIR * len(pairs)
    while True:
        number, face_a, face_b = np.empty((3, room), np.int64)
        plane_is_of_a = np.empty(room, bool)
        point, normal, base = np.empty((3, room, 3))
        area = np.empty(room)
        area_rate, closure_rate = np.empty((2, room, 6))
        out = PointArrays(capacity=room)
        out.bind(
            number=number, face_a=face_a, face_b=face_b, plane_is_of_a=plane_is_of_a, point=point,
            normal=normal, base=base, area=area, area_rate=area_rate, closure_rate=closure_rate,
        )  # fmt: skip
        places = map(address, (pairs, max_gap, max_depth, tie, strip))
        count = surfaces.arrays.call("face_contacts", len(pairs), *places, address(out))
        if count < 0:
            raise ValueError(
                f"two faces in contact have more than {MAX_FACE_CORNERS} corners, or two blocks "
                f"more than {MAX_FACE_PAIRS} pairs of faces in contact"
            )
        if count <= room:
            break
        room = count
    face_a, face_b = face_a[:count], face_b[:count]
    contact = np.cumsum(number[:count] == 0) - 1
    return ContactPoints(
        surfaces.block_of_face[face_a], surfaces.block_of_face[face_b], face_a, face_b,
        plane_is_of_a[:count].copy(), point[:count].copy(), normal[:count].copy(),
        base[:count].copy(), area[:count].copy(), area_rate[:count].copy(),
        closure_rate[:count].copy(), contact,
    )  # fmt: skip


def dip_line(normal: np.ndarray) -> np.ndarray:
    """Unit vectors (k, 3) down the dip of planes with normals (k, 3); to the north (y) in a
    horizontal plane."""
    down = np.array([0.0, 0.0, -1.0]) + normal[:, 2:] * normal
    steepness = np.linalg.norm(down, axis=1)
    is_flat = steepness < np.sin(np.radians(1e-6))
    down[is_flat] = [0.0, 1.0, 0.0]
    down -= np.einsum("ki,ki->k", down, normal)[:, None] * normal
    return down / np.linalg.norm(down, axis=1)[:, None]


def turned_from_dip(normal: np.ndarray, degrees: np.ndarray) -> np.ndarray:
    """Unit vectors (k, 3) in planes with normals (k, 3) at angles (k,) from their dip lines.

    Angles (degrees) are counter-clockwise seen from above, of a vertical plane seen from the side
    to which x increases, or y if the plane is normal to y. Both sides of a plane have the same
    vector.
    """
    down = dip_line(normal)
    rounded = np.round(normal, 9)
    x, y, z = rounded.T
    is_up = (z > 0) | ((z == 0) & ((x > 0) | ((x == 0) & (y > 0))))
    upward = np.where(is_up[:, None], normal, -normal)
    angle = np.radians(degrees)[:, None]
    return np.cos(angle) * down + np.sin(angle) * np.cross(upward, down)


def contact_axes(surfaces: Surfaces, points: ContactPoints, axis_2: np.ndarray) -> np.ndarray:
    """Axes (k, 3, 3) of the law at contact points: normal from b to a, axis 2, axis 3.

    axis_2 (k, 3): directions that are projected on the planes of the contacts; the dip line where
    a direction is almost normal to its plane, as where a block stands on its edge.
    """
    normal = points.normal_to_a
    axis_2 = axis_2 - np.einsum("ki,ki->k", axis_2, normal)[:, None] * normal
    size = np.linalg.norm(axis_2, axis=1)
    is_across = size < MIN_AXIS_SINE
    axis_2[is_across] = dip_line(normal[is_across])
    size[is_across] = 1.0
    axis_2 /= size[:, None]
    return np.stack([normal, axis_2, np.cross(normal, axis_2)], axis=1)


def motion_gradients(surfaces: Surfaces, points: ContactPoints, rate: np.ndarray) -> np.ndarray:
    """Derivatives (k, 12) by the motions of block a, then of block b.

    rate (k, 6): derivatives by displacements of the block of the point against the block of the
    plane, and by rotations through `base`.
    """
    slope, moment = rate[:, :3], rate[:, 3:]
    parts = []
    for block, owns_plane in (
        (points.block_a, points.plane_is_of_a),
        (points.block_b, ~points.plane_is_of_a),
    ):
        arm = points.base - surfaces.position[block]
        turning = np.cross(arm, slope) + moment
        turning = np.einsum("ki,kij->kj", turning, surfaces.rotation[block])
        sign = np.where(owns_plane, -1.0, 1.0)[:, None]
        parts += [sign * slope, sign * turning]
    return np.concatenate(parts, axis=1)


def contact_rows(surfaces: Surfaces, points: ContactPoints, axes: np.ndarray) -> ContactRows:
    """Rows of contact points at the present places of the blocks.

    axes (k, 3, 3): of `contact_axes`. Keys are the two faces, and the number of the point in their
    contact.
    """
    k = len(points.area)
    rates = axes * np.array([-1.0, 1.0, 1.0])[:, None]  # of closure and shears by a
    parts = []
    for block, sign in ((points.block_a, 1.0), (points.block_b, -1.0)):
        arm = points.point - surfaces.position[block]
        turning = np.cross(arm[:, None], rates) @ surfaces.rotation[block]
        parts += [sign * rates, sign * turning]
    rows = ContactRows.zeros(k, dim=3, dof=6, n_keys=3)
    rows.block_a[:] = points.block_a
    rows.block_b[:] = points.block_b
    rows.closure[:] = points.closure
    rows.area[:] = points.area
    rows.kinematics[:] = np.concatenate(parts, axis=2)
    rows.kinematics[:, 0] += motion_gradients(surfaces, points, points.closure_rate)
    rows.area_gradient[:] = motion_gradients(surfaces, points, points.area_rate)
    first = np.searchsorted(points.contact, points.contact)
    rows.keys[:] = points.face_a, points.face_b, np.arange(k) - first
    return rows
