"""What joints ask of their law; the laws themselves lie above them."""

from typing import Any, Protocol

from numpy.typing import ArrayLike

from ..kernels.reference import Tables


class LawLike(Protocol):
    """A law, as joints and laboratory tests see it: `jointlaw.laws.law.Law`."""

    plane: float | None  # azimuth (rad) of the one plane of motion, if there is one

    @property
    def tables(self) -> Tables:
        """What the kernels read."""

    @property
    def fingerprint(self) -> str:
        """By which a state knows its law."""

    @property
    def dim(self) -> int:
        """Components of a displacement."""

    @property
    def state_size(self) -> int:
        """Numbers of state of one joint."""

    @property
    def largest_reach(self) -> float:
        """Closure (m) up to which forces are finite."""

    def closure(self, normal_stress: ArrayLike) -> Any:
        """Closure (m) at a normal stress (Pa)."""

    def crushed(self, closure: float) -> float:
        """Share of the asperities in touch at this closure (m), if they yield; else 0."""
