"""One joint with memory."""

from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.reference import Measures
from ..law import JointLaw
from ..support.checks import Array, numbers
from .batch import JointBatch, components
from .state import JointState


class Joint:
    """One joint: as `JointBatch`, with vectors (dim,) and a matrix (dim, dim)."""

    def __init__(self, law: JointLaw) -> None:
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
        return self._advance(d, tangent, keep=True)

    def trial(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """As `update`, but the state is left untouched."""
        return self._advance(d, tangent, keep=False)

    def _advance(self, d: ArrayLike, tangent: bool, keep: bool) -> tuple[Array, Array | None]:
        values, batch = numbers("d", d, "m"), self._batch
        if values.shape != self._shape:
            raise ValueError(
                f"d has shape {values.shape}; expected {self._shape}: {components(self.law)}"
            )
        # the sum is no less than the largest, and NaN if one is
        reach = batch._reach + batch._stretch * sum(map(abs, values.tolist()))
        if not reach <= self.law.largest_reach:  # the batch finds out and says why
            F, C = batch._advance(values[None], None, tangent, None, keep)
            return F[0], None if C is None else C[0]
        step = values[None].copy()  # contiguous and writeable, as the kernel is compiled for
        F, C = np.empty(self._shape_F), np.empty(self._shape_C) if tangent else None
        batch._engine.advance(batch._state, step, F, C, None, keep, True)
        if keep:
            batch._reach = reach
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

    def measures(self) -> Measures:
        """Shares, stored energy and reach of `JointBatch.measures` in one pass, as numbers."""
        return Measures(*(value[0] for value in self._batch.measures()))

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
        """Energy in J/m2 lost to friction since the virgin state; never decreases."""
        return float(self._batch.dissipated_energy[0])
