"""How finely the law is discretised: orientations and depth cells."""

import math
from dataclasses import dataclass

from ..support.checks import whole


@dataclass(frozen=True)
class Resolution:
    """Number of nodes that the law sums over.

    u: rings of one inclination each (Gauss rule of the density, crowded to the steepest), >= 1.
    phi: intervals of azimuth on the half circle of the steepest ring, >= 3; flatter rings have
        fewer, and motion in 3-D takes both halves.
    depth: cells of touch depth of a facet of the ring of most weight, >= 1; lighter ones have
        fewer.
    front: one more slider per facet, which moves with the closure: small cycles of closure then
        leave locked-in shear as it is (docs/theory-incremental.md, "A front that moves").
    """

    u: int
    phi: int
    depth: int
    front: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "u", whole("resolution.u", self.u, 1))
        object.__setattr__(self, "phi", whole("resolution.phi", self.phi, 3))
        object.__setattr__(self, "depth", whole("resolution.depth", self.depth, 1))
        if not isinstance(self.front, bool):
            raise ValueError(f"resolution.front = {self.front!r} must be True or False")

    def __repr__(self) -> str:
        front = ", front=True" if self.front else ""
        return f"Resolution(u={self.u}, phi={self.phi}, depth={self.depth}{front})"

    @property
    def sliders(self) -> int:
        """Most sliders a joint may have for motion in one plane; `law.tables.sliders` counts."""
        return self.u * (self.phi + 1) * (self.depth + self.front)


# Slip far beyond the closure asks for facets, slip no longer than the closure for depth cells.
# Chosen with benchmarks/slip.py and benchmarks/nodes.py.
LONG = 2.5  # closure ranges: a critical slip from here on is long
NAMED = {
    "fast": Resolution(3, 3, 2),
    "balanced": Resolution(3, 6, 3),
    "fine": Resolution(5, 7, 8),
    "reference": Resolution(16, 10, 24),
}
NAMED_SHORT = NAMED | {"fast": Resolution(2, 3, 3), "balanced": Resolution(2, 4, 4)}
# What was pressed flat touches all at once, orientation by orientation: more of these, fewer cells
FLAT = 0.5  # closure ranges: a yield interference below presses many facets flat
NAMED_FLAT = {"fine": Resolution(8, 9, 6), "reference": Resolution(16, 20, 20)}
# Direct shear within 0.03 % of finer nodes over 26 closure ranges: for what is computed once
SLIP = Resolution(10, 10, 6)


def named(slip: float = math.inf, interference: float = math.inf) -> dict[str, Resolution]:
    """The resolutions by name, for critical slip and yield interference over closure range."""
    names = NAMED if slip >= LONG else NAMED_SHORT
    return names | NAMED_FLAT if interference < FLAT else names


def resolve(
    value: str | Resolution, slip: float = math.inf, interference: float = math.inf
) -> Resolution:
    """A resolution from its name or itself; `slip` and `interference` as in `named`."""
    if isinstance(value, Resolution):
        return value
    if isinstance(value, str) and value in NAMED:
        return named(slip, interference)[value]
    raise ValueError(
        f"resolution = {value!r} is unknown; choose one of {', '.join(NAMED)} "
        "or give Resolution(u, phi, depth)"
    )
