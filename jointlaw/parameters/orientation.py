"""Directions of asperity contacts: the density of Eq. 14."""

import math
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from ..support.checks import Array, at_least, finite, more_than, number
from .declared import declared, parameter


def largest_c(b: float) -> float:
    """Largest |c| at which the density stays positive, Eq. 18."""
    return 1 / 3 - b / 6


def bounded(a: Any, b: Any, c: Any, *, smooth: bool = False) -> tuple[float, float, float]:
    """Validate a, b and c of Eq. 14 by the bounds of Eq. 18; `smooth` allows an infinite a."""
    a = at_least("orientation.a", a, 1.0, infinite=smooth)
    b, c = number("orientation.b", b), number("orientation.c", c)
    if not -1.0 <= b <= 2.0:
        raise ValueError(
            f"orientation.b = {b!r} is out of bounds: -1 <= b <= 2 (Eq. 18), "
            "or the density turns negative"
        )
    bound = largest_c(b)
    if abs(c) > bound + 1e-12:  # 1e-12 allows the bound itself in decimals
        raise ValueError(
            f"orientation.c = {c!r} is out of bounds: |c| <= 1/3 - b/6 = {bound:.9g} "
            "(Eq. 18), or the density turns negative"
        )
    return a, b, c


def shape(u: Array, b: float) -> Array:
    """Density of Eq. 14 over u = cos(a theta), averaged over the azimuths: 1 for b = 0."""
    return 1.0 + 0.5 * b * (3.0 * u**2 - 1.0)


@declared
@dataclass(frozen=True)
class Orientation:
    """Density of asperity contact orientations, Eq. 14.

    Raises ValueError when a bound of Eq. 18 is broken.

    >>> orientation = jl.Orientation(a=3.0, b=0.5, c=0.1)
    """

    a: float = parameter(
        "extent of the inclinations, theta <= pi/(2a); large a is smooth", low=1.0, fit=(1.0, 100.0)
    )
    b: float = parameter(
        "shape within this extent; b = 2 concentrates the contacts at the joint normal",
        "",
        0.0,
        low=-1.0,
        high=2.0,
        fit=(-1.0, 2.0),
        log=False,
    )
    c: float = parameter(
        "azimuthal anisotropy, within +-(1/3 - b/6); c > 0 makes axis 2 (azimuth 0) stiffer",
        "",
        0.0,
        fit=(-0.5, 0.5),
        log=False,
    )

    def __post_init__(self) -> None:
        for name, value in zip("abc", bounded(self.a, self.b, self.c), strict=True):
            object.__setattr__(self, name, value)

    @classmethod
    def from_moments(cls, mean: float, variance: float, c: float = 0.0) -> Self:
        """The density with this mean (rad) and variance (rad^2) of the inclinations: Eq. 17.

        c: as of the class. If two values of b have these moments (the variance over the squared
        mean has its maximum near b = 1.4), the smaller one is used. Raises ValueError if none has.

        >>> orientation = jl.Orientation.from_moments(mean=0.2, variance=0.0056)
        """
        mean = more_than("mean", mean, 0.0)
        variance = more_than("variance", variance, 0.0)
        # Eq. 17 leaves one quadratic in b: v0 + v1 b - b^2 = ratio (6 - b)^2
        ratio = variance / mean / mean  # the square of a mean may underflow
        v0 = 36 * math.pi - 108
        v1 = 20 - 6 * math.pi
        roots = np.roots([-1 - ratio, v1 + 12 * ratio, v0 - 36 * ratio] if ratio < 1 else [])
        for root in sorted(roots[np.abs(roots.imag) < 1e-12].real):
            b = float(np.clip(root, -1.0, 2.0))
            if abs(b - root) < 1e-9 and (a := (6 - b) / (6 * mean)) >= 1.0 - 1e-12:
                return cls(max(a, 1.0), b, c)
        raise ValueError(
            f"no density of Eq. 14 has a mean inclination of {mean:g} rad and a variance of "
            f"{variance:g} rad^2: variance/mean^2 = {ratio:.4g} must give -1 <= b <= 2 and a >= 1 "
            "(Eq. 17, 18)"
        )

    @property
    def mean(self) -> float:
        """Mean inclination E[theta] in rad, Eq. 17."""
        return (6 - self.b) / (6 * self.a)

    @property
    def variance(self) -> float:
        """Variance of the inclination in rad^2, Eq. 17."""
        b = self.b
        return (36 * math.pi - 108 + 20 * b - 6 * b * math.pi - b * b) / (36 * self.a**2)

    def density(self, theta: ArrayLike, phi: ArrayLike = 0.0) -> Any:
        """Density per solid angle (1/sr) at inclination theta and azimuth phi in rad, Eq. 14.

        Raises ValueError for angles that are not finite.
        """
        th = finite("theta", theta, "rad")
        ph = finite("phi", phi, "rad")
        # a sin(a theta)/sin(theta) -> a^2 as theta -> 0, by the ratio of two sinc functions
        ratio = self.a**2 * np.sinc(self.a * th / np.pi) / np.sinc(th / np.pi)
        shape = 1 + self.b / 4 * (3 * np.cos(2 * self.a * th) + 1)
        shape = shape + 3 * self.c * np.sin(self.a * th) ** 2 * np.cos(2 * ph)
        inside = (th >= 0) & (th <= math.pi / (2 * self.a) * (1 + 1e-15))
        return np.where(inside, ratio * shape / (2 * math.pi), 0.0)[()]
