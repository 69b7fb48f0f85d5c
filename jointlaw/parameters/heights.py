"""Distributions of asperity heights: fraction of the asperities in contact at an overlap r."""

from dataclasses import dataclass
from typing import Any, Self, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from ..support.checks import Array, at_least, finite, more_than, one_of
from .declared import check, declared, parameter

FORMATIONS = ("population", "individual")
FORMATION = (
    '"population": the number of asperities in contact grows as P(r0 + y) and all have the same '
    'closure y, Eq. 37 as printed; "individual": each asperity has only the closure since its '
    "first contact"
)

# Probabilities at both ends of a distribution: integrals are split at these quantiles
_TAILS = np.array([1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 1e-2, 0.1, 0.3, 0.5])


@declared
@dataclass(frozen=True)
class GammaHeights:
    """Gamma distribution of asperity heights, Eq. 12.

    >>> heights = jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6)
    """

    alpha: float = parameter(
        "shape; the mean is beta (alpha + 1), Eq. 13", above=-1.0, fit=(-0.99, 1e3), shift=1.0
    )
    beta: float = parameter("scale", "m", above=0.0, fit=(1e-10, 1.0))
    overlap: float = parameter(
        "r0, overlap of the two surfaces at zero closure", "m", 0.0, low=0.0, fit=(1e-12, 1.0)
    )
    formation: str = parameter(FORMATION, "", "population", kind=str, choices=FORMATIONS)

    def __post_init__(self) -> None:
        check(self, "heights")

    @classmethod
    def from_moments(
        cls, mean: float, variance: float, overlap: float = 0.0, formation: str = "population"
    ) -> Self:
        """The gamma distribution with this mean (m) and variance (m^2): Eq. 13.

        overlap (m), formation: as of the class. Raises ValueError for a number out of its bounds.

        >>> heights = jl.GammaHeights.from_moments(150e-6, (70e-6) ** 2, overlap=40e-6)
        """
        mean = more_than("mean", mean, 0.0)
        variance = more_than("variance", variance, 0.0)
        return cls(mean**2 / variance - 1, variance / mean, overlap, formation)

    @property
    def mean(self) -> float:
        """Mean height in m, Eq. 13."""
        return self.beta * (self.alpha + 1)

    @property
    def variance(self) -> float:
        """Variance of the heights in m^2, Eq. 13."""
        return self.beta**2 * (self.alpha + 1)

    def pdf(self, r: ArrayLike) -> Any:
        """Density H(r) in 1/m at the overlap r in m, of any shape, Eq. 12. Raises nothing."""
        x = np.maximum(np.asarray(r, float), 0.0) / self.beta
        log_density = special.xlogy(self.alpha, x) - x - special.gammaln(self.alpha + 1)
        return np.where(np.asarray(r) >= 0, np.exp(log_density) / self.beta, 0.0)[()]

    def cdf(self, r: ArrayLike) -> Any:
        """Fraction P(r) of asperities in contact at the overlap r in m, Eq. 11. Raises nothing."""
        return special.gammainc(self.alpha + 1, np.maximum(r, 0.0) / self.beta)

    def breakpoints(self) -> Array:
        """Quantiles of the heights in m, ascending from 0, down to both tails: limits of panels
        within which a quadrature rule resolves the density.
        """
        k = self.alpha + 1
        low = special.gammaincinv(k, _TAILS)
        high = special.gammainccinv(k, _TAILS[::-1])
        return np.unique(self.beta * np.concatenate([[0.0], low, high]))


@declared
@dataclass(frozen=True)
class Heights:
    """A measured histogram of asperity heights, which also represents any other distribution.

    Raises ValueError for an invalid histogram.

    >>> heights = jl.Heights(np.histogram(np.array([1.0, 2.0, 2.5, 4.0]) * 1e-6, bins=3),
    ...                     formation="individual")
    """

    distribution: Any = parameter(
        "counts, and edges in m, as `numpy.histogram` returns them", "m", kind=object
    )
    overlap: float = parameter(
        "r0, overlap of the two surfaces at zero closure", "m", 0.0, low=0.0, fit=(1e-12, 1.0)
    )
    formation: str = parameter(
        f"{FORMATION}. A histogram has steps, which make most closure curves by population concave",
        "",
        "individual",
        kind=str,
        choices=FORMATIONS,
    )

    def __post_init__(self) -> None:
        check(self, "heights")
        object.__setattr__(self, "distribution", _histogram(self.distribution))

    def pdf(self, r: ArrayLike) -> Any:
        """Density H(r) in 1/m at the overlap r in m, of any shape. Raises nothing."""
        counts, edges = (np.array(v) for v in self.distribution)
        density = np.concatenate([[0.0], counts / (counts.sum() * np.diff(edges)), [0.0]])
        return density[np.searchsorted(edges, np.asarray(r), side="right")]

    def cdf(self, r: ArrayLike) -> Any:
        """Fraction P(r) of asperities in contact at the overlap r in m. Raises nothing."""
        counts, edges = (np.array(v) for v in self.distribution)
        cumulative = np.concatenate([[0.0], np.cumsum(counts) / counts.sum()])
        return np.interp(np.asarray(r, float), edges, cumulative)

    def breakpoints(self) -> Array:
        """Heights in m, ascending, between which the density is smooth on one scale."""
        return np.array(self.distribution[1])


HeightDistribution: TypeAlias = Any  # see `require_heights`
# Classes of heights by their names in files, the default first
KINDS = {"gamma": GammaHeights, "histogram": Heights}
MAX_DENSITY_ERROR = 0.1  # fraction of asperities: a density may be infinite at a breakpoint
_REQUIRED_NAMES = ("overlap", "formation", "pdf", "cdf", "breakpoints")


def require_heights(heights: Any) -> None:
    """Raise ValueError unless `heights` is None or a distribution of heights.

    A class of a user's own has `overlap` (m) and `formation`, `pdf(r)` in 1/m and `cdf(r)` of
    arrays r (m), and `breakpoints()`: heights in m, ascending, between which its density is smooth
    on one scale. It compares and hashes by its numbers, as a frozen dataclass does.
    """
    if heights is None:
        return
    missing = [name for name in _REQUIRED_NAMES if not hasattr(heights, name)]
    if missing:
        raise ValueError(
            f"heights = {heights!r} has no {', '.join(missing)}: give GammaHeights, Heights, None, "
            "or a class with these (a histogram in Heights represents any other distribution)"
        )
    kind = type(heights)
    methods = {getattr(kind, name) for name in ("__hash__", "__repr__")}
    if methods & {None, object.__hash__, object.__repr__}:
        raise ValueError(
            f"heights = {heights!r}: objects with equal numbers must be equal, hash and print "
            f"alike; make {kind.__name__} a frozen dataclass"
        )
    at_least("heights.overlap", heights.overlap, 0.0)
    one_of("heights.formation", heights.formation, FORMATIONS)
    points = heights.breakpoints()
    if not isinstance(points, np.ndarray) or points.ndim != 1 or points.size < 2:
        raise ValueError("heights.breakpoints() must be an array of two or more heights in m")
    finite("heights.breakpoints()", points, "m")
    if (np.diff(points) <= 0).any() or points[0] < 0:
        raise ValueError("heights.breakpoints() must be ascending heights, >= 0 m")
    if kind not in KINDS.values():
        _require_consistent_density(heights, points)


def _require_consistent_density(heights: Any, points: Array) -> None:
    """Raise ValueError unless the density is roughly the derivative of `cdf`."""
    x, weight = np.polynomial.legendre.leggauss(16)
    half = 0.5 * np.diff(points)
    density = np.asarray(heights.pdf(points[:-1, None] + half[:, None] * (x + 1.0)), float)
    integral = half * (density @ weight)
    increase = np.diff(heights.cdf(points))
    error = np.abs(integral - increase)
    if not (error <= MAX_DENSITY_ERROR).all() or (density < 0.0).any():
        worst = int(np.argmax(np.nan_to_num(error, nan=np.inf)))
        raise ValueError(
            f"heights: pdf(r) in 1/m must be >= 0 and the slope of cdf(r), but from "
            f"{points[worst]:g} to {points[worst + 1]:g} m its integral is {integral[worst]:.4g}, "
            f"and cdf increases by {increase[worst]:.4g}"
        )


def _histogram(pair: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Counts and edges as hashable tuples, checked."""
    try:
        counts, edges = (np.asarray(part, float) for part in pair)
    except (TypeError, ValueError):
        raise ValueError(
            f"heights.distribution = {pair!r} must be (counts, edges), as numpy.histogram gives; a "
            "gamma distribution is GammaHeights"
        ) from None
    if counts.ndim != 1 or edges.shape != (counts.size + 1,) or counts.size == 0:
        raise ValueError(
            f"heights.distribution: {counts.size} counts need {counts.size + 1} edges, "
            f"got {edges.size}"
        )
    if not (np.isfinite(edges).all() and (np.diff(edges) > 0).all() and edges[0] >= 0):
        raise ValueError("heights.distribution: edges must be finite, ascending and >= 0 m")
    if not (np.isfinite(counts).all() and (counts >= 0).all() and counts.sum() > 0):
        raise ValueError("heights.distribution: counts must be finite, >= 0 and not all zero")
    return tuple(map(float, counts)), tuple(map(float, edges))
