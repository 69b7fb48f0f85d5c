"""One joint with its history variables."""

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


class _SingleJointProperty(Generic[T]):
    """A property of `JointBatch` for a batch of one joint, without the axis over joints."""

    def __init__(self, batch_property: Any, kind: Callable[[Any], T]) -> None:
        self.batch_property = batch_property
        self.kind = kind
        text = batch_property.__doc__ or ""  # `python -OO` has none
        self.__doc__ = text.replace("(n, dim)", "(dim,)").replace(" (n,)", "")

    def __get__(self, joint: Joint | None, owner: type) -> T:
        if joint is None:
            return self  # type: ignore[return-value]  # an attribute of the class, for its documentation
        return self.kind(self.batch_property.fget(joint._batch)[0])


class Joint:
    """One joint, with vectors (dim,) and a matrix (dim, dim) where `JointBatch` has arrays.

    `law.joint()` makes one. batch: of one joint, which belongs to it from then on; law: the law of
    the batch.

    >>> joint = law.joint()
    >>> F, C = joint.update([2e-7, 0.0, 0.0])
    """

    def __init__(self, batch: JointBatch) -> None:
        self._batch = batch
        self.law = batch.law
        dim = batch.law.dim
        d = np.empty((1, dim))
        F = np.empty((1, dim))
        C = np.empty((1, dim, dim))
        self._steps = Step(d, F, None), Step(d, F, C)  # without and with tangent

    def __copy__(self) -> Joint:
        return Joint(copy(self._batch))

    def update(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """Advance by the increment d (dim,) in m: F (dim,) in Pa, C (dim, dim) in Pa/m.

        Without `tangent` C is None, and the step is faster. Raises as `JointBatch.update`.
        """
        return self._step(d, tangent, commit=True)

    def trial(self, d: ArrayLike, tangent: bool = True) -> tuple[Array, Array | None]:
        """As `update` with d and tangent, but the state does not change. Raises the same."""
        return self._step(d, tangent, commit=False)

    def _step(self, d: ArrayLike, tangent: bool, commit: bool) -> tuple[Array, Array | None]:
        step = self._steps[bool(tangent)]
        step.d[0] = increments(d, step.d.shape[1:])
        step.commit = commit
        self._batch.advance(step)
        return step.F[0].copy(), None if step.C is None else step.C[0].copy()

    def snapshot(self) -> JointState:
        """A copy of the state."""
        return self._batch.snapshot()

    def restore(self, state: JointState) -> None:
        """Return to `state`, a snapshot. Raises ValueError if another law wrote it."""
        self._batch.restore(state)

    def reset(self, mated: bool = True) -> None:
        """Return to the initial state.

        mated: True for the virgin state, False for faces that have never met. Raises ValueError for
        a law with permanent interlock.
        """
        self._batch.reset(mated=mated)

    def measures(self) -> Measures:
        """Sliding, slipping and separated fractions, stored energy and largest effective closure
        in one pass, as numbers."""
        return Measures(*(values[0] for values in self._batch.measures()))

    @property
    def kernel(self) -> str:
        """Name of the kernel that advances the joint: "native" or "numpy"."""
        return self._batch.kernel

    delta = _SingleJointProperty(JointBatch.delta, np.asarray)
    F = _SingleJointProperty(JointBatch.F, np.asarray)
    stored_energy = _SingleJointProperty(JointBatch.stored_energy, float)
    dissipated_energy = _SingleJointProperty(JointBatch.dissipated_energy, float)
    plastic_work = _SingleJointProperty(JointBatch.plastic_work, float)
    slope_retention = _SingleJointProperty(JointBatch.slope_retention, float)
    damage = _SingleJointProperty(JointBatch.damage, float)
