"""The initial equilibrium: displacements with which the joints carry gravity and loads."""

import numpy as np

from ..contact import Joints, Tracker
from ..scene import Scene
from .blocks import Blocks
from .edge_loads import press
from .equilibrium import Equilibrium
from .in_situ import begin

ROUNDS = 40  # most rounds of the initial equilibrium
SETTLED = 1e-10  # movement of a round, as a share of the first, that ends them


def seat(
    scene: Scene, blocks: Blocks, tracker: Tracker, joints: Joints, slid: np.ndarray
) -> np.ndarray:
    """Move the blocks to where their joints carry them; slid (k,) in m: sliding at first. Returns
    the sliding with which the joints start.

    Loose blocks, which cannot be held, stay almost where they are drawn; all others are in balance
    with what the loose ones do to them there.
    """
    loose, first, pairs = np.zeros(len(blocks.free), bool), 0.0, blocks.near()
    for again in range(ROUNDS):  # each at the places just found: joints turn with the blocks
        tracker.follow(blocks.motion)
        tracker.urgent[:] = True  # it is cheap here, and nothing is missed
        before = tracker.renew(blocks.motion, pairs)
        if before is not None:
            joints.rearrange(before, tracker.law, tracker.keys)
            slid = np.where(before >= 0, slid[before], 0.0)
        press(scene, blocks, tracker)
        force = blocks.gravity + blocks.loads
        if again:
            force = force + _length_forces(scene, blocks, tracker, joints, slid)
        search = Equilibrium(scene, blocks, tracker, joints, slid, force)
        start = search.none if again or scene.in_situ is not None else search.unslid()
        more, known = ~loose, loose
        while more.any():
            moved, more = search.attempt(start, loose, known)
            loose = loose | more
        slid = slid + (search.rows @ moved)[len(slid) :]
        blocks.motion[:3] += search.spread(moved * search.root).T
        most = np.abs(moved[~loose[search.block]]).max(initial=0.0)
        first = first or most
        if again and most <= SETTLED * first:
            break
    tracker.renewed_at[:] = blocks.motion[:3]
    return slid


def displacements(
    scene: Scene, guess: np.ndarray | None = None, loose: np.ndarray | None = None
) -> np.ndarray | None:
    """Displacements of the free motions at which virgin joints carry a scene as drawn.

    All loads act at once; in unit-mass motions, None where none are found. They are looked for from
    guess, those of a similar scene, and from those of joints that cannot slide: where bonds break
    and joints soften, one may find what the other misses. loose (n,): blocks that need not be
    carried.
    """
    blocks, joints = Blocks(scene), Joints(scene)
    tracker = Tracker(scene, blocks.motion)
    slid = begin(scene, blocks, tracker, joints)
    search = Equilibrium(scene, blocks, tracker, joints, slid, blocks.gravity + blocks.loads)
    known = np.zeros(len(blocks.free), bool) if loose is None else loose
    moved, more = search.attempt(search.unslid() if guess is None else guess, known)
    if more.any() and guess is not None:
        moved, more = search.attempt(search.unslid(), known)
    return None if more.any() else moved


def _length_forces(scene, blocks, tracker, joints, slid) -> np.ndarray:
    """Forces (n, 3) of joints whose length changes as the blocks move, after their first step."""
    closed = np.stack([tracker.closure, slid], axis=1) - joints.delta
    stored, none = joints.trial(closed)[2] * scene.thickness, np.zeros(joints.n)
    return tracker.contacts.assemble(blocks.motion, none, none, stored) * blocks.mobile
