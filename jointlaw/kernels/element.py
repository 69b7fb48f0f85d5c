"""An element: one of the parallel parts that a joint is the sum of."""

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np

from ..support.checks import Array


class Share(NamedTuple):
    """What an element of B joints adds to a step."""

    F: Array  # (dim, B) in Pa
    lost: Array  # (B,) in J/m2, >= 0
    C: Array | None  # (dim, dim, B) in Pa/m, if asked for


class Element(ABC):
    """What every element says of itself; all else about a joint is a sum over its elements.

    Arrays have physical axes first and B joints last. `delta` (dim, B) is the displacement from the
    mated position in m, `state` (rows, B) the element's own rows of the state; zeros are virgin.
    """

    rows: int  # of its state

    @abstractmethod
    def numbers(self) -> dict[str, float]:
        """Its numbers in `struct jlaw_law`, by the names of native/layout.py."""

    @abstractmethod
    def step(self, delta: Array, d: Array, state: Array, new: Array, tangent: bool) -> Share:
        """Advance from `delta` by d (dim, B) in m, from `state` to `new`, which is written."""

    @abstractmethod
    def stored(self, delta: Array, state: Array) -> Array:
        """Elastic energy (B,) in J/m2."""

    @abstractmethod
    def stiffness(self, delta: Array, state: Array) -> Array:
        """Upper bound (B,) of `|C|` in Pa/m that it adds to joints in these states."""

    @abstractmethod
    def largest_stiffness(self, closure: Array, shear: Array) -> Array:
        """Upper bound (...) of `|C|` in Pa/m up to this closure and this shear (...) in m."""

    def traction(self, delta: Array, state: Array) -> Array:
        """Traction (dim, B) in Pa that a state carries: that of a step by nothing."""
        return self.step(delta, np.zeros_like(delta), state, np.empty_like(state), False).F

    def normal_stress(self, closure: Array) -> Array:
        """Normal stress (...) in Pa of first loading to this closure (...) in m, unsheared."""
        d = closure.reshape(1, -1)
        virgin = np.zeros((self.rows, d.shape[1]))
        F = self.step(np.zeros_like(d), d, virgin, virgin.copy(), False).F
        return F[0].reshape(closure.shape)
