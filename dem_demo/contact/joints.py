"""The law's side: one batch of joints per law, one call per law and step.

Contacts come and go; each keeps its joint in the pool of its law for as long as its interface is in
reach, so history is never given to the wrong joint.
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from scipy.integrate import cumulative_trapezoid

import jointlaw as jl
from jointlaw.joints.state import JointState

from ..scene import Scene, is_coulomb
from .tracker import Identity

PARTS = "contacts", "law", "fingerprint", "touch"  # of a snapshot of the joints of a law


@lru_cache(maxsize=64)
def unmated_curve(law: jl.JointLaw) -> dict[str, np.ndarray]:
    """Closure from first touch (m) and work (J/m2) of a joint whose faces have never met."""
    closure = virgin_curve(law)["closure"]
    batch = jl.JointBatch(law, len(closure))
    batch.reset(mated=False)
    batch.update(np.stack([closure, 0.0 * closure], axis=1), tangent=False)
    return {"closure": closure, "work": batch.stored_energy}


@lru_cache(maxsize=64)
def virgin_curve(law: jl.JointLaw) -> dict[str, np.ndarray]:
    """Closure (m), stress (Pa) and work (J/m2) of a virgin joint from no closure to 2 GPa, more
    than any corner of rock stands, and an upper bound of its stiffness (Pa/m) there.

    At a given normal stress the unsheared joint is the stiffest one (Phi' is a concave function of
    Phi), so the virgin curve bounds the sheared joint as well.
    """
    top = float(law.closure(2e9))
    closure = np.concatenate([[0.0], np.geomspace(1e-8 * top, top, 600)])
    stress = law.normal_stress(closure)
    work = cumulative_trapezoid(stress, closure, initial=0.0)
    stiffness = law.max_stiffness(closure)
    if is_coulomb(law):
        # The law's bound adds mu for the coupling of shear to closure. That of level asperities has
        # no eigenvalue of its own: (kn, 0; mu kn, 0) has kn and 0. K is ks, lam K is kn.
        p = law.asperity
        stiffness = np.full(len(closure), max(1.0, p.lam) * p.K * law.asperity_density)
        stiffness += 0.0 if law.bond is None else law.bond.largest_stiffness
    return {"closure": closure, "stress": stress, "stiffness": stiffness, "work": work}


class Joints:
    """All joints of a scene. After `assign`, arrays run over the k contacts given.

    delta (k, 2) in m: closure and sliding; traction (k, 2) in Pa; sliding, slipping, separated
    (k,): shares of their shear capacity; stored, lost (k,) in J/m2; damage (k,) of their bonds, 1
    where there is none.

    The scene's `reduction` F divides the shear stress of every joint and multiplies the sliding at
    which it has it. So tan(friction angle), tan(dilation angle) and cohesion are divided by F, and
    the work is that of the law: no energy is made.

    Faces that meet in a run are unmated where the law fades. `touch` holds, by contact, where its
    joint first touches (closure and sliding in m, zeros for a mated one); delta counts from there.
    """

    def __init__(self, scene: Scene) -> None:
        self.choose, self.reduction = scene.law_of, np.array([1.0, scene.reduction])
        self.pools = {name: jl.JointPool(law) for name, law in scene.laws.items()}
        self.curves = {name: {**virgin_curve(law)} for name, law in scene.laws.items()}
        for curve in self.curves.values():
            curve["stiffness"] = curve["stiffness"] * max(1.0, scene.reduction**-2)
        self.touch: dict[Identity, np.ndarray] = {}
        self.assign([])

    def assign(self, contacts: Sequence[Identity], started: bool = False) -> None:
        """Keep the joints of these contacts, forget the others, make new ones virgin.

        started: whether the run has started. Then new ones have no bond, and are mated only where
        their two faces still touch in a mated joint, which they then continue.
        """
        fit = {key for (key, _), touch in self.touch.items() if not touch.any()}
        held, self.touch = self.touch, {}
        for who in contacts:
            self.touch[who] = held.get(who, np.zeros(2))
        of_law: dict[str, list[int]] = {name: [] for name in self.pools}
        for i, (key, _) in enumerate(contacts):
            of_law[self.choose(key)].append(i)
        self.groups = []
        for name, rows in of_law.items():
            pool = self.pools[name]
            places = pool.assign(contacts[i] for i in rows)
            for i, place in zip(rows if started else [], places, strict=started):
                if contacts[i] not in held:
                    mated = contacts[i][0] in fit or not pool.batch.law.tables.fades
                    self.touch[contacts[i]] = self._begin(pool, place, mated)
            if rows:
                whole = np.array_equal(places, np.arange(len(pool.batch)))
                self.groups.append((name, np.array(rows), None if whole else places))
        self.n, self.contacts = len(contacts), contacts
        self.traction = np.zeros((self.n, 2))
        for name, rows, places in self.groups:
            F = self.pools[name].batch.F[... if places is None else places]
            self.traction[rows] = F / self.reduction
        self.measure()

    def update(self, closure: np.ndarray, sliding: np.ndarray, parts: int = 1) -> None:
        """Advance every joint to a closure (m), and by a sliding (m), in equal parts.

        The law's friction work is first order in its step: more parts balance energy better.
        """
        d = np.stack([closure - self.delta[:, 0], sliding], axis=1) / (parts * self.reduction)
        for name, rows, places in self.groups:
            for _ in range(parts):
                F, _ = self.pools[name].batch.update(d[rows], where=places, tangent=False)
            self.traction[rows] = F / self.reduction
        self.measure()

    def trial(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tractions (k, 2) and tangents (k, 2, 2) for d, leaving the state alone."""
        F, C, by = np.empty((self.n, 2)), np.empty((self.n, 2, 2)), self.reduction
        for name, rows, places in self.groups:
            F[rows], C[rows] = self.pools[name].batch.trial(d[rows] / by, where=places)
        return F / by, C / np.outer(by, by)

    def measure(self) -> None:
        """Read what the batches hold by now."""
        self.delta = np.zeros((self.n, 2))
        shares, touch = np.zeros((6, self.n)), np.array([*self.touch.values()]).reshape(-1, 2)
        for name, rows, places in self.groups:
            batch, here = self.pools[name].batch, slice(None) if places is None else places
            self.delta[rows] = (batch.delta[here] - touch[rows]) * self.reduction
            columns = *batch.measures()[:4], batch.dissipated_energy, batch.damage
            shares[:, rows] = np.array(columns)[:, here]
        self.sliding, self.slipping, self.separated, self.stored, self.lost, self.damage = shares

    def virgin(self, of: str, by: str, x: np.ndarray) -> np.ndarray:
        """A column of the virgin curves, such as "stress", where another one is x (k,)."""
        out = np.empty(self.n)
        for name, rows, _ in self.groups:
            out[rows] = np.interp(x[rows], self.curves[name][by], self.curves[name][of])
        return out

    @property
    def stiffness(self) -> np.ndarray:
        """Upper bound (k,) of the stiffness at the normal stress of now (Pa/m)."""
        stress = self.traction[:, 0]
        return self.virgin("stiffness", "stress", stress) * ((stress > 0) | (self.damage < 1))

    def renew(self, rows: np.ndarray, work: np.ndarray, most: np.ndarray) -> np.ndarray:
        """Let joints (m,) start anew, mated or not as they were, without a bond.

        Returns closure (m) and stored energy (J/m2) (2, m) to start with: those at which they hold
        `work` (m,), or at which they are closed by `most` (k,) if that is less.
        """
        out = np.empty((2, len(rows)))
        for i, (row, held) in enumerate(zip(rows.tolist(), work.tolist(), strict=True)):
            who = self.contacts[row]
            name, mated = self.choose(who[0]), not self.touch[who].any()
            law = self.pools[name].batch.law
            curve = self.curves[name] if mated else unmated_curve(law)
            anew = min(np.interp(held, curve["work"], curve["closure"]), most[row])
            out[:, i] = anew, np.interp(anew, curve["closure"], curve["work"])
            self._begin(self.pools[name], self.pools[name].add([who])[0], mated)
        self.delta[rows] = self.stored[rows] = 0.0  # what a new joint holds
        return out

    def _begin(self, pool: jl.JointPool, place: int, mated: bool) -> np.ndarray:
        """Reset a joint, without a bond; closure and sliding (2,) in m where it first touches."""
        pool.batch.reset([place], mated)
        pool.batch.unbond([place])
        return pool.batch.delta[place].copy()

    def snapshot(self) -> dict[str, np.ndarray]:
        """A copy of all state; the laws are numbered, their names may be no names of arrays."""
        arrays = {}
        for i, pool in enumerate(self.pools.values()):
            state, contacts = pool.snapshot(), [[*key, number] for key, number in pool.keys]
            touch = np.array([self.touch[who] for who in pool.keys]).reshape(-1, 2)
            parts = np.array(contacts, int), state.values.T, np.array(state.fingerprint), touch
            arrays |= {f"{part}-{i}": array for part, array in zip(PARTS, parts, strict=True)}
        return arrays

    def restore(self, state: dict[str, np.ndarray], contacts: Sequence[Identity]) -> None:
        """Back to a snapshot whose contacts were these. Raises ValueError for another's."""
        held = []
        for i in range(len(self.pools)):
            rows, values, fingerprint, touch = (state[f"{part}-{i}"] for part in PARTS)
            keys = [(tuple(key), number) for *key, number in rows.tolist()]
            held.append((keys, JointState(str(fingerprint), values.T), touch))
        if {contact for keys, *_ in held for contact in keys} != set(contacts):
            raise ValueError("the state's joints are not those of the scene's laws and contacts")
        for pool, (keys, joints, touch) in zip(self.pools.values(), held, strict=True):
            pool.restore(keys, joints)
            self.touch |= dict(zip(keys, touch, strict=True))
        self.assign(contacts)
