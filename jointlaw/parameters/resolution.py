"""How finely the law is discretised: orientations and depth cells."""

from dataclasses import dataclass

from ..support.checks import whole


@dataclass(frozen=True)
class Resolution:
    """Number of nodes that the law sums over.

    u: rings of one inclination each (Gauss rule of the density, crowded to the steepest), >= 1.
    phi: intervals of azimuth on the half circle of the longest ring, >= 3; shorter rings have
        fewer, and motion in 3-D takes both halves.
    depth: cells of touch depth of a facet of the ring of most weight, >= 1; lighter ones have
        fewer.
    """

    u: int
    phi: int
    depth: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "u", whole("resolution.u", self.u, 1))
        object.__setattr__(self, "phi", whole("resolution.phi", self.phi, 3))
        object.__setattr__(self, "depth", whole("resolution.depth", self.depth, 1))

    @property
    def sliders(self) -> int:
        """Most sliders a joint may have for motion in one plane; `law.tables.sliders` counts."""
        return self.u * (self.phi + 1) * self.depth


NAMED = {
    "fast": Resolution(2, 3, 2),
    "balanced": Resolution(3, 5, 3),
    "fine": Resolution(5, 6, 8),
    "reference": Resolution(16, 10, 24),
}


def resolve(value: str | Resolution) -> Resolution:
    """A resolution from its name or itself."""
    if isinstance(value, Resolution):
        return value
    if isinstance(value, str) and value in NAMED:
        return NAMED[value]
    raise ValueError(
        f"resolution = {value!r} is unknown; choose one of {', '.join(NAMED)} "
        "or give Resolution(u, phi, depth)"
    )
