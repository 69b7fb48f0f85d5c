"""Joints of contacts: one pool of joints for each law, advanced by one call per law and step.

The law advances joints in batches, and contacts come and go. Each contact therefore holds a place
in the pool of its law for as long as it lasts (`jl.JointPool`), so its history is never given to
another joint. A released place goes to a later contact, whose joint starts as new.

The compiled step writes the displacement increments of all contacts to their places, and reads
tractions and measures from there: arrays of a law run over the places of its pool, arrays of
`Joints` over the contacts.
"""

from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np
from scipy.integrate import cumulative_trapezoid

import jointlaw as jl

from ..compiled import LawJointArrays, StepArrays, address
from ..native.layout import MEASURES
from ..scene import Scene

MAX_STRESS = 2e9  # Pa: end of the tabulated curves, more than any corner of rock bears
MIN_CLOSURE = 1e-9  # m: closure from which the stick predictor takes its derivative
STATE_PARTS = "states", "fingerprint"  # saved for the joints of each law


@lru_cache(maxsize=64)
def tabulate_unmated_loading(law: jl.Law) -> dict[str, np.ndarray]:
    """First loading of a joint whose faces have never met, as columns "closure" and "work".

    Closure since first touch (m), at the closures of the first-loading table of the law, and the
    energy stored up to there (J/m2).
    """
    closure = tabulate_first_loading(law)["closure"]
    batch = law.joints(len(closure), mated=False)
    d = np.zeros((len(closure), law.dim))
    d[:, 0] = closure
    batch.update(d, tangent=False)
    return {"closure": closure, "work": batch.stored_energy}


@lru_cache(maxsize=64)
def tabulate_first_loading(law: jl.Law) -> dict[str, np.ndarray]:
    """First-loading curve of a law from zero closure to `MAX_STRESS`, by columns.

    "closure" in m, normal "stress" in Pa, "work" in J/m2, and "stiffness" in Pa/m, an upper bound.

    At a given normal stress the unsheared joint is the stiffest one, because Phi' is a concave
    function of Phi. The stiffness on this curve therefore bounds sheared joints as well.
    """
    top = float(law.closure(MAX_STRESS))
    closure = np.concatenate([[0.0], np.geomspace(1e-8 * top, top, 600)])
    stress = law.normal_stress(closure)
    return {
        "closure": closure,
        "stress": stress,
        "stiffness": law.first_loading_stiffness(closure),
        "work": cumulative_trapezoid(stress, closure, initial=0.0),
    }


class LawJoints:
    """The joints of one law, at their places in a pool.

    dim: components of a displacement, 2 or 3. pool: `jl.JointPool` of the law; curve: its
    first-loading curve, by columns.
    step: one step of all places: d (places, dim) in m, F (places, dim) in Pa, and `measures`
    (places, 6 + dim), measures and displacements. silent_step: the same without `measures`.
    """

    def __init__(self, law: jl.Law, reduction: float) -> None:
        self.law = law
        self.dim = law.dim
        self.curve = {**tabulate_first_loading(law)}
        self.curve["stiffness"] = law.first_loading_stiffness(self.curve["closure"], reduction)
        self.clear()

    def clear(self) -> None:
        """Start with an empty pool."""
        self.pool = jl.JointPool(self.law)
        self._make_steps(np.zeros((0, self.dim)), np.zeros((0, len(MEASURES) + self.dim)))

    def _make_steps(self, F: np.ndarray, shown: np.ndarray) -> None:
        """Arrays for all places of the pool, the first of them with this content."""
        places = len(self.pool.batch)
        d = np.zeros((places, self.dim))
        all_F = np.zeros((places, self.dim))
        all_shown = np.zeros((places, len(MEASURES) + self.dim))
        all_F[: len(F)] = F
        all_shown[: len(shown)] = shown
        self.step = jl.Step(d, all_F, None, measures=all_shown)
        self.silent_step = jl.Step(d, all_F, None)

    def allocate(self, m: int) -> np.ndarray:
        """Places (m,) for new virgin joints in the pool.

        The pool grows where it is full; then the arrays of steps are made anew and must be bound
        again.
        """
        places = self.pool.allocate(m)
        if len(self.pool.batch) > len(self.step.d):
            self._make_steps(self.step.F, self.step.measures)
        return places

    def release(self, places: np.ndarray) -> None:
        """Give back the places of contacts that have ended."""
        self.pool.release(places)
        self.step.d[places] = 0.0

    def initialise(self, places: np.ndarray, mated: bool, bonded: bool) -> np.ndarray:
        """Let joints start as new at their first touch.

        mated: whether the two faces fit each other; bonded: whether bonds are intact. Returns the
        displacement (dim,) of the law at first touch: closure and sliding (m).
        """
        start = np.zeros(self.dim) if mated else self.law.unmated_start
        batch = self.pool.batch
        batch.reset(places, mated)
        if bonded:
            damage = batch.damage[places]
        else:
            batch.break_bond(places)
            damage = min([1.0, *self.law.tables.damage_rows.values()])
        measures = np.zeros((len(places), self.step.measures.shape[1]))
        measures[:, MEASURES.index("separated")] = 1.0
        measures[:, MEASURES.index("damage")] = damage
        measures[:, len(MEASURES) :] = start
        self.step.F[places] = 0.0
        self.step.measures[places] = measures
        return start

    def copy(self, source: np.ndarray, target: np.ndarray) -> None:
        """Make the joints at places `target` (m,) copies of the joints at `source` (m,)."""
        batch = self.pool.batch
        batch.copy(source, target)
        self.step.F[target] = self.step.F[source]
        self.step.measures[target] = self.step.measures[source]

    def restore(self, state: jl.JointState) -> np.ndarray:
        """Replace all joints of this law by the joints of a snapshot, and their readings.

        Returns the places (n,) of the joints in the pool, in the order of the snapshot.
        """
        self.clear()
        places = self.allocate(len(state))
        batch = self.pool.batch
        batch.restore(state)
        measures = batch.measures()[:4]
        self.step.F[:] = batch.F
        self.step.measures[:] = np.column_stack(
            [*measures, batch.dissipated_energy, batch.damage, batch.delta]
        )
        return places

    def arrays(self) -> LawJointArrays:
        """Addresses of the arrays for the compiled step."""
        stress = self.curve["stress"]
        arrays = self.step.d, self.step.F, self.step.measures, stress, self.curve["stiffness"]
        bears_tension = self.law.tensile_opening > 0.0
        return LawJointArrays(*map(address, arrays), len(stress), bears_tension)


def stick_response(
    d: np.ndarray,
    stress_and_stiffness: Callable[[np.ndarray], np.ndarray],
    tensile_stiffness: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Tractions (k, dim) and tangents (k, dim, dim) of virgin joints that stick.

    d (k, dim) in m: closure and shears. stress_and_stiffness: normal stress (Pa) and stiffness
    bound (Pa/m) of first loading at closures (k,), as (2, k); the shear stiffness is this bound.
    tensile_stiffness (k,) in Pa/m: of intact bonds; without one an open joint bears nothing.
    """
    size = np.maximum(np.abs(d[:, 0]), MIN_CLOSURE)
    sign = np.sign(d[:, 0])
    shears = d[:, 1:]
    stress, shear_stiffness = stress_and_stiffness(size)
    above = stress_and_stiffness(size * 1.01)
    below = stress_and_stiffness(size * 0.99)
    normal_stiffness, stiffening = (above - below) / (0.02 * size)
    is_open = d[:, 0] <= 0
    F = shear_stiffness[:, None] * d
    F[:, 0] = np.where(is_open, tensile_stiffness * d[:, 0], stress)
    C = shear_stiffness[:, None, None] * np.eye(d.shape[1])
    C[:, 0, 0] = np.where(is_open, tensile_stiffness, normal_stiffness)
    C[:, 1:, 0] = (stiffening * sign)[:, None] * shears
    return F, C


def _repetitions(old_row: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the contacts whose row before, `old_row` (k,), another contact has too: all second
    ones, then all third ones and so on, so that no row comes twice in one group."""
    order = np.argsort(old_row, kind="stable")
    order = order[old_row[order] >= 0]
    rows = old_row[order]
    number = np.arange(len(rows)) - np.searchsorted(rows, rows)  # of a contact with its row
    for repetition in range(1, int(number.max(initial=0)) + 1):
        yield np.sort(order[number == repetition])


class Joints:
    """All joints of a scene; arrays run over the k contacts.

    dim: components of a displacement of the laws, 2 in the plane and 3 in space.
    delta (k, dim) in m: closure and sliding since first touch; traction (k, dim) in Pa.
    sliding, slipping, separated (k,): fractions of their shear capacity.
    stored_energy, dissipated_energy (k,) in J/m2; damage (k,): of bonds, 1 without tension.
    law, place (k,): number of the law, and place in its pool. by_law: the joints of each law.

    A strength reduction by a factor F, `scene.reduction`, divides the shear stress of every joint
    and multiplies the sliding at which it acts. Hence tan(friction angle), tan(dilation angle) and
    cohesion are divided by F, while the work is the work of the law, so no energy is created.

    Faces that meet in a run are unmated if the law has a finite mating length. first_touch
    (k, dim): displacement of the law (closure and sliding, m) at which such a joint first touches,
    zero for a mated one. face_pairs (k, 2): the two faces that meet, edges in the plane.
    """

    def __init__(self, scene: Scene) -> None:
        self.law_names = [*scene.laws]
        self.by_law = [LawJoints(law, scene.reduction) for law in scene.laws.values()]
        self.dim = len(scene.gravity)
        for name, law in scene.laws.items():
            if law.dim != self.dim:
                raise ValueError(
                    f"law {name!r} has displacements of {law.dim} components, and the scene has "
                    f"{self.dim}: make it with plane={0.0 if self.dim == 2 else None}"
                )
        self.reduction = np.array([1.0, *[scene.reduction] * (self.dim - 1)])
        self.tensile_stiffness = np.array([law.tensile_stiffness for law in scene.laws.values()])
        self.first_touch = np.zeros((0, self.dim))
        self.face_pairs = np.zeros((0, 2), int)
        self._arrange(np.zeros(0, int), np.zeros(0, int))

    def _arrange(self, law: np.ndarray, place: np.ndarray) -> None:
        """Make the arrays for contacts (k,) with these laws, at these places of their pools."""
        self.n = len(law)
        self.law = law.astype(np.int64)
        self.place = place.astype(np.int64)
        self.rows_by_law = [np.flatnonzero(law == i) for i in range(len(self.by_law))]
        self.traction = np.zeros((self.n, self.dim))
        self.delta = np.zeros((self.n, self.dim))
        self.measures = np.zeros((len(MEASURES), self.n))
        (
            self.sliding,
            self.slipping,
            self.separated,
            self.stored_energy,
            self.dissipated_energy,
            self.damage,
        ) = self.measures  # in the order of MEASURES
        arrays = [joints.arrays() for joints in self.by_law]
        self._law_arrays = (LawJointArrays * len(arrays))(*arrays)
        self.step_arrays = StepArrays(n_contacts=self.n, dim=self.dim)
        self.bind(self.step_arrays)
        self.step_arrays.call("read_joints")

    def bind(self, arrays: StepArrays) -> None:
        """Bind the arrays of the joints to those of a step."""
        arrays.bind(
            self, "law", "place", "first_touch", "reduction", "traction", "delta", "measures",
            laws=self._law_arrays,
        )  # fmt: skip

    def rearrange(
        self, old_row: np.ndarray, law: np.ndarray, face_pairs: np.ndarray, started: bool = False
    ) -> None:
        """Follow a new list of contacts.

        old_row (k,): row of each contact in the list before, -1 for a new one; law (k,);
        face_pairs (k, 2); started: whether the run has started. Before the start, new joints are
        mated and bonded. In a run they have no bond, and are mated only where the same two faces
        still touch in another mated joint, which they continue. Of several contacts with one row
        before, the first keeps the joint and the others get copies of it.
        """
        is_new = old_row < 0
        new_rows = np.flatnonzero(is_new)
        has_ended = ~np.isin(np.arange(self.n), old_row)
        place = np.append(self.place, -1)[old_row]
        first_touch = np.vstack([self.first_touch, np.zeros(self.dim)])[old_row]
        pair_as_number = [1, 1j]
        mated_pairs = self.face_pairs[~self.first_touch.any(axis=1)] @ pair_as_number
        continues = np.isin(face_pairs[new_rows] @ pair_as_number, mated_pairs) | (not started)
        for i, joints in enumerate(self.by_law):
            joints.release(self.place[has_ended & (self.law == i)])
            is_mated = continues | (not joints.law.tables.interlock_decays)
            for mated in (True, False):
                rows = new_rows[(law[new_rows] == i) & (is_mated == mated)]
                if len(rows):
                    place[rows] = joints.allocate(len(rows))
                    first_touch[rows] = joints.initialise(place[rows], mated, bonded=not started)
        for repeats in _repetitions(old_row):
            for i, joints in enumerate(self.by_law):
                rows = repeats[law[repeats] == i]
                if len(rows):
                    sources = place[rows]
                    place[rows] = joints.allocate(len(rows))
                    joints.copy(sources, place[rows])
        self.first_touch = first_touch
        self.face_pairs = face_pairs
        self._arrange(law, place)

    def update(self, closure: np.ndarray, shears: np.ndarray) -> None:
        """Advance all joints to a closure (k,) and by shears (k, dim - 1), both in m.

        They take one increment of their laws, which changes their states and readings.
        """
        d = np.column_stack([closure - self.delta[:, 0], shears]) / self.reduction
        for joints, rows in zip(self.by_law, self.rows_by_law, strict=True):
            joints.step.d[self.place[rows]] = d[rows]
        self.advance(1)
        self.step_arrays.call("read_joints")

    def advance(self, law_steps: int) -> None:
        """Advance the joints of all laws `law_steps` times by the increments of their steps.

        The friction work of the law is first-order accurate in its step: more steps improve the
        energy balance.
        """
        for joints, rows in zip(self.by_law, self.rows_by_law, strict=True):
            if len(rows):
                for step in [joints.silent_step] * (law_steps - 1) + [joints.step]:
                    joints.pool.batch.advance(step)

    def trial(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Trial step by increments d (k, dim) in m; the state of the joints is unchanged.

        Returns tractions (k, dim) in Pa, tangents (k, dim, dim) in Pa/m, stored energies (k,) in
        J/m2.
        """
        dim = self.dim
        F = np.empty((self.n, dim))
        C = np.empty((self.n, dim, dim))
        stored_energy = np.empty(self.n)
        for joints, rows in zip(self.by_law, self.rows_by_law, strict=True):
            m = len(rows)
            step = jl.Step(
                d[rows] / self.reduction,
                np.empty((m, dim)),
                np.empty((m, dim, dim)),
                where=self.place[rows],
                commit=False,
                measures=np.empty((m, len(MEASURES) + dim)),
            )
            joints.pool.batch.advance(step)
            F[rows] = step.F
            C[rows] = step.C
            stored_energy[rows] = step.measures[:, MEASURES.index("stored_energy")]
        return F / self.reduction, C / np.outer(self.reduction, self.reduction), stored_energy

    def stick_predictor(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Tractions (k, dim), tangents (k, dim, dim) of virgin joints that stick, at d (k, dim)."""
        pulling = self.tensile_stiffness[self.law] * (self.damage < 1)
        return stick_response(d, self._stress_and_stiffness, pulling)

    def _stress_and_stiffness(self, closure: np.ndarray) -> np.ndarray:
        """Normal stress (Pa) and stiffness bound (Pa/m) at first loading, (2, k)."""
        return np.array(
            [self.interpolate(column, "closure", closure) for column in ("stress", "stiffness")]
        )

    def interpolate(self, column: str, by: str, x: np.ndarray) -> np.ndarray:
        """A column of the first-loading curves, such as "stress", where column `by` is x (k,)."""
        out = np.empty(self.n)
        for joints, rows in zip(self.by_law, self.rows_by_law, strict=True):
            out[rows] = np.interp(x[rows], joints.curve[by], joints.curve[column])
        return out

    @property
    def stiffness(self) -> np.ndarray:
        """Upper bound (k,) in Pa/m of the stiffness of each joint at its present normal stress.

        From the first-loading curve of its law. Zero for a joint that bears no compression and
        whose bond is broken.
        """
        stress = self.traction[:, 0]
        bears_load = (stress > 0) | (self.damage < 1)
        return self.interpolate("stiffness", "stress", stress) * bears_load

    def restart(self, rows: np.ndarray, energy: np.ndarray, max_closure: np.ndarray) -> np.ndarray:
        """Let the joints of rows (m,) start as new, mated or not as before, without a bond.

        energy (m,) in J/m2: stored energy to start with; max_closure (m,) in m: limit of the
        closure. Returns closure (m) and stored energy (J/m2) to start with, (2, m): the closure
        that stores `energy`, or `max_closure` if that is smaller.
        """
        out = np.empty((2, len(rows)))
        is_mated = ~self.first_touch[rows].any(axis=1)
        for i, joints in enumerate(self.by_law):
            for mated in (True, False):
                mine = (self.law[rows] == i) & (is_mated == mated)
                if mine.any():
                    curve = joints.curve if mated else tabulate_unmated_loading(joints.law)
                    closure = np.interp(energy[mine], curve["work"], curve["closure"])
                    closure = np.minimum(closure, max_closure[mine])
                    out[:, mine] = closure, np.interp(closure, curve["closure"], curve["work"])
                    joints.initialise(self.place[rows[mine]], mated, bonded=False)
        self.step_arrays.call("read_joints_of", len(rows), address(rows))
        return out

    def continue_joints(self, rows: np.ndarray, sources: np.ndarray) -> bool:
        """Let the joints of contacts `rows` (m,) continue the joints of contacts `sources` (m,).

        They become copies with the same law and history. No contact is among both.

        Returns whether arrays were made anew, which must be bound again: where a law changes.
        """
        law = self.law[sources]
        changed = np.flatnonzero(self.law[rows] != law).tolist()
        for i in changed:
            row = int(rows[i])
            new_law = int(law[i])
            self.by_law[self.law[row]].release(self.place[[row]])
            self.law[row] = new_law
            self.place[row] = self.by_law[new_law].allocate(1)[0]
        new_places = self.place[rows]
        old_places = self.place[sources]
        for i in set(law.tolist()):
            has_law = law == i
            batch = self.by_law[i].pool.batch
            batch.copy(old_places[has_law], new_places[has_law])
        if changed:
            self._arrange(self.law, self.place)
        self.step_arrays.call("continue_joints", len(rows), address(rows), address(sources))
        return bool(changed)

    def snapshot(self) -> dict[str, np.ndarray]:
        """A copy of all state, by names of arrays. Laws are numbered in them."""
        arrays = {"first_touch": self.first_touch.copy()}
        for i, (joints, rows) in enumerate(zip(self.by_law, self.rows_by_law, strict=True)):
            state = joints.pool.batch.snapshot(self.place[rows])
            arrays[f"states-{i}"] = state.values.T
            arrays[f"fingerprint-{i}"] = np.array(state.fingerprint)
        return arrays

    def restore(
        self, state: dict[str, np.ndarray], law: np.ndarray, face_pairs: np.ndarray
    ) -> None:
        """Return to a snapshot of contacts with these laws (k,) and faces (k, 2).

        Raises ValueError for a snapshot of other contacts or laws.
        """
        place = np.zeros(len(law), int)
        first_touch = state["first_touch"]
        for i, joints in enumerate(self.by_law):
            rows = np.flatnonzero(law == i)
            values, fingerprint = (state[f"{part}-{i}"] for part in STATE_PARTS)
            if len(values.T) != len(rows) or len(first_touch) != len(law):
                raise ValueError(
                    "the state's joints are not those of the scene's laws and contacts"
                )
            place[rows] = joints.restore(jl.JointState(str(fingerprint), values.T))
        self.first_touch = first_touch.copy()
        self.face_pairs = face_pairs
        self._arrange(law, place)
