"""The initial equilibrium: displacements with which the joints carry gravity and loads.

First with joints that cannot slide; then with the law itself. Blocks that the law cannot hold are
placed with joints that neither slide nor open, which always has an answer. Blocks that no joint
connects, such as two slopes side by side, find their answers apart.
"""

import numpy as np
from scipy.sparse import bmat, csr_array, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from jointlaw.support.progress import track

from ..contact import Joints, Tracker
from ..scene import Scene
from .blocks import Blocks
from .edge_loads import press
from .in_situ import begin
from .timestep import rates

ATTEMPTS = 40  # most rounds of the initial equilibrium
SETTLED = 1e-10  # movement of a round, as a share of the first, that ends them
TIGHT = 1e-11  # residual force as a share of the applied one
PATIENCE = 20  # trials after which an island is given up whose residual is still above ...
FALLEN = 0.999  # ... this share of what it was


def seat(
    scene: Scene, blocks: Blocks, tracker: Tracker, joints: Joints, slid: np.ndarray
) -> tuple[np.ndarray, bool]:
    """Move the blocks to where their joints carry them; slid (k,) in m: sliding at first.

    Returns the first sliding (k,) of the joints (m), and whether the law can hold all blocks: those
    that it cannot hold will move from step 0.
    """
    free = blocks.free.ravel()
    still = np.ones(int(free.sum()), bool)
    all_balanced, first, pairs = True, 0.0, blocks.near()
    for attempt in range(ATTEMPTS):  # each at the places just found: joints turn with the blocks
        tracker.follow(blocks.motion)
        tracker.urgent[:] = True  # it is cheap here, and nothing is missed
        before = tracker.renew(blocks.motion, pairs)
        if before is not None:
            joints.rearrange(before, tracker.law, tracker.keys)
            slid = np.where(before >= 0, slid[before], 0.0)
        press(scene, blocks, tracker)
        force = blocks.gravity + blocks.loads
        if attempt:
            force = force + _length_forces(scene, blocks, tracker, joints, slid)
        force = (force * blocks.root).ravel()[free]
        rows = rates(blocks, tracker.contacts)
        area = tracker.contacts.length * scene.thickness
        start = np.concatenate([tracker.closure, slid])
        again = attempt > 0
        near = again or scene.in_situ is not None
        moved, balanced = _equilibrium(joints, rows, start, area, force, still, near, not again)
        if not again:
            all_balanced, first = bool(balanced.all()), np.abs(moved).max()
        else:  # what was found before is balanced but for the turning of the joints
            moved = np.where(balanced & still, moved, 0.0)
        slid = slid + (rows @ moved)[len(slid) :]
        shift = np.zeros(blocks.free.size)
        shift[free] = moved * blocks.root.ravel()[free]
        blocks.motion[:3] += shift.reshape(-1, 3).T
        still &= balanced
        if not still.any() or np.abs(moved).max() < SETTLED * first:
            break
    tracker.renewed_at[:] = blocks.motion[:3]
    return slid, all_balanced


def displacements(scene: Scene, guess: np.ndarray | None = None) -> np.ndarray | None:
    """Displacements of the free motions at which virgin joints carry a scene as drawn.

    All loads act at once; in unit-mass motions, None where none are found. They are looked for from
    guess, those of a similar scene, from those with which no joint slides, and from none: where
    bonds break and joints soften, one of these may find what the others miss.
    """
    blocks, joints = Blocks(scene), Joints(scene)
    tracker = Tracker(scene, blocks.motion)
    closed = begin(scene, blocks, tracker, joints)
    rows, area = rates(blocks, tracker.contacts), tracker.contacts.length * scene.thickness
    force = ((blocks.gravity + blocks.loads) * blocks.root).ravel()[blocks.free.ravel()]
    none, whole = np.zeros(len(force)), np.ones(len(force), bool)
    for first, near in ((guess, True), (none, False), (none, True)):
        if first is not None:
            opened, slid = (rows @ first).reshape(2, -1)
            start = np.concatenate([tracker.closure - opened, closed + slid])
            moved, balanced = _equilibrium(joints, rows, start, area, force, whole, near, False)
            if balanced.all():
                return first + moved
    return None


def _length_forces(scene, blocks, tracker, joints, slid) -> np.ndarray:
    """Forces (n, 3) of joints whose length changes as the blocks move, after their first step."""
    closed = np.stack([tracker.closure, slid], axis=1) - joints.delta
    stored, none = joints.trial(closed)[2] * scene.thickness, np.zeros(joints.n)
    return tracker.contacts.assemble(blocks.motion, none, none, stored) * blocks.mobile


def _equilibrium(joints: Joints, rows: csr_array, start, area, force, settle, near, glue):
    """Displacements of the free motions that balance `force`; rows as `rates` gives them.

    start (2 k,): closures, then slidings, without these displacements (m), reached in one step
    from the virgin state. settle (free motions,): those that are asked for; near: they are almost
    in balance; glue: place what the law cannot hold with joints that neither slide nor open.
    Returns (displacement, balanced), both (free motions,).
    """
    k = len(area)
    rows = diags(np.concatenate([-np.ones(k), np.ones(k)])) @ rows  # to (closure, shear)
    weight = np.concatenate([area, area])

    def unsliding(d, pull=0.0):
        c = np.maximum(np.abs(d[:k]), 1e-9)
        shear = joints.virgin("stiffness", "closure", c)
        stress, above, below = (
            joints.virgin("stress", "closure", part * c) for part in (1.0, 1.01, 0.99)
        )
        slope = (above - below) / (0.02 * c)
        acts = np.where((d[:k] > 0) | (joints.damage < 1), 1.0, pull)
        F = np.concatenate([stress * acts * np.sign(d[:k]), shear * d[k:]])
        return F, diags(np.concatenate([slope * acts, shear]))

    def real(d):
        F, C, _ = joints.trial(np.stack([d[:k], d[k:]], axis=1))
        blocks = [[diags(C[:, i, j]) for j in (0, 1)] for i in (0, 1)]
        return F.T.ravel(), csr_array(bmat(blocks))

    touched = abs(rows[:k]) + abs(rows[k:])  # the law couples closure and shear
    _, island = connected_components(touched.T @ touched, directed=False)
    idle, nothing = np.bincount(island, settle) == 0, np.zeros(len(force))
    guess = nothing
    if not near:
        guess, _ = _newton(unsliding, rows, start, weight, force, nothing, 300, island, idle)
    best, balanced = _newton(real, rows, start, weight, force, guess, 100, island, idle)
    if glue and not balanced.all():

        def glued(d):
            return unsliding(d, pull=1.0)

        placed, _ = _newton(glued, rows, start, weight, force, nothing, 300, island, balanced, 1.0)
        best = np.where(balanced[island], best, placed)
    return best, balanced[island]


def _newton(law, rows, start, weight, force, y, most, island, idle, fallen=FALLEN):
    """Levenberg's damped Newton steps on the unbalanced force, each island with its damping.

    island (free motions,): number of the group of connected blocks; idle: islands to leave alone;
    fallen: share of its residual that is still too much for an island after PATIENCE trials.
    Returns y and whether each island found its balance.
    """

    def unbalanced(y):
        F, C = law(start + rows @ y)
        return force - rows.T @ (weight * F), C

    def norm(r):
        return np.sqrt(np.bincount(island, r * r))

    r, C = unbalanced(y)
    size, target = norm(r), TIGHT * norm(force)
    damp = None
    stuck = idle.copy()  # no damping makes a better step
    last, tried = np.full(len(size), np.inf), 0
    for _ in track(range(most), f"equilibrium, {law.__name__} joints"):
        if tried >= PATIENCE:
            stuck |= size > fallen * last
            last, tried = size, 0
        active = (size > target) & ~stuck
        if not active.any():
            break
        K = (rows.T @ diags(weight) @ C @ rows).tocsc()
        if damp is None:
            damp = np.full(len(size), max(1e-3 * abs(K).max(), 1.0))
        waits = active.copy()
        step = np.zeros(len(y))
        for _ in range(40):
            tried += 1
            found = spsolve((K + diags(damp[island])).tocsc(), r)
            step = np.where(waits[island], found, step)
            r_new, C_new = unbalanced(y + step * active[island])
            waits = active & ~(norm(r_new) < size)
            if not waits.any():
                break
            damp = np.where(waits, 4 * damp, damp)
        stuck |= waits
        y = y + step * (active & ~waits)[island]
        r, C = (r_new, C_new) if not waits.any() else unbalanced(y)
        size = norm(r)
        damp = np.where(active & ~waits, damp / 10, damp)
    return y, size <= 1e3 * target
