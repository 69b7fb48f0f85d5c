"""Resolution of the discretisation: orientations and cells."""

import math
from dataclasses import dataclass

from .declared import check, declared, parameter


@declared
@dataclass(frozen=True)
class Resolution:
    """Number of nodes over which the law sums.

    >>> fine = replace(law, resolution=jl.Resolution(u=5, phi=7, depth=8))
    """

    u: int = parameter(
        "rings of one inclination each (Gauss rule of the density, closest at the steepest)",
        kind=int,
        low=1,
    )
    phi: int = parameter(
        "intervals of azimuth on the half circle of the steepest ring; flatter rings have fewer, "
        "and motion in 3-D has both halves",
        kind=int,
        low=3,
    )
    depth: int = parameter(
        "cells of a facet of the ring with the largest weight; other rings have fewer",
        kind=int,
        low=1,
    )
    lowest: float = parameter(
        "smallest closure for which the cells are placed, as a fraction of the closure range. 1 "
        "places nearly all of them for the largest loads; a smaller fraction spreads them, so that "
        "paths of small loads have small errors too (docs/accuracy.md)",
        "",
        1.0,
        above=0.0,
        high=1.0,
    )

    def __post_init__(self) -> None:
        check(self, "resolution")

    @property
    def sliders(self) -> int:
        """Upper bound of the sliders of a joint in one plane; `law.tables.sliders` is exact."""
        return self.u * (self.phi + 1) * self.depth


# Slip far beyond the closure needs facets, slip no longer than the closure needs cells. Of the
# resolutions with this number of sliders these had the smallest errors over the presets and random
# laws: docs/validation.md, "Friction and dilation angle", and docs/accuracy.md, "Names".
NAMED_RESOLUTIONS = {
    "fast": Resolution(3, 3, 2),
    "balanced": Resolution(3, 6, 3),
    "fine": Resolution(5, 7, 8),
    "reference": Resolution(16, 10, 24),
}
# With a mating length of few closure ranges
MAX_SHORT_MATING_LENGTH = 2.5  # closure ranges
RESOLUTIONS_SHORT = NAMED_RESOLUTIONS | {
    "fast": Resolution(2, 3, 3),
    "balanced": Resolution(2, 4, 4),
}
# With a mating length so long that friction peaks before dilation decays: the steepest facets
# decide
MIN_LONG_MATING_LENGTH = 100.0  # closure ranges
RESOLUTIONS_LONG = {"fine": Resolution(6, 8, 8)}
# With a small yield interference many facets have plastic indentation. The springs that have
# yielded engage at one closure, so that more cells help less than more orientations
MAX_SMALL_YIELD_INTERFERENCE = 0.5  # closure ranges
RESOLUTIONS_YIELDING = {"fine": Resolution(8, 9, 6), "reference": Resolution(16, 20, 20)}
# For quantities that are computed once: in direct shear within 0.03 % of finer nodes over 26
# closure ranges
SHEAR_RESOLUTION = Resolution(10, 10, 6)


def named_resolutions(
    mating_length: float = math.inf,
    yield_interference: float = math.inf,
    closure_range: float = 1.0,
) -> dict[str, Resolution]:
    """The resolutions by name for a law with these lengths (m)."""
    ratio = mating_length / closure_range
    resolutions = NAMED_RESOLUTIONS if ratio >= MAX_SHORT_MATING_LENGTH else RESOLUTIONS_SHORT
    if MIN_LONG_MATING_LENGTH <= ratio < math.inf:
        resolutions = resolutions | RESOLUTIONS_LONG
    if yield_interference / closure_range < MAX_SMALL_YIELD_INTERFERENCE:
        resolutions = resolutions | RESOLUTIONS_YIELDING
    return resolutions


def resolve(
    value: str | Resolution,
    mating_length: float = math.inf,
    yield_interference: float = math.inf,
    closure_range: float = 1.0,
) -> Resolution:
    """A resolution from its name, or itself; the lengths (m) as in `named_resolutions`.

    Raises ValueError for an unknown name.
    """
    if isinstance(value, Resolution):
        return value
    if isinstance(value, str) and value in NAMED_RESOLUTIONS:
        return named_resolutions(mating_length, yield_interference, closure_range)[value]
    raise ValueError(
        f"resolution = {value!r} is unknown; choose one of {', '.join(NAMED_RESOLUTIONS)} "
        "or give Resolution(u, phi, depth)"
    )
