"""How finely the law is discretised: orientations and depth cells."""

import math
from dataclasses import dataclass

from .declared import check, declared, parameter


@declared
@dataclass(frozen=True)
class Resolution:
    """Number of nodes that the law sums over.

    >>> fine = replace(law, resolution=jl.Resolution(u=5, phi=7, depth=8))
    """

    u: int = parameter(
        "rings of one inclination each (Gauss rule of the density, crowded to the steepest)",
        kind=int, low=1,
    )  # fmt: skip
    phi: int = parameter(
        "intervals of azimuth on the half circle of the steepest ring; flatter rings have fewer, "
        "and motion in 3-D takes both halves", kind=int, low=3,
    )  # fmt: skip
    depth: int = parameter(
        "cells of touch depth of a facet of the ring of most weight; lighter ones have fewer",
        kind=int, low=1,
    )  # fmt: skip
    lowest: float = parameter(
        "smallest closure that the cells are made for, as a share of the closure range. 1 puts "
        "nearly all of them where the largest loads act; a smaller share spreads them, so that "
        "paths of small loads have small errors too (docs/accuracy.md)", "", 1.0,
        above=0.0, high=1.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        check(self, "resolution")

    @property
    def sliders(self) -> int:
        """Most sliders a joint may have for motion in one plane; `law.tables.sliders` counts."""
        return self.u * (self.phi + 1) * self.depth


# Slip far beyond the closure asks for facets, slip no longer than the closure for depth cells.
# Of the resolutions with as few sliders these had the smallest errors over the presets and random
# laws: docs/validation.md, "Friction and dilation angle", and docs/accuracy.md, "Names".
LONG = 2.5  # closure ranges: a mating length from here on is long
NAMED = {
    "fast": Resolution(3, 3, 2),
    "balanced": Resolution(3, 6, 3),
    "fine": Resolution(5, 7, 8),
    "reference": Resolution(16, 10, 24),
}
NAMED_SHORT = NAMED | {"fast": Resolution(2, 3, 3), "balanced": Resolution(2, 4, 4)}
# Where slopes fade that late friction peaks before they do: the steepest facets decide
LATE = 100.0  # closure ranges
NAMED_LATE = {"fine": Resolution(6, 8, 8)}
# The flattened springs of a facet all touch at the same closure, so that more depth cells help
# less than more orientations
FLAT = 0.5  # closure ranges: with a smaller yield interference many facets are flattened
NAMED_FLAT = {"fine": Resolution(8, 9, 6), "reference": Resolution(16, 20, 20)}
# Direct shear within 0.03 % of finer nodes over 26 closure ranges: for what is computed once
SLIP = Resolution(10, 10, 6)


def named(
    mating_length: float = math.inf,
    yield_interference: float = math.inf,
    closure_range: float = 1.0,
) -> dict[str, Resolution]:
    """The resolutions by name of a law with these lengths (m)."""
    lengths = mating_length / closure_range
    names = NAMED if lengths >= LONG else NAMED_SHORT
    if LATE <= lengths < math.inf:
        names = names | NAMED_LATE
    return names | NAMED_FLAT if yield_interference / closure_range < FLAT else names


def resolve(
    value: str | Resolution,
    mating_length: float = math.inf,
    yield_interference: float = math.inf,
    closure_range: float = 1.0,
) -> Resolution:
    """A resolution from its name or itself; the lengths (m) as in `named`."""
    if isinstance(value, Resolution):
        return value
    if isinstance(value, str) and value in NAMED:
        return named(mating_length, yield_interference, closure_range)[value]
    raise ValueError(
        f"resolution = {value!r} is unknown; choose one of {', '.join(NAMED)} "
        "or give Resolution(u, phi, depth)"
    )
