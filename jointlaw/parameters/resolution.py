"""How finely the law is discretised: orientations and depth cells."""

from dataclasses import dataclass

from ..support.checks import whole


@dataclass(frozen=True)
class Resolution:
    """Number of nodes that the law sums over.

    u: inclinations (Gauss rule of the density in cos(a theta)), >= 1.
    phi: azimuths on the half circle, >= 3; motion in 3-D uses twice as many.
    depth: cells of touch depth per orientation, >= 1.
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
        """Sliders per joint for motion in one plane; motion in 3-D has twice as many."""
        return self.u * self.phi * self.depth


NAMED = {
    "fast": Resolution(1, 3, 2),
    "balanced": Resolution(2, 3, 4),
    "fine": Resolution(4, 5, 10),
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
