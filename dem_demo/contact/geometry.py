"""Geometry of contacts in the plane: the rows of corners on edges.

A contact is one corner over the line of one edge of another block. It is the simplest element that
keeps work and force consistent: its closure is the depth of the corner below the line, and closure,
shear and force share one normal, so the work of the force on the blocks is the work that the joint
takes up. An edge-to-edge contact needs no element of its own. Where two edges lie on each other,
the two ends of their overlap are corners on edges, and each carries half of the overlap, so the
pair bears force and moment.

The length of joint that a contact stands for therefore depends on how the corner meets the edge:

- a side of the corner that lies on the edge, tilted by less than 2 degrees: half of its overlap;
- a corner that stands on the edge, its sides tilted by more than 5 degrees: a fixed length;
- in between, a smooth interpolation;
- within `transition_length` of the end of an edge, where the side over the edge is raised by more
  than 30 degrees: less, none at the end, where blocks meet in a point. Up to 20 degrees the length
  is kept, so that a block rocks on the end of another one, unless three blocks are drawn with
  corners in this point: one of them may fill the opening between both sides, as a wedge in a roof.

Any change of this length changes the stored energy of the contact. Minus the stored energy per
length times the derivative of the length is hence a force, which acts on the two blocks
(`area_gradient`). Without it, rocking blocks would gain or lose energy.

A corner belongs to an edge only within a range, outside of which a neighbouring corner or edge is
in the same place (see `manager.py`). The margin to either end of the range is computed here with
the rest, in one pass.

The geometry is computed by `native/corners.c`. Vectors are complex numbers x + iy here: conj(p) q
holds their dot product (real part) and cross product (imaginary part).
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from ..compiled import CornerArrays, address
from ..scene import Block
from .rows import ContactRows


class Outlines:
    """Corners and edges of all blocks, c in all; edge i starts at corner i and ends at next[i].

    local_corner (c,): corners relative to the centroids (m), complex; local_direction (c,): unit
    vectors of the edges, complex; both before any rotation. neighbour_direction (c, 2): unit
    vectors of the edges before and after each edge, relative to it. edge_length (c,) in m. block,
    previous, next (c,): block of each corner, and the corners before and after it. first_corner
    (blocks + 1,): number of the first corner of each block, and c. corner_position, edge_direction
    (c,): at the present motion, written by the compiled step. corner_length (m): length of joint at
    a corner that stands on an edge; is_junction (c,): corners in whose place two or more other
    blocks have one, as drawn; transition_length (m): distance over which one corner gives way
    to another. thickness (m): of the blocks.
    """

    def __init__(
        self,
        blocks: Sequence[Block],
        corner_length: float,
        transition_length: float,
        thickness: float,
    ) -> None:
        self.corner_length = corner_length
        self.transition_length = transition_length
        self.thickness = thickness
        sizes = np.array([len(block.corners) for block in blocks])
        self.first_corner = np.concatenate([[0], np.cumsum(sizes)])
        self.block = np.repeat(np.arange(len(blocks)), sizes)
        corners_of_blocks = np.split(np.arange(self.first_corner[-1]), self.first_corner[1:-1])
        self.next = np.concatenate([np.roll(corners, -1) for corners in corners_of_blocks])
        self.previous = np.concatenate([np.roll(corners, 1) for corners in corners_of_blocks])
        self.local_corner = np.concatenate([block.local for block in blocks]) @ [1, 1j]
        edge = self.local_corner[self.next] - self.local_corner
        self.edge_length = np.abs(edge)
        self.local_direction = edge / self.edge_length
        drawn = np.concatenate([block.corners for block in blocks])
        self.is_junction = find_junctions(drawn, self.block, transition_length)
        neighbours = np.stack([self.previous, self.next], axis=1)
        reverse = self.local_direction.conj()[:, None]
        self.neighbour_direction = self.local_direction[neighbours] * reverse
        self.corner_position = np.empty(len(edge), complex)
        self.edge_direction = np.empty(len(edge), complex)

    def corner_arrays(self, motion: np.ndarray, contacts: int = 0) -> CornerArrays:
        """Arguments of the compiled step with the geometry of these outlines bound to them.

        motion: (6, blocks), position, rotation and velocities of each block; contacts: how many
        contacts there are.
        """
        arrays = CornerArrays(
            n_blocks=len(self.first_corner) - 1,
            n_corners=len(self.block),
            n_contacts=contacts,
            thickness=self.thickness,
            corner_length=self.corner_length,
            transition_length=self.transition_length,
        )
        arrays.bind(
            self, "local_corner", "local_direction", "neighbour_direction", "edge_length", "block",
            "previous", "next", "is_junction", "corner_position", "edge_direction",
            motion=np.ascontiguousarray(motion, float),
        )  # fmt: skip
        return arrays


def find_junctions(corners: np.ndarray, block: np.ndarray, distance: float) -> np.ndarray:
    """Mask (c,) of the corners (c, 2) that lie within a distance (m) of corners of two or more
    other blocks; block (c,): block of each corner."""
    pairs = cKDTree(corners).query_pairs(distance, output_type="ndarray")
    pairs = np.concatenate([pairs, pairs[:, ::-1]])
    others = np.unique(np.stack([pairs[:, 0], block[pairs[:, 1]]], axis=1), axis=0)
    is_other = block[others[:, 0]] != others[:, 1]
    return np.bincount(others[is_other, 0], minlength=len(corners)) >= 2


class Contacts(ContactRows):
    """k contacts of corners with edges, at a motion of the blocks; SI units, vectors complex.

    The rows: closure is the depth of the corner below the line of the edge; the shear is the
    displacement of block b relative to block a along the direction a quarter turn clockwise from
    the normal.

    corner, edge (k,): numbers in the outlines, the keys of a contact.
    position (k,): of the corner; normal (k,): unit vector from block a to block b.
    length (k,): of the joint that the contact stands for, its area over the thickness;
    previous_length (k,): the same before corners went on to other edges in the last update.

    Arrays (2, k) run over the two sides, the edges that meet at the corner. tilt_sine: sine of the
    angle between side and edge; overlap_length: length of joint where that side lies on the edge;
    range_margin (m): depth by which the corner is the deeper one within its range; beyond the range
    another corner takes over if `corner_takes_over`, else another edge.
    """

    def __init__(
        self, outlines: Outlines, corner: np.ndarray, edge: np.ndarray, motion: np.ndarray
    ) -> None:
        """Contacts of corners (k,) with edges (k,) at a motion (6, blocks)."""
        k = len(corner)
        super().__init__(**vars(ContactRows.zeros(k, dim=2, dof=3, n_keys=2)))
        self.outlines = outlines
        self.corner, self.edge = self.keys
        self.corner[:] = corner
        self.edge[:] = edge
        self.position = np.empty(k, complex)
        self.normal = np.empty(k, complex)
        self.length = np.empty(k)
        self.previous_length = np.empty(k)
        self.tilt_sine = np.empty((2, k))
        self.overlap_length = np.empty((2, k))
        self.range_margin = np.empty((2, k))
        self.corner_takes_over = np.empty((2, k), bool)
        self.corner_arrays = outlines.corner_arrays(motion, k)
        self.corner_arrays.bind(
            self, "corner", "edge", "block_a", "block_b", "closure", "area", "kinematics",
            "area_gradient", "position", "normal", "length", "previous_length", "tilt_sine",
            "overlap_length", "range_margin", "corner_takes_over",
            work_rows=np.empty(k, np.int64),
        )  # fmt: skip
        self.corner_arrays.call("locate_contacts")

    @property
    def codes(self) -> np.ndarray:
        """One number (k,) for the pair of corner and edge of each contact."""
        return self.corner * len(self.outlines.block) + self.edge

    @property
    def edge_direction(self) -> np.ndarray:
        """Directions (k,) of the edges, complex unit vectors."""
        return self.outlines.edge_direction[self.edge]

    @property
    def edge_pairs(self) -> np.ndarray:
        """The two edges (k, 2) whose faces meet, in the order of their blocks.

        Of the two sides of the corner, the one with the smaller tilt.
        """
        pairs = np.empty((len(self.corner), 2), np.int64)
        self.corner_arrays.call("edge_pairs", address(pairs))
        return pairs

    def changed_lengths(self, stored_energy: np.ndarray) -> np.ndarray:
        """Contacts (m,) that store energy and whose length changed as they went on to other edges.

        stored_energy (k,) in J/m2: of their joints. Of the last update.
        """
        arrays = self.corner_arrays
        n = arrays.call("changed_lengths", address(stored_energy))
        return arrays.bound_arrays["work_rows"][:n].copy()

    def next_codes(self) -> np.ndarray:
        """Codes (k,) of the contacts that come next at the nearer limits of the ranges."""
        corner = np.empty(len(self.corner), np.int64)
        edge = np.empty(len(self.corner), np.int64)
        self.corner_arrays.call("next_contacts", address(corner), address(edge))
        return corner * len(self.outlines.block) + edge
