"""Distributions of asperity heights: which share of the asperities touches at an overlap r."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from ..support.checks import Array, at_least, more_than, number, one_of

FORMATIONS = ("population", "individual")

# Probabilities at both ends of a distribution; integrals are split at these quantiles
_TAILS = np.array([1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 1e-2, 0.1, 0.3, 0.5])


@dataclass(frozen=True)
class GammaHeights:
    """Gamma distribution of asperity heights, Eq. 12.

    Parameters
    ----------
    alpha: shape, > -1 (the mean is beta (alpha + 1), Eq. 13).
    beta: scale in m, > 0.
    overlap: r0, overlap of the two surfaces at zero closure, in m, >= 0.
    formation: "population", the count of asperities in touch grows as P(r0 + y) and all carry the
        same closure y (Eq. 37 as printed); or "individual", each asperity feels only the closure
        since it touched.
    """

    alpha: float
    beta: float
    overlap: float = 0.0
    formation: str = "population"

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "alpha", more_than("heights.alpha", self.alpha, -1.0))
        set_(self, "beta", more_than("heights.beta", self.beta, 0.0))
        set_(self, "overlap", at_least("heights.overlap", self.overlap, 0.0))
        one_of("heights.formation", self.formation, FORMATIONS)

    @classmethod
    def from_moments(
        cls, mean: float, variance: float, overlap: float = 0.0, formation: str = "population"
    ) -> GammaHeights:
        """The gamma distribution of this mean (m) and variance (m^2): Eq. 13."""
        mean, variance = more_than("mean", mean, 0.0), more_than("variance", variance, 0.0)
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
        """Density H(r) in 1/m at the overlap r in m, Eq. 12."""
        x = np.maximum(np.asarray(r, float), 0.0) / self.beta
        log_density = special.xlogy(self.alpha, x) - x - special.gammaln(self.alpha + 1)
        return np.where(np.asarray(r) >= 0, np.exp(log_density) / self.beta, 0.0)[()]

    def cdf(self, r: ArrayLike) -> Any:
        """Share P(r) of the asperities in touch at the overlap r in m: Eq. 11 over N."""
        return special.gammainc(self.alpha + 1, np.maximum(r, 0.0) / self.beta)

    def breakpoints(self) -> Array:
        """Heights in m, ascending, between which the density is smooth on one scale."""
        k = self.alpha + 1
        low, high = special.gammaincinv(k, _TAILS), special.gammainccinv(k, _TAILS[::-1])
        return np.unique(self.beta * np.concatenate([[0.0], low, high]))


@dataclass(frozen=True)
class Heights:
    """Any other distribution of asperity heights.

    Parameters
    ----------
    distribution: name of a continuous distribution of scipy.stats ("chi2", "lognorm", ...), or a
        measured histogram as `numpy.histogram` returns it: (counts, edges in m).
    overlap: r0, overlap at zero closure, in m, >= 0.
    formation: as in `GammaHeights`. A histogram has steps, so it needs "individual".
    parameters: mapping of the distribution's parameters by their scipy names, with its name; a
        histogram takes none.

    Raises ValueError for an unknown name, missing parameters, or a histogram that is none.
    """

    distribution: Any
    overlap: float = 0.0
    formation: str = "population"
    parameters: Any = ()
    _frozen: Any = field(init=False, repr=False, compare=False, default=None)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "overlap", at_least("heights.overlap", self.overlap, 0.0))
        one_of("heights.formation", self.formation, FORMATIONS)
        try:
            given = dict(self.parameters)
        except (TypeError, ValueError):
            raise ValueError(
                f"heights.parameters = {self.parameters!r} must map names to numbers"
            ) from None
        if isinstance(self.distribution, (tuple, list)):
            if given:
                raise ValueError(
                    f"heights.parameters = {self.parameters!r}: a histogram takes none; leave them "
                    "out"
                )
            set_(self, "distribution", _histogram(self.distribution))
            set_(self, "parameters", ())
            return
        values = {k: number(f"heights.parameters.{k}", v) for k, v in given.items()}
        set_(self, "parameters", tuple(sorted(values.items())))
        set_(self, "_frozen", _freeze(self.distribution, values))

    @property
    def is_histogram(self) -> bool:
        """Whether the heights are a measured histogram rather than a named distribution."""
        return isinstance(self.distribution, tuple)

    def pdf(self, r: ArrayLike) -> Any:
        """Density H(r) in 1/m at the overlap r in m."""
        if self.is_histogram:
            counts, edges = (np.array(v) for v in self.distribution)
            density = np.concatenate([[0.0], counts / (counts.sum() * np.diff(edges)), [0.0]])
            return density[np.searchsorted(edges, np.asarray(r), side="right")]
        with np.errstate(divide="ignore"):  # a density may be infinite at its lower end
            return self._frozen.pdf(r)

    def cdf(self, r: ArrayLike) -> Any:
        """Share P(r) of the asperities in touch at the overlap r in m."""
        if self.is_histogram:
            counts, edges = (np.array(v) for v in self.distribution)
            return np.interp(
                np.asarray(r, float),
                edges,
                np.concatenate([[0.0], np.cumsum(counts) / counts.sum()]),
            )
        return self._frozen.cdf(r)

    def breakpoints(self) -> Array:
        """Heights in m, ascending, between which the density is smooth on one scale."""
        if self.is_histogram:
            return np.array(self.distribution[1])
        low, high = self._frozen.ppf(_TAILS), self._frozen.isf(_TAILS[::-1])
        points = np.unique(np.concatenate([low, high, self._frozen.support()]))
        return points[np.isfinite(points)]


HeightDistribution: TypeAlias = GammaHeights | Heights


def _histogram(pair: Any) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Counts and edges as hashable tuples, checked."""
    try:
        counts, edges = (np.asarray(part, float) for part in pair)
    except (TypeError, ValueError):
        raise ValueError(
            "heights.distribution as a histogram must be (counts, edges), as numpy.histogram gives"
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


def _freeze(name: Any, parameters: dict[str, float]) -> Any:
    """The scipy distribution of this name and parameters."""
    from scipy import stats  # slow to import, and few laws need it

    generator = getattr(stats, name, None) if isinstance(name, str) else None
    if not isinstance(generator, stats.rv_continuous):
        raise ValueError(
            f"heights.distribution = {name!r} is unknown; give the name of a continuous "
            "distribution of scipy.stats with its parameters, or (counts, edges)"
        )
    try:
        frozen = generator(**parameters)
        median = float(frozen.median())
    except TypeError as error:
        takes = ", ".join(n for n in (generator.shapes, "loc", "scale") if n)
        raise ValueError(
            f"heights.parameters = {parameters} do not fit {name!r}, which takes {takes}: {error}"
        ) from None
    if not np.isfinite(median):
        raise ValueError(f"heights.parameters = {parameters} are out of bounds for {name!r}")
    return frozen
