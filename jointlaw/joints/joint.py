"""One joint with memory."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.engine import Step
from ..kernels.reference import Measures
from ..support.checks import Array
from .batch import JointBatch, Law, increments
from .state import JointState


class Joint:
    """One joint: as `JointBatch`, with vectors (dim,) and a matrix (dim, dim)."""

    def __init__(self, law: Law) -> None:
        self.law = law
        self._batch = JointBatch(law, 1)
        dim = law.tables.dim
        self._shape, self._shape_F, self._shape_C = (dim,), (1, dim), (1, dim, dim)

    def __copy__(self) -> Joint:
        twin = Joint(self.law)
        twin._batch = copy(self._batch)
        return twin

    def __repr__(self) -> str:
        return f"<Joint at delta = {self.delta} m>"

    def update(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """Advance by the increment d (dim,) in m: F (dim,) in Pa, C (dim, dim) in Pa/m."""
        return self._step(d, tangent, keep=True)

    def trial(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """As `update`, but the state is left untouched."""
        return self._step(d, tangent, keep=False)

    def _step(self, d: ArrayLike, tangent: bool, keep: bool) -> tuple[Array, Array | None]:
        values = increments(d, self._shape)[None].copy()  # the caller's may be strided
        F, C = np.empty(self._shape_F), np.empty(self._shape_C) if tangent else None
        self._batch.take(Step(values, F, C, None, keep))
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
        return self._batch.delta[0]

    @property
    def F(self) -> Array:
        """Traction (dim,) in Pa."""
        return self._batch.F[0]

    def measures(self) -> Measures:
        """Shares, stored energy and reach in one pass, as numbers."""
        return Measures(*(values[0] for values in self._batch.measures()))

    @property
    def sliding(self) -> float:
        """Share of all facet orientations: in touch, and every cell at its friction limit."""
        return float(self._batch.sliding[0])

    @property
    def slipping(self) -> float:
        """Share of friction capacity that is at its limit: partial slip."""
        return float(self._batch.slipping[0])

    @property
    def separated(self) -> float:
        """Share of all facet orientations: out of touch."""
        return float(self._batch.separated[0])

    @property
    def stored_energy(self) -> float:
        """Elastic energy in J/m2."""
        return float(self._batch.stored_energy[0])

    @property
    def dissipated_energy(self) -> float:
        """Energy in J/m2 lost since the virgin state, to friction and to yielding asperities; never
        decreases."""
        return float(self._batch.dissipated_energy[0])

    @property
    def plastic_work(self) -> float:
        """The part of the dissipated energy, in J/m2, that yielding asperities took."""
        return float(self._batch.plastic_work[0])

    @property
    def friction(self) -> float:
        """Friction coefficient of the asperities, worn by their slip so far."""
        return float(self._batch.friction[0])
