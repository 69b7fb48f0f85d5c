"""Joints with memory, a batch of them advanced together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..discretisation.tables import Tables
from ..kernels import reference, wear
from ..kernels.blocks import LANES, empty_blocks, rows_of, write_rows, zeros
from ..kernels.engine import Step, engine
from ..kernels.reference import Measures
from ..parameters.asperity import Asperity
from ..support.checks import Array, numbers, whole
from .state import JointState, NonFiniteError, write_replay

Index = Sequence[int] | NDArray[np.integer[Any]] | NDArray[np.bool_]
Out = tuple[Array, Array | None]
COMPONENTS = {  # of a displacement, by their number, and how to have more
    1: "closure; for shear take a law without closure_only",
    2: "closure and shear along the plane; for motion in 3-D take a law with plane=None",
    3: "closure and shear along axes 2 and 3",
}
FEW = 8  # numbers of an increment up to which Python looks at them faster than numpy


class Law(Protocol):
    """What joints, and tests on them, read of a law."""

    @property
    def tables(self) -> Tables: ...
    @property
    def asperity(self) -> Asperity: ...
    @property
    def plane(self) -> float | None: ...
    @property
    def closure_only(self) -> bool: ...
    @property
    def largest_reach(self) -> float: ...
    @property
    def fingerprint(self) -> str: ...
    def joints(self, n: int, ledger: bool = True) -> JointBatch: ...
    def closure(self, normal_stress: ArrayLike) -> Any: ...
    def max_stiffness(self, closure: ArrayLike) -> Any: ...
    def to_toml(self) -> str: ...


class JointBatch:
    """n joints of one law. Arrays over joints: displacements (n, dim) in m, tractions (n, dim) in
    Pa; dim is 3 (closure, shear along axes 2 and 3), 2 for a law with a plane, or 1 for a law with
    closure_only.

    The traction is the joint's resistance in the sense of the displacement: the force on the body
    that moves by +d is -area * F. Without `ledger` no dissipated energy is added up, which is
    faster with the compiled kernel.
    """

    def __init__(self, law: Law, n: int, ledger: bool = True) -> None:
        self.law, self.ledger = law, ledger
        self._engine = engine(law.tables)
        self._n = whole("n", n, 0)
        self._state = empty_blocks(self._engine.rows, self._n)
        self._reach = 0.0  # no facet's effective closure exceeds it, in either sense
        numbers = np.arange(law.tables.rows, dtype=np.float64)[:, None]
        self._number = reference.parts(law.tables, numbers)  # of the rows of each part
        self._stretch = 1.0 + 2.0 * float(np.max(np.abs(law.tables.m)))  # of y over that of d

    def __getstate__(self) -> dict[str, Any]:
        kept = {k: v for k, v in self.__dict__.items() if k != "_engine"}  # holds compiled code
        return kept | {"_state": self._state[:, : self.law.tables.rows]}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._engine, rows = engine(self.law.tables), state["_state"]
        blocks, kept, lanes = rows.shape
        self._state = zeros(blocks, self._engine.rows, lanes)
        self._state[:, :kept] = rows
        self._engine.refresh(self._state, self._n)

    def __len__(self) -> int:
        return self._n

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._n} joints, {self.law.tables.dim}-D>"

    # ------------------------------------------------------------------ steps

    def update(
        self,
        d: ArrayLike,
        where: Index | None = None,
        tangent: bool = True,
        out: Out | None = None,
    ) -> Out:
        """Advance by the displacement increments d and keep the new state.

        d: (n, dim) in m; with `where`, an index or mask of m joints, (m, dim).
        out: arrays F and C (or None) to write into instead of new ones.
        Returns F (n or m, dim) in Pa and C = dF/dd (n or m, dim, dim) in Pa/m, None without
        `tangent`. Raises ValueError for a wrong shape, index or a non-finite increment, and
        NonFiniteError when the result would overflow; the state is then as it was.
        """
        return self._step(d, where, tangent, out, keep=True)

    def trial(
        self,
        d: ArrayLike,
        where: Index | None = None,
        tangent: bool = True,
        out: Out | None = None,
    ) -> Out:
        """As `update`, but the state is left untouched."""
        return self._step(d, where, tangent, out, keep=False)

    def _step(
        self, d: ArrayLike, where: Index | None, tangent: bool, out: Out | None, keep: bool
    ) -> Out:
        index = None if where is None else self._index(where)
        m, dim = self._n if index is None else len(index), self.law.tables.dim
        values = increments(d, (m, dim))
        if out is None:
            F, C = np.empty((m, dim)), np.empty((m, dim, dim)) if tangent else None
        else:
            F, C = _require_out(out, m, dim, tangent)
        self.take(Step(np.ascontiguousarray(values), F, C, index, keep))
        return F, C

    def take(self, step: Step) -> None:
        """Take a step whose arrays have the right shapes: check its numbers, then the kernel."""
        reach = self._admit(step)
        self._engine.advance(self._state, step, self.ledger)
        if step.keep:
            self._reach = reach

    # ------------------------------------------------------------------ state

    def snapshot(self, where: Index | None = None) -> JointState:
        """A copy of the state of all joints, or of those that `where` names, in that order."""
        index = None if where is None else self._index(where)
        return JointState(self.law.fingerprint, self._rows(index))

    def restore(self, state: JointState, where: Index | None = None) -> None:
        """Return to a snapshot; with `where` these joints take its states, the others stay.

        So joints move between batches: `other.restore(batch.snapshot(where), places)`. Raises
        ValueError if another law wrote the state or it holds another number of joints.
        """
        index = np.arange(self._n) if where is None else self._index(where)
        if not isinstance(state, JointState):
            raise ValueError(f"state = {state!r} is not a snapshot; give one of snapshot()")
        state.require(self.law.fingerprint)
        if state.values.shape != (self.law.tables.rows, len(index)):
            other = f"this batch {self._n}: resize first"
            if where is not None:
                other = f"where names {len(index)}"
            raise ValueError(f"state holds {len(state)} joints, {other}")
        if not np.isfinite(state.values).all():
            raise ValueError("state holds values that are not finite; it is damaged")
        rows = self._state[:, : self.law.tables.rows]
        write_rows(rows, state.values, index)
        self._engine.refresh(self._state, self._n)
        self._reach = self._bound(self._rows()).max(initial=0.0)

    def reset(self, index: Index | None = None) -> None:
        """Return the joints at `index` (all if None) to the virgin state: new contacts."""
        which = np.arange(self._n) if index is None else self._index(index)
        lanes = self._state.shape[2]
        self._state[which // lanes, :, which % lanes] = 0.0

    def resize(self, n: int) -> None:
        """Change the number of joints; joints beyond the old number are new and unloaded."""
        n = whole("n", n, 0)
        blocks, rows, lanes = self._state.shape
        if n < self._n:
            self.reset(np.arange(n, self._n))
        elif n > blocks * lanes:  # grow by doubling, so that steady growth copies rarely
            grown = zeros(max(-(-n // LANES), 2 * blocks), rows, LANES)
            write_rows(grown, rows_of(self._state, self._n), np.arange(self._n))
            self._state = grown
        self._n = n

    # ---------------------------------------------------------- what they show

    def measures(self) -> Measures:
        """Shares, stored energy and reach of all joints in one pass, as arrays (n,)."""
        values = np.empty((5, self._n))
        self._engine.measures(self._state, values)
        return Measures(*values)

    @property
    def kernel(self) -> str:
        """Which kernel advances these joints: "native" or "numpy"."""
        return self._engine.name

    @property
    def bytes_per_joint(self) -> int:
        """Memory that the state of one joint of a large batch takes."""
        return 8 * self._engine.rows

    def max_stiffness(self) -> Array:
        """Upper bound (n,) of `|C|` in Pa/m at each joint's own reach, for explicit time steps."""
        return self.law.max_stiffness(self.measures().reach)

    @property
    def delta(self) -> Array:
        """Displacement since the virgin state (n, dim): closure and shear, in m."""
        return rows_of(self._state[:, : self.law.tables.dim], self._n).T

    @property
    def F(self) -> Array:
        """Traction (n, dim) in Pa."""
        return reference.traction(self.law.tables, self._rows()).T

    @property
    def sliding(self) -> Array:
        """Share (n,) of all facet orientations: in touch, every cell at its friction limit."""
        return self.measures().sliding

    @property
    def slipping(self) -> Array:
        """Share (n,) of friction capacity that is at its limit: partial slip."""
        return self.measures().slipping

    @property
    def separated(self) -> Array:
        """Share (n,) of all facet orientations: out of touch."""
        return self.measures().separated

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
    def friction(self) -> Array:
        """Friction coefficient (n,) of the asperities, worn by their slip so far."""
        k = self.law.tables
        return wear.friction(k, self._part("slip")) if k.wears else np.full(self._n, k.mu)

    # --------------------------------------------------------------- internals

    def _part(self, name: str) -> Array:
        """A part of one row, or of none, of the states of all joints, by name in `State`."""
        row = getattr(self._number, name).astype(int).ravel()
        return np.sum(rows_of(self._state[:, row], self._n), axis=0)

    def _ledger(self, name: str, part: str) -> Array:
        """A part of the ledger, if it is kept."""
        if not self.ledger:
            raise ValueError(f"{name} is not added up: make the joints with ledger=True")
        return self._part(part)

    def _rows(self, index: NDArray[np.intp] | None = None) -> Array:
        """States (rows, n) of all joints or those of `index`, as a copy."""
        return rows_of(self._state[:, : self.law.tables.rows], self._n, index)

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

    def _admit(self, step: Step) -> float:
        """New bound of the reach; raises for increments that are not finite or would overflow.

        The bound of the whole batch costs one pass over d; joints are looked at only beyond it.
        """
        d, limit = step.d, self.law.largest_reach
        if d.size <= FEW:  # the sum is no less than the largest, and NaN if one is
            largest = sum(map(abs, d.ravel().tolist()))
        else:
            largest = max(float(d.max()), -float(d.min()))  # both NaN if one is
        reach = self._reach + self._stretch * largest
        return reach if reach <= limit else self._admit_each(step, limit)

    def _admit_each(self, step: Step, limit: float) -> float:
        """As `_admit`, joint by joint."""
        d, index = step.d, step.where
        finite = np.isfinite(d).all(axis=1)
        if not finite.all():
            row = int(np.argmin(finite))
            joint = row if index is None else int(index[row])
            raise ValueError(f"d of joint {joint} = {d[row]} is not finite; nothing was moved")
        old = self._rows(index)
        with np.errstate(over="ignore"):
            new = self._bound(old) + self._stretch * np.abs(d).max(axis=1)
        if (new > limit).any():
            row = int(np.argmax(new > limit))
            joint = row if index is None else int(index[row])
            path = write_replay(self.law.to_toml, old[:, [row]], d[[row]].T, step.C is not None)
            again = "no replay file could be written"
            if path is not None:
                again = f"`jointlaw replay {path}` repeats it"
            raise NonFiniteError(
                f"joint {joint}: the step d = {d[row]} m gives a result that is not finite; "
                f"nothing was moved. Take a smaller step; {again}",
                path,
            )
        rest = self._bound(self._rows()).max(initial=0.0)
        return max(float(rest), float(new.max(initial=0.0)))

    def _bound(self, rows: Array) -> Array:
        """Bound of the reach of states (rows, n), from closure and offset."""
        now = reference.parts(self.law.tables, rows)
        far = np.maximum(np.abs(now.delta).max(axis=0), np.abs(now.offset).max(axis=0, initial=0.0))
        return self._stretch * far


def increments(d: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Increments of this shape, (dim,) or (joints, dim), in m."""
    values = numbers("d", d, "m")
    if values.shape != shape:
        joints = "joints, " if len(shape) == 2 else ""
        raise ValueError(
            f"d has shape {values.shape}; expected {shape}: {joints}{COMPONENTS[shape[-1]]}"
        )
    return values


def _require_out(out: Out, m: int, dim: int, tangent: bool) -> Out:
    """Arrays that the caller gave for the results, checked."""
    for name, array, shape in (("F", out[0], (m, dim)), ("C", out[1], (m, dim, dim))):
        if name == "C" and not tangent:
            continue
        if array is None or array.shape != shape or array.dtype != np.float64:
            raise ValueError(f"out: {name} must be a float64 array of shape {shape}")
        if not (array.flags.c_contiguous and array.flags.writeable):
            raise ValueError(f"out: {name} must be C-contiguous and writeable")
    return out[0], out[1] if tangent else None
