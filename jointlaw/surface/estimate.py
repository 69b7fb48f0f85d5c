"""What a scan says of the parameters: values, errors, intervals, and what it leaves open."""

import math
from dataclasses import dataclass

import numpy as np

from ..calibration.estimate import WIDEST
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..support.checks import Array
from .asperities import Asperities
from .densities import DirectionFit, HeightFit

VAGUE = 0.25  # standard error over the whole range of a parameter: beyond it says nothing
NOISY = 0.04  # error of a gradient over the median gradient, from which summits get misplaced


@dataclass(frozen=True, eq=False)
class SurfaceEstimate:
    """A scan and the densities fitted to it; `SurfaceFit` adds a law, words and pictures."""

    z: Array
    spacing: float
    asperities: Asperities
    directions: DirectionFit
    heights_fit: HeightFit

    @property
    def orientation(self) -> Orientation:
        """Density of asperity directions, Eq. 14; azimuth 0 is along the rows of the scan."""
        d = self.directions
        return Orientation(max(d.a, 1.0), d.b, d.c)

    @property
    def heights(self) -> GammaHeights:
        """Gamma heights, Eq. 12; their overlap puts zero closure at the highest summit."""
        h = self.heights_fit
        return GammaHeights(h.alpha, h.beta, h.overlap, "individual")

    @property
    def is_profile(self) -> bool:
        """Whether the scan is a line rather than an area."""
        return self.z.ndim == 1

    @property
    def sampling_length(self) -> float:
        """Edge of a facet in m: inclinations and densities hold at this length only."""
        return self.asperities.size

    @property
    def asperity_density(self) -> float:
        """Asperities per m2; NaN for a profile, which does not know how far they reach sideways."""
        return math.nan if self.is_profile else self.asperities.density

    @property
    def parameters(self) -> dict[str, float]:
        """All parameters that a scan speaks of, in SI units."""
        d, h = self.directions, self.heights_fit
        return {
            "a": d.a, "b": d.b, "c": d.c, "alpha": h.alpha, "beta": h.beta, "overlap": h.overlap,
            "asperity_density": self.asperity_density,
        }  # fmt: skip

    @property
    def standard_error(self) -> dict[str, float]:
        """Their standard errors in SI units; NaN where the scan says nothing."""
        d = np.sqrt(np.diag(self.directions.covariance))
        h, fit = np.sqrt(np.diag(self.heights_fit.covariance)), self.heights_fit
        n = self.asperities.depth.size
        return {
            "a": float(d[0]),
            "b": float(d[1]),
            "c": math.nan if self.is_profile else float(d[2]),
            "alpha": float(h[0]) * (fit.alpha + 1),
            "beta": float(h[1]) * fit.beta,
            "overlap": float(h[2]) * fit.overlap,
            "asperity_density": self.asperity_density / math.sqrt(n),
        }

    def interval(self, name: str) -> tuple[float, float]:
        """95 % interval of a parameter in SI units; of alpha and beta by their logarithms."""
        value, error = self.parameters[name], self.standard_error[name]
        shift = {"alpha": 1.0, "beta": 0.0, "overlap": 0.0}.get(name)
        if shift is None:
            return value - 1.96 * error, value + 1.96 * error
        factor = math.exp(1.96 * error / (value + shift))
        return (value + shift) / factor - shift, (value + shift) * factor - shift

    @property
    def identifiable(self) -> tuple[str, ...]:
        """Parameters that this scan fixes."""
        return tuple(name for name in self.parameters if name not in self.not_identifiable)

    @property
    def not_identifiable(self) -> dict[str, str]:
        """Parameters that this scan leaves open, with the reason."""
        found: dict[str, str] = {}
        if self.is_profile:
            found["c"] = "a profile has one direction: scan an area or a profile across"
            found["asperity_density"] = (
                "a profile does not say how far an asperity reaches sideways"
            )
        if self.directions.at_bound:
            found["b"] = "at its bound of Eq. 18: the inclinations are not of the form of Eq. 14"
        # a to a factor of 2, b and c against all that Eq. 18 allows
        for name, reach in (("a", self.parameters["a"]), ("b", 3.0), ("c", 2 / 3)):
            if self.standard_error[name] > VAGUE * reach:
                found[name] = f"its standard error is {self.standard_error[name]:.2g}"
        h = np.sqrt(np.diag(self.heights_fit.covariance))
        for k, name in enumerate(("alpha", "beta", "overlap")):
            if h[k] > WIDEST or self.heights_fit.at_bound:
                low, high = self.interval(name)
                found[name] = f"these summits leave it anywhere from {low:.3g} to {high:.3g}"
        return found

    @property
    def warnings(self) -> list[str]:
        """What speaks against this fit, in words; empty when nothing does."""
        found = []
        slope = np.linalg.norm(self.asperities.slope, axis=-1)
        ratio = self.asperities.slope_noise / float(np.median(slope))
        if ratio > NOISY:
            found.append(
                f"facets miss their planes by {100 * ratio:.0f} % of the median slope: summits may "
                "be misplaced and a, b lean towards small inclinations; lengthen sampling_length"
            )
        for what, distance, n in (
            ("heights", self.distance_heights, self.asperities.depth.size),
            ("inclinations", self.distance_inclinations, slope.size),
        ):
            if distance > 1.36 / math.sqrt(n):
                found.append(
                    f"the {what} do not follow the fitted density: largest difference of the "
                    f"cumulative curves {distance:.3f}, {1.36 / math.sqrt(n):.3f} expected of a "
                    "perfect one in 95 % of scans"
                )
        return found

    @property
    def distance_heights(self) -> float:
        """Largest difference of the cumulative curves of heights (0 is perfect)."""
        return self.heights_fit.distance

    @property
    def distance_inclinations(self) -> float:
        """Largest difference of the cumulative curves of inclination (0 is perfect)."""
        return self.directions.distance
