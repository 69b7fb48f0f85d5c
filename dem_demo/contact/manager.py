"""The contact manager: which corners are on which edges, and the identity of contacts in time.

A joint remembers its history, so a contact must keep its joint for as long as two faces stay
together, and must never get the history of another one. Three ideas make this work.

Range. A corner may lie over the lines of several edges, and several corners of a block over the
same edge. A contact is kept only where its corner is within its range on the edge. The range ends
where the neighbour, the next corner or the next edge, is equally deep. So exactly one contact
remains at each place, and blocks that overlap have a contact at the shallowest corner.

Transfer. Contacts are not found anew in each step. When a corner leaves its range, the contact goes
on to the corner or edge that comes next, and takes its joint with it: while a corner slides over an
edge, while a block rolls from one side to the next, while two corners swap roles at the end of an
edge. The depth is continuous there, and so is the closure. The length may jump;
`Simulation._transfer_joints` keeps the energy balance then. Corners return to a range only beyond a
small tolerance, so that rounding does not make them chatter.

Rebuild. New contacts appear only between blocks that have moved. As in a Verlet neighbour list,
each block has a skin: pairs are candidates from a gap of one skin, and their contacts are searched
again only when a block has moved by a fraction of it (`MAX_SKIN_UNTIL_REBUILD`), or when a transfer
shows that another contact may begin beside it (`needs_rebuild`). Between two rebuilds the geometry
is plain arrays. A corner becomes a contact from a gap of a skin, and is dropped beyond 1.5 skins: a
contact that opens and closes keeps its joint.

A rebuild raises an error rather than to miss a contact: where two blocks overlap and no corner in
its range sees half of the overlap.

Seams. A block may slide from one block onto its coplanar neighbour, or from under one roof block to
the next. The contact that will bear on the neighbour is found between the two end faces, which face
each other across the seam, and its corner then goes on to the coplanar face. With a new joint rough
faces would drop there by their whole dilation, although the surface does not end at a seam. Such a
contact continues the joint of its neighbour instead (`find_neighbours`).
"""

import ctypes

import numpy as np

from ..compiled import EdgeLawArrays, SeamArrays, address
from ..native.layout import CONSTANTS
from ..scene import Scene, SceneError
from .geometry import Contacts, Outlines

RANGE_TOLERANCE = CONSTANTS["RANGE_TOLERANCE"].value
MAX_DIP_SINE = np.sin(np.radians(6.5))  # tilt by which a side of a corner may dip below the edge
MIN_SEEN_FRACTION = 0.5  # of an overlap of two blocks, that the deepest contact must see
MIN_CHECKED_OVERLAP = 0.25  # fraction of the skin: smaller overlaps are not checked
MAX_SKIN_UNTIL_REBUILD = 0.25  # fraction of its skin that a block may move until a rebuild
MOVED_FRACTION = 0.001  # of its skin: blocks that moved less are left out of a rebuild
DROP_GAP = 1.5  # skins: gap beyond which a contact is dropped
CAPACITY = 64  # candidates that there is room for at first
ANY = -1  # block in a table of laws
NO_ROWS = np.zeros(0, np.int64)


def _in_range(contacts: Contacts, is_known: np.ndarray) -> np.ndarray:
    """Whether each corner is in its range on its edge, (k,).

    is_known (k,): whether the contact exists already. Of two corners at the limit between them one
    is chosen, the known one.
    """
    is_raised = (contacts.tilt_sine > -MAX_DIP_SINE).all(axis=0)
    margin = contacts.range_margin.min(axis=0)
    in_range = is_raised & (margin >= -RANGE_TOLERANCE)
    at_limit = np.flatnonzero(in_range & (margin <= RANGE_TOLERANCE))
    row_of_code = dict(zip(contacts.codes[at_limit].tolist(), at_limit.tolist(), strict=True))
    known_first = at_limit[np.argsort(~is_known[at_limit], kind="stable")]
    next_codes = contacts.next_codes()[known_first]
    chosen = in_range.tolist()
    for row, next_code in zip(known_first.tolist(), next_codes.tolist(), strict=True):
        if next_code in row_of_code:
            chosen[row_of_code[next_code]] &= not chosen[row]
    return np.array(chosen, bool)


class ContactManager:
    """The contacts of a scene, k at present.

    contacts: at the motion of the last update, on corner and edge (k,). face_pairs (k, 2): edges
    whose faces met when the contact was found. law (k,): number of the law between these.
    closure_offset (k,): depth at zero closure (m). Above zero it is a depth that the contact had to
    give up (`Simulation._transfer_joints`), until it opens; below zero it is minus the closure
    under in-situ stress, for good. rebuilt_at (3, blocks): motion at which the contacts of each
    block were last searched. needs_rebuild (blocks,): contacts must be searched wherever the block
    is. max_skin_until_rebuild: fraction of its skin that a block may move until a rebuild. skins
    (blocks,) in m: pymunk reports pairs within the sum of their skins; a contact begins
    at a gap of their mean.
    """

    def __init__(self, scene: Scene, motion: np.ndarray) -> None:
        self.blocks = blocks = scene.blocks
        self.max_skin_until_rebuild = MAX_SKIN_UNTIL_REBUILD
        self.skins = scene.skins
        self.outlines = Outlines(blocks, scene.run.corner_length, scene.run.soft, scene.thickness)
        self.max_overlap = scene.run.max_overlap * np.array([block.width for block in blocks])
        self.radius = np.array([block.reach for block in blocks])
        self.is_fixed = np.array([block.fixed for block in blocks])
        self._read_laws(scene)
        self.law = np.zeros(0, int)
        self.face_pairs = np.zeros((0, 2), int)
        self.closure_offset = np.zeros(0)
        self.needs_rebuild = np.zeros(len(blocks), bool)
        self.rebuilt_at = np.full((3, len(blocks)), np.nan)  # never
        no_rows = np.zeros(0, int)
        self.contacts = Contacts(self.outlines, no_rows, no_rows, motion)

    def _read_laws(self, scene: Scene) -> None:
        """Numbers of the laws: default, of edges, and of [[joint]] tables in rising priority."""
        number = {name: i for i, name in enumerate(scene.laws)}
        law_of_edge = np.full(self.outlines.first_corner[-1], -1)
        for (block, edge), law in scene.edge_laws.items():
            law_of_edge[self.outlines.first_corner[block] + edge] = number[law]
        tables = []
        for named, law in scene.pairs.items():
            if len(named) == 1:
                (block,) = named
                tables += [(0, ANY, block, number[law]), (1, block, ANY, number[law])]
            else:
                tables.append((2, *sorted(named), number[law]))
        in_rising_priority = [table[1:] for table in sorted(tables, key=lambda table: table[0])]
        self._laws = EdgeLawArrays(default_law=number[scene.default_law], n_tables=len(tables))
        self._laws.bind(
            law_of_edge=law_of_edge,
            tables=np.array(in_rising_priority, np.int64).reshape(-1, 3),
        )

    @property
    def closure(self) -> np.ndarray:
        """Closure (k,) of the joints: depth less closure offset (m)."""
        has_offset = (self.contacts.closure > 0) | (self.closure_offset < 0)
        return self.contacts.closure - np.where(has_offset, self.closure_offset, 0.0)

    def update(self, motion: np.ndarray) -> None:
        """Update the contacts to a motion (6, blocks).

        Corners that have left the range of their edge go on to the next corner or edge.
        """
        arrays = self.contacts.corner_arrays
        arrays.bind(motion=motion, needs_rebuild=self.needs_rebuild)
        arrays.call("update_contacts", 0, arrays.n_contacts)

    def rebuild(
        self, motion: np.ndarray, candidates: np.ndarray, keep_closure: bool = True
    ) -> np.ndarray:
        """Rebuild the list of contacts, next to blocks that have moved.

        motion: (6, blocks); candidates (p, 2): pairs of neighbouring blocks; keep_closure: whether
        a new contact that overlaps already is closed by its depth, as at the start of a run.
        Otherwise the depth becomes its closure offset, so that it brings no energy.

        Returns the row (k,) of each contact in the list before, -1 for a new one.
        """
        has_moved = self._blocks_to_rebuild(motion)
        pairs = candidates[has_moved[candidates].any(axis=1)]
        pairs = pairs[~self.is_fixed[pairs].all(axis=1)]
        present = self.contacts
        searched = np.flatnonzero(has_moved[present.block_a] | has_moved[present.block_b])
        detected, edge_pairs = self._find(motion, pairs, present.codes[searched])
        old_row = _match(detected.codes, present.codes[searched], searched)
        law = self.laws_of(edge_pairs)
        same_law = np.append(self.law, -1)[old_row] == law
        stays = (old_row >= 0) & ((detected.closure > 0) | same_law)
        is_new = ~stays & (detected.closure > -self._skin(detected.block_a, detected.block_b))
        dropped = np.setdiff1d(searched, old_row[stays], assume_unique=True)
        rows = np.setdiff1d(np.arange(len(self.law)), dropped, assume_unique=True)
        if len(rows) == len(self.law) and not is_new.any():
            return rows
        depth = np.maximum(detected.closure[is_new], 0.0)
        offset = 0.0 * depth if keep_closure else depth
        self.face_pairs = np.concatenate([self.face_pairs[rows], edge_pairs[is_new]])
        self.law = np.concatenate([self.law[rows], law[is_new]])
        self.closure_offset = np.concatenate([self.closure_offset[rows], offset])
        corner = np.concatenate([present.corner[rows], detected.corner[is_new]])
        edge = np.concatenate([present.edge[rows], detected.edge[is_new]])
        self.contacts = Contacts(self.outlines, corner, edge, motion)
        return np.concatenate([rows, np.full(len(offset), -1)])

    def _blocks_to_rebuild(self, motion: np.ndarray) -> np.ndarray:
        """Mask (blocks,) of the blocks whose contacts must be found again.

        Blocks that have moved by more than a fraction of their skin since their last rebuild, and
        blocks in `needs_rebuild`. Their present positions are recorded as those of the rebuild, and
        `needs_rebuild` is cleared.
        """
        x, y, rotation = motion[:3] - self.rebuilt_at
        distance = np.hypot(x, y) + np.abs(rotation) * self.radius
        has_rested = distance <= MOVED_FRACTION * self.skins  # false before the first rebuild
        has_moved = self.needs_rebuild | ~has_rested
        self.rebuilt_at[:, has_moved] = motion[:3, has_moved]
        self.needs_rebuild[:] = False
        return has_moved

    def bind_joints(self, stored_energy: np.ndarray, traction: np.ndarray) -> None:
        """Bind stored energies (k,) in J/m2 and tractions (k, 2) in Pa of the joints to the search
        across seams, after each change of the list of contacts."""
        k = len(self.law)
        self._seams = SeamArrays()
        self._seams.bind(
            self, "skins", "law", "face_pairs", corners=self.contacts.corner_arrays,
            laws=self._laws, stored_energy=stored_energy, traction=traction,
            is_new=np.zeros(k, bool), rows=np.empty(k, np.int64), edges=np.empty((k, 2), np.int64),
            sources=np.empty(k, np.int64), first_side=np.full(len(self.outlines.block), -1),
            next_side=np.empty(2 * k, np.int64), distance=np.empty(k),
        )  # fmt: skip

    def find_neighbours(self, is_new: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Contacts (m,) whose joints continue the joints of neighbours across a seam, and these
        neighbours (m,).

        is_new (k,): mask of new contacts; none by default. Such a contact bears nothing, and is new
        or meets between other edges than `face_pairs`, which it then gets. It shares an edge with
        its neighbour. Their other edges belong to two blocks and are coplanar: parallel within 2
        degrees; at the seam they end within a skin of each other, and within `MAX_SEAM_STEP` of a
        skin across their direction. The neighbour stores energy, is as deep as the contact within
        `MAX_SEAM_STEP` of a skin, and has the law that the edges of the contact need. Of several
        neighbours the nearest one is taken.
        """
        arrays = self._seams.bound_arrays
        arrays["is_new"][:] = False if is_new is None else is_new
        n = self._seams.call("find_neighbours")
        if n == 0:
            return NO_ROWS, NO_ROWS
        rows = arrays["rows"][:n].copy()
        self.face_pairs[rows] = arrays["edges"][:n]
        return rows, arrays["sources"][:n].copy()

    def between(self, one: int, other: int) -> np.ndarray:
        """Mask (k,) of the contacts between two blocks."""
        contacts = self.contacts
        return (contacts.block_a == min(one, other)) & (contacts.block_b == max(one, other))

    def _skin(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """Mean skin (m) of two blocks."""
        return 0.5 * (self.skins[a] + self.skins[b])

    def laws_of(self, edge_pairs: np.ndarray) -> np.ndarray:
        """Number (k,) of the law between two edges (k, 2) that meet, in the order of their blocks.

        In this order: the law of a [[joint]] table that names both blocks; of one that names one of
        them, the block that comes first in the scene if both have one; the law of the joint set
        that cut both edges; the default of the scene.
        """
        pairs = np.ascontiguousarray(edge_pairs, np.int64)
        law = np.empty(len(pairs), np.int64)
        arrays = self.contacts.corner_arrays
        laws = ctypes.addressof(self._laws)
        arrays.call("laws_of", laws, len(pairs), address(pairs), address(law))
        return law

    def _find(
        self, motion: np.ndarray, pairs: np.ndarray, known_codes: np.ndarray
    ) -> tuple[Contacts, np.ndarray]:
        """Contacts between pairs (p, 2) of blocks, and the edges (k, 2) that meet there.

        known_codes: of existing contacts, which are preferred where two are equivalent. Raises
        SceneError for an overlap beyond its limit, or seen by no corner.
        """
        p = len(pairs)
        pairs = np.ascontiguousarray(pairs, np.int64)
        limit = self.max_overlap[pairs].min(axis=1)
        max_gap = DROP_GAP * self._skin(*pairs.T)
        max_depth = 1.5 * limit
        separation = np.empty((2, p))
        arrays = self.outlines.corner_arrays(motion)
        inputs = [address(a) for a in (pairs, self.outlines.first_corner, max_gap, max_depth)]
        capacity = 0
        n_candidates = CAPACITY
        while n_candidates > capacity:  # again where there was no room for all
            capacity = n_candidates
            out = np.empty((3, capacity), np.int64)
            outputs = [address(a) for a in (*out, separation)]
            n_candidates = arrays.call("find_candidates", p, *inputs, capacity, *outputs)
        corner, edge, pair = out[:, :n_candidates]
        candidates = Contacts(self.outlines, corner, edge, motion)
        in_range = _in_range(candidates, np.isin(candidates.codes, known_codes))
        deepest_seen = np.full(2 * p, -np.inf)
        np.maximum.at(deepest_seen, pair[in_range], candidates.closure[in_range])
        overlap = -separation.max(axis=0)
        self._require_seen(pairs, overlap, deepest_seen.reshape(2, p).max(axis=0), limit)
        detected = Contacts(self.outlines, corner[in_range], edge[in_range], motion)
        return detected, detected.edge_pairs

    def _require_seen(
        self, pairs: np.ndarray, overlap: np.ndarray, seen: np.ndarray, limit: np.ndarray
    ) -> None:
        """Refuse overlaps (p,) in m of pairs of blocks beyond a limit (p,), and overlaps of which
        the contacts see too little: `seen` (p,), the depth of the deepest one."""
        if (overlap > limit).any():
            i = int((overlap - limit).argmax())
            self.refuse_overlap(pairs[i], overlap[i])
        is_checked = overlap > MIN_CHECKED_OVERLAP * self._skin(*pairs.T)
        is_missed = is_checked & (seen < MIN_SEEN_FRACTION * overlap)
        if is_missed.any():
            p = int(is_missed.argmax())
            name_a, name_b = (self.blocks[n].name for n in pairs[p])
            raise SceneError(
                f"blocks {name_a!r} and {name_b!r} overlap by {overlap[p]:.3g} m where no corner "
                "is over an edge that faces it: start the blocks apart, or resume with a smaller "
                "step"
            )

    def refuse_overlap(self, pair, depth: float) -> None:
        """Raise SceneError for an overlap (m) of two blocks beyond run.max_overlap."""
        name_a, name_b = (self.blocks[n].name for n in pair)
        raise SceneError(
            f"blocks {name_a!r} and {name_b!r} overlap by {depth:.3g} m: must stay below "
            f"{self.max_overlap[list(pair)].min():.3g} m (a share of the smaller block's width); "
            "draw them apart, resume with a smaller step, or use stiffer joints, lower loads or "
            "speeds, a larger run.corner_length or run.max_overlap"
        )


def _match(codes: np.ndarray, known_codes: np.ndarray, known_rows: np.ndarray) -> np.ndarray:
    """Row (k,) of the known contact with the same code, -1 where there is none."""
    rows = np.full(len(codes), -1)
    _, here, there = np.intersect1d(codes, known_codes, return_indices=True)
    rows[here] = known_rows[there]
    return rows
