"""The start of a scene: contacts and loads as drawn, joints that bear the stress of before, and
displacements with which the joints carry gravity and loads."""

import numpy as np

from ..contact import Joints, Tracker
from ..scene import Scene
from .blocks import Blocks, press
from .equilibrium import Equilibrium

ROUNDS = 40  # most rounds of the initial equilibrium
SETTLED = 1e-10  # movement of a round, as a share of the first, that ends them
TOUCHES = 0.01  # of the least skin: joints drawn farther open bear nothing
SHORT = 1e-6  # m: joints that are drawn shorter bear nothing either
TRIALS = 50  # most steps to closure and sliding for a stress
BALANCED = 1e-12  # what a joint may lack, as a share of its normal stress
FLAT = 0.05  # least slope of the shear stress, as a share of that of the unsheared joint


def begin(scene: Scene, blocks: Blocks, tracker: Tracker, joints: Joints) -> np.ndarray:
    """Find the contacts of blocks as drawn; their joints are virgin. Returns the sliding (k,) in m
    with which they start, and keeps as the tracker's offset the closure: both are those of the
    in-situ stress, zero without one."""
    joints.rearrange(tracker.renew(blocks.motion, blocks.near()), tracker.law, tracker.keys)
    press(scene, blocks, tracker)
    stress, c, skin = scene.in_situ, tracker.contacts, scene.skins.min()
    if stress is None or not joints.n:
        return np.zeros(joints.n)
    # The end p of an overlap bears (2 S(p) + S(q))/3, q the other end: together they have force and
    # moment of a stress that goes straight from p to q. It is that at (2 p + q)/3.
    ahead, behind = c.carried
    at = c.at + 2 / 3 * (ahead**2 - behind**2) / np.maximum(c.length, 1e-300) * c.way
    on = np.maximum(stress.signed(at), 0.0) * stress.on(c.normal) * c.normal.conj()
    if scene.water:
        on -= np.maximum(scene.water.signed(at), 0.0)
    on[(c.closure < -TOUCHES * skin) | (c.length < SHORT) | (on.real <= 0)] = 0.0
    closure, slid = _displaced(joints, np.stack([on.real, on.imag], axis=1)).T
    if closure.max() > skin:
        raise ValueError(
            f"in_situ closes joints by up to {closure.max():.3g} m, but contacts are followed to "
            f"{skin:.3g} m: set a larger run.skin, or stiffer laws"
        )
    tracker.offset = np.where(closure > 0, c.closure - closure, 0.0)
    return slid


def _displaced(joints: Joints, bears: np.ndarray) -> np.ndarray:
    """Closure and sliding (k, 2) in m at which virgin joints bear normal and shear stress (k, 2).

    Newton's steps. A joint that cannot bear so much shear stress keeps the first of them, with
    which it bears what it can.
    """
    closure = joints.virgin("closure", "stress", bears[:, 0])
    tried, least = [np.stack([closure, np.zeros(joints.n)], axis=1)], np.full(joints.n, 1e-300)
    while True:
        F, C, _ = joints.trial(d := tried[-1])
        lacks, stiff = bears - F, np.maximum(C[:, 0, 0], 1e-300)
        done = (np.abs(lacks) <= BALANCED * bears[:, :1]).all(axis=1)
        if done.all() or len(tried) == TRIALS:
            return np.where(done[:, None], d, tried[:2][-1])
        slope = C[:, 1, 1] - C[:, 1, 0] * C[:, 0, 1] / stiff  # at constant normal stress
        least = np.maximum(least, FLAT * slope)
        shear = (lacks[:, 1] - C[:, 1, 0] / stiff * lacks[:, 0]) / np.maximum(slope, least)
        shear[done] = 0.0
        press = (lacks[:, 0] - C[:, 0, 1] * shear) / stiff
        tried.append(np.stack([np.maximum(d[:, 0] + press, 0.1 * d[:, 0]), d[:, 1] + shear], 1))


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
        joints.rearrange(before, tracker.law, tracker.keys)
        slid = np.append(slid, 0.0)[before]
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
