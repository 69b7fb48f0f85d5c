"""The equilibrium of blocks on their joints, and the blocks that no equilibrium holds.

Newton's method finds the displacements at which all blocks are in balance. Where there are none the
blocks creep through a drag: drag times movement = unbalanced force, in implicit steps, through less
and less drag. What can be held comes to rest. What cannot be held moves on, and what it lacks of a
balance no longer falls: it is loose. Contacts keep their places and normals here: displacements are
small, and where a loose block would be in the end means nothing.
"""

import numpy as np
from scipy.sparse import bmat, csc_array, csr_array, diags
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

from jointlaw.support.progress import track

from ..contact import Contacts, Joints
from ..scene import Scene
from .blocks import Blocks
from .timestep import rates

BALANCED = 1e-3  # most unbalanced force of a block that is held, as a share of its weight
LOOSE = 1e-2  # least that a loose block keeps in the creep; held ones that follow it keep less
TIGHT, ROUGH = 1e-11, 1e-8  # residual of a solution and of a step of the creep, shares of the load
ITERATIONS, DAMPINGS = 60, 20  # most of Newton's, and most trials of damping in one
FAR = 0.1  # of its reach: how far the drag of the first guess lets a block fall
STEPS = 40  # most of the creep
WEAKER, STRONGER = 0.1, 10.0  # change of the drag after a step, and after one that was not found
STEADY = (
    0.8,
    0.9,
)  # unbalanced force over that of the step before: no fall, with less drag or the same
LET_GO, FALLS = 10, 0.99  # most steps in which loose blocks let go; a fall of what is unbalanced
HELD = 1e25  # drag (1/s2) that holds a block where it is


def shares(blocks: Blocks, force: np.ndarray) -> np.ndarray:
    """Sizes of forces (n, 3) as shares (n,) of the weights, moments divided by the block's reach;
    where there is no weight, of a millionth of the largest load."""
    weight = np.hypot(*blocks.gravity[:, :2].T)
    largest = np.abs(blocks.gravity + blocks.loads).max(initial=1e-300)
    x, y, turn = (force * blocks.free).T
    return np.sqrt(x**2 + y**2 + (turn / blocks.reach) ** 2) / np.maximum(weight, 1e-6 * largest)


def out_of_balance(scene: Scene, blocks: Blocks, contacts: Contacts, joints: Joints) -> np.ndarray:
    """Which blocks (n,) their joints do not carry now, apart from dashpots and drives."""
    push, slide = (joints.traction * contacts.length[:, None] * scene.thickness).T
    held = contacts.assemble(blocks.motion, push, -slide, joints.stored * scene.thickness)
    return shares(blocks, held + blocks.gravity + blocks.loads) > BALANCED


class Equilibrium:
    """The search for an equilibrium from where the blocks are.

    Joints are new but for their closure and what they have slid so far, (k,) in m. force (n, 3):
    what they have to carry. Displacements y (free motions,) are in unit-mass motions, as in `rates`.
    """

    def __init__(
        self, scene: Scene, blocks: Blocks, contacts: Contacts, joints: Joints,
        slid: np.ndarray, force: np.ndarray,
    ) -> None:  # fmt: skip
        self.blocks, self.joints, self.k = blocks, joints, joints.n
        signs = diags(np.repeat([-1.0, 1.0], self.k))
        self.rows: csr_array = signs @ rates(blocks, contacts)  # to closure and shear
        self.area = np.tile(contacts.length * scene.thickness, 2)
        self.start = np.concatenate([contacts.closure, slid])
        self.free, arms = blocks.free.ravel(), np.ones(blocks.free.shape)
        arms[:, 2] = blocks.reach
        self.root, self.arm = (part.ravel()[self.free] for part in (blocks.root, arms))
        self.block = np.repeat(np.arange(len(arms)), 3)[self.free]
        self.force, self.none = force.ravel()[self.free] * self.root, np.zeros(len(self.block))
        touched = abs(self.rows[: self.k]) + abs(self.rows[self.k :])
        self.island = connected_components(touched.T @ touched, directed=False)[1]

    def spread(self, parts: np.ndarray) -> np.ndarray:
        """Values (n, 3) of all motions from those (free motions,) of free ones."""
        out = np.zeros(self.free.size)
        out[self.free] = parts
        return out.reshape(-1, 3)

    def attempt(self, guess: np.ndarray, loose: np.ndarray, stay: np.ndarray | bool = False):
        """Displacements at which all blocks but loose ones are in balance, and, if there are none,
        which others are loose as well (n,).

        guess: where to begin; loose (n,): those that are known to be; stay: those of them that
        nothing moves any more. The others move by a few closures from where they are, as far as
        they need to let go of the rest.
        """
        closed = (self.start + self.rows @ guess)[: self.k]
        far = float(np.median(closed[closed > 0])) if (closed > 0).any() else 1.0
        least = np.where((loose & stay)[self.block], HELD, self._drag(far)) * loose[self.block]
        y = np.where(loose[self.block], 0.0, guess)
        moved, found = self._let_go(y, least, LET_GO if (loose & ~stay).any() else 1)
        if found.all():
            return moved, loose & False
        y, least = np.where(found, moved, y), np.where(found, HELD, least)
        moved, r = self._creep(y, least)
        out = self._shares(np.where(least > 0, 0.0, r))
        return moved, out > max(BALANCED, min(LOOSE, 0.5 * out.max()))

    def _let_go(self, y: np.ndarray, least: np.ndarray, steps: int):
        """Steps through the drag `least` until what holds loose blocks no longer falls."""
        before = np.inf
        for _ in range(steps):
            y, r, found = self._step(y, least)
            size = np.linalg.norm(r)
            if not found.all() or size > FALLS * before:
                break
            before = size
        return y, found

    def _drag(self, far: float) -> np.ndarray:
        """Drag through which a weight moves a block by `far` (m) in a step."""
        weight = np.hypot(*self.blocks.gravity[:, :2].T) / far
        return (weight + 1e-300)[self.block] * (self.root * self.arm) ** 2

    def _shares(self, r: np.ndarray) -> np.ndarray:
        return shares(self.blocks, self.spread(r / self.root))

    def _stiffness(self, C) -> csc_array:
        return (self.rows.T @ (diags(self.area) @ C) @ self.rows).tocsc()

    def unslid(self) -> np.ndarray:
        """Displacements with joints that cannot slide, for a guess."""
        far = FAR * float(np.median(self.blocks.reach))
        return self._step(self.none, self._drag(far), ROUGH, slides=False)[0]

    def _creep(self, y: np.ndarray, least: np.ndarray):
        """Steps through less and less drag, of some motions at `least` that much, until all others
        are in balance or what they lack no longer falls. Returns y and the unbalanced force."""
        median = np.median(self._stiffness(self._unbalanced(y)[1]).diagonal())
        drag, r, before, change = 1e3 * median, self.none, np.inf, WEAKER
        for _ in track(range(STEPS), "looking for loose blocks"):
            further, lacking, found = self._step(y, np.maximum(drag, least), ROUGH)
            if not found.all():
                drag, change, before = drag * STRONGER, 1.0, np.inf
                continue
            y, r = further, lacking
            now = self._shares(np.where(least > 0, 0.0, r))
            steady = now > STEADY[change == 1.0] * before
            if now.max() <= BALANCED or drag < 0.1 * median and steady[now > LOOSE].all():
                break
            before, drag = now, drag * change
        return y, r

    def _unbalanced(self, y: np.ndarray, slides: bool = True):
        """Unbalanced forces (free motions,), and the stiffness (2 k, 2 k) of the joints."""
        joints, k, d = self.joints, self.k, self.start + self.rows @ y
        if slides:
            F, C, _ = joints.trial(d.reshape(2, k).T)
            F, (nn, ns, sn, ss) = F.T.ravel(), C.reshape(k, 4).T
        else:
            c, sign, shear = np.maximum(np.abs(d[:k]), 1e-9), np.sign(d[:k]), d[k:]
            (stress, ss), above, below = (
                np.array([joints.virgin(of, "closure", c * at) for of in ("stress", "stiffness")])
                for at in (1.0, 1.01, 0.99)
            )
            slope, stiffens = (above - below) / (0.02 * c)
            acts = (d[:k] > 0) | (joints.damage < 1)
            F = np.concatenate([stress * acts * sign, ss * shear])
            nn, ns, sn = slope * acts, 0.0 * c, stiffens * sign * shear
        stiffness = csr_array(bmat([[diags(nn), diags(ns)], [diags(sn), diags(ss)]]))
        return self.force - self.rows.T @ (self.area * F), stiffness

    def _step(self, y: np.ndarray, drag: np.ndarray, tight: float = TIGHT, slides: bool = True):
        """An implicit step through a drag (free motions,), or without drag to the equilibrium.

        Newton's iterations, damped where the residual does not fall, each island of blocks that
        touch by itself. Returns y, the unbalanced forces, and which motions belong to islands whose
        step was found.
        """
        begin, island, free = y, self.island, drag < HELD

        def norm(parts):
            return np.sqrt(np.bincount(island, parts * parts))

        def at(y):
            r, C = self._unbalanced(y, slides)
            left = (r - drag * (y - begin)) * free
            return r, C, left, norm(left)

        r, C, left, size = at(y)
        target = tight * norm(self.force)
        damp, stuck = np.zeros(len(size)), np.zeros(len(size), bool)
        for _ in track(range(ITERATIONS), "equilibrium"):
            active = (size > target) & ~stuck
            if not active.any():
                break
            K = self._stiffness(C)
            least = 1e-3 * K.diagonal().max() + 1.0
            waits, step = active, self.none
            for _ in range(DAMPINGS):
                trial = spsolve((K + diags(drag + damp[island] + 1e-9 * least)).tocsc(), left)
                step = np.where(waits[island], trial, step)
                r, C, left_new, size_new = at(y + step * active[island])
                waits = active & ~(size_new < size)
                if not waits.any():
                    break
                damp = np.where(waits, np.maximum(4 * damp, least), damp)
            stuck |= waits
            y = y + step * (active & ~waits)[island]
            r, C, left, size = at(y) if waits.any() else (r, C, left_new, size_new)
            damp = np.where(active & ~waits, np.where(damp > least, damp / 10, 0.0), damp)
        return y, r, (size <= 1e3 * target)[island]
