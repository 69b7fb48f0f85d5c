"""How finely the law is discretised: orientations and depth cells."""

import math
from dataclasses import dataclass

from ..support.checks import integer, more_than


@dataclass(frozen=True)
class Resolution:
    """Number of nodes that the law sums over.

    u: rings of one inclination each (Gauss rule of the density, crowded to the steepest), >= 1.
    phi: intervals of azimuth on the half circle of the steepest ring, >= 3; flatter rings have
        fewer, and motion in 3-D takes both halves.
    depth: cells of touch depth of a facet of the ring of most weight, >= 1; lighter ones have
        fewer.
    lowest: smallest closure that the cells are made for, as a share of the closure range, > 0 to 1.
        1 puts nearly all of them where the largest loads act; a smaller share spreads them, so that
        paths of small loads have small errors too (docs/accuracy.md).
    """

    u: int
    phi: int
    depth: int
    lowest: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "u", integer("resolution.u", self.u, 1))
        object.__setattr__(self, "phi", integer("resolution.phi", self.phi, 3))
        object.__setattr__(self, "depth", integer("resolution.depth", self.depth, 1))
        object.__setattr__(self, "lowest", more_than("resolution.lowest", self.lowest, 0.0))
        if self.lowest > 1.0:
            raise ValueError(
                f"resolution.lowest = {self.lowest!r} is out of bounds: it is a share of the "
                "closure range, 1 at most; for larger closures raise closure_range"
            )

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
