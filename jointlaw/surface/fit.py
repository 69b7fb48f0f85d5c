"""From a scan to a law: heights, directions and number of asperities of a measured surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..law import JointLaw
from ..parameters.asperity import Asperity
from ..support.checks import above
from .asperities import extract
from .direction_fit import fit_directions
from .estimate import SurfaceEstimate
from .height_fit import fit_heights
from .plot import plot_surface
from .report import report

SAMPLES = 4  # points along the edge of a facet, by default


@dataclass(frozen=True, eq=False)
class SurfaceFit(SurfaceEstimate):
    """Orientation and heights of a scanned surface, with their errors and the quality of the fit.

    `parameters` and `standard_error` hold a, b, c, alpha, beta (m), overlap (m) and
    asperity_density (1/m2; NaN for a profile); `identifiable` names those that the scan fixes,
    `not_identifiable` the others with the reason. `distance_heights` and `distance_inclinations`
    are the largest differences of measured and fitted cumulative curves.
    """

    def law(
        self, asperity: Asperity, asperity_density: float | None = None, **options: Any
    ) -> JointLaw:
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
        return report(self, self.at_lengths())

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw data against fit (needs matplotlib: extra `plot`)."""
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
