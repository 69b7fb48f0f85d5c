"""The law's side: one batch of joints per law, one call per law and step.

Law points come and go; each keeps a slot of its law's batch for as long as its interface is in
reach, so history is never given to the wrong joint.
"""

from collections.abc import Callable, Sequence

import numpy as np

import jointlaw as jl

from ..scene import Key
from .law_points import Identity
from .stiffness import StiffnessCurve

MEASURED = ("sliding", "slipping", "separated", "stored", "lost")

BatchState = tuple[jl.JointState, dict[Identity, int], list[int]]  # and slots taken, slots free


class Joints:
    """All joints of a scene. After `assign`, arrays run over the law points given.

    laws: by name; choose: names the law of a key (block, edge, block, edge).
    """

    def __init__(self, laws: dict[str, jl.JointLaw], choose: Callable[[Key], str]) -> None:
        self.laws, self.choose = laws, choose
        self.batches = {name: law.joints(0) for name, law in laws.items()}
        self.curves = {name: StiffnessCurve.of(law) for name, law in laws.items()}
        self._slots: dict[str, dict[Identity, int]] = {name: {} for name in laws}
        self._free: dict[str, list[int]] = {name: [] for name in laws}
        self.assign([])

    def assign(self, points: Sequence[Identity]) -> None:
        """Keep the joints of these law points, forget the others, make new ones virgin."""
        of_law: dict[str, list[int]] = {name: [] for name in self.laws}
        for i, (key, _) in enumerate(points):
            of_law[self.choose(key)].append(i)
        self.groups = []
        for name, rows in of_law.items():
            slots = self._place(name, [points[i] for i in rows])
            size = len(self.batches[name])
            straight = len(slots) == size and (slots == np.arange(size)).all()
            all_points = len(rows) == len(points)
            if rows:
                where = None if straight else slots
                self.groups.append((name, slice(None) if all_points else np.array(rows), where))
        self.n = len(points)
        self.measure()

    def _place(self, name: str, wanted: list[Identity]) -> np.ndarray:
        taken, free, batch = self._slots[name], self._free[name], self.batches[name]
        for gone in set(taken) - set(wanted):
            free.append(taken.pop(gone))
        free.sort(reverse=True)
        for new in (p for p in wanted if p not in taken):
            if not free:
                free.append(len(batch))
                batch.resize(len(batch) + 1)
            taken[new] = free.pop()
            batch.reset(np.array([taken[new]]))
        return np.array([taken[p] for p in wanted], int)

    def increments(self, closure: np.ndarray, sliding: np.ndarray) -> np.ndarray:
        """(k, 2): closure is absolute, from geometry; sliding (m) is what this step added."""
        return np.stack([closure - self.read("delta")[:, 0], sliding], axis=1)

    def update(self, d: np.ndarray, parts: int = 1) -> np.ndarray:
        """Advance every joint by d (k, 2), in equal parts; tractions (k, 2) in Pa.

        The law's friction work is first order in its step: parts sharpen the books in impacts.
        """
        F, d = np.empty((self.n, 2)), d / parts
        for name, rows, where in self.groups:
            for _ in range(parts):
                F[rows] = self.batches[name].update(d[rows], where=where, tangent=False)[0]
        self.measure()
        return F

    def measure(self) -> None:
        """Take the shares and energies of now: sliding, slipping, separated, stored, lost."""
        self.now: dict[str, np.ndarray] = {what: np.zeros(self.n) for what in MEASURED}
        for name, rows, where in self.groups:
            batch = self.batches[name]
            values = [*batch.measures()[:4], batch.dissipated_energy]
            for what, value in zip(MEASURED, values, strict=True):
                self.now[what][rows] = value if where is None else value[where]

    def trial(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tractions (k, 2) and tangents (k, 2, 2) for d, leaving the state alone."""
        F, C = np.empty((self.n, 2)), np.empty((self.n, 2, 2))
        for name, rows, where in self.groups:
            F[rows], C[rows] = self.batches[name].trial(d[rows], where=where, tangent=True)
        return F, C

    def read(self, what: str) -> np.ndarray:
        """A property of all joints with two components: "delta" or "F"."""
        out = np.zeros((self.n, 2))
        for name, rows, where in self.groups:
            value = getattr(self.batches[name], what)
            out[rows] = value if where is None else value[where]
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
        name = self.choose(point[0])
        self.batches[name].reset(np.array([self._slots[name][point]]))
        self.measure()

    def snapshot(self) -> dict[str, BatchState]:
        """A copy of all state, with the slots."""
        return {
            name: (batch.snapshot(), dict(self._slots[name]), list(self._free[name]))
            for name, batch in self.batches.items()
        }

    def restore(self, state: dict[str, BatchState], points: Sequence[Identity]) -> None:
        """Back to a snapshot whose law points were `points`. Raises ValueError for another's."""
        held = {point for _, slots, _ in state.values() for point in slots}
        if set(state) != set(self.batches) or held != set(points):
            raise ValueError("the state's joints are not those of the scene's laws and law points")
        for name, (values, slots, free) in state.items():
            self.batches[name].resize(len(slots) + len(free))
            self.batches[name].restore(values)
            self._slots[name], self._free[name] = dict(slots), list(free)
        self.assign(points)
