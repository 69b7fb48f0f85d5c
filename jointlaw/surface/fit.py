"""From a scan to a law: heights, directions and number of asperities of a measured surface."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..laws.joint_law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..support.checks import Array, finite, more_than, numbers
from ..support.markdown import table
from .asperities import MeasuredAsperities, extract_asperities, remove_mean_plane
from .densities import HEIGHT_PARAMETERS, Estimate, fit_directions, fit_heights
from .picture import plot_surface
from .roughness import find_spikes, measured_slopes, rms_slope

SAMPLES = 4  # points along the edge of a facet, by default
MIN_SAMPLES = 3
MIN_FACETS = 6  # along both axes of a scan
UNITS = {"beta": "m", "overlap": "m", "asperity_density": "1/m2"}
MAX_SLOPE_DIFFERENCE = 0.2  # relative difference of the rms slopes of law and surface
MIN_SLOPE_RATIO = 0.1  # smaller over larger rms slope: a surface with less has ridges
MAX_SLOPE_NOISE = 0.04  # error of a gradient over the median gradient: summits are displaced beyond


@dataclass(frozen=True, eq=False)
class SurfaceFit:
    """Orientation, heights and number of asperities of a scanned surface, with their errors.

    estimates: a, b, c, alpha, beta (m), overlap (m) and asperity_density (1/m2) by name.
    asperities: summits and facets; `asperities.size` is the sampling length (m), for which alone
        the parameters are valid.
    spacing: spacing of the points in m.
    slopes: rms slopes (Z2) of the whole surface along the rows and across them.
    spikes: grid indices (n, 2) of points that are probably measurement errors.
    heights_of_scan: heights (ny, nx) in m about their mean plane.
    """

    estimates: dict[str, Estimate]
    asperities: MeasuredAsperities
    spacing: float
    slopes: tuple[float, float]
    spikes: NDArray[np.intp]
    heights_of_scan: Array

    @property
    def parameters(self) -> dict[str, float]:
        """Values in SI units."""
        return {name: estimate.value for name, estimate in self.estimates.items()}

    @property
    def not_identifiable(self) -> dict[str, str]:
        """Parameters that this scan does not determine, each with the reason."""
        return {
            name: estimate.not_identifiable
            for name, estimate in self.estimates.items()
            if estimate.not_identifiable
        }

    @property
    def orientation(self) -> Orientation:
        """Density of asperity directions, Eq. 14; azimuth 0 is along the rows of the scan."""
        return Orientation(*(self.estimates[name].value for name in "abc"))

    @property
    def heights(self) -> GammaHeights:
        """Gamma density of heights, Eq. 12; with its overlap the highest summit touches at zero
        closure.
        """
        alpha, beta, overlap = (self.estimates[name].value for name in HEIGHT_PARAMETERS)
        return GammaHeights(alpha, beta, overlap, "individual")

    @property
    def law_slopes(self) -> tuple[float, float]:
        """Root mean square slopes of the orientation along the rows and across them."""
        return rms_slope(self.orientation), rms_slope(self.orientation, math.pi / 2)

    @property
    def orientation_is_representative(self) -> bool:
        """Whether a law with these a, b and c represents the slopes of the surface.

        True where all three are identifiable and the rms slopes of the law, along and across the
        rows, differ from the measured ones by at most 20 %.
        """
        pairs = zip(self.slopes, self.law_slopes, strict=True)
        slopes_agree = all(
            abs(law - measured) <= MAX_SLOPE_DIFFERENCE * measured for measured, law in pairs
        )
        return slopes_agree and not set("abc") & set(self.not_identifiable)

    def law(self, asperity: Asperity, **options: Any) -> JointLaw:
        """A law of this surface.

        Parameters
        ----------
        asperity: asperity contacts, which a scan does not determine.
        options: further keywords of `JointLaw`; `asperity_density` replaces the value of the scan.
        """
        options.setdefault("asperity_density", self.asperities.density)
        return JointLaw(
            orientation=self.orientation, asperity=asperity, heights=self.heights, **options
        )

    def plot(self, path: str | Path | None = None) -> Any:
        """Plot the surface with its summits, inclinations by direction, and depths of summits.

        path: file to save the figure to, or None. Returns the figure. Needs matplotlib (extra
        `plot`).
        """
        return plot_surface(self, path)

    def report(self) -> str:
        """The result in sentences and tables (Markdown)."""
        asperities = self.asperities
        estimates = (
            f"{name} | {estimate.value:.4g} | {estimate.standard_error:.2g} | "
            f"{UNITS.get(name, '1')} | {'no' if estimate.not_identifiable else 'yes'}"
            for name, estimate in self.estimates.items()
        )
        slopes = {"measured": self.slopes, "of the law": self.law_slopes}
        slope_rows = (f"{name} | {one[0]:.3g} | {one[1]:.3g}" for name, one in slopes.items())
        lines = [
            "# Asperities of a scanned surface",
            "",
            f"{asperities.depth.size} summits and {len(asperities.slope)} facets at a sampling "
            f"length of {asperities.size:.3g} m (spacing {self.spacing:.3g} m).",
            "",
            *table("parameter | value | standard error | unit | identifiable", estimates),
            "",
            "Not identifiable from this scan:",
            "",
            *(f"- {name}: {reason}" for name, reason in self.not_identifiable.items()),
            "- K, lam, eta, mu: a scan measures neither stiffness nor friction; take them from the "
            "rock or from a closure and a shear test",
            "",
            "Rock is rough at every scale: another sampling length gives other asperities. Choose "
            "the size of the contacts that carry the load, and state it with the result.",
            "",
            *table("rms slope (Z2) | along the rows | across them", slope_rows),
            *(line for text in self.warnings for line in ("", f"Warning: {text}.")),
        ]
        return "\n".join(lines) + "\n"

    @property
    def warnings(self) -> tuple[str, ...]:
        """What a user of these asperities has to know, for report and parameter file."""
        warnings = []
        if not self.orientation_is_representative:
            warnings.append(
                "the slopes of law and surface differ by more than 20 %, or the "
                "orientation is not identifiable: do not use its friction angle"
            )
        if len(self.spikes):
            row, column = self.spikes[0]
            warnings.append(
                f"{len(self.spikes)} points are spikes, far above or below all their neighbours "
                f"(the first in row {row}, column {column}, counted from 0): replace them, for "
                "example by the median of their neighbours, and scan again"
            )
        median_slope = float(np.median(np.linalg.norm(self.asperities.slope, axis=-1)))
        slope_noise = self.asperities.slope_noise
        if slope_noise > MAX_SLOPE_NOISE * median_slope:
            warnings.append(
                f"the noise of the slopes is {100 * slope_noise / median_slope:.0f} % of the "
                "median slope: summits may be displaced, and a and b wrong; increase "
                "sampling_length"
            )
        return tuple(warnings)


def from_surface(z: ArrayLike, spacing: float, sampling_length: float | None = None) -> SurfaceFit:
    """Determine orientation and heights of the asperities of a scanned surface.

    Parameters
    ----------
    z: heights (ny, nx) in m of the composite surface, positive upwards: the sum of the heights of
        the upper side (measured from its mean plane into the gap) and of the lower side. Axis 2 of
        the law (azimuth 0) is along the rows, axis 3 along the columns. One side alone gives the
        asperities of this side.
    spacing: spacing of the points in m, along both axes.
    sampling_length: edge of the facets in m, a whole number (>= 3) of spacings; 4 by default. A
        shorter length gives more, smaller and steeper asperities.

    Returns a `SurfaceFit`. Raises ValueError for an invalid array or too few summits.

    Source: Misra 1999, sections 2.2.1, 2.2.2 and Eq. 12 to 18; summits, facets and estimators are
    described in `asperities` and `densities`.

    >>> from scipy.ndimage import gaussian_filter
    >>> z = 4e-4 * gaussian_filter(np.random.default_rng(0).standard_normal((200, 200)), 3)
    >>> surface = jl.from_surface(z, spacing=1e-4)
    """
    gaps = np.argwhere(np.isnan(numbers("z", z, "m")))
    if len(gaps):
        raise ValueError(
            f"z is not finite at {len(gaps)} of its points, the first at {gaps[0].tolist()}: fill "
            "or cut off points without a height"
        )
    heights = finite("z", z, "m")
    spacing = more_than("spacing", spacing, 0.0)
    samples = _points_per_facet(sampling_length, spacing)
    _require_area(heights, samples)
    level = remove_mean_plane(heights)
    slopes = measured_slopes(level, spacing, samples)
    if min(slopes) < MIN_SLOPE_RATIO * max(slopes):
        raise ValueError(
            f"z has ridges: its rms slope (Z2) is {slopes[0]:.3g} along the rows and "
            f"{slopes[1]:.3g} across them, and no density of Eq. 14 has such directions. Its "
            "friction angle along the steeper direction is the friction angle of its faces "
            "(atan mu) plus their inclination"
        )
    asperities = extract_asperities(heights, spacing, samples)
    estimates = fit_directions(asperities.slope, asperities.summit, asperities.slope_noise)
    estimates |= fit_heights(asperities.depth)
    density = asperities.density
    error = density / math.sqrt(asperities.depth.size)
    estimates["asperity_density"] = Estimate(
        density, error, density - 1.96 * error, density + 1.96 * error
    )
    return SurfaceFit(estimates, asperities, spacing, slopes, find_spikes(level), level)


def _points_per_facet(sampling_length: float | None, spacing: float) -> int:
    """The sampling length in points. Raises ValueError unless it is a whole number of spacings."""
    length = SAMPLES * spacing if sampling_length is None else sampling_length
    ratio = more_than("sampling_length", length, 0.0) / spacing
    samples = max(round(ratio), MIN_SAMPLES)
    if abs(ratio - samples) > 1e-6 * samples:
        raise ValueError(
            f"sampling_length = {length:g} m is {ratio:.6g} spacings: it must be a whole number of "
            f"at least {MIN_SAMPLES}; give {samples * spacing:.9g} m"
        )
    return samples


def _require_area(heights: Array, samples: int) -> None:
    """Raise ValueError unless heights are a matrix with several facets along both axes."""
    points = MIN_FACETS * samples
    if heights.ndim != 2 or min(heights.shape) < points or not float(np.ptp(heights)) > 0:
        raise ValueError(
            f"z has shape {heights.shape} and heights over {np.ptp(heights):g} m: give an area "
            f"(ny, nx) that is not flat, with at least {points} points along both axes at a "
            f"sampling length of {samples} points; a profile has one direction only, see "
            "docs/field.md for its JRC"
        )
