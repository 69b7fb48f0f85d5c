"""Joints with memory: one, or a batch advanced together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _kernel_numpy as kernel
from ._checks import Array, numbers, whole
from .law import JointLaw, Tables
from .state import JointState, NonFiniteError, write_replay

CHUNK = 4096  # joints per call of the numpy kernel: keeps its temporaries in cache

Index = Sequence[int] | NDArray[np.integer[Any]] | NDArray[np.bool_]


class JointBatch:
    """n joints of one law. Arrays over joints: displacements (n, dim) in m, tractions (n, dim) in
    Pa; dim is 3 (closure, shear along axes 2 and 3), or 2 for a law with a plane.

    The traction is the joint's resistance in the sense of the displacement: the force on the body
    that moves by +d is -area * F.
    """

    def __init__(self, law: JointLaw, n: int) -> None:
        self.law = law
        self._state = np.zeros((law.tables.rows, whole("n", n, 0)))
        self._n = self._state.shape[1]

    def __len__(self) -> int:
        return self._n

    def __repr__(self) -> str:
        return f"<{type(self).__name__} of {self._n} joints, {self.law.tables.dim}-D>"

    # ------------------------------------------------------------------ steps

    def update(
        self, d: ArrayLike, where: Index | None = None, tangent: bool = True
    ) -> tuple[Array, Array | None]:
        """Advance by the displacement increments d and keep the new state.

        d: (n, dim) in m; with `where`, an index or mask of m joints, (m, dim).
        Returns F (n or m, dim) in Pa and C = dF/dd (n or m, dim, dim) in Pa/m, None without
        `tangent`. Raises ValueError for a wrong shape, index or a non-finite increment, and
        NonFiniteError when a result overflows; the state is then as it was.
        """
        return self._advance(d, where, tangent, keep=True)

    def trial(
        self, d: ArrayLike, where: Index | None = None, tangent: bool = True
    ) -> tuple[Array, Array | None]:
        """As `update`, but the state is left untouched."""
        return self._advance(d, where, tangent, keep=False)

    def _advance(
        self, d: ArrayLike, where: Index | None, tangent: bool, keep: bool
    ) -> tuple[Array, Array | None]:
        index = self._index(where)
        step = self._increments(d, index)
        dim, m = step.shape
        F = np.empty((m, dim))
        C = np.empty((m, dim, dim)) if tangent else None
        fresh = []
        for first in range(0, m, CHUNK):
            part = slice(first, first + CHUNK)
            which = part if index is None else index[part]
            old = self._state[:, : self._n][:, which]
            with np.errstate(over="ignore", invalid="ignore"):  # reported below, with the joint
                state, F_part, C_part = kernel.step(self.law.tables, old, step[:, part], tangent)
            self._require_finite(state, F_part, C_part, old, step[:, part], which)
            F[part] = F_part.T
            if C is not None and C_part is not None:
                C[part] = np.moveaxis(C_part, 2, 0)
            fresh.append((which, state))
        if keep:
            for which, state in fresh:
                self._state[:, : self._n][:, which] = state
        return F, C

    # ------------------------------------------------------------------ state

    def snapshot(self) -> JointState:
        """A copy of the state of all joints."""
        return JointState(self.law.fingerprint, self._state[:, : self._n].copy())

    def restore(self, state: JointState) -> None:
        """Return to a snapshot. Raises ValueError if another law or batch size wrote it."""
        if not isinstance(state, JointState):
            raise ValueError(f"state = {state!r} is not a snapshot; give one of snapshot()")
        if state.fingerprint != self.law.fingerprint:
            raise ValueError("state belongs to a joint law with other parameters")
        if state.values.shape != (len(self._state), self._n):
            raise ValueError(f"state holds {len(state)} joints, this batch {self._n}: resize first")
        if not np.isfinite(state.values).all():
            raise ValueError("state holds values that are not finite; it is damaged")
        self._state[:, : self._n] = state.values

    def reset(self, index: Index | None = None) -> None:
        """Return the joints at `index` (all if None) to the virgin state: new contacts."""
        which = self._index(index)
        self._state[:, : self._n][:, slice(None) if which is None else which] = 0.0

    def resize(self, n: int) -> None:
        """Change the number of joints; joints beyond the old number are new and unloaded."""
        n = whole("n", n, 0)
        if n > self._state.shape[1]:  # grow by doubling, so that steady growth copies rarely
            grown = np.zeros((len(self._state), max(n, 2 * self._state.shape[1])))
            grown[:, : self._n] = self._state[:, : self._n]
            self._state = grown
        elif n < self._n:
            self._state[:, n : self._n] = 0.0
        self._n = n

    # ---------------------------------------------------------- what they show

    @property
    def delta(self) -> Array:
        """Displacement since the virgin state (n, dim): closure and shear, in m."""
        delta: Array = self._state[: self.law.tables.dim, : self._n].T.copy()
        return delta

    @property
    def F(self) -> Array:
        """Traction (n, dim) in Pa."""
        return self._measure(kernel.traction, slice(None)).T

    @property
    def sliding(self) -> Array:
        """Share (n,) of asperities in touch whose every cell is at its friction limit."""
        return self._measure(kernel.shares, 0)

    @property
    def slipping(self) -> Array:
        """Share (n,) of friction capacity that is at its limit: partial slip."""
        return self._measure(kernel.shares, 1)

    @property
    def separated(self) -> Array:
        """Share (n,) of asperities out of touch."""
        return self._measure(kernel.shares, 2)

    @property
    def stored_energy(self) -> Array:
        """Elastic energy (n,) in J/m2."""
        return self._measure(kernel.stored_energy)

    @property
    def dissipated_energy(self) -> Array:
        """Energy (n,) in J/m2 lost to friction since the virgin state; never decreases."""
        lost: Array = self._state[2 * self.law.tables.dim - 1, : self._n].copy()
        return lost

    # --------------------------------------------------------------- internals

    def _measure(self, measure: Callable[[Tables, Array], Any], row: Any = 0) -> Array:
        """One or more rows of a measure of all states, taken in chunks."""
        parts = [
            np.atleast_2d(measure(self.law.tables, self._state[:, : self._n][:, i : i + CHUNK]))
            for i in range(0, max(self._n, 1), CHUNK)
        ]
        rows: Array = np.concatenate(parts, axis=-1)[row]
        return rows

    def _index(self, where: Index | None) -> NDArray[np.intp] | None:
        if where is None:
            return None
        index = np.asarray(where)
        if index.dtype == bool:
            if index.shape != (self._n,):
                raise ValueError(f"where has shape {index.shape}; a mask needs ({self._n},)")
            return np.flatnonzero(index)
        if index.size == 0:
            return np.empty(0, np.intp)
        if index.ndim != 1 or not np.issubdtype(index.dtype, np.integer):
            raise ValueError("where must be a one-dimensional array of joint numbers or a mask")
        if index.min() < 0 or index.max() >= self._n:
            wrong = index.min() if index.min() < 0 else index.max()
            raise ValueError(f"where names joint {wrong}; joints are 0 to {self._n - 1}")
        if len(np.unique(index)) != len(index):
            raise ValueError("where names a joint twice; each joint takes one increment per step")
        return index.astype(np.intp)

    def _increments(self, d: ArrayLike, index: NDArray[np.intp] | None) -> Array:
        """Increments as (dim, m), checked."""
        values = numbers("d", d, "m")
        shape = (self._n if index is None else len(index), self.law.tables.dim)
        if values.shape != shape:
            raise ValueError(f"d has shape {values.shape}; expected {shape}: joints, components")
        if not np.isfinite(values).all():
            row = int(np.argmin(np.isfinite(values).all(axis=1)))
            joint = row if index is None else int(index[row])
            raise ValueError(f"d of joint {joint} = {values[row]} is not finite; nothing was moved")
        return values.T

    def _require_finite(
        self, state: Array, F: Array, C: Array | None, old: Array, d: Array, which: Any
    ) -> None:
        good = np.isfinite(state).all(axis=0) & np.isfinite(F).all(axis=0)
        if C is not None:
            good &= np.isfinite(C).all(axis=(0, 1))
        if good.all():
            return
        at = int(np.argmin(good))
        joint = which.start + at if isinstance(which, slice) else int(which[at])
        path = write_replay(
            self.law.to_toml(), old[:, at : at + 1], d[:, at : at + 1], C is not None
        )
        again = "no replay file could be written"
        if path is not None:
            again = f"`jointlaw replay {path}` repeats it"
        raise NonFiniteError(
            f"joint {joint}: the step d = {d[:, at]} m gives a result that is not finite; nothing "
            f"was moved. Take a smaller step; {again}",
            path,
        )


class Joint:
    """One joint: as `JointBatch`, with vectors (dim,) and a matrix (dim, dim)."""

    def __init__(self, law: JointLaw) -> None:
        self.law = law
        self._batch = JointBatch(law, 1)

    def __repr__(self) -> str:
        return f"<Joint at delta = {self.delta} m>"

    def update(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """Advance by the increment d (dim,) in m: F (dim,) in Pa, C (dim, dim) in Pa/m."""
        return self._advance(d, tangent, keep=True)

    def trial(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """As `update`, but the state is left untouched."""
        return self._advance(d, tangent, keep=False)

    def _advance(self, d: ArrayLike, tangent: bool, keep: bool) -> tuple[Array, Array | None]:
        values = numbers("d", d, "m")
        if values.shape != (self.law.tables.dim,):
            raise ValueError(f"d has shape {values.shape}; expected ({self.law.tables.dim},)")
        F, C = self._batch._advance(values[None], None, tangent, keep)
        return F[0], None if C is None else C[0]

    def snapshot(self) -> JointState:
        """A copy of the state."""
        return self._batch.snapshot()

    def restore(self, state: JointState) -> None:
        """Return to a snapshot. Raises ValueError if another law wrote it."""
        self._batch.restore(state)

    def reset(self) -> None:
        """Return to the virgin state."""
        self._batch.reset()

    @property
    def delta(self) -> Array:
        """Displacement since the virgin state (dim,): closure and shear, in m."""
        delta: Array = self._batch.delta[0]
        return delta

    @property
    def F(self) -> Array:
        """Traction (dim,) in Pa."""
        F: Array = self._batch.F[0]
        return F

    @property
    def sliding(self) -> float:
        """Share of asperities in touch whose every cell is at its friction limit."""
        return float(self._batch.sliding[0])

    @property
    def slipping(self) -> float:
        """Share of friction capacity that is at its limit: partial slip."""
        return float(self._batch.slipping[0])

    @property
    def separated(self) -> float:
        """Share of asperities out of touch."""
        return float(self._batch.separated[0])

    @property
    def stored_energy(self) -> float:
        """Elastic energy in J/m2."""
        return float(self._batch.stored_energy[0])

    @property
    def dissipated_energy(self) -> float:
        """Energy in J/m2 lost to friction since the virgin state; never decreases."""
        return float(self._batch.dissipated_energy[0])
