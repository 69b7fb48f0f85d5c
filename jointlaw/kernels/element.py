"""An element: one of the parallel parts that a joint is the sum of."""

import math
from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np

from ..support.checks import Array


class ElementResponse(NamedTuple):
    """What an element of B joints adds in a step."""

    F: Array  # (dim, B) in Pa
    lost: Array  # (B,) in J/m2, >= 0
    C: Array | None  # (dim, dim, B) in Pa/m, if asked for


class Measures(NamedTuple):
    """What the states of joints amount to, arrays (n,): docs/theory-incremental.md."""

    sliding: Array  # share of all facet orientations: in touch, every cell at its limit
    slipping: Array  # share of the friction capacity that is at its limit
    separated: Array  # share of all facet orientations: out of touch
    stored: Array  # elastic energy, J/m2
    reach: Array  # largest effective closure of any facet, m


class Element(ABC):
    """What every element says of itself; all else about a joint is a sum over its elements.

    Arrays have physical axes first and B joints last. `delta` (dim, B) is the displacement from the
    mated position in m, `state` (rows, B) the element's own rows of the state; zeros are virgin.
    """

    native_name = ""  # of its number in native/layout.py; empty: it runs by the numpy kernel alone
    dim = 1  # components of a displacement that it needs, at least
    rows: dict[str, int]  # of its state: how many, by name
    parted = 1.0  # damage of joints whose faces meet anew
    tensile_strength = 0.0  # Pa: largest tension of an intact joint
    tensile_opening = 0.0  # m: an intact joint bears tension up to this opening
    tensile_stiffness = 0.0  # Pa/m: normal stiffness of an intact joint up to that opening
    stretch = 1.0  # bound of the closure that it feels over the size of the displacement
    reach = math.inf  # m: up to this closure its forces, energies and their squares stay finite
    farthest = 1e304  # m: largest closure that a normal stress is looked for in

    def numbers(self) -> dict[str, float]:
        """Its numbers in `struct jlaw_law`, by the names of native/layout.py."""
        return {}

    @abstractmethod
    def step(
        self, delta: Array, d: Array, state: Array, new: Array, tangent: bool
    ) -> ElementResponse:
        """Advance from `delta` by d (dim, B) in m, from `state` to `new`, which is written."""

    @abstractmethod
    def stiffness(self, delta: Array, state: Array) -> Array:
        """Upper bound (B,) of `|C|` in Pa/m that it adds to joints in these states."""

    def traction(self, delta: Array, state: Array) -> Array:
        """Traction (dim, B) in Pa that a state carries: that of a step by nothing."""
        return self.step(delta, np.zeros_like(delta), state, np.empty_like(state), False).F

    def normal_stress(self, closure: Array) -> Array:
        """Normal stress (...) in Pa of first loading to this closure (...) in m, unsheared."""
        d = np.zeros((self.dim, closure.size))
        d[0] = closure.ravel()
        virgin = np.zeros((sum(self.rows.values()), d.shape[1]))
        F = self.step(np.zeros_like(d), d, virgin, virgin.copy(), False).F
        return F[0].reshape(closure.shape)

    def largest_stiffness(self, closure: Array, shear: Array) -> Array:
        """Upper bound (...) of `|C|` in Pa/m up to this closure and this shear (...) in m."""
        virgin = np.zeros((sum(self.rows.values()), 1))
        return self.stiffness(np.zeros((self.dim, 1)), virgin)[0] + 0.0 * (closure + shear)

    def shear_stiffness(self, delta: Array, stress: float) -> float:
        """Elastic shear stiffness in Pa/m of first loading to `delta` (dim, 1), a closure in m.

        stress: the normal stress in Pa that the element bears there. The default is the tangent of
        a zero increment.
        """
        start = np.zeros_like(delta)
        virgin = np.zeros((sum(self.rows.values()), 1))
        closed = virgin.copy()
        self.step(start, delta, virgin, closed, False)
        C = self.step(delta, start, closed, closed.copy(), True).C
        return 0.0 if C is None or len(delta) == 1 else float(C[1, 1, 0])

    def first_loading_stiffness(self, closure: Array, reduction: float) -> Array:
        """Upper bound (...) in Pa/m of the tangent's norm on first loading to this closure (...).

        reduction: the factor F of a strength reduction, by which a host divides shear displacement
        and shear stress (`Law.strength_reduced`); 1 for none.
        """
        bound = self.largest_stiffness(closure, np.zeros(()))
        return bound * max(1.0, reduction**-2)

    def stored(self, delta: Array, state: Array) -> Array:
        """Elastic energy (B,) in J/m2."""
        return self.measures(delta, state).stored

    def measures(self, delta: Array, state: Array) -> Measures:
        """What slips, touches and is stored; asked of the first element of a joint."""
        raise NotImplementedError(f"{type(self).__name__} may only stand beside asperities")
