"""From a scan to a law: heights, directions and number of asperities of a measured surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..calibration.fit import WIDEST
from ..law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..support.checks import Array, above
from .asperities import Asperities, extract
from .direction_fit import DirectionFit, fit_directions
from .height_fit import HeightFit, fit_heights

SAMPLES = 4  # points along the edge of a facet, by default
NOISY = 0.04  # error of a gradient over the median gradient, from which summits get misplaced


@dataclass(frozen=True, eq=False)
class SurfaceFit:
    """Orientation and heights of a scanned surface, with their errors and the quality of the fit.

    `parameters` and `standard_error` hold a, b, c, alpha, beta (m), overlap (m) and
    asperity_density (1/m2; NaN for a profile); `identifiable` names those that the scan fixes,
    `not_identifiable` the others with the reason. `distance_heights` and `distance_inclinations`
    are the largest differences of measured and fitted cumulative curves.
    """

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

    def law(self, asperity: Asperity, asperity_density: float | None = None, **options: Any) -> Any:
        """The law of this surface with these asperity contacts.

        asperity: stiffness and friction, which no scan knows; asperity_density: 1/m2, needed for a
        profile; options: further keywords of `JointLaw`.
        """
        density = self.asperity_density if asperity_density is None else asperity_density
        if math.isnan(density):
            raise ValueError("asperity_density is missing: a profile does not give it (1/m2)")
        return JointLaw(
            orientation=self.orientation,
            asperity=asperity,
            heights=self.heights,
            asperity_density=density,
            **options,
        )

    def at_lengths(self, factors: Sequence[int] = (1, 2, 4)) -> list[SurfaceFit]:
        """The same scan read at multiples of the sampling length, as far as summits remain."""
        samples = round(self.sampling_length / self.spacing)
        fits = []
        for factor in factors:
            try:
                fits.append(from_surface(self.z, self.spacing, factor * samples * self.spacing))
            except ValueError:
                break
        return fits

    def report(self) -> str:
        """The fit in words and tables (Markdown), and how it depends on the sampling length."""
        from .report import report

        return report(self)

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw data against fit (needs matplotlib: extra `plot`)."""
        from ..calibration.plot import plot_surface

        return plot_surface(self, path)


def from_surface(
    z: ArrayLike,
    spacing: float,
    sampling_length: float | None = None,
    reference: float | None = None,
) -> SurfaceFit:
    """Read orientation and heights of the asperities off a scanned surface.

    Parameters
    ----------
    z: heights in m of the composite surface, upwards positive: the sum of the heights of the upper
        side (measured from its mean plane into the gap) and of the lower one, (ny, nx); or of a
        profile, (nx,). Axis 2 of the law (azimuth 0) lies along the rows, axis 3 along the columns.
        One side alone gives that side's asperities.
    spacing: of the points in m, along both axes.
    sampling_length: edge of the facets in m, a whole number (>= 3) of spacings; 4 by default. A
        finer look finds more, smaller and steeper asperities: see `SurfaceFit.at_lengths`.
    reference: how far above the highest summit the height distribution begins (m), if known; None
        fits it.

    Returns a `SurfaceFit`. Raises ValueError for a bad array or too few summits.

    Source: Misra 1999, sections 2.2.1, 2.2.2 and Eq. 12 to 18; summits, facets and estimators are
    described in `asperities`, `height_fit` and `direction_fit`.
    """
    try:
        heights = np.asarray(z, float)
    except (TypeError, ValueError):
        raise ValueError("z must be an array of heights in m") from None
    if heights.ndim not in (1, 2) or not np.isfinite(heights).all():
        raise ValueError(
            f"z has shape {heights.shape} and {int(np.sum(~np.isfinite(heights)))} points that are "
            "not finite: give (ny, nx) or (nx,) heights in m, gaps filled or cut off"
        )
    spacing = above("spacing", spacing, 0.0)
    length = SAMPLES * spacing if sampling_length is None else sampling_length
    ratio = above("sampling_length", length, 0.0) / spacing
    samples = max(round(ratio), 3)
    if abs(ratio - samples) > 1e-6 * samples:
        raise ValueError(
            f"sampling_length = {length:g} m is {ratio:.6g} spacings: it must be a whole number of "
            f"at least 3; give {samples * spacing:.9g} m"
        )
    if min(heights.shape) < 6 * samples:
        raise ValueError(
            f"z has shape {heights.shape}: at a sampling length of {samples} points at least "
            f"{6 * samples} along every axis are needed; shorten sampling_length"
        )
    if not float(np.ptp(heights)) > 0:
        raise ValueError("z is flat: there are no asperities to read")
    found = extract(heights, spacing, samples)
    if reference is not None:
        reference = above("reference", reference, 0.0)
    return SurfaceFit(
        heights,
        spacing,
        found,
        fit_directions(found.slope, found.summit, found.slope_noise),
        fit_heights(found.depth, reference),
    )
