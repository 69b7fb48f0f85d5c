"""The start of a scene: joints that bear the stress of before, the equilibrium of blocks on their
joints, and the blocks that no equilibrium holds.

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

from ..contact import ContactManager, Contacts, Joints
from ..scene import Scene
from .blocks import Blocks, apply_loads
from .timestep import rates

BALANCED = 1e-3  # most unbalanced force of a block that is held, as a share of its weight
LOOSE = 1e-2  # least that a loose block keeps in the creep; held ones that follow it keep less
TIGHT, ROUGH = 1e-11, 1e-8  # residual of a solution and of a step of the creep, shares of the load
ITERATIONS, DAMPINGS = 60, 20  # most of Newton's, and most trials of damping in one
FAR = 0.1  # of its reach: how far the drag of the first guess lets a block fall
STEPS = 40  # most of the creep
WEAKER, STRONGER = 0.1, 10.0  # change of the drag after a step, and after one that was not found
WEAK = 2e-3, 1e-1  # drag, as a share of the median stiffness, from which on that is asked
STEADY = 0.8, 0.9  # unbalanced force over that before: no fall, with less drag or the same drag
LET_GO, FALLS = 40, 0.9  # most steps in which loose blocks let go, which go on while this falls
SLOW = 0.01  # their drag, as a share of the median stiffness
EARTH = 9.81  # m/s2
FOLLOW = 6  # steps in which blocks that a loose one props follow it
HELD = 1e25  # drag (1/s2) that holds a block where it is
ROUNDS, SETTLED = 40, 1e-10  # most rounds; which ends them: movement, as a share of the first
TOUCHES = 0.01  # of the least skin: joints drawn farther open bear nothing
SHORT = 1e-6  # m: joints that are drawn shorter bear nothing either
TRIALS, BORNE = 50, 1e-12  # most steps to a stress; what may lack, as a share of the normal one
FLAT = 0.05  # least slope of the shear stress, as a share of that of the unsheared joint


def shares(blocks: Blocks, force: np.ndarray) -> np.ndarray:
    """Sizes of forces (n, 3) as shares (n,) of the weights, on Earth where there is no gravity, or
    of a millionth of the largest load if that is more; moments are divided by the block's reach."""
    mass, largest = blocks.inertia[:, 0], np.abs(blocks.gravity + blocks.loads).max(initial=0.0)
    weight = mass * ((np.hypot(*blocks.gravity[:, :2].T) / mass).max() or EARTH)
    x, y, turn = (force * blocks.free).T
    return np.sqrt(x**2 + y**2 + (turn / blocks.reach) ** 2) / np.maximum(weight, 1e-6 * largest)


def out_of_balance(scene: Scene, blocks: Blocks, contacts: Contacts, joints: Joints) -> np.ndarray:
    """Which blocks (n,) their joints do not carry now, apart from dashpots and drives."""
    push, slide = (joints.traction * contacts.length[:, None] * scene.thickness).T
    held = contacts.assemble(blocks.motion, push, -slide, joints.stored_energy * scene.thickness)
    return shares(blocks, held + blocks.gravity + blocks.loads) > BALANCED


class Equilibrium:
    """The search for an equilibrium from where the blocks are, with their weight and loads.

    Joints are new but for their closure and what they have slid so far, (k,) in m; `moved`: their
    lengths change as well, as the blocks do since they were drawn. Displacements y (free motions,)
    are in unit-mass motions.
    """

    def __init__(
        self, scene: Scene, blocks: Blocks, manager: ContactManager, joints: Joints,
        slid: np.ndarray, moved: bool = False,
    ) -> None:  # fmt: skip
        self.blocks, self.joints, self.k = blocks, joints, joints.n
        signs, contacts = diags(np.repeat([-1.0, 1.0], self.k)), manager.contacts
        self.rows: csr_array = signs @ rates(blocks, contacts)  # to closure and shear
        self.area = np.tile(contacts.length * scene.thickness, 2)
        self.start = np.concatenate([manager.closure, slid])
        self.root, self.block = blocks.root[blocks.free], np.nonzero(blocks.free)[0]
        force = blocks.gravity + blocks.loads
        if moved:
            closed = np.stack([manager.closure, slid], axis=1) - joints.delta
            stored, none = joints.trial(closed)[2] * scene.thickness, np.zeros(self.k)
            force = force + contacts.assemble(blocks.motion, none, none, stored) * blocks.mobile
        pull = np.hypot(*force[:, :2].T) / blocks.inertia[:, 0] / blocks.reach
        self.slow = float(np.median(pull[blocks.free.any(axis=1)]))  # drag: the reach in a step
        self.force, self.none = force[blocks.free] * self.root, np.zeros(len(self.block))
        touched = abs(self.rows[: self.k]) + abs(self.rows[self.k :])
        self.island = connected_components(touched.T @ touched, directed=False)[1]

    def spread(self, parts: np.ndarray) -> np.ndarray:
        """Values (n, 3) of all motions from those (free motions,) of free ones."""
        out = np.zeros(self.blocks.free.shape)
        out[self.blocks.free] = parts
        return out

    def attempt(self, guess: np.ndarray, loose: np.ndarray, stay: np.ndarray | bool = False):
        """Displacements at which all blocks but loose ones are in balance, and, if there are none,
        which others are loose as well (n,).

        guess: where to begin; loose (n,): those that are known to be; stay: those of them that
        nothing moves any more. The others move by a few closures from where they are, as far as
        they need to let go of the rest.
        """
        drag = max(SLOW * self._median(guess), 1e3 * self.slow)
        least = np.where((loose & stay)[self.block], HELD, drag) * loose[self.block]
        y, before = np.where(loose[self.block], 0.0, guess), np.inf
        for _ in range(LET_GO if (loose & np.logical_not(stay)).any() else 1):
            moved, r, found = self._step(y, least)
            y = np.where(found, moved, y)
            if not found.all() or np.linalg.norm(r) > FALLS * before:
                break
            before = np.linalg.norm(r)
        if found.all():
            return moved, self._follow(moved, loose, least)
        least = np.where(found, HELD, least)
        moved, r = self._creep(y, least)
        if (out := self._shares(np.where(least > 0, 0.0, r))).max() <= BALANCED:
            y, _, found = self._step(moved, least)  # is it at rest, or does it creep on?
            if found.all():
                return y, loose & False
        return moved, out > min(LOOSE, 0.5 * out.max())

    def _follow(self, y: np.ndarray, loose: np.ndarray, least: np.ndarray) -> np.ndarray:
        """Blocks (n,) that only the drag `least` of loose ones holds: these move on through less of
        it now, and others that follow are loose as well."""
        out, drag = 0.0 * loose, np.where(least < HELD, WEAK[0] * self._median(y), HELD)
        for _ in range(FOLLOW if ((least > 0) & (least < HELD)).any() else 0):
            y, r, found = self._step(y, drag, ROUGH)
            if not found.all():
                break
            out = self._shares(np.where(drag < HELD, r, 0.0)) * ~loose
        return out > LOOSE

    def _shares(self, r: np.ndarray) -> np.ndarray:
        return shares(self.blocks, self.spread(r / self.root))

    def _stiffness(self, C) -> csc_array:
        return (self.rows.T @ (diags(self.area) @ C) @ self.rows).tocsc()

    def stick_predictor(self) -> np.ndarray:
        """Displacements to begin with: those of joints that cannot slide, in a step through a drag
        in which a block that nothing holds falls by a tenth of its reach; none where that is not
        found."""
        y, _, found = self._step(self.none, self.slow / FAR + self.none, ROUGH, slides=False)
        return y * found

    def _median(self, y: np.ndarray) -> float:
        """Median stiffness of the free motions."""
        stiffness = self._stiffness(self._unbalanced(y)[1]).diagonal()
        return float(np.median(stiffness[stiffness > 0])) if (stiffness > 0).any() else 0.0

    def _creep(self, y: np.ndarray, least: np.ndarray):
        """Steps through less and less drag, of some motions at `least` that much, until all others
        are in balance or what they lack no longer falls. Returns y and the unbalanced force."""
        stiff = self._median(y)
        drag, change = max(1e3 * stiff, 1e4 * self.slow), WEAKER
        r, before = self.none, np.inf
        for _ in track(range(STEPS), "looking for loose blocks"):
            further, lacking, found = self._step(y, np.maximum(drag, least), ROUGH)
            if not found.all():
                drag, change, before = drag * STRONGER, 1.0, np.inf
                continue
            y, r = further, lacking
            now = self._shares(np.where(least > 0, 0.0, r))
            asked = now > (LOOSE if now.max() > LOOSE else BALANCED)
            steady = (now > STEADY[change == 1.0] * before)[asked].all()
            stiff = max(stiff, self._median(y))  # it is none where all blocks fall
            if now.max() <= BALANCED or (steady and drag < WEAK[change == 1.0] * stiff):
                break
            before, drag = now, drag * change
        return y, r

    def _unbalanced(self, y: np.ndarray, slides: bool = True):
        """Unbalanced forces (free motions,), and the stiffness (2 k, 2 k) of the joints."""
        d = (self.start + self.rows @ y).reshape(2, -1).T
        F, C = self.joints.trial(d)[:2] if slides else self.joints.stick_predictor(d)
        nn, ns, sn, ss = (diags(part) for part in C.reshape(-1, 4).T)
        stiffness = csr_array(bmat([[nn, ns], [sn, ss]]))
        return self.force - self.rows.T @ (self.area * F.T.ravel()), stiffness

    def _step(self, y: np.ndarray, drag: np.ndarray, tight: float = TIGHT, slides: bool = True):
        """An implicit step through a drag (free motions,), or without drag to the equilibrium.

        Newton's iterations, damped where the residual does not fall, each island of blocks that
        touch by itself. Returns y, the unbalanced forces, and which motions belong to islands whose
        step was found.
        """
        island, free, begin = self.island, drag < HELD, y

        def norm(parts):
            return np.sqrt(np.bincount(island, parts * parts))

        def at(y):
            r, C = self._unbalanced(y, slides)
            left = (r - drag * (y - begin)) * free
            return r, C, left, norm(left)

        (r, C, left, size), target = at(y), tight * norm(self.force)
        damp, active = 0.0 * target, size > target
        for _ in track(range(ITERATIONS), "equilibrium"):
            if not active.any():
                break
            K = self._stiffness(C)
            least, waits, step = 1e-3 * K.diagonal().max() + 1.0, active, self.none
            for _ in range(DAMPINGS):
                damped = diags(drag + damp[island] + 1e-9 * least)
                step = np.where(waits[island], spsolve((K + damped).tocsc(), left), step)
                now = at(y + step * active[island])
                waits = active & ~(now[-1] < size)
                if not waits.any():
                    break
                damp = np.where(waits, np.maximum(4 * damp, least), damp)
            active = active & ~waits
            y = y + step * active[island]
            r, C, left, size = at(y) if waits.any() else now
            damp = np.where(active & (damp <= least), 0.0, damp / 10)
            active = active & (size > target)
        return y, r, (size <= 1e3 * target)[island]


def begin(scene: Scene, blocks: Blocks, manager: ContactManager, joints: Joints) -> np.ndarray:
    """Find the contacts of blocks as drawn; their joints are virgin. Returns the sliding (k,) in m
    with which they start, and keeps as the manager's offset the closure: both are those of the
    in-situ stress, zero without one."""
    joints.rearrange(manager.renew(blocks.motion, blocks.near()), manager.law, manager.keys)
    apply_loads(scene, blocks, manager)
    stress, c, skin = scene.in_situ, manager.contacts, scene.skins.min()
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
    manager.offset = np.where(closure > 0, c.closure - closure, 0.0)
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
        done = (np.abs(lacks) <= BORNE * bears[:, :1]).all(axis=1)
        if done.all() or len(tried) == TRIALS:
            return np.where(done[:, None], d, tried[:2][-1])
        slope = C[:, 1, 1] - C[:, 1, 0] * C[:, 0, 1] / stiff  # at constant normal stress
        least = np.maximum(least, FLAT * slope)
        shear = (lacks[:, 1] - C[:, 1, 0] / stiff * lacks[:, 0]) / np.maximum(slope, least)
        shear[done] = 0.0
        press = (lacks[:, 0] - C[:, 0, 1] * shear) / stiff
        tried.append(np.stack([np.maximum(d[:, 0] + press, 0.1 * d[:, 0]), d[:, 1] + shear], 1))


def seat(
    scene: Scene, blocks: Blocks, manager: ContactManager, joints: Joints, slid: np.ndarray
) -> np.ndarray:
    """Move the blocks to where their joints carry them; slid (k,) in m: sliding at first. Returns
    the sliding with which the joints start.

    Loose blocks, which cannot be held, stay almost where they are drawn; all others are in balance
    with what the loose ones do to them there.
    """
    loose, first, pairs = np.zeros(len(blocks.free), bool), 0.0, blocks.near()
    for again in range(ROUNDS):  # each at the places just found: joints turn with the blocks
        manager.follow(blocks.motion)
        manager.urgent[:] = True  # it is cheap here, and nothing is missed
        before = manager.renew(blocks.motion, pairs)
        joints.rearrange(before, manager.law, manager.keys)
        slid = np.append(slid, 0.0)[before]
        apply_loads(scene, blocks, manager)
        search = Equilibrium(scene, blocks, manager, joints, slid, again > 0)
        start = search.none if again or scene.in_situ is not None else search.stick_predictor()
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
    manager.renewed_at[:] = blocks.motion[:3]
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
    manager = ContactManager(scene, blocks.motion)
    slid = begin(scene, blocks, manager, joints)
    search = Equilibrium(scene, blocks, manager, joints, slid)
    known = np.zeros(len(blocks.free), bool) if loose is None else loose
    moved, more = search.attempt(search.stick_predictor() if guess is None else guess, known)
    if more.any() and guess is not None:
        moved, more = search.attempt(search.stick_predictor(), known)
    return None if more.any() else moved
