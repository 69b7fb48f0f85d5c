"""The law's side: one batch of joints per law, one call per law and step.

Law points come and go; each keeps its joint in the pool of its law for as long as its interface
is in reach, so history is never given to the wrong joint.
"""

from collections.abc import Callable, Sequence

import numpy as np

import jointlaw as jl
from jointlaw.joints.state import JointState

from ..scene import Key
from .law_points import Identity
from .stiffness import StiffnessCurve

MEASURED = ("sliding", "slipping", "separated", "stored", "lost")

PoolState = tuple[list[Identity], JointState]  # law points, and their joints in that order


class Joints:
    """All joints of a scene. After `assign`, arrays run over the law points given.

    laws: by name; choose: names the law of a key (block, edge, block, edge).
    """

    def __init__(self, laws: dict[str, jl.JointLaw], choose: Callable[[Key], str]) -> None:
        self.laws, self.choose = laws, choose
        self.pools = {name: jl.JointPool(law) for name, law in laws.items()}
        self.curves = {name: StiffnessCurve.of(law) for name, law in laws.items()}
        self.assign([])

    def assign(self, points: Sequence[Identity]) -> None:
        """Keep the joints of these law points, forget the others, make new ones virgin."""
        of_law: dict[str, list[int]] = {name: [] for name in self.laws}
        for i, (key, _) in enumerate(points):
            of_law[self.choose(key)].append(i)
        self.groups = []
        for name, rows in of_law.items():
            pool = self.pools[name]
            places = pool.assign(points[i] for i in rows)
            if rows:
                whole = np.array_equal(places, np.arange(len(pool.batch)))
                self.groups.append((name, np.array(rows), None if whole else places))
        self.n = len(points)
        self.measure()

    def increments(self, closure: np.ndarray, sliding: np.ndarray) -> np.ndarray:
        """(k, 2): closure is absolute, from geometry; sliding (m) is what this step added."""
        return np.stack([closure - self.read("delta")[:, 0], sliding], axis=1)

    def update(self, d: np.ndarray, parts: int = 1) -> np.ndarray:
        """Advance every joint by d (k, 2), in equal parts; tractions (k, 2) in Pa.

        The law's friction work is first order in its step: more parts balance energy better.
        """
        F, d = np.empty((self.n, 2)), d / parts
        for name, rows, places in self.groups:
            for _ in range(parts):
                F[rows] = self.pools[name].batch.update(d[rows], where=places, tangent=False)[0]
        self.measure()
        return F

    def measure(self) -> None:
        """Take the shares and energies of now: sliding, slipping, separated, stored, lost."""
        self.now: dict[str, np.ndarray] = {what: np.zeros(self.n) for what in MEASURED}
        for name, rows, places in self.groups:
            batch = self.pools[name].batch
            values = [*batch.measures()[:4], batch.dissipated_energy]
            for what, value in zip(MEASURED, values, strict=True):
                self.now[what][rows] = value if places is None else value[places]

    def trial(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tractions (k, 2) and tangents (k, 2, 2) for d, leaving the state alone."""
        F, C = np.empty((self.n, 2)), np.empty((self.n, 2, 2))
        for name, rows, places in self.groups:
            F[rows], C[rows] = self.pools[name].batch.trial(d[rows], where=places)
        return F, C

    def read(self, what: str) -> np.ndarray:
        """A property of all joints with two components: "delta" or "F"."""
        out = np.zeros((self.n, 2))
        for name, rows, places in self.groups:
            value = getattr(self.pools[name].batch, what)
            out[rows] = value if places is None else value[places]
        return out

    def virgin(
        self, of: Callable[[StiffnessCurve, np.ndarray], np.ndarray], x: np.ndarray
    ) -> np.ndarray:
        """A function of the virgin curves, such as `StiffnessCurve.at_stress`, for each joint."""
        out = np.empty(self.n)
        for name, rows, _ in self.groups:
            out[rows] = of(self.curves[name], x[rows])
        return out

    def curve(self, point: Identity) -> StiffnessCurve:
        """The virgin curve of a law point's joint."""
        return self.curves[self.choose(point[0])]

    def renew(self, point: Identity) -> None:
        """Make the joint of a law point virgin again."""
        pool = self.pools[self.choose(point[0])]
        pool.batch.reset(pool.add([point]))
        self.measure()

    def snapshot(self) -> dict[str, PoolState]:
        """A copy of all state, by law."""
        return {name: (pool.keys, pool.snapshot()) for name, pool in self.pools.items()}

    def restore(self, state: dict[str, PoolState], points: Sequence[Identity]) -> None:
        """Back to a snapshot whose law points were `points`. Raises ValueError for another's."""
        held = {point for keys, _ in state.values() for point in keys}
        if set(state) != set(self.pools) or held != set(points):
            raise ValueError("the state's joints are not those of the scene's laws and law points")
        for name, (keys, joints) in state.items():
            self.pools[name].restore(keys, joints)
        self.assign(points)
