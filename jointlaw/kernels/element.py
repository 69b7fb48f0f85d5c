"""An element: one of the parallel components whose tractions add up to the traction of a joint."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..support.checks import Array


class ElementResponse(NamedTuple):
    """Contribution of an element to a step of B joints.

    F: traction; dissipated: energy; C: tangent, None unless requested.
    """

    F: Array  # traction (dim, B) in Pa
    dissipated: Array  # (B,) in J/m2, >= 0
    C: Array | None  # tangent (dim, dim, B) in Pa/m, None unless requested


class Measures(NamedTuple):
    """Scalar measures of the states of joints, arrays (n,): docs/theory-incremental.md."""

    sliding: Array  # weight fraction of the facets in touch with every cell at its friction limit
    slipping: Array  # fraction of the friction capacity that is exhausted
    separated: Array  # weight fraction of the facets that do not touch
    stored_energy: Array  # elastic energy, J/m2
    max_effective_closure: Array  # of all facets, m


class Element(ABC):
    """Base class of elements: the properties and functions that every element declares.

    All other quantities of a joint are sums over its elements. Arrays have physical axes first and
    B joints last. `delta` (dim, B) is the displacement from the interlocked position in m, `state`
    (rows, B) the rows of the state that belong to the element; zeros are the virgin state.

    The names of rows differ from the names of all other elements of a law. An element that bears
    tension sets `tensile_strength`, `tensile_opening` and `tensile_stiffness`, and has a row that
    `damage_row` names: 0 while the element is intact, and >= 1 once it has failed.
    """

    native_name = ""  # its name in native/layout.py; empty if it has no C version
    dim = 1  # least number of components of a displacement
    rows: dict[str, int]  # number of rows of its state by name; empty without history variables
    row_bounds: Mapping[str, tuple[float, float]] = MappingProxyType({})  # by name; default: finite
    damage_row = ""  # name of the row of its damage; empty for an element that does not break
    separated_damage = 1.0  # its damage once the faces have separated
    tensile_strength = 0.0  # Pa: largest tension of an intact joint
    tensile_opening = 0.0  # m: an intact joint bears tension up to this opening
    tensile_stiffness = 0.0  # Pa/m: normal stiffness of an intact joint up to that opening
    closure_per_displacement = 1.0  # upper bound of |effective closure| over |displacement|
    max_effective_closure = math.inf  # m: beyond it forces, energies or their squares overflow
    max_search_closure = 1e304  # m: upper end of the search for the closure at a normal stress

    def numbers(self) -> dict[str, float]:
        """Numbers of the element in `struct jlaw_law`, by the names of native/layout.py."""
        return {}

    @abstractmethod
    def step(
        self, delta: Array, d: Array, state: Array, new: Array, tangent: bool
    ) -> ElementResponse:
        """Advance joints by a displacement increment.

        delta: displacement (dim, B) in m before the step; d: increment (dim, B) in m; state: rows
        before the step; new: rows after the step, which are written; their contents before are
        arbitrary. Returns the traction after the step, the dissipated energy, and with `tangent`
        the consistent tangent dF/dd.
        """

    @abstractmethod
    def stiffness(self, delta: Array, state: Array) -> Array:
        """Upper bound (B,) of its part of `|C|` in Pa/m, for joints at displacements `delta`
        (dim, B) in m with rows of `state`."""

    def traction(self, delta: Array, state: Array) -> Array:
        """Traction (dim, B) in Pa of a `state` at displacements `delta` (dim, B), from a zero
        increment."""
        return self.step(delta, np.zeros_like(delta), state, np.empty_like(state), False).F

    def normal_stress(self, closure: Array) -> Array:
        """Normal stress (...) in Pa of first loading to this closure (...) in m, unsheared."""
        d = np.zeros((self.dim, closure.size))
        d[0] = closure.ravel()
        virgin = self._virgin_rows(closure.size)
        F = self.step(np.zeros_like(d), d, virgin, virgin.copy(), False).F
        return F[0].reshape(closure.shape)

    def largest_stiffness(self, closure: Array, shear: Array) -> Array:
        """Upper bound (...) of `|C|` in Pa/m up to this closure and this shear (...) in m."""
        bound = self.stiffness(np.zeros((self.dim, 1)), self._virgin_rows(1))[0]
        return bound + 0.0 * (closure + shear)

    def shear_stiffness(self, delta: Array, stress: float) -> float:
        """Elastic shear stiffness in Pa/m after first loading to `delta` (dim, 1), a closure in m.

        stress: the normal stress in Pa that the element bears there. The default is the tangent of
        a zero increment.
        """
        if len(delta) == 1:
            return 0.0
        start = np.zeros_like(delta)
        virgin = self._virgin_rows(1)
        loaded = virgin.copy()
        self.step(start, delta, virgin, loaded, False)
        C = self.step(delta, start, loaded, loaded.copy(), True).C
        return 0.0 if C is None else float(C[1, 1, 0])

    def first_loading_stiffness(self, closure: Array, reduction: float) -> Array:
        """Upper bound (...) of `|C|` in Pa/m during first loading to this closure (...) in m.

        reduction: the factor F of a strength reduction, by which a host divides shear displacement
        and shear stress (`Law.strength_reduced`); 1 for none.
        """
        bound = self.largest_stiffness(closure, np.zeros(()))
        return bound * max(1.0, reduction**-2)

    def stored_energy(self, delta: Array, state: Array) -> Array:
        """Elastic energy (B,) in J/m2 of a `state` at displacements `delta` (dim, B) in m."""
        return self.measures(delta, state).stored_energy

    def measures(self, delta: Array, state: Array) -> Measures:
        """Measures (B,) of a `state` at displacements `delta` (dim, B) in m.

        Needed only if the element is the first one of a law. Raises NotImplementedError otherwise.
        """
        raise NotImplementedError(
            f"{type(self).__name__} has no measures: put it after the first element of the law"
        )

    def _virgin_rows(self, n: int) -> Array:
        return np.zeros((sum(self.rows.values()), n))
