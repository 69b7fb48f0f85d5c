"""The readable kernel: a joint is the sum of its elements. All others are tested against it.

Symbols and order are those of docs/theory-incremental.md. Arrays carry physical axes first and B
joints last. A state (rows, B) holds

    delta (dim) | dissipated energy (1) | rows of the first element | of the second | ...

where delta is counted from the mated position.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from types import SimpleNamespace

import numpy as np

from ..discretisation.tables import FacetTables
from ..support.checks import Array
from . import asperities
from .asperities import Asperities
from .element import Element, Measures
from .mating import first_touch


@dataclass(frozen=True, eq=False)
class LawTables:
    """All that a kernel reads of a law: its elements. The first tells what slips and touches."""

    dim: int  # components of a displacement: 3, 2 in one plane, 1 for closure alone
    elements: tuple[Element, ...]

    @cached_property
    def names(self) -> dict[str, int]:
        """Rows of a state by name, in their order: how many of each."""
        own = [row for element in self.elements for row in element.rows.items()]
        return {"delta": self.dim, "dissipated": 1, **dict(own)}

    @cached_property
    def first(self) -> dict[str, int]:
        """Number of the first row of each name."""
        return dict(zip(self.names, accumulate(self.names.values(), initial=0), strict=False))

    @cached_property
    def rows(self) -> int:
        """Numbers of a state."""
        return sum(self.names.values())

    @property
    def asperities(self) -> FacetTables | None:
        """The tables of the asperities, if the law has any."""
        first = self.elements[0]
        return first.k if isinstance(first, Asperities) else None

    @cached_property
    def python_only(self) -> list[str]:
        """Names of the classes of elements without C: the law runs by the numpy kernel.

        A subclass of an element with C counts as one without, unless it has a `native_name` too.
        """
        kinds = [type(element) for element in self.elements]
        return [kind.__name__ for kind in kinds if not vars(kind).get("native_name")]

    @property
    def sliders(self) -> int:
        """Sliders of a joint, at least one."""
        return 1 if self.asperities is None else self.asperities.sliders

    @property
    def yields(self) -> bool:
        """Whether asperities yield."""
        return self.asperities is not None and self.asperities.yields

    @property
    def fades(self) -> bool:
        """Whether slopes fade with the distance from the mated position."""
        return self.asperities is not None and self.asperities.fades

    @property
    def unmated_start(self) -> Array:
        """`delta` (dim,) in m of a joint whose faces have never met, at first touch.

        Zeros where nothing but a bond or cohesion is missing. Raises ValueError where nothing is.
        """
        k = self.asperities
        if k is None or ("damage" in self.names and not (k.fades and k.dim > 1)):
            return np.zeros(self.dim)
        return first_touch(k)

    @property
    def stretch(self) -> float:
        """Bound of the closure that an element feels over the size of the displacement."""
        return max(element.stretch for element in self.elements)

    def own(self, *states: Array) -> Iterator[tuple[Element, list[Array]]]:
        """Every element with its own rows of these states, as views."""
        at = self.dim + 1
        for element in self.elements:
            end = at + sum(element.rows.values())
            yield element, [state[at:end] for state in states]
            at = end


def step(k: LawTables, state: Array, d: Array, tangent: bool) -> tuple[Array, Array, Array | None]:
    """Advance joints by the increments d (dim, B): new state, F (dim, B), C (dim, dim, B).

    The displacement grows by d; tractions, tangents and losses of the elements add up. Their own
    numbered steps: `Asperities.step`, `Bonded.step`, `Coulomb.step`.
    """
    new, dim = np.array(state), k.dim
    new[:dim] += d
    F, lost = np.zeros_like(d), np.zeros(d.shape[1])
    C = np.zeros((dim, dim, d.shape[1])) if tangent else None
    for element, (before, after) in k.own(state, new):
        share = element.step(state[:dim], d, before, after, tangent)
        F, lost = F + share.F, lost + share.lost
        if C is not None and share.C is not None:
            C = C + share.C
    new[dim] += lost
    return new, F, C


def parts(k: LawTables, state: Array) -> SimpleNamespace:
    """Views of the parts of a state array by name, as rows (B,) where there is one of a kind.

    Those of asperities as `asperities.State` has them, and the share of the slopes that is left.
    """
    named = {
        name: state[at] if several == 1 and at else state[at : at + several]
        for (name, several), at in zip(k.names.items(), k.first.values(), strict=True)
    }
    for element, (own,) in k.own(state):
        if isinstance(element, Asperities):
            now = asperities.parts(element.k, own)
            named |= {**now._asdict(), "slopes": now.slopes}
    return SimpleNamespace(**named)


def traction(k: LawTables, state: Array) -> Array:
    """Traction F (dim, B) in Pa that a state carries."""
    bear = [element.traction(state[: k.dim], own) for element, (own,) in k.own(state)]
    return np.sum(bear, axis=0)


def stiffness(k: LawTables, state: Array) -> Array:
    """Upper bound (B,) of `|C|` in Pa/m of joints in these states."""
    bounds = [element.stiffness(state[: k.dim], own) for element, (own,) in k.own(state)]
    return np.sum(bounds, axis=0)


def measures(k: LawTables, state: Array) -> Measures:
    """Shares, stored energy and reach of a batch of states (rows, B)."""
    delta = state[: k.dim]
    (first, (own,)), *others = k.own(state)
    now = first.measures(delta, own)
    beside = (element.stored(delta, own) for element, (own,) in others)
    return now._replace(stored=sum(beside, start=now.stored))
