"""The readable kernel: a joint is the sum of its elements. All other kernels are tested against it.

Symbols and order are as in docs/theory-incremental.md. Arrays carry physical axes first and B
joints last. A state (rows, B) holds

    delta (dim) | dissipated energy (1) | rows of the first element | rows of the second | ...

where delta is the displacement from the interlocked position.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from types import SimpleNamespace

import numpy as np

from ..discretisation.tables import FacetTables
from ..native.layout import LARGEST_FLOAT
from ..support.checks import Array
from .asperities import AsperityElement
from .element import Element, Measures
from .float_sliders import SliderPacking
from .interlock import first_touch


@dataclass(frozen=True, eq=False)
class LawTables:
    """Everything that a kernel reads of a law: its elements.

    dim: components of a displacement: 3, 2 in one plane, 1 for closure alone; elements: parallel
    components, the first of which provides the measures of a joint.
    """

    dim: int
    elements: tuple[Element, ...]

    def __post_init__(self) -> None:
        owners = {"delta": "the joint", "dissipated_energy": "the joint"}
        for element in self.elements:
            name = type(element).__name__
            for row in element.rows:
                if row in owners:
                    raise ValueError(
                        f"{owners[row]} and {name} have a state row of the same name, {row!r}: "
                        "rename it in one of them"
                    )
                owners[row] = name
            if element.damage_row and element.damage_row not in element.rows:
                raise ValueError(
                    f"{name}.damage_row = {element.damage_row!r} is none of its rows: "
                    f"{', '.join(element.rows) or 'it has none'}"
                )

    @cached_property
    def row_counts(self) -> dict[str, int]:
        """Number of rows of a state by name, in their order."""
        rows = {"delta": self.dim, "dissipated_energy": 1}
        for element in self.elements:
            rows |= element.rows
        return rows

    @cached_property
    def first_rows(self) -> dict[str, int]:
        """Index of the first row of each name."""
        counts = self.row_counts
        return dict(zip(counts, accumulate(counts.values(), initial=0), strict=False))

    @cached_property
    def rows(self) -> int:
        """Numbers of a state."""
        return sum(self.row_counts.values())

    @cached_property
    def state_bounds(self) -> tuple[Array, Array]:
        """Lower and upper bound (rows,) of every number of a state; finite."""
        largest = min(element.max_effective_closure for element in self.elements)
        displacement = largest / self.closure_per_displacement
        bounds = {"delta": (-displacement, displacement)}
        for element in self.elements:
            bounds |= element.row_bounds
        of_rows = [
            bounds.get(name, (-LARGEST_FLOAT, LARGEST_FLOAT))
            for name, count in self.row_counts.items()
            for _ in range(count)
        ]
        lower, upper = np.clip(of_rows, -LARGEST_FLOAT, LARGEST_FLOAT).T.copy()
        return lower, upper

    @property
    def asperities(self) -> FacetTables | None:
        """Tables of the asperities, None for a law without asperities."""
        first = self.elements[0]
        return first.k if isinstance(first, AsperityElement) else None

    @cached_property
    def with_float_sliders(self) -> "LawTables":
        """The same tables, whose steps round the forces of sliders to floats."""
        elements = [
            element.with_float_sliders() if isinstance(element, AsperityElement) else element
            for element in self.elements
        ]
        return LawTables(self.dim, tuple(elements))

    @cached_property
    def max_closure_with_float_sliders(self) -> float:
        """Effective closure (m) up to which forces are finite and slider forces fit into floats."""
        elements = self.elements
        limits = [element.max_effective_closure for element in elements]
        limits += [e.max_float_closure for e in elements if isinstance(e, AsperityElement)]
        return min(limits)

    @cached_property
    def slider_packing(self) -> SliderPacking:
        """Packing of states whose slider forces are stored as float."""
        if not any(isinstance(element, AsperityElement) for element in self.elements):
            return SliderPacking(self.rows, self.rows, 0)
        return SliderPacking(self.rows, self.first_rows["q"], self.row_counts["q"] // 2)

    @cached_property
    def python_only(self) -> list[str]:
        """Names of the classes of elements without a C version; such a law runs in numpy.

        A subclass of an element with C counts as one without, unless it has a `native_name` too.
        """
        kinds = [type(element) for element in self.elements]
        return [kind.__name__ for kind in kinds if not vars(kind).get("native_name")]

    @property
    def sliders(self) -> int:
        """Number of sliders of a joint, at least one."""
        return 1 if self.asperities is None else self.asperities.sliders

    @property
    def yields(self) -> bool:
        """Whether asperities are elastic-perfectly plastic."""
        return self.asperities is not None and self.asperities.yields

    @property
    def degrades_by_stress(self) -> bool:
        """Whether asperities degrade by the contact stress."""
        return self.asperities is not None and self.asperities.degrades_by_stress

    @property
    def interlock_decays(self) -> bool:
        """Whether the interlock decays with slip, over the mating length."""
        return self.asperities is not None and self.asperities.interlock_decays

    @property
    def breaks(self) -> bool:
        """Whether joints have a bond or cohesion, which can break."""
        return bool(self.damage_rows)

    @cached_property
    def damage_rows(self) -> dict[int, float]:
        """Damage of every element that can break, after separation, by its row in a state."""
        return {
            self.first_rows[element.damage_row]: element.separated_damage
            for element in self.elements
            if element.damage_row
        }

    @property
    def unmated_start(self) -> Array:
        """`delta` (dim,) in m at first touch of a joint whose faces have never met.

        Zeros for a law that always interlocks but whose bond or cohesion can break. Raises
        ValueError for a law without either.
        """
        k = self.asperities
        always_interlocks = k is None or not (k.interlock_decays and k.dim > 1)
        if k is None or (self.breaks and always_interlocks):
            return np.zeros(self.dim)
        return first_touch(k)

    @property
    def closure_per_displacement(self) -> float:
        """Upper bound of the effective closure of any element over the size of the displacement."""
        return max(element.closure_per_displacement for element in self.elements)

    def element_rows(self, *states: Array) -> Iterator[tuple[Element, list[Array]]]:
        """Yield every element with its rows of these `states` (rows, B), as views."""
        first = self.dim + 1
        for element in self.elements:
            end = first + sum(element.rows.values())
            yield element, [state[first:end] for state in states]
            first = end


def step(k: LawTables, state: Array, d: Array, tangent: bool) -> tuple[Array, Array, Array | None]:
    """Advance joints by the increments d (dim, B): new state, F (dim, B), C (dim, dim, B).

    The displacement grows by d; tractions, tangents and dissipated energies of the elements add up.
    Their steps are numbered in `AsperityElement.step`, `BondElement.step`, `CoulombElement.step`.
    """
    dim = k.dim
    new = np.array(state)
    new[:dim] += d
    F = np.zeros_like(d)
    dissipated = np.zeros(d.shape[1])
    C = np.zeros((dim, dim, d.shape[1])) if tangent else None
    for element, (before, after) in k.element_rows(state, new):
        response = element.step(state[:dim], d, before, after, tangent)
        F = F + response.F
        dissipated = dissipated + response.dissipated
        if C is not None and response.C is not None:
            C = C + response.C
    new[dim] += dissipated
    new += 0.0  # a negative zero becomes positive, as in the compiled law
    return new, F, C


def state_parts(k: LawTables, state: Array) -> SimpleNamespace:
    """Views of the parts of states (rows, B) by name; a name with one row is an array (B,).

    For asperities the parts of `AsperityState`, and the slope retention.
    """
    parts = {}
    for name, count in k.row_counts.items():
        first = k.first_rows[name]
        parts[name] = state[first] if count == 1 and first else state[first : first + count]
    for element, (rows,) in k.element_rows(state):
        if isinstance(element, AsperityElement):
            asperities = element.unpack(rows)
            parts |= {**asperities._asdict(), "slope_retention": asperities.slope_retention}
    return SimpleNamespace(**parts)


def traction(k: LawTables, state: Array) -> Array:
    """Traction F (dim, B) in Pa of states."""
    delta = state[: k.dim]
    tractions = [element.traction(delta, rows) for element, (rows,) in k.element_rows(state)]
    return np.sum(tractions, axis=0)


def stiffness(k: LawTables, state: Array) -> Array:
    """Upper bound (B,) of `|C|` in Pa/m of joints in these states."""
    delta = state[: k.dim]
    bounds = [element.stiffness(delta, rows) for element, (rows,) in k.element_rows(state)]
    return np.sum(bounds, axis=0)


def damage(k: LawTables, state: Array) -> Array:
    """Damage (B,) of states (rows, B): of the least damaged element; 0 to 1, 1 without damage."""
    return np.min([np.ones(state.shape[1]), *state[list(k.damage_rows)]], axis=0)


def measures(k: LawTables, state: Array) -> Measures:
    """`Measures` of a batch of states (rows, B): all of the first element, whose stored energy is
    replaced by the sum over elements.
    """
    delta = state[: k.dim]
    (first, (rows,)), *remaining = k.element_rows(state)
    result = first.measures(delta, rows)
    stored_energy = result.stored_energy
    for element, (rows,) in remaining:
        stored_energy = stored_energy + element.stored_energy(delta, rows)
    return result._replace(stored_energy=stored_energy)
