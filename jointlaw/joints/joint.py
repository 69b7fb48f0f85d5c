"""One joint with memory."""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from ..kernels.element import Measures
from ..kernels.engine import Step
from ..support.checks import Array
from .batch import JointBatch, increments
from .state import JointState

T = TypeVar("T")


class _OfOne(Generic[T]):
    """A property of `JointBatch`, read of a batch of one joint, without the axis over joints."""

    def __init__(self, of_batch: Any, kind: Callable[[Any], T]) -> None:
        self.of_batch, self.kind = of_batch, kind
        text = of_batch.__doc__ or ""  # `python -OO` has none
        self.__doc__ = text.replace("(n, dim)", "(dim,)").replace(" (n,)", "")

    def __get__(self, joint: Joint | None, owner: type) -> T:
        if joint is None:
            return self  # type: ignore[return-value]  # asked of the class, for its documentation
        return self.kind(self.of_batch.fget(joint._batch)[0])


class Joint:
    """One joint: as `JointBatch`, with vectors (dim,) and a matrix (dim, dim).

    `law.joint()` makes one. batch: of one joint, which it takes over; law: that of the batch.

    >>> joint = law.joint()
    >>> F, C = joint.update([2e-7, 0.0, 0.0])
    """

    def __init__(self, batch: JointBatch) -> None:
        self._batch = batch
        self.law = law = batch.law
        d, F, C = np.empty((1, law.dim)), np.empty((1, law.dim)), np.empty((1, law.dim, law.dim))
        self._steps = Step(d, F, None), Step(d, F, C)  # without and with tangent

    def __copy__(self) -> Joint:
        return Joint(copy(self._batch))

    def update(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """Advance by the increment d (dim,) in m: F (dim,) in Pa, C (dim, dim) in Pa/m.

        tangent: without it C is None, and the step is faster. Raises as `JointBatch.update`.
        """
        return self._step(d, tangent, keep=True)

    def trial(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """As `update` of d, tangent or not, but the state is left untouched. Raises the same."""
        return self._step(d, tangent, keep=False)

    def _step(self, d: ArrayLike, tangent: bool, keep: bool) -> tuple[Array, Array | None]:
        step = self._steps[bool(tangent)]
        step.d[0] = increments(d, step.d.shape[1:])
        step.keep = keep
        self._batch.take(step)
        return step.F[0].copy(), None if step.C is None else step.C[0].copy()

    def snapshot(self) -> JointState:
        """A copy of the state."""
        return self._batch.snapshot()

    def restore(self, state: JointState) -> None:
        """Return to `state`, a snapshot. Raises ValueError if another law wrote it."""
        self._batch.restore(state)

    def reset(self, mated: bool = True) -> None:
        """Return to the start: the virgin state, or that of faces that have never met.

        mated: which of the two. Raises ValueError for a law that is always mated.
        """
        self._batch.reset(mated=mated)

    def measures(self) -> Measures:
        """Shares, stored energy and reach in one pass, as numbers."""
        return Measures(*(values[0] for values in self._batch.measures()))

    @property
    def kernel(self) -> str:
        """Which kernel advances the joint: "native" or "numpy"."""
        return self._batch.kernel

    delta = _OfOne(JointBatch.delta, np.asarray)
    F = _OfOne(JointBatch.F, np.asarray)
    stored_energy = _OfOne(JointBatch.stored_energy, float)
    dissipated_energy = _OfOne(JointBatch.dissipated_energy, float)
    plastic_work = _OfOne(JointBatch.plastic_work, float)
    slopes = _OfOne(JointBatch.slopes, float)
    damage = _OfOne(JointBatch.damage, float)
