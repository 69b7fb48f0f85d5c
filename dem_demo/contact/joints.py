"""The law's side: one batch of joints per law, one call per law and step.

Contacts come and go; each keeps its place in the batch of its law for as long as its interface is
in reach, so history is never given to the wrong joint. A place that falls free goes to a later
contact, whose joint starts anew.
"""

from functools import lru_cache

import numpy as np
from scipy.integrate import cumulative_trapezoid

import jointlaw as jl
from jointlaw.joints.state import JointState
from jointlaw.kernels.engine import Step

from ..compiled import SHOWN, Pool, World, address
from ..scene import Law, Scene, opens_to

PARTS = "states", "fingerprint"  # of a snapshot of the joints of a law


@lru_cache(maxsize=64)
def tabulate_unmated_loading(law: Law) -> dict[str, np.ndarray]:
    """Closure from first touch (m) and work (J/m2) of a joint whose faces have never met."""
    closure = tabulate_first_loading(law)["closure"]
    batch = law.joints(len(closure), mated=False)
    batch.update(np.stack([closure, 0.0 * closure], axis=1), tangent=False)
    return {"closure": closure, "work": batch.stored_energy}


@lru_cache(maxsize=64)
def tabulate_first_loading(law: Law) -> dict[str, np.ndarray]:
    """Closure (m), stress (Pa) and work (J/m2) of a virgin joint from no closure to 2 GPa, more
    than any corner of rock stands, and an upper bound of its stiffness (Pa/m) there.

    At a given normal stress the unsheared joint is the stiffest one (Phi' is a concave function of
    Phi), so the virgin curve bounds the sheared joint as well.
    """
    top = float(law.closure(2e9))
    closure = np.concatenate([[0.0], np.geomspace(1e-8 * top, top, 600)])
    stress = law.normal_stress(closure)
    return {
        "closure": closure,
        "stress": stress,
        "stiffness": stiffness_bound(law, closure, 1.0),
        "work": cumulative_trapezoid(stress, closure, initial=0.0),
    }


def stiffness_bound(law: Law, closure: np.ndarray, reduction: float) -> np.ndarray:
    """Upper bound (k,) in Pa/m of the stiffness of joints closed to `closure` (k,) in m.

    Their shear stress is divided by F = `reduction` and their sliding multiplied by it. A facet at
    inclination theta then has the normal (cos, sin/F) and the tangent (-sin, cos/F), so its elastic
    stiffness is the largest eigenvalue of a 2 x 2 matrix. Friction adds at most mu times the square
    of the length of the normal.
    """
    F = reduction
    if isinstance(law, jl.CoulombLaw):
        # The coupling of shear to closure has no eigenvalue of its own: those of
        # (kn, 0; mu kn, 0) are kn and 0.
        return np.full(len(closure), max(law.normal_stiffness, law.shear_stiffness / F**2))
    bound = law.max_stiffness(closure)
    if F == 1.0:
        return bound
    cemented = 0.0
    if bond := law.bond:
        bound = bound - max(bond.normal_stiffness, bond.shear_stiffness)
        cemented = max(bond.normal_stiffness, bond.shear_stiffness / F**2)
    lam, mu = law.asperity.lam, law.asperity.mu
    theta = np.linspace(0.0, np.pi / (2 * law.orientation.a), 65)
    normal = np.cos(theta) ** 2 + np.sin(theta) ** 2 / F**2  # squares of the lengths
    tangent = np.sin(theta) ** 2 + np.cos(theta) ** 2 / F**2
    mixed = (np.cos(theta) * np.sin(theta) * (1 / F**2 - 1)) ** 2  # square of their product
    spread = np.sqrt((normal - tangent / lam) ** 2 + 4 * mixed / lam)
    elastic = 0.5 * (normal + tangent / lam + spread)
    largest = float((elastic + mu * normal).max())
    return bound * largest / (max(1.0, 1 / lam) + mu) + cemented


class LawJoints:
    """The joints of one law: batch, and by their places there what the compiled step needs.

    step: d (places, 2) in m, F (places, 2) in Pa and shown (places, 8), of one step of all; silent:
    the same without shown; free: places without a contact, the lowest last; curve: the law's virgin
    curve.
    """

    def __init__(self, law: Law, reduction: float) -> None:
        self.batch, self.free = jl.JointBatch(law, 0), []
        self.curve = {**tabulate_first_loading(law)}
        self.curve["stiffness"] = stiffness_bound(law, self.curve["closure"], reduction)
        self.grow(0)

    def grow(self, n: int) -> None:
        """Make room for n joints; those that are there keep what they show."""
        held = len(self.batch)
        self.free = [*range(n - 1, held - 1, -1), *self.free]
        self.batch.resize(n)
        d, F, shown = np.zeros((n, 2)), np.zeros((n, 2)), np.zeros((n, SHOWN + 2))
        if held:
            F[:held], shown[:held] = self.step.F, self.step.shown
        self.step = Step(d, F, None, shown=shown)
        self.silent = Step(d, F, None)

    def take(self, m: int) -> np.ndarray:
        """Places (m,) for new contacts."""
        if m > len(self.free):
            self.grow(len(self.batch) + m - len(self.free))
        return np.array([self.free.pop() for _ in range(m)], int)

    def drop(self, places: np.ndarray) -> None:
        """Forget the joints at these places."""
        self.batch.reset(places)
        self.step.d[places] = 0.0
        self.free = sorted([*self.free, *places.tolist()], reverse=True)

    def begin(self, places: np.ndarray, mated: bool, bonded: bool) -> np.ndarray:
        """Let joints start, as new; closure and sliding (2,) in m where they first touch."""
        law = self.batch.law
        start = np.zeros(2) if mated else law.unmated_start
        self.batch.reset(places, mated)
        if not bonded:
            self.batch.unbond(places)
        damage = 0.0 if bonded and "damage" in law.tables.names else 1.0
        shown = 0.0, 0.0, 1.0, 0.0, 0.0, damage, *start  # by SHOWN: it is separated, no more
        self.step.F[places], self.step.shown[places] = 0.0, shown
        return start

    def pool(self) -> Pool:
        """What the compiled step knows of them."""
        step, stress = self.step, self.curve["stress"]
        arrays = step.d, step.F, step.shown, stress, self.curve["stiffness"]
        return Pool(*map(address, arrays), len(stress), bool(opens_to(self.batch.law) > 0.0))


class Joints:
    """All joints of a scene; arrays run over the k contacts.

    delta (k, 2) in m: closure and sliding; traction (k, 2) in Pa; sliding, slipping, separated
    (k,): shares of their shear capacity; stored, lost (k,) in J/m2; damage (k,) of their bonds, 1
    where nothing holds tension. law, place (k,): number of the law, and place in its batch.

    The scene's `reduction` F divides the shear stress of every joint and multiplies the sliding at
    which it has it. So tan(friction angle), tan(dilation angle) and cohesion are divided by F, and
    the work is that of the law: no energy is made.

    Faces that meet in a run are unmated where the law fades. touch (k, 2): where its joint first
    touches (closure and sliding in m, zeros for a mated one); delta counts from there.
    """

    def __init__(self, scene: Scene) -> None:
        self.reduction = np.array([1.0, scene.reduction])
        self.law_names = [*scene.laws]
        self.by_law = [LawJoints(law, scene.reduction) for law in scene.laws.values()]
        holds = [law if isinstance(law, jl.CoulombLaw) else law.bond for law in scene.laws.values()]
        self.pulls = np.array([part.normal_stiffness if part else 0.0 for part in holds])  # Pa/m
        self.touch, self.keys = np.zeros((0, 2)), np.zeros((0, 2), int)
        self._arrange(np.zeros(0, int), np.zeros(0, int))

    def _arrange(self, law: np.ndarray, place: np.ndarray) -> None:
        """Arrays for contacts with these laws, their joints at these places."""
        self.law, self.place, self.n = law.astype(np.int64), place.astype(np.int64), len(law)
        self.rows = [np.flatnonzero(law == i) for i in range(len(self.by_law))]
        self.traction, self.delta = np.zeros((2, self.n, 2))
        self.shares = np.zeros((SHOWN, self.n))
        self.sliding, self.slipping, self.separated, self.stored_energy, self.lost, self.damage = (
            self.shares
        )
        self._pools = (Pool * len(self.by_law))(*(held.pool() for held in self.by_law))
        self.world = World(contacts=self.n)
        self.bind(self.world)
        self.world.call("read")

    def bind(self, world: World) -> None:
        """Tell the compiled step where these arrays lie."""
        world.bind(self, "law", "place", "touch", "reduction", "traction", "delta", "shares",
                   pools=self._pools)  # fmt: skip

    def rearrange(
        self, before: np.ndarray, law: np.ndarray, keys: np.ndarray, started: bool = False
    ) -> None:
        """Keep the joints of the contacts (k,) that were at the rows `before`; -1 is a new one.

        law (k,), keys (k, 2): of each its law and the edges that met. started: whether the run has
        started. Then new ones have no bond, and are mated only where their two faces still touch in
        a mated joint, which they then continue.
        """
        new, gone = np.flatnonzero(before < 0), ~np.isin(np.arange(self.n), before)
        place = np.append(self.place, -1)[before]  # -1, the last one, is that of what is new
        touch = np.vstack([self.touch, [0.0, 0.0]])[before]
        mates = self.keys[~self.touch.any(axis=1)] @ [1, 1j]  # two edges as one number
        fits = np.isin(keys[new] @ [1, 1j], mates) | (not started)
        for i, held in enumerate(self.by_law):
            held.drop(self.place[gone & (self.law == i)])
            mated = fits | (not held.batch.law.tables.fades)
            for kind in (True, False):
                rows = new[(law[new] == i) & (mated == kind)]
                if len(rows):
                    place[rows] = held.take(len(rows))
                    touch[rows] = held.begin(place[rows], kind, bonded=not started)
        self.touch, self.keys = touch, keys
        self._arrange(law, place)

    def update(self, closure: np.ndarray, sliding: np.ndarray) -> None:
        """Advance every joint to a closure (m), and by a sliding (m), in one step."""
        d = np.stack([closure - self.delta[:, 0], sliding], axis=1) / self.reduction
        for held, rows in zip(self.by_law, self.rows, strict=True):
            held.step.d[self.place[rows]] = d[rows]
        self.advance(1)
        self.world.call("read")

    def advance(self, parts: int) -> None:
        """Advance the joints of all laws `parts` times by what their steps hold.

        The law's friction work is first order in its step: more parts balance energy better.
        """
        for held, rows in zip(self.by_law, self.rows, strict=True):
            if len(rows):
                for step in [held.silent] * (parts - 1) + [held.step]:
                    held.batch.take(step)

    def trial(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Tractions (k, 2), tangents (k, 2, 2) and stored energies (k,) in J/m2 after increments d
        (k, 2), leaving the state alone."""
        F, C, by = np.empty((self.n, 2)), np.empty((self.n, 2, 2)), self.reduction
        shown = np.empty((self.n, SHOWN + 2))
        for held, rows in zip(self.by_law, self.rows, strict=True):
            m = len(rows)
            step = Step(d[rows] / by, np.empty((m, 2)), np.empty((m, 2, 2)), self.place[rows],
                        False, np.empty((m, SHOWN + 2)))  # fmt: skip
            held.batch.take(step)
            F[rows], C[rows], shown[rows] = step.F, step.C, step.shown
        return F / by, C / np.outer(by, by), shown[:, 3]

    def stick_predictor(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `trial` of virgin joints that cannot slide: tractions and tangents."""
        closure, sign, shear = np.maximum(np.abs(d[:, 0]), 1e-9), np.sign(d[:, 0]), d[:, 1]
        (stress, ss), above, below = (
            np.array([self.virgin(of, "closure", closure * at) for of in ("stress", "stiffness")])
            for at in (1.0, 1.01, 0.99)
        )
        rises, stiffens = (above - below) / (0.02 * closure)
        pulls = self.pulls[self.law] * (self.damage < 1)  # what is open bears nothing, a bond does
        normal, rises = np.where(d[:, 0] <= 0, [pulls * d[:, 0], pulls], [stress, rises])
        C = np.stack([rises, 0.0 * rises, stiffens * sign * shear, ss], axis=1)
        return np.stack([normal, ss * shear], axis=1), C.reshape(-1, 2, 2)

    def virgin(self, of: str, by: str, x: np.ndarray) -> np.ndarray:
        """A column of the virgin curves, such as "stress", where another one is x (k,)."""
        out = np.empty(self.n)
        for held, rows in zip(self.by_law, self.rows, strict=True):
            out[rows] = np.interp(x[rows], held.curve[by], held.curve[of])
        return out

    @property
    def stiffness(self) -> np.ndarray:
        """Upper bound (k,) of the stiffness at the normal stress of now (Pa/m)."""
        stress = self.traction[:, 0]
        return self.virgin("stiffness", "stress", stress) * ((stress > 0) | (self.damage < 1))

    def renew(self, rows: np.ndarray, work: np.ndarray, most: np.ndarray) -> np.ndarray:
        """Let the joints of rows (m,) start anew, mated or not as they were, without a bond.

        Returns closure (m) and stored energy (J/m2) (2, m) to start with: those at which they hold
        `work` (m,), or at which they are closed by `most` (m,) if that is less.
        """
        out, mated = np.empty((2, len(rows))), ~self.touch[rows].any(axis=1)
        for i, held in enumerate(self.by_law):
            for kind in (True, False):
                mine = (self.law[rows] == i) & (mated == kind)
                if mine.any():
                    curve = held.curve if kind else tabulate_unmated_loading(held.batch.law)
                    anew = np.interp(work[mine], curve["work"], curve["closure"])
                    anew = np.minimum(anew, most[mine])
                    out[:, mine] = anew, np.interp(anew, curve["closure"], curve["work"])
                    held.begin(self.place[rows[mine]], kind, bonded=False)
        self.world.call("read")
        return out

    def snapshot(self) -> dict[str, np.ndarray]:
        """A copy of all state; the laws are numbered, their names may be no names of arrays."""
        arrays = {"touch": self.touch.copy()}
        for i, (held, rows) in enumerate(zip(self.by_law, self.rows, strict=True)):
            state = held.batch.snapshot(self.place[rows])
            fingerprint = np.array(state.fingerprint)
            arrays |= {f"states-{i}": state.values.T, f"fingerprint-{i}": fingerprint}
        return arrays

    def restore(self, state: dict[str, np.ndarray], law: np.ndarray, keys: np.ndarray) -> None:
        """Back to a snapshot, of contacts with these laws and keys. Raises ValueError for
        another's."""
        place, touch = np.zeros(len(law), int), state["touch"]
        for i, held in enumerate(self.by_law):
            rows = np.flatnonzero(law == i)
            values, fingerprint = (state[f"{part}-{i}"] for part in PARTS)
            if len(values.T) != len(rows) or len(touch) != len(law):
                raise ValueError(
                    "the state's joints are not those of the scene's laws and contacts"
                )
            held.grow(len(rows))
            held.batch.restore(JointState(str(fingerprint), values.T))
            held.free, place[rows] = [], np.arange(len(rows))
            held.step.F[:] = held.batch.F
            shares = *held.batch.measures()[:4], held.batch.dissipated_energy, held.batch.damage
            held.step.shown[:] = np.column_stack([*shares, held.batch.delta])
        self.touch, self.keys = touch.copy(), keys
        self._arrange(law, place)
