"""The contact manager in space: contact points while blocks move, and their identity in time.

Between two rebuilds of the list of contacts a point is fixed to its block, and the compiled step
follows its closure (`native/face_points.c`). A rebuild clips the faces of blocks that have moved by
a twentieth of their skin anew, so polygons, points and areas follow.

Identity. A joint remembers its history. A point of a rebuilt list continues the joint of the
nearest point that the same two faces had before, in the frame of block a. Two new points may
continue one old joint where a polygon gains a corner; the second gets a copy. Points lie on the
face of their block, and corners stay with the block whose corner they are, so closures do not jump.
The roles of the blocks never change.

Seams. A block may slide from one block onto its coplanar neighbour. With new joints rough faces
would drop there by their whole dilation, although the surface does not end at a seam. The points of
a new contact continue the joints of the nearest points across the seam instead, if both contacts
have the face of a or the face of b in common, their other faces are coplanar, and axis 2 points the
same way (`find_neighbours`). All other faces that meet in a run meet anew: their joints are unmated
if their law has a mating length.

Edges and corners. A block that stands on an edge or a corner has its points over the face of the
other block, whichever of them is a (`native/face_contacts.c`). Where it rolls on, its points
continue their joints. Next to the border of a face contacts change fast: a point that has lost or
gained 0.5 % of its area, or slid by 0.5 % of its closure, has the contacts searched in the next
step. An overlap that no contact sees raises an error in a rebuild.
"""

import numpy as np

from ..compiled import FacePointArrays
from ..contact import ContactRows
from ..contact.candidates import find_equal, find_nearest
from ..scene import SceneError
from .blocks import SpaceBlocks
from .contacts import (
    MAX_TILT,
    ContactPoints,
    contact_axes,
    find_contacts,
    motion_gradients,
    require_apart,
)
from .face_laws import FaceLaws
from .scene import SpaceScene

MAX_SKIN_UNTIL_REBUILD = 0.05  # fraction of its skin that a block may move until a rebuild
MOVED_FRACTION = 0.001  # of its skin: blocks that moved less are left out of a rebuild
MIN_SEAM_COSINE = np.cos(MAX_TILT)  # of the angle between coplanar faces, and between their axes 2
MAX_SEAM_STEP = 0.05  # of the skin: step between coplanar faces at a seam
CHECKED_OVERLAP = 0.02  # of the smallest skin: smaller overlaps are not checked
MAX_SHIFT_PER_SKIN = 0.25  # sum of two skins: shift of a point that keeps its joint on other faces
MIN_SEEN_FRACTION = 0.5  # of an overlap of two blocks, that the deepest contact must see
POINT_ARRAYS = {  # with the keys, these are a point
    "plane_is_of_a": bool, "local_point": float, "local_frame": float, "plane_offset": float,
    "found_area": float, "found_at": float, "area_gradient": float, "sliding_gradient": float,
}  # fmt: skip


class FacePoints(ContactRows):
    """k contact points of faces on faces as rows, at the present places of the blocks.

    keys (3, k): the two faces, and the number of the point among the points of these faces.
    plane_is_of_a (k,): whether the plane of the contact is fixed to a, and the point to b; else the
    other way round. local_point (k, 3) in m: from the centroid of its block, along its axes.
    local_frame (k, 3, 3), along the axes of the block of the plane: the normal out of this block,
    and the axes along which the block of the point moves where shears grow: axes 2 and 3 of the
    law, or their opposites if the plane is of a, so that shears are of a against b. plane_offset
    (k,) in m: of the plane from the centroid of its block. found_area (k,) in m2, found_at
    (k, 12): area, and motions of a and b, when the point was found; since then the area has
    followed its derivatives `area_gradient` (k, 12), and the closure of a point that slides along
    the border of a face `sliding_gradient` (k, 12).
    """

    def __init__(self, blocks: SpaceBlocks, keys: np.ndarray, **arrays: np.ndarray) -> None:
        """Points with these keys and `POINT_ARRAYS`."""
        k = keys.shape[1]
        super().__init__(**vars(ContactRows.zeros(k, dim=3, dof=6, n_keys=3)))
        self.blocks = blocks
        self.keys[:] = keys
        for name, kind in POINT_ARRAYS.items():
            setattr(self, name, np.ascontiguousarray(arrays[name], kind))
        gradients = np.concatenate([self.area_gradient, self.sliding_gradient], axis=1)
        self.has_gradients = gradients.any(axis=1)  # false for faces that lie on each other
        self.block_a[:] = blocks.surfaces.block_of_face[self.face_a]
        self.block_b[:] = blocks.surfaces.block_of_face[self.face_b]
        self.arrays = FacePointArrays(n_blocks=len(blocks.names), n_points=k)
        self.arrays.bind(blocks, "motion", "axes")
        self.arrays.bind(
            self, "block_a", "block_b", "plane_is_of_a", "local_point", "local_frame",
            "plane_offset", "closure", "kinematics", "found_area", "found_at", "area_gradient",
            "sliding_gradient", "has_gradients", "area",
        )  # fmt: skip
        self.update()

    @classmethod
    def none(cls, blocks: SpaceBlocks) -> "FacePoints":
        """No points."""
        shapes = {"local_point": (3,), "local_frame": (3, 3)}
        shapes |= dict.fromkeys(("found_at", "area_gradient", "sliding_gradient"), (12,))
        arrays = {name: np.zeros((0, *shapes.get(name, ()))) for name in POINT_ARRAYS}
        return cls(blocks, np.zeros((3, 0), np.int64), **arrays)

    @classmethod
    def found(cls, blocks: SpaceBlocks, points: ContactPoints, axis_2: np.ndarray) -> "FacePoints":
        """Points that a search has found, with directions of axis 2 (k, 3)."""
        surfaces = blocks.surfaces
        first = np.searchsorted(points.contact, points.contact)
        keys = np.array([points.face_a, points.face_b, np.arange(len(first)) - first])
        of_a = points.plane_is_of_a
        point_block = np.where(of_a, points.block_b, points.block_a)
        plane_block = np.where(of_a, points.block_a, points.block_b)
        arm = points.point - surfaces.position[point_block]
        frame = contact_axes(surfaces, points, axis_2)
        frame[of_a] *= -1.0
        base = points.base - surfaces.position[plane_block]
        return cls(
            blocks,
            keys,
            plane_is_of_a=of_a,
            local_point=np.einsum("kji,kj->ki", surfaces.rotation[point_block], arm),
            local_frame=frame @ surfaces.rotation[plane_block],
            plane_offset=np.einsum("ki,ki->k", points.normal, base),
            found_area=points.area,
            found_at=blocks.motion[:6]
            .T[np.stack([points.block_a, points.block_b], 1)]
            .reshape(-1, 12),
            area_gradient=motion_gradients(surfaces, points, points.area_rate),
            sliding_gradient=motion_gradients(surfaces, points, points.closure_rate),
        )

    def joined(self, rows: np.ndarray, others: "FacePoints") -> "FacePoints":
        """The points `rows` of these and all points of others."""
        arrays = {
            name: np.concatenate([getattr(self, name)[rows], getattr(others, name)])
            for name in POINT_ARRAYS
        }
        keys = np.concatenate([self.keys[:, rows], others.keys], axis=1)
        return FacePoints(self.blocks, keys, **arrays)

    @property
    def face_a(self) -> np.ndarray:
        """Face (k,) of block a."""
        return self.keys[0]

    @property
    def face_b(self) -> np.ndarray:
        """Face (k,) of block b."""
        return self.keys[1]

    @property
    def face_pairs(self) -> np.ndarray:
        """The two faces (k, 2) that meet."""
        return np.ascontiguousarray(self.keys[:2].T)

    @property
    def codes(self) -> np.ndarray:
        """One number (k,) for the two faces."""
        return self.face_a * len(self.blocks.surfaces.local_normal) + self.face_b

    @property
    def contact(self) -> np.ndarray:
        """Number (k,) of the contact of two faces, whose points follow each other."""
        return np.cumsum(self.keys[2] == 0) - 1

    @property
    def point(self) -> np.ndarray:
        """Places (k, 3) of the points in m."""
        blocks = self.blocks
        point_block = np.where(self.plane_is_of_a, self.block_b, self.block_a)
        arm = np.einsum("kij,kj->ki", blocks.axes[point_block], self.local_point)
        return blocks.motion[:3].T[point_block] + arm

    @property
    def point_in_a(self) -> np.ndarray:
        """Places (k, 3) in m from the centroid of block a, along its axes."""
        arm = self.point - self.blocks.motion[:3].T[self.block_a]
        return np.einsum("kji,kj->ki", self.blocks.axes[self.block_a], arm)

    @property
    def directions(self) -> np.ndarray:
        """Normal from b to a, axis 2 and axis 3 (k, 3, 3) of the points."""
        plane_block = np.where(self.plane_is_of_a, self.block_a, self.block_b)
        frame = np.einsum("kij,kcj->kci", self.blocks.axes[plane_block], self.local_frame)
        return np.where(self.plane_is_of_a[:, None, None], -frame, frame)

    def update(self) -> None:
        """Compute closures and kinematics at the present places of the blocks."""
        self.arrays.call("update_face_points", 0, self.arrays.n_points)


class FaceContactManager:
    """The contacts of a scene in space, k points at present.

    contacts: the points; law (k,): number of the law; face_pairs (k, 2): the faces that meet.
    closure_offset (k,) in m: depth at zero closure, of points that were found when they overlapped
    already, until they open. rebuilt_at (6, n): motion at which the contacts of each block were
    last searched; needs_rebuild (n,): blocks whose contacts must be searched wherever they are.
    skins (n,) in m: a contact is found at a gap of the sum of two skins.
    """

    def __init__(self, scene: SpaceScene, blocks: SpaceBlocks) -> None:
        self.blocks = blocks
        self.max_skin_until_rebuild = MAX_SKIN_UNTIL_REBUILD
        self.skins = scene.skins
        self.max_overlap_fraction = scene.max_overlap
        self.strip_width = scene.strip_width
        self.max_overlap = scene.max_overlap * blocks.surfaces.width
        self.is_fixed = np.array([block.fixed for block in scene.blocks])
        self.face_laws = FaceLaws(scene, blocks.surfaces)
        require_apart(blocks.surfaces, blocks.names, scene.skins, blocks.is_removed)
        self.law = np.zeros(0, int)
        self.face_pairs = np.zeros((0, 2), int)
        self.closure_offset = np.zeros(0)
        self.needs_rebuild = np.zeros(len(blocks.names), bool)
        self.rebuilt_at = np.full((6, len(blocks.names)), np.nan)  # never
        self.contacts = FacePoints.none(blocks)

    @property
    def closure(self) -> np.ndarray:
        """Closure (k,) of the joints: depth less closure offset (m)."""
        has_offset = (self.contacts.closure > 0) | (self.closure_offset < 0)
        return self.contacts.closure - np.where(has_offset, self.closure_offset, 0.0)

    def update(self, motion: np.ndarray) -> None:
        """Update the points to the present places of the blocks, whose motion is (12, n)."""
        self.contacts.update()

    def rebuild(
        self, motion: np.ndarray, candidates: np.ndarray, keep_closure: bool = True
    ) -> np.ndarray:
        """Rebuild the list of points, next to blocks that have moved.

        motion: (12, n), of the blocks; candidates (p, 2): pairs of neighbouring blocks;
        keep_closure: whether a new point that overlaps already is closed by its depth, as at the
        start of a run. Otherwise the depth becomes its closure offset, so that it brings no energy.

        Returns the row (k,) in the list before of the point whose joint each point continues, -1
        for a new one. Raises SceneError for overlaps that are too deep, or that no contact sees.
        """
        has_moved = self._blocks_to_rebuild(motion)
        self.blocks.place()
        pairs = candidates[has_moved[candidates].any(axis=1)]
        pairs = np.ascontiguousarray(pairs[~self.is_fixed[pairs].all(axis=1)])
        present = self.contacts
        is_searched = has_moved[present.block_a] | has_moved[present.block_b]
        unsearched = np.flatnonzero(~is_searched)
        searched = np.flatnonzero(is_searched)
        surfaces = self.blocks.surfaces
        points = find_contacts(
            surfaces, self.skins, self.max_overlap_fraction, pairs, self.strip_width
        )
        law, axis_2 = self.face_laws.law_and_axis(points)
        detected = FacePoints.found(self.blocks, points, axis_2)
        old_row = self._continued(detected, law, searched)
        self._require_seen(pairs, detected)
        new_offset = np.maximum(detected.closure, 0.0) * (not keep_closure)
        old_offset = np.append(self.closure_offset, 0.0)[old_row]
        offset = np.where(old_row < 0, new_offset, old_offset)
        self.law = np.concatenate([self.law[unsearched], law])
        self.closure_offset = np.concatenate([self.closure_offset[unsearched], offset])
        self.contacts = present.joined(unsearched, detected)
        self.face_pairs = self.contacts.face_pairs
        return np.concatenate([unsearched, old_row])

    def _blocks_to_rebuild(self, motion: np.ndarray) -> np.ndarray:
        """Mask (n,) of the blocks whose contacts must be found again, as in the plane.

        Their present positions are recorded as the positions of the rebuild.
        """
        displacement = motion[:6] - self.rebuilt_at
        rotation = np.abs(displacement[3:]).sum(axis=0)
        distance = np.linalg.norm(displacement[:3], axis=0) + rotation * self.blocks.radius
        has_rested = distance <= MOVED_FRACTION * self.skins  # false before the first rebuild
        has_moved = self.needs_rebuild | ~has_rested
        self.rebuilt_at[:, has_moved] = motion[:6, has_moved]
        self.needs_rebuild[:] = False
        return has_moved

    def _continued(self, found: FacePoints, law: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Row (k,) of the present point whose joint each point continues, -1 for a new joint.

        The nearest one of the same two faces and of the same plane within a part of the skins, as
        an edge on an edge has points over the planes of both; else the nearest one of the same two
        faces. Where a block that stands on an edge rolls on, the edge comes to belong to other
        faces: the nearest one of the same two blocks, within a part of their skins. law (k,): of
        the points found; rows (m,): present points to be compared.
        """
        present = self.contacts
        max_shift = MAX_SHIFT_PER_SKIN * (self.skins[found.block_a] + self.skins[found.block_b])
        plane_code = 2 * found.codes + found.plane_is_of_a
        present_plane_code = 2 * present.codes + present.plane_is_of_a
        same_row, distance = _nearest(found, present, rows, plane_code, present_plane_code)
        old_row, _ = _nearest(found, present, rows, found.codes, present.codes)
        old_row = np.where((same_row >= 0) & (distance <= max_shift), same_row, old_row)
        n = len(self.blocks.names)
        block_pair = found.block_a * n + found.block_b
        present_pair = present.block_a * n + present.block_b
        other_row, distance = _nearest(found, present, rows, block_pair, present_pair)
        is_same_joint = (other_row >= 0) & (distance <= max_shift)
        is_same_joint[is_same_joint] &= self.law[other_row[is_same_joint]] == law[is_same_joint]
        return np.where((old_row < 0) & is_same_joint, other_row, old_row)

    def _require_seen(self, pairs: np.ndarray, found: FacePoints) -> None:
        """Require that the deepest contact of blocks sees their overlap, and that it is not too
        deep.

        pairs (p, 2): searched pairs of blocks; found: their points. Raises SceneError.
        """
        tolerance = CHECKED_OVERLAP * float(self.skins.min())
        overlap = -self.blocks.surfaces.separations(pairs, tolerance)
        for i in np.flatnonzero(overlap > tolerance):
            a, b = pairs[i]
            is_pair = (found.block_a == a) & (found.block_b == b)
            seen = found.closure[is_pair].max(initial=0.0)
            if overlap[i] > min(self.max_overlap[a], self.max_overlap[b]):
                self.refuse_overlap((a, b), overlap[i])
            if seen < MIN_SEEN_FRACTION * overlap[i]:
                names = self.blocks.names
                raise SceneError(
                    f"blocks {names[a]!r} and {names[b]!r} overlap by {overlap[i]:.3g} m, of which "
                    f"their contacts see {seen:.3g} m: resume with a smaller step"
                )

    def refuse_overlap(self, pair, depth: float) -> None:
        """Raise SceneError for an overlap (m) of two blocks beyond run.max_overlap."""
        first, second = (self.blocks.names[n] for n in pair)
        raise SceneError(
            f"blocks {first!r} and {second!r} overlap by {depth:.3g} m: must stay below "
            f"{self.max_overlap[list(pair)].min():.3g} m (a share of the narrower block's width); "
            "draw them apart, resume with a smaller step, or use stiffer joints, lower loads or "
            "speeds, or a larger run.max_overlap"
        )

    def find_neighbours(self, rows: np.ndarray, bears_load: np.ndarray) -> np.ndarray:
        """Points (m,) whose joints the points `rows` (m,) continue across a seam; -1 for none.

        bears_load (k,): points that bear a load.
        """
        contacts = self.contacts
        loaded = np.flatnonzero(bears_load)
        position = contacts.point
        axis_2 = contacts.directions[:, 1]
        pairs = [find_equal(keys[rows], keys[loaded]) for keys in contacts.keys[:2]]
        number, candidate = np.concatenate(pairs, axis=1)
        row = rows[number]
        candidate = loaded[candidate]
        side = np.repeat([1, 0], [len(one) for one, _ in pairs])  # of the faces across the seam
        skin = 0.5 * (self.skins[contacts.block_a[row]] + self.skins[contacts.block_b[row]])
        distance = np.linalg.norm(position[candidate] - position[row], axis=1)
        step = np.abs(contacts.closure[candidate] - contacts.closure[row])
        cosine = np.einsum("pj,pj->p", axis_2[candidate], axis_2[row])
        is_neighbour = (distance <= skin) & (step <= MAX_SEAM_STEP * skin)
        is_neighbour &= (self.law[candidate] == self.law[row]) & (cosine >= MIN_SEAM_COSINE)
        plausible = np.flatnonzero(is_neighbour)
        across_seam = contacts.keys[side[plausible], candidate[plausible]]
        face_of_row = contacts.keys[side[plausible], row[plausible]]
        is_neighbour[plausible] = self._are_coplanar(across_seam, face_of_row, skin[plausible])
        distance[~is_neighbour] = np.inf
        return find_nearest(len(rows), number, candidate, distance)

    def _are_coplanar(self, faces: np.ndarray, others: np.ndarray, skin: np.ndarray) -> np.ndarray:
        """Whether faces (m,) of other blocks continue the faces `others` (m,) across a seam.

        They are parallel within 2 degrees, and their planes differ by less than `MAX_SEAM_STEP` of
        a skin (m,) in m.
        """
        surfaces = self.blocks.surfaces
        normal = surfaces.normal[others]
        first_corner = surfaces.vertex[surfaces.corner[surfaces.first_corner[:-1]]]
        step = np.einsum("mj,mj->m", first_corner[faces] - first_corner[others], normal)
        is_parallel = np.einsum("mj,mj->m", surfaces.normal[faces], normal) >= MIN_SEAM_COSINE
        is_level = np.abs(step) <= MAX_SEAM_STEP * skin
        is_of_other_block = surfaces.block_of_face[faces] != surfaces.block_of_face[others]
        return is_parallel & is_level & is_of_other_block

    def between(self, one: int, other: int) -> np.ndarray:
        """Mask (k,) of the points between two blocks."""
        contacts = self.contacts
        return (contacts.block_a == min(one, other)) & (contacts.block_b == max(one, other))


def _nearest(
    found: FacePoints,
    present: FacePoints,
    rows: np.ndarray,
    code: np.ndarray,
    present_code: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Row (k,) of the nearest present point with the same code, -1 where there is none, and its
    distance (k,) in m.

    rows (m,): present points to be compared; code (k,), present_code: of points found and present.
    Distances are in the frame of block a.
    """
    order = rows[np.argsort(present_code[rows], kind="stable")]
    sorted_codes = present_code[order]
    first = np.searchsorted(sorted_codes, code)
    last = np.searchsorted(sorted_codes, code, side="right")
    place_before = present.point_in_a
    place_now = found.point_in_a
    nearest = np.full(len(first), -1)
    smallest = np.full(len(first), np.inf)
    for number in range(int((last - first).max(initial=0))):
        has_one = first + number < last
        row = order[first[has_one] + number]
        distance = np.linalg.norm(place_before[row] - place_now[has_one], axis=1)
        is_nearer = distance < smallest[has_one]
        place = np.flatnonzero(has_one)[is_nearer]
        nearest[place] = row[is_nearer]
        smallest[place] = distance[is_nearer]
    return nearest, smallest
