"""From a scan to a law: heights, directions and number of asperities of a measured surface."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..laws.joint_law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.heights import GammaHeights
from ..parameters.orientation import Orientation
from ..support.checks import finite, more_than, numbers
from ..support.markdown import table
from .asperities import Asperities, extract, levelled
from .densities import HEIGHTS, Estimate, fit_directions, fit_heights
from .roughness import measured_slopes, rms_slope, spikes

SAMPLES = 4  # points along the edge of a facet, by default
UNITS = {"beta": "m", "overlap": "m", "asperity_density": "1/m2"}
APART = 0.2  # of the measured rms slope: what that of the law may differ by
RIDGED = 0.1  # the smaller over the larger rms slope: below it a surface has but one direction
NOISY = 0.04  # error of a gradient over the median gradient, from which summits get misplaced


@dataclass(frozen=True, eq=False)
class SurfaceFit:
    """Orientation, heights and number of asperities of a scanned surface, with their errors.

    estimates: by name, a, b, c, alpha, beta (m), overlap (m) and asperity_density (1/m2);
    asperities: summits and facets, `asperities.size` the sampling length (m), at which alone the
    parameters hold; spacing: of the points in m; slopes: rms slopes (Z2) of the whole surface along
    the rows and across them; spikes: grid indices (n, 2) of points that may be none of the surface.
    """

    estimates: dict[str, Estimate]
    asperities: Asperities
    spacing: float
    slopes: tuple[float, float]
    spikes: NDArray[np.intp]

    @property
    def parameters(self) -> dict[str, float]:
        """Values in SI units."""
        return {name: one.value for name, one in self.estimates.items()}

    @property
    def not_identifiable(self) -> dict[str, str]:
        """Parameters that this scan leaves open, with the reason."""
        return {name: one.left_open for name, one in self.estimates.items() if one.left_open}

    @property
    def orientation(self) -> Orientation:
        """Density of asperity directions, Eq. 14; azimuth 0 is along the rows of the scan."""
        return Orientation(*(self.estimates[name].value for name in "abc"))

    @property
    def heights(self) -> GammaHeights:
        """Gamma heights, Eq. 12; their overlap puts zero closure at the highest summit."""
        alpha, beta, overlap = (self.estimates[name].value for name in HEIGHTS)
        return GammaHeights(alpha, beta, overlap, "individual")

    @property
    def law_slopes(self) -> tuple[float, float]:
        """`slopes` as the orientation has them."""
        return rms_slope(self.orientation), rms_slope(self.orientation, math.pi / 2)

    @property
    def describes(self) -> bool:
        """Whether the orientation is that of the surface: known, and its slopes within 20 %."""
        pairs = zip(self.slopes, self.law_slopes, strict=True)
        close = all(abs(law - measured) <= APART * measured for measured, law in pairs)
        return close and not set("abc") & set(self.not_identifiable)

    def law(self, asperity: Asperity, **options: Any) -> JointLaw:
        """The law of this surface with these asperity contacts, which no scan knows.

        options: further keywords of `JointLaw`, such as asperity_density in place of the scan's.
        """
        options.setdefault("asperity_density", self.asperities.density)
        return JointLaw(
            orientation=self.orientation, asperity=asperity, heights=self.heights, **options
        )

    def report(self) -> str:
        """The fit in words and a table (Markdown)."""
        found = self.asperities
        slope = float(np.median(np.linalg.norm(found.slope, axis=-1)))
        estimates = (
            f"{name} | {one.value:.4g} | {one.standard_error:.2g} | {UNITS.get(name, '1')} | "
            f"{'no' if one.left_open else 'yes'}"
            for name, one in self.estimates.items()
        )
        pairs = {"measured": self.slopes, "of the law": self.law_slopes}
        slopes = (f"{name} | {one[0]:.3g} | {one[1]:.3g}" for name, one in pairs.items())
        lines = [
            "# Asperities of a scanned surface",
            "",
            f"{found.depth.size} summits and {len(found.slope)} facets at a sampling length of "
            f"{found.size:.3g} m (spacing {self.spacing:.3g} m).",
            "",
            *table("parameter | value | standard error | unit | fixed by this scan", estimates),
            "",
            "Not identifiable from this scan:",
            "",
            *(f"- {name}: {reason}" for name, reason in self.not_identifiable.items()),
            "- K, lam, eta, mu: no scan measures stiffness or friction; take them from the rock or "
            "from a closure and a shear test",
            "",
            "Rock is rough at every scale: at another sampling length the asperities are others. "
            "Choose the size of the contacts that carry the load, and state it with the result.",
            "",
            *table("rms slope (Z2) | along the rows | across them", slopes),
        ]
        if len(self.spikes):
            row, column = self.spikes[0]
            lines += [
                "",
                f"Warning: {len(self.spikes)} points are spikes, far above or below all their "
                f"neighbours (the first in row {row}, column {column}, counted from 0): replace "
                "them, for example by the median of their neighbours, and scan again.",
            ]
        if found.slope_noise > NOISY * slope:
            lines += [
                "",
                f"Warning: facets miss their planes by {100 * found.slope_noise / slope:.0f} % of "
                "the median slope: summits may be misplaced, and a and b wrong; lengthen "
                "sampling_length.",
            ]
        return "\n".join(lines) + "\n"


def from_surface(z: ArrayLike, spacing: float, sampling_length: float | None = None) -> SurfaceFit:
    """Read orientation and heights of the asperities off a scanned surface.

    Parameters
    ----------
    z: heights (ny, nx) in m of the composite surface, upwards positive: the sum of the heights of
        the upper side (measured from its mean plane into the gap) and of the lower one. Axis 2 of
        the law (azimuth 0) lies along the rows, axis 3 along the columns. One side alone gives
        that side's asperities.
    spacing: of the points in m, along both axes.
    sampling_length: edge of the facets in m, a whole number (>= 3) of spacings; 4 by default. A
        finer look finds more, smaller and steeper asperities.

    Returns a `SurfaceFit`. Raises ValueError for a bad array or too few summits.

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
    length = SAMPLES * spacing if sampling_length is None else sampling_length
    ratio = more_than("sampling_length", length, 0.0) / spacing
    samples = max(round(ratio), 3)
    if abs(ratio - samples) > 1e-6 * samples:
        raise ValueError(
            f"sampling_length = {length:g} m is {ratio:.6g} spacings: it must be a whole number of "
            f"at least 3; give {samples * spacing:.9g} m"
        )
    if heights.ndim != 2 or min(heights.shape) < 6 * samples or not float(np.ptp(heights)) > 0:
        raise ValueError(
            f"z has shape {heights.shape} and heights over {np.ptp(heights):g} m: give an area "
            f"(ny, nx) that is not flat, with at least {6 * samples} points along both axes at a "
            "sampling length of "
            f"{samples} points; a profile has one direction only, see docs/field.md for its JRC"
        )
    level = levelled(heights)
    slopes = measured_slopes(level, spacing, samples)
    if min(slopes) < RIDGED * max(slopes):
        raise ValueError(
            f"z has ridges: its rms slope (Z2) is {slopes[0]:.3g} along the rows and "
            f"{slopes[1]:.3g} across them, and no density of Eq. 14 has such directions. Its "
            "friction angle along the steeper direction is that of its faces (atan mu) plus their "
            "inclination"
        )
    found = extract(heights, spacing, samples)
    estimates = fit_directions(found.slope, found.summit, found.slope_noise)
    estimates |= fit_heights(found.depth)
    density, error = found.density, found.density / math.sqrt(found.depth.size)
    estimates["asperity_density"] = Estimate(
        density, error, density - 1.96 * error, density + 1.96 * error
    )
    return SurfaceFit(estimates, found, spacing, slopes, spikes(level))
