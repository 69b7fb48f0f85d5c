"""Joints with memory, a batch of them advanced together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..kernels.element import Measures
from ..kernels.engine import LANES, Step, at, blocks, engine
from ..support.checks import Array, finite, integer, numbers
from .state import JointState, NonFiniteError

Index = Sequence[int] | NDArray[np.integer[Any]] | NDArray[np.bool_]
Result = tuple[Array, Array | None]
COMPONENTS = {  # what the 1, 2 or 3 components of a displacement are
    1: "closure; for shear take a law without closure_only",
    2: "closure and shear along the plane; for motion in 3-D take a law with plane=None",
    3: "closure and shear along axes 2 and 3",
}
FEW = 8  # numbers: the largest of so few is found faster by Python than by numpy


class JointBatch:
    """n joints of one law. Arrays over joints: displacements (n, dim) in m, tractions (n, dim) in
    Pa; dim is 3 (closure, shear along axes 2 and 3), 2 for a law with a plane, or 1 for a law with
    closure_only.

    The traction is the joint's resistance in the sense of the displacement: the force on the body
    that moves by +d is -area * F. Without `ledger` no dissipated energy is added up, which is
    faster with the compiled kernel.

    >>> joints = law.joints(1000)
    >>> F, _ = joints.update(np.full((1000, 3), 1e-9), tangent=False)
    """

    # law: of the class jointlaw.laws.law.Law, which lies above this file
    def __init__(self, law: Any, n: int, ledger: bool = True) -> None:
        self.law, self.ledger = law, ledger
        self._engine = engine(law.tables)
        self._n = integer("n", n, 0)
        self._state = blocks(self._n, self._engine.rows, 1 if self._n == 1 else LANES)
        self._largest_reach = 0.0  # bound of |y| of all facets of all joints
        # a step changes the y of a facet by no more than this times its largest component
        self._steepness = law.tables.stretch

    def __getstate__(self) -> dict[str, Any]:
        return {"law": self.law, "ledger": self.ledger, "states": self.snapshot()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        JointBatch.__init__(self, state["law"], len(state["states"]), state["ledger"])
        self.restore(state["states"])

    def __len__(self) -> int:
        return self._n

    # ------------------------------------------------------------------ steps

    def update(self, d: ArrayLike, where: Index | None = None, tangent: bool = True) -> Result:
        """Advance by the displacement increments d and keep the new state.

        d: (n, dim) in m; with `where`, an index or mask of m joints, (m, dim).
        Returns F (n or m, dim) in Pa and C = dF/dd (n or m, dim, dim) in Pa/m, None without
        `tangent`. Raises ValueError for a wrong shape, index or a non-finite increment, and
        NonFiniteError when the result would overflow; the state is then as it was.
        """
        return self._step(d, where, tangent, keep=True)

    def trial(self, d: ArrayLike, where: Index | None = None, tangent: bool = True) -> Result:
        """As `update` of d, where, tangent, but the state is left untouched. Raises the same."""
        return self._step(d, where, tangent, keep=False)

    def _step(self, d: ArrayLike, where: Index | None, tangent: bool, keep: bool) -> Result:
        index = None if where is None else self._index(where)
        m, dim = self._n if index is None else len(index), self.law.dim
        values = increments(d, (m, dim))
        F, C = np.empty((m, dim)), np.empty((m, dim, dim)) if tangent else None
        self.take(Step(np.ascontiguousarray(values), F, C, index, keep))
        return F, C

    def take(self, step: Step) -> None:
        """Take a step whose arrays have the right shapes: check its numbers, then the kernel.

        Raises as `update`.
        """
        reach = self._reach_after(step)
        self._engine.advance(self._state, step, self.ledger)
        if step.keep:
            self._largest_reach = reach

    # ------------------------------------------------------------------ state

    def snapshot(self, where: Index | None = None) -> JointState:
        """A copy of the state of all joints, or of those that `where` names, in that order.

        Raises ValueError for a wrong index.
        """
        index = None if where is None else self._index(where)
        return JointState(self.law.fingerprint, self._rows(index))

    def restore(self, state: JointState, where: Index | None = None) -> None:
        """Return to a snapshot; with `where` these joints take its states, the others stay.

        So joints move between batches: `other.restore(batch.snapshot(where), places)`. Raises
        ValueError if another law wrote the state or it holds another number of joints.
        """
        index = None if where is None else self._index(where)
        if not isinstance(state, JointState):
            raise ValueError(f"state = {state!r} is not a snapshot; give one of snapshot()")
        state.require(self.law.fingerprint)
        n, rows = self._n if index is None else len(index), self.law.state_size
        if state.values.shape != (n, rows):
            raise ValueError(
                f"state holds {len(state)} joints, for {n} of the batch: resize it, or "
                "name as many by where"
            )
        if not np.isfinite(state.values).all():
            raise ValueError("state holds values that are not finite; it is damaged")
        values = state.values
        if index is None:
            lanes = self._state.shape[2]
            whole = n // lanes * lanes  # joints of blocks that are full
            blocks = values[:whole].reshape(-1, lanes, rows)
            self._state[: len(blocks), :rows] = np.moveaxis(blocks, 1, 2)
            index, values = np.arange(whole, n), values[whole:]
        self._state[at(self._state, index, slice(rows))] = values
        self._engine.refresh(self._state, self._n)
        self._largest_reach = self._reach_of(self.delta).max(initial=0.0)

    def reset(self, index: Index | None = None, mated: bool = True) -> None:
        """Return the joints at `index` (all if None) to their start: new contacts.

        If `mated` to the virgin state, else to the start of faces that have never met, as
        `JointLaw.joint` has it. Raises ValueError for a wrong index, or a law that is always mated.
        """
        start = 0.0 if mated else self.law.tables.unmated_start
        which = np.arange(self._n) if index is None else self._index(index)
        self._state[at(self._state, which)] = 0.0
        self._state[at(self._state, which, slice(self.law.dim))] = start
        far = self._steepness * float(np.max(np.abs(start)))
        self._largest_reach = max(self._largest_reach, far)
        if not mated:
            self.unbond(which)

    def unbond(self, index: Index) -> None:
        """Break bond or cohesion of the joints at `index`: faces that meet anew have none.

        Raises ValueError for a wrong index, if the law has any.
        """
        if (row := self.law.tables.first.get("damage")) is not None:
            parted = max(element.parted for element in self.law.tables.elements)
            self._state[at(self._state, self._index(index), row)] = parted

    def resize(self, n: int) -> None:
        """Change the number of joints to n; joints beyond the old number are new and mated.

        Raises ValueError where n is no whole number >= 0.
        """
        n = integer("n", n, 0)
        held, rows, lanes = self._state.shape
        if n < self._n:
            self.reset(np.arange(n, self._n))
        elif n > held * lanes:  # grow by doubling, so that steady growth copies rarely
            grown, old = blocks(max(n, 2 * held * LANES), rows), np.arange(self._n)
            grown[at(grown, old)] = self._state[at(self._state, old)]
            self._state = grown
        self._n = n

    # ---------------------------------------------------------- what they show

    def measures(self) -> Measures:
        """Shares, stored energy and reach of all joints in one pass, as arrays (n,)."""
        values = self._engine.of_states("measures", self._state, self._n)
        return Measures(*np.array(values.T, order="C"))

    @property
    def kernel(self) -> str:
        """Which kernel advances these joints: "native" or "numpy"."""
        return self._engine.name

    @property
    def bytes_per_joint(self) -> int:
        """Memory that the state of one joint of a large batch takes."""
        return 8 * self._engine.rows

    def max_stiffness(self) -> Array:
        """Upper bound (n,) of `|C|` in Pa/m at each joint's present displacement."""
        return self._engine.of_states("stiffness", self._state, self._n)

    def critical_time_step(self, mass: ArrayLike, area: ArrayLike) -> Array:
        """Largest stable explicit step (n,) in s of one translating mass on each joint as it is.

        mass: reduced mass m1 m2/(m1 + m2) in kg; area: in m2; numbers or (n,). Infinite where
        nothing touches. Joints that close or shear further grow stiffer: ask again, or take a
        margin. As for `JointLaw.critical_time_step`, rotation is not counted. Raises ValueError for
        other shapes or numbers that are not > 0.
        """
        for name, given in (("mass", mass), ("area", area)):
            if (shape := np.shape(given)) not in ((), (self._n,)):
                raise ValueError(f"{name} has shape {shape}: give a number or ({self._n},)")
        return stable_step(mass, area, self.max_stiffness())

    @property
    def delta(self) -> Array:
        """Displacement from the mated position (n, dim): closure and shear, in m."""
        return self._all(slice(self.law.dim))

    @property
    def F(self) -> Array:
        """Traction (n, dim) in Pa."""
        return self._engine.of_states("traction", self._state, self._n)

    @property
    def stored_energy(self) -> Array:
        """Elastic energy (n,) in J/m2."""
        return self.measures().stored

    @property
    def dissipated_energy(self) -> Array:
        """Energy (n,) in J/m2 lost since the virgin state, to friction and to yielding asperities;
        never decreases."""
        return self._ledger("dissipated_energy", "dissipated")

    @property
    def plastic_work(self) -> Array:
        """The part (n,) of the dissipated energy, in J/m2, that yielding asperities took."""
        return self._ledger("plastic_work", "plastic")

    @property
    def slopes(self) -> Array:
        """Share (n,) of the slopes of the asperities that has not been worn away."""
        return 1.0 - self._part("worn")

    @property
    def damage(self) -> Array:
        """Damage (n,) of bond or cohesion: 0 whole, 1 broken, and 1 where the law has none."""
        return np.minimum(self._part("damage", absent=1.0), 1.0)

    # --------------------------------------------------------------- internals

    def _part(self, name: str, absent: float = 0.0) -> Array:
        """A row of the states of all joints, by its name; `absent` where the law has none."""
        row = self.law.tables.first.get(name)
        return np.full(self._n, absent) if row is None else self._all(row)

    def _all(self, rows: Any) -> Array:
        """Rows of the states of all joints, as a copy (n,) or (n, rows): three times as fast as by
        a list of joints."""
        kept = np.moveaxis(self._state[:, rows], -1, 1)
        return np.array(kept, order="C").reshape(-1, *kept.shape[2:])[: self._n]

    def _ledger(self, name: str, part: str) -> Array:
        """A part of the ledger, if it is kept."""
        if not self.ledger:
            raise AttributeError(f"{name} is not added up: make the joints with ledger=True")
        return self._part(part)

    def _rows(self, index: NDArray[np.intp] | None = None) -> Array:
        """States (n, rows) of all joints or those of `index`, as a copy."""
        rows = slice(self.law.state_size)
        return self._all(rows) if index is None else self._state[at(self._state, index, rows)]

    def _index(self, where: Index) -> NDArray[np.intp]:
        index = np.asarray(where)
        if index.dtype == bool:
            if index.shape != (self._n,):
                raise ValueError(f"where has shape {index.shape}; a mask needs ({self._n},)")
            return np.flatnonzero(index)
        if index.size == 0:
            return np.empty(0, np.intp)
        if index.ndim != 1 or not np.issubdtype(index.dtype, np.integer):
            raise ValueError("where must be a one-dimensional array of joint numbers or a mask")
        low, high = int(index.min()), int(index.max())
        if low < 0 or high >= self._n:
            wrong = low if low < 0 else high
            raise ValueError(f"where names joint {wrong}; joints are 0 to {self._n - 1}")
        if len(index) > 1 and np.bincount(index, minlength=1).max() > 1:
            raise ValueError("where names a joint twice; each joint takes one increment per step")
        return index.astype(np.intp)

    def _reach_after(self, step: Step) -> float:
        """Bound of |y| after a step; raises if it is not finite, or its forces would overflow.

        One pass over d gives a bound for the whole batch; only where that is too large is each
        joint looked at.
        """
        d, limit = step.d, self.law.largest_reach
        if d.size <= FEW:  # the sum of sizes is a bound too; it is NaN if one number is
            largest = sum(map(abs, d.ravel().tolist()))
        else:
            largest = max(float(d.max()), -float(d.min()))  # NaN if one number is
        reach = self._largest_reach + self._steepness * largest
        return reach if reach <= limit else self._reach_by_joint(step, limit)

    def _reach_by_joint(self, step: Step, limit: float) -> float:
        """As `_reach_after`, joint by joint."""
        d, index = step.d, step.where
        old = self.delta if index is None else self.delta[index]
        with np.errstate(over="ignore"):
            new = self._reach_of(old) + self._steepness * np.abs(d).max(axis=1)
        if not (new <= limit).all():
            row = int(np.argmin(new <= limit))
            joint = row if index is None else int(index[row])
            if not np.isfinite(d[row]).all():
                raise ValueError(f"d of joint {joint} = {d[row]} is not finite; nothing was moved")
            error = NonFiniteError(
                f"joint {joint}: the step d = {d[row]} m gives a result that is not finite; "
                "nothing was moved. Take a smaller step (state and d of this error repeat it)"
            )
            error.joint, error.d = joint, d[row].copy()
            error.state = JointState(self.law.fingerprint, self._rows(index)[[row]])
            raise error
        rest = self._reach_of(self.delta).max(initial=0.0)
        return max(float(rest), float(new.max(initial=0.0)))

    def _reach_of(self, delta: Array) -> Array:
        """Bound (n,) of |y| of all facets of joints at delta (n, dim)."""
        return self._steepness * np.abs(delta).max(axis=1)


def increments(d: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Increments of this shape, (dim,) or (joints, dim), in m."""
    values = numbers("d", d, "m")
    if values.shape != shape:
        joints = "joints, " if len(shape) == 2 else ""
        raise ValueError(
            f"d has shape {values.shape}; expected {shape}: {joints}{COMPONENTS[shape[-1]]}"
        )
    return values


def stable_step(mass: ArrayLike, area: ArrayLike, stiffness: Array) -> Array:
    """2 sqrt(m/(K area)) in s, infinite where nothing touches.

    mass: reduced mass in kg, > 0; area: in m2, > 0; stiffness: K in Pa/m.
    """
    m, a = finite("mass", mass, "kg"), finite("area", area, "m2")
    if not ((m > 0).all() and (a > 0).all()):
        raise ValueError(f"mass = {m} kg, area = {a} m2 are out of bounds: both must be > 0")
    with np.errstate(divide="ignore"):
        return 2 * np.sqrt(m / (stiffness * a))
