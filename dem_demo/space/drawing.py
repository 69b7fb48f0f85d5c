"""What a picture of blocks in space shows: their faces, edges, states, and the rough directions.

`pictures` draws it with pyvista, `view` as a page for the browser. Lengths are in m.

Fixed rock is cut to a box around the free blocks, so that these fill the picture. The rough
direction of a joint is shown by hatching on both faces of each contact; it moves with the faces.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .scene import is_anisotropic
from .solids import OUTLINE, Solid
from .statics import Statics

CROP_MARGIN = 0.25  # of the extent of the free blocks: fixed rock that is drawn around them
LINES_PER_WIDTH = 6  # lines of hatching over the median width of the free blocks
SIDEWAYS = np.radians(25.0)  # angle of the view from the direction in which the blocks are free
ELEVATION = np.radians(28.0)  # angle of the view above the horizontal
MIN_FREE_SHARE = 0.05  # of the area: smaller resultants of free faces have no direction


@dataclass(frozen=True)
class Motion:
    """Displacements (n, 3) of the centroids in m, and rotations (n, 3, 3), from the drawing.

    Displacements of removed blocks are NaN. shown (n,): lengths (m) that colours show, by default
    of the displacements.
    """

    displacement: np.ndarray
    rotation: np.ndarray
    shown: np.ndarray | None = None

    @property
    def is_present(self) -> np.ndarray:
        """Blocks (n,) that are not removed."""
        return np.isfinite(self.displacement[:, 0])

    @property
    def distances(self) -> np.ndarray:
        """Lengths (n,) in m that colours show."""
        return np.linalg.norm(self.displacement, axis=1) if self.shown is None else self.shown

    def place(self, block: np.ndarray, centroid: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Present places (m, 3) of points (m, 3) as drawn, each fixed to a block (m,).

        centroid (n, 3): of the blocks as drawn.
        """
        arms = points - centroid[block]
        turned = np.einsum("mij,mj->mi", self.rotation[block], arms)
        return centroid[block] + self.displacement[block] + turned


class Drawing:
    """The shapes of a scene as drawn, and the state of each block.

    Made of unstable (n,): blocks without static equilibrium; is_decided: False if the search for it
    did not decide about them.

    title: of the scene. solids: of the n blocks, None where a fixed block lies outside the picture.
    centroid (n, 3); state (n,): numbers in STATES. hatch_block (h,), hatch (h, 2, 3): lines along
    axis 2 of the law, each fixed to a block. size, free_extent: longest side of the box around all
    that is drawn, and around the free blocks. support (3,): resultant of the contact areas (m2) of
    free blocks with fixed ones, towards the free ones.
    """

    STATES = "fixed", "stable", "unstable", "not decided"

    def __init__(self, statics: Statics, unstable: np.ndarray, is_decided: bool = True) -> None:
        blocks = statics.scene.blocks
        self.title = statics.scene.title
        self.names = [block.name for block in blocks]
        self.is_free = statics.is_free
        self.unstable = unstable
        self.centroid = statics.surfaces.position.copy()
        self.state = np.where(unstable, 2 if is_decided else 3, self.is_free.astype(int))
        free = [block.solid for block in blocks if not block.fixed]
        corners = np.concatenate([solid.vertices for solid in free or [b.solid for b in blocks]])
        low, high = corners.min(axis=0), corners.max(axis=0)
        margin = CROP_MARGIN * (high - low).max()
        self.solids = [
            _cropped(block.solid, low - margin, high + margin) if block.fixed else block.solid
            for block in blocks
        ]
        self.free_extent = float((high - low).max())
        self.support = _support(statics)
        drawn = np.concatenate([solid.vertices for solid in self.solids if solid])
        self.size = float(np.ptp(drawn, axis=0).max())
        width = np.median([solid.width for solid in free]) if free else self.size
        self.hatch_block, self.hatch = _hatching(
            statics, width / LINES_PER_WIDTH, low - margin, high + margin
        )

    @cached_property
    def edges(self) -> tuple[np.ndarray, np.ndarray]:
        """Numbers (e,) of the blocks of all edges, and their ends (e, 2, 3) as drawn."""
        block, ends = [], []
        for i, solid in enumerate(self.solids):
            for start, end in sorted(_edges(solid)) if solid else ():
                block.append(i)
                ends.append(solid.vertices[[start, end]])
        return np.array(block), np.array(ends)

    @cached_property
    def pull(self) -> np.ndarray:
        """Displacements (n, 3) that pull the free blocks apart, and away from the fixed ones.

        The free blocks move from their common middle by their distance to it, so convex blocks
        separate, and all of them along the resultant of their contact areas with fixed blocks, by
        the extent of all free blocks; up if they rest on no fixed block.
        """
        free = self.centroid[self.is_free]
        if not len(free):
            return np.zeros_like(self.centroid)
        away = self.support / max(float(np.linalg.norm(self.support)), 1e-300)
        if not away.any():
            away = np.array([0.0, 0.0, 1.0])
        apart = self.centroid - free.mean(axis=0) + self.free_extent * away
        return self.is_free[:, None] * apart

    @cached_property
    def view_direction(self) -> np.ndarray:
        """Unit vector (3,) from the blocks to the eye.

        Seen from the side on which the free blocks have free faces, somewhat turned and from
        above; from the south if they are free on all sides.
        """
        free = np.zeros(3)
        total = 0.0
        for i in np.flatnonzero(self.is_free):
            solid = self.solids[i]
            is_outline = np.array(solid.face_sets) == OUTLINE
            free += solid.face_vectors[is_outline].sum(axis=0)
            total += solid.face_areas.sum()
        azimuth = np.arctan2(free[1], free[0])
        if np.hypot(free[0], free[1]) <= MIN_FREE_SHARE * total:
            azimuth = -0.5 * np.pi
        azimuth -= SIDEWAYS
        level = np.cos(ELEVATION)
        return np.array([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(ELEVATION)])

    @property
    def as_drawn(self) -> Motion:
        """No motion."""
        n = len(self.names)
        return Motion(np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3)))

    def pulled_apart(self, share: float) -> Motion:
        """The blocks moved by a share of `pull`."""
        motion = self.as_drawn
        return Motion(share * self.pull, motion.rotation)


def _cropped(solid: Solid, low: np.ndarray, high: np.ndarray) -> Solid | None:
    """The part of a solid in a box, None if there is none."""
    for axis in np.eye(3):
        for sign, limit in ((-1.0, low), (1.0, high)):
            tolerance = 1e-9 * solid.size
            below, _ = solid.split(sign * axis, sign * float(axis @ limit), OUTLINE, tolerance)
            if below is None:
                return None
            solid = below
    return solid


def _support(statics: Statics) -> np.ndarray:
    """Resultant (3,) of the contact areas (m2) of free blocks with fixed ones, towards the free
    ones."""
    points, normal = statics.points, statics.axes[:, 0]
    a, b = statics.is_free[points.block_a], statics.is_free[points.block_b]
    sign = a.astype(float) - b  # the normal points from block b to block a
    return (sign * points.area) @ normal


def _edges(solid: Solid) -> set[tuple[int, int]]:
    """Pairs of vertices that an edge joins, the lower number first."""
    return {
        (min(pair), max(pair))
        for face in solid.faces
        for pair in zip(face, [*face[1:], face[0]], strict=True)
    }


def _hatching(
    statics: Statics, distance: float, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Blocks (h,) and ends (h, 2, 3) of lines along axis 2 on the joints that have a rough
    direction.

    Lines of one plane are `distance` apart and continue over its contacts; what lies outside the
    box from `low` to `high` is left out.
    """
    points, axes = statics.points, statics.axes
    laws = list(statics.scene.laws.values())
    block, ends = [np.zeros(0, int)], [np.zeros((0, 2, 3))]
    first = np.flatnonzero(np.diff(points.contact, prepend=-1))
    for start, stop in zip(first, np.append(first[1:], len(points.contact)), strict=False):
        if not is_anisotropic(laws[statics.law[start]]):
            continue
        lines = hatched(points.point[start:stop], axes[start], distance)
        is_inside = ((lines >= low) & (lines <= high)).all(axis=(1, 2))
        for number in (points.block_a[start], points.block_b[start]):
            block.append(np.full(int(is_inside.sum()), number))
            ends.append(lines[is_inside])
    return np.concatenate(block), np.concatenate(ends)


def hatched(corners: np.ndarray, axes: np.ndarray, distance: float) -> np.ndarray:
    """Segments (m, 2, 3) along axis 2 in a convex polygon (p, 3).

    axes (3, 3): normal, axis 2, axis 3. The segments lie at whole multiples of `distance` (m) along
    axis 3, counted from the origin, so neighbouring polygons of a plane have common lines.
    """
    along, across = corners @ axes[1], corners @ axes[2]
    height = float(corners[0] @ axes[0])
    next_along, next_across = np.roll(along, -1), np.roll(across, -1)
    segments = []
    for at in distance * np.arange(np.ceil(across.min() / distance), across.max() / distance):
        crosses = (across > at) != (next_across > at)
        if not crosses.any():  # a line through a corner
            continue
        share = (at - across[crosses]) / (next_across - across)[crosses]
        places = along[crosses] + share * (next_along - along)[crosses]
        segments.append([height * axes[0] + x * axes[1] + at * axes[2] for x in places])
    return np.array(segments).reshape(-1, 2, 3)
