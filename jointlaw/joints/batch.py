"""A batch of joints of one law, advanced together.

The batch keeps the states of its joints in the blocks of an engine (`kernels/engine.py`). A step is
valid or changes nothing: before the kernel runs, a bound of the effective closure after the step is
compared with the closure beyond which forces overflow. The bound is one number for the whole batch
(`_closure_bound`), the largest closure that any joint had, plus the largest component of the
increments times `closure_per_displacement`. Only if this bound is too large are joints checked one
by one; the bound is then replaced by the largest closure of the joints as they are.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from ..kernels.admissible import require_admissible_states
from ..kernels.element import Measures
from ..kernels.engine import (
    JOINTS_PER_BLOCK,
    ListVerdict,
    Step,
    allocate_blocks,
    block_index,
    engine,
    require_valid_list,
)
from ..support.checks import Array, integer, numbers
from .state import JointState, NonFiniteError
from .time_step import single_mass_time_step

Index = Sequence[int] | NDArray[np.integer[Any]] | NDArray[np.bool_]
Result = tuple[Array, Array | None]
COMPONENTS = {  # of a displacement, by their number
    1: "closure; for shear take a law without closure_only",
    2: "closure and shear along the plane; for motion in 3-D take a law with plane=None",
    3: "closure and shear along axes 2 and 3",
}
MAX_SIZE_IN_PYTHON = 8  # numbers whose largest size Python finds faster than numpy


class JointBatch:
    """n joints of one law.

    Arrays over joints: displacements (n, dim) in m, tractions (n, dim) in Pa; dim is 3 (closure,
    shear along axes 2 and 3), 2 for a law with a plane, or 1 for a law with closure_only. The
    traction is the joint's resistance in the direction of the displacement: the force on the body
    that moves by +d is -area * F.

    law: of the joints; n: their number; track_dissipation: without it the dissipated energy is not
    available, which is faster with the compiled kernel. slider_dtype: numpy.float32 stores the
    forces of sliders, most numbers of a state, as 32-bit floats; other numbers and all arithmetic
    stay in double precision (docs/accuracy.md, "Memory"). Raises ValueError for another dtype.

    >>> joints = law.joints(1000)
    >>> F, _ = joints.update(np.full((1000, 3), 1e-9), tangent=False)
    """

    # law: of the class jointlaw.laws.law.Law, which imports this module
    def __init__(
        self,
        law: Any,
        n: int,
        track_dissipation: bool = True,
        slider_dtype: DTypeLike = np.float64,
    ) -> None:
        self.law = law
        self.track_dissipation = track_dissipation
        self.slider_dtype = _slider_dtype(slider_dtype)
        float_sliders = self.slider_dtype == np.float32
        self._engine = engine(law.tables, float_sliders)
        self._n = integer("n", n, 0)
        lanes = 1 if self._n == 1 and not float_sliders else JOINTS_PER_BLOCK
        self._state = allocate_blocks(self._n, self._engine.rows, lanes)
        self._closure_bound = 0.0  # upper bound of |y| of all facets of all joints
        self._closure_per_displacement = law.tables.closure_per_displacement
        self._max_effective_closure = law.max_effective_closure
        if float_sliders:
            self._max_effective_closure = law.tables.max_closure_with_float_sliders

    def __getstate__(self) -> dict[str, Any]:
        return {
            "law": self.law,
            "track_dissipation": self.track_dissipation,
            "slider_dtype": self.slider_dtype,
            "states": self.snapshot(),
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        JointBatch.__init__(
            self,
            state["law"],
            len(state["states"]),
            state["track_dissipation"],
            state["slider_dtype"],
        )
        self.restore(state["states"])

    def __len__(self) -> int:
        return self._n

    # ------------------------------------------------------------------ steps

    def update(self, d: ArrayLike, where: Index | None = None, tangent: bool = True) -> Result:
        """Advance by the displacement increments d.

        d: (n, dim) in m; with `where`, an index or mask of m joints, (m, dim).
        Returns F (n or m, dim) in Pa and C = dF/dd (n or m, dim, dim) in Pa/m, None without
        `tangent`. Raises ValueError for a wrong shape, index or a non-finite increment, and
        NonFiniteError when the result would overflow; the state is then as it was.
        """
        return self._step(d, where, tangent, commit=True)

    def trial(self, d: ArrayLike, where: Index | None = None, tangent: bool = True) -> Result:
        """As `update` with d, where and tangent, but states do not change. Raises the same."""
        return self._step(d, where, tangent, commit=False)

    def _step(self, d: ArrayLike, where: Index | None, tangent: bool, commit: bool) -> Result:
        index, verdict = (None, None) if where is None else self._checked_list(where)
        m = self._n if index is None else len(index)
        dim = self.law.dim
        values = increments(d, (m, dim))
        F = np.empty((m, dim))
        C = np.empty((m, dim, dim)) if tangent else None
        step = Step(np.ascontiguousarray(values), F, C, index, commit)
        step.list_verdict = verdict
        self.advance(step)
        return F, C

    def advance(self, step: Step) -> None:
        """Advance joints by a prepared step, in place, without copies.

        The arrays of `step` have the shapes of this batch: F, and C and measures where they are not
        None, are filled. With `step.commit` False the joints stay in their states, as in `trial`.
        Raises as `update`, before any joint changes.
        """
        closure_bound = self._closure_bound_after(step)
        self._engine.advance(self._state, step, self.track_dissipation)
        if step.commit:
            self._closure_bound = closure_bound

    # ------------------------------------------------------------------ state

    def snapshot(self, where: Index | None = None) -> JointState:
        """A copy of the states of all joints, or of the joints `where`, in that order.

        Raises ValueError for a wrong index.
        """
        index = None if where is None else self._index(where)
        return JointState(self.law.fingerprint, self._rows(index), self._engine.float_rows)

    def restore(self, state: JointState, where: Index | None = None) -> None:
        """Return to a snapshot; with `where` only these joints.

        Joints move between batches by `other.restore(batch.snapshot(where), places)`. Raises
        ValueError if another law wrote the state, it holds another number of joints, or a number
        beyond its bounds (`jointlaw.kernels.admissible`); all joints are then as they were.

        Between batches of one `slider_dtype` a restored state is exact. A batch with numpy.float32
        rounds the slider forces of a state from a batch with numpy.float64 to the nearest float.
        """
        index = None if where is None else self._index(where)
        if not isinstance(state, JointState):
            raise ValueError(f"state = {state!r} is not a snapshot; give one of snapshot()")
        state.require(self.law.fingerprint)
        n = self._n if index is None else len(index)
        if state.values.shape != (n, self.law.state_size):
            raise ValueError(
                f"state holds {len(state)} joints, for {n} of the batch: resize it, or "
                "name as many by where"
            )
        require_admissible_states(self.law.tables, state.values)
        values = self._engine.pack(state.values)
        rows = self._engine.state_rows
        if index is None:
            lanes = self._state.shape[2]
            in_full_blocks = n // lanes * lanes
            full = values[:in_full_blocks].reshape(-1, lanes, rows)
            self._state[: len(full), :rows] = np.moveaxis(full, 1, 2)
            index = np.arange(in_full_blocks, n)
            values = values[in_full_blocks:]
        self._state[block_index(self._state, index, slice(rows))] = values
        self._engine.refresh(self._state, self._n)
        bound_of_restored = self._closure_bounds_at(state.values[:, : self.law.dim]).max(
            initial=0.0
        )
        bound_of_unlisted = 0.0 if where is None else self._closure_bound
        self._closure_bound = max(bound_of_unlisted, bound_of_restored)

    def copy(self, sources: Index, targets: Index) -> None:
        """Let the joints `targets` (m,) become copies of the joints `sources` (m,).

        As `restore(snapshot(sources), targets)`, but a joint may be the source of several copies,
        and the time does not depend on the number of joints in the batch. sources, targets: joint
        numbers. Raises ValueError for a wrong number, a joint that is named twice in `targets`, or
        lists of different lengths; all joints are then as they were.
        """
        copied = self._checked_list(sources, can_repeat=True)[0]
        index = self._index(targets)
        if copied.shape != index.shape:
            raise ValueError(
                f"sources name {len(copied)} joints, targets {len(index)}: give one target for each"
            )
        state = self._state
        state[block_index(state, index)] = state[block_index(state, copied)]

    def reset(self, index: Index | None = None, mated: bool = True) -> None:
        """Return the joints at `index` (all if None) to their initial state.

        mated: True for the virgin state, False for faces that have never met, as `JointLaw.joint`.
        Raises ValueError for a wrong index, or a law with permanent interlock.
        """
        start = 0.0 if mated else self.law.tables.unmated_start
        joints = np.arange(self._n) if index is None else self._index(index)
        self._state[block_index(self._state, joints)] = 0.0
        self._state[block_index(self._state, joints, slice(self.law.dim))] = start
        bound = self._closure_per_displacement * float(np.max(np.abs(start)))
        self._closure_bound = max(self._closure_bound, bound)
        if not mated:
            self.break_bond(joints)

    def break_bond(self, index: Index) -> None:
        """Break bond or cohesion of the joints at `index`, as of faces that meet again.

        Does nothing for a law without either. Raises ValueError for a wrong index.
        """
        joints = self._index(index)
        for row, damage in self.law.tables.damage_rows.items():
            place = self._engine.row(row)
            self._state[block_index(self._state, joints, place)] = damage

    def resize(self, n: int) -> None:
        """Change the number of joints to n; the first joints keep their states.

        Joints beyond the old number are new and mated, also where the batch was larger before.
        Memory is never released. Raises ValueError where n is no whole number >= 0.
        """
        n = integer("n", n, 0)
        capacity, rows, lanes = self._state.shape
        if n < self._n:
            self.reset(np.arange(n, self._n))
        elif n > capacity * lanes:  # double the capacity, so that steady growth copies rarely
            larger = allocate_blocks(max(n, 2 * capacity * JOINTS_PER_BLOCK), rows)
            joints = np.arange(self._n)
            larger[block_index(larger, joints)] = self._state[block_index(self._state, joints)]
            self._state = larger
        self._n = n

    # --------------------------------------------------------------- evaluation

    def measures(self) -> Measures:
        """Sliding, slipping and separated fractions, stored energy and largest effective closure
        of all joints in one pass, as arrays (n,)."""
        values = self._engine.evaluate("measures", self._state, self._n)
        return Measures(*np.array(values.T, order="C"))

    @property
    def kernel(self) -> str:
        """Name of the kernel that advances these joints: "native" or "numpy"."""
        return self._engine.name

    @property
    def bytes_per_joint(self) -> int:
        """Bytes of memory for the state of one joint of a large batch."""
        return 8 * self._engine.rows

    def max_stiffness(self) -> Array:
        """Upper bound (n,) of `|C|` in Pa/m at each joint's present displacement."""
        return self._engine.evaluate("stiffness", self._state, self._n)

    def critical_time_step(self, mass: ArrayLike, area: ArrayLike) -> Array:
        """Largest stable explicit step (n,) in s of one translating mass on each joint as it is.

        mass: reduced mass m1 m2/(m1 + m2) in kg; area: in m2; numbers or (n,). Infinite where
        nothing touches. Joints that close or shear further become stiffer: compute it again, or
        keep a margin. Several joints on one body, bodies in series, and rotation need a smaller
        step: `jl.stable_time_step(first, second, mass, area, joints.max_stiffness())`. Raises
        ValueError for other shapes or numbers <= 0.
        """
        for name, value in (("mass", mass), ("area", area)):
            shape = np.shape(value)
            if shape not in ((), (self._n,)):
                raise ValueError(f"{name} has shape {shape}: give a number or ({self._n},)")
        return single_mass_time_step(mass, area, self.max_stiffness())

    @property
    def delta(self) -> Array:
        """Displacement from the interlocked position (n, dim): closure and shear, in m."""
        return self._all(slice(self.law.dim))

    @property
    def F(self) -> Array:
        """Traction (n, dim) in Pa of the present states, without a step.

        A zero increment of `update` is not neutral if asperities degrade: their degradation lags
        one step behind the work of shear.
        """
        return self._engine.evaluate("traction", self._state, self._n)

    @property
    def stored_energy(self) -> Array:
        """Elastic energy (n,) in J/m2."""
        return self.measures().stored_energy

    @property
    def dissipated_energy(self) -> Array:
        """Energy (n,) in J/m2 dissipated since the virgin state, by friction, plastic indentation,
        degradation and damage; never decreases.

        Its error depends on the steps: 0.8 to 4 times the loss with one step between two reversals,
        0.9 to 1.1 times with ten, 0.95 to 1.02 times with thirty (docs/theory-incremental.md,
        "Energy balance"). Raises AttributeError without `track_dissipation`.
        """
        return self._tracked_row("dissipated_energy")

    @property
    def plastic_work(self) -> Array:
        """The part (n,) of the dissipated energy, in J/m2, by plastic indentation of asperities.

        Raises AttributeError without `track_dissipation`.
        """
        return self._tracked_row("plastic_work")

    @property
    def slope_retention(self) -> Array:
        """Remaining fraction (n,) of the slopes of the asperities, 1 without degradation."""
        return 1.0 - self._row("lost_slopes")

    @property
    def damage(self) -> Array:
        """Damage (n,) of bond or cohesion: 0 intact, 1 broken, and 1 for a law without either.

        Of the least damaged one, if several elements of the law can break.
        """
        places = map(self._engine.row, self.law.tables.damage_rows)
        rows = [self._all(place) for place in places]
        return np.min([np.ones(self._n), *rows], axis=0)

    # --------------------------------------------------------------- internals

    def _row(self, name: str) -> Array:
        """A row of the states of all joints by name; zeros for a law without this row."""
        row = self.law.tables.first_rows.get(name)
        return np.zeros(self._n) if row is None else self._all(self._engine.row(row))

    def _all(self, rows: Any) -> Array:
        """Rows of the states of all joints, as a copy (n,) or (n, rows).

        Three times as fast as by a list of joints.
        """
        joints_first = np.moveaxis(self._state[:, rows], -1, 1)
        copy = np.array(joints_first, order="C")
        return copy.reshape(-1, *joints_first.shape[2:])[: self._n]

    def _tracked_row(self, name: str) -> Array:
        """A row of dissipated energy (n,). Raises AttributeError if it is not tracked."""
        if not self.track_dissipation:
            raise AttributeError(
                f"{name} is not tracked: make the joints with track_dissipation=True"
            )
        return self._row(name)

    def _rows(self, index: NDArray[np.intp] | None = None) -> Array:
        """States (n, rows) of all joints or of the joints `index`, as a copy."""
        rows = slice(self._engine.state_rows)
        if index is None:
            return self._engine.unpack(self._all(rows))
        return self._engine.unpack(self._state[block_index(self._state, index, rows)])

    def _index(self, where: Index) -> NDArray[np.intp]:
        return self._checked_list(where)[0]

    def _checked_list(self, where: Index, can_repeat: bool = False) -> tuple[NDArray[np.intp], int]:
        """Numbers of the joints `where`, and whether they increase (`ListVerdict`).

        can_repeat: whether the list may name a joint several times.
        """
        index = np.asarray(where)
        if index.dtype == bool:
            if index.shape != (self._n,):
                raise ValueError(f"where has shape {index.shape}; a mask needs ({self._n},)")
            return np.flatnonzero(index), ListVerdict.INCREASING
        if index.size == 0:
            return np.empty(0, np.intp), ListVerdict.INCREASING
        if index.ndim != 1 or index.dtype.kind not in "iu":
            raise ValueError("where must be a one-dimensional array of joint numbers or a mask")
        joints = np.ascontiguousarray(index, np.intp)
        return joints, require_valid_list(self._engine, joints, self._n, can_repeat)

    def _closure_bound_after(self, step: Step) -> float:
        """Upper bound (m) of |y| over all joints and facets after a step.

        A cheap bound over all joints is tried first, and single joints only where it exceeds the
        largest effective closure of the law, or is NaN. Raises as `_closure_bound_by_joint`.
        """
        d = step.d
        limit = self._max_effective_closure
        if d.size <= MAX_SIZE_IN_PYTHON:  # the sum of sizes is a bound too
            largest = sum(map(abs, d.ravel().tolist()))
        else:
            values = d.reshape(
                -1
            )  # reduced without the methods of arrays, which take twice as long
            largest = max(float(np.maximum.reduce(values)), -float(np.minimum.reduce(values)))
        bound = self._closure_bound + self._closure_per_displacement * largest
        return bound if bound <= limit else self._closure_bound_by_joint(step, limit)

    def _closure_bound_by_joint(self, step: Step, limit: float) -> float:
        """As `_closure_bound_after`, from the displacement and the increment of every joint.

        Raises ValueError for an increment that is not finite, and NonFiniteError (with number,
        state and increment of the joint) where forces would overflow.
        """
        d = step.d
        index = step.where
        delta = self.delta if index is None else self.delta[index]
        with np.errstate(over="ignore"):
            increase = self._closure_per_displacement * np.abs(d).max(axis=1)
            bounds = self._closure_bounds_at(delta) + increase
        is_valid = bounds <= limit
        if not is_valid.all():
            row = int(np.argmin(is_valid))
            joint = row if index is None else int(index[row])
            if not np.isfinite(d[row]).all():
                raise ValueError(f"d of joint {joint} = {d[row]} is not finite; nothing was moved")
            storage = " as float32" if limit < self.law.max_effective_closure else ""
            error = NonFiniteError(
                f"joint {joint}: the step d = {d[row]} m gives a result that is not finite"
                f"{storage}; nothing was moved. Take a smaller step (state and d of this error "
                "repeat it)"
            )
            error.joint = joint
            error.d = d[row].copy()
            values = self._rows(index)[[row]]
            error.state = JointState(self.law.fingerprint, values, self._engine.float_rows)
            raise error
        present = self._closure_bounds_at(self.delta).max(initial=0.0)
        return max(float(present), float(bounds.max(initial=0.0)))

    def _closure_bounds_at(self, delta: Array) -> Array:
        """Bound (n,) of |y| of all facets of joints at delta (n, dim)."""
        return self._closure_per_displacement * np.abs(delta).max(axis=1)


def _slider_dtype(value: DTypeLike) -> np.dtype[Any]:
    """Validate the dtype of stored slider forces: numpy.float64 or numpy.float32."""
    for dtype in (np.dtype(np.float64), np.dtype(np.float32)):
        with suppress(TypeError):  # of a value that names no dtype
            if value is not None and np.dtype(value) == dtype:
                return dtype
    raise ValueError(
        f"slider_dtype = {value!r} is not supported: slider forces are stored as numpy.float64 or "
        "numpy.float32"
    )


def increments(d: ArrayLike, shape: tuple[int, ...]) -> Array:
    """Validate increments in m: their shape is (dim,) or (joints, dim)."""
    values = numbers("d", d, "m")
    if values.shape != shape:
        joints = "joints, " if len(shape) == 2 else ""
        raise ValueError(
            f"d has shape {values.shape}; expected {shape}: {joints}{COMPONENTS[shape[-1]]}"
        )
    return values
