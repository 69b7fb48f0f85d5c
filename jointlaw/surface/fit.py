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
from ..support.pyplot import pyplot, written
from .asperities import extract
from .densities import fit_directions, fit_heights
from .estimate import SurfaceEstimate

SAMPLES = 4  # points along the edge of a facet, by default
UNITS = {"beta": "m", "overlap": "m", "asperity_density": "1/m2"}
CLASSES = 5  # of the fit's classes of inclination, drawn as one


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
        found = self.asperities
        lines = [
            "# Asperities of a scanned surface",
            "",
            f"{found.depth.size} summits and {len(found.slope)} facets at a sampling length of "
            f"{self.sampling_length:.3g} m ({'profile' if self.is_profile else 'surface'}, spacing "
            f"{self.spacing:.3g} m).",
            "",
            "| parameter | value | standard error | unit | fixed by this scan |",
            "|---|---|---|---|---|",
        ]
        left = self.not_identifiable
        for name, value in self.parameters.items():
            error = self.standard_error[name]
            shown = "-" if math.isnan(error) else f"{error:.2g}"
            lines.append(
                f"| {name} | {value:.4g} | {shown} | {UNITS.get(name, '1')} | "
                f"{'yes' if name in self.identifiable else 'no'} |"
            )
        lines += ["", "Not identifiable from this scan:", ""]
        lines += [f"- {name}: {reason}" for name, reason in left.items()]
        lines += [
            "- K, lam, eta, mu: no scan measures stiffness or friction; take them from the rock or "
            "from a closure and a shear test",
            "",
            f"Largest difference of the cumulative curves: heights {self.distance_heights:.3f}, "
            f"inclinations {self.distance_inclinations:.3f}.",
        ]
        lines += [f"Warning: {text}." for text in self.warnings]
        lines += [
            "",
            "## Dependence on the sampling length",
            "",
            "Rock is rough at every scale: a finer look finds more, smaller and steeper "
            "asperities. These parameters hold at their sampling length and no other; choose the "
            "size of the contacts that carry the load, and state it with the result.",
            "",
            "| sampling length (m) | summits | density | mean inclination (deg) | a | b | c "
            "| alpha | beta (m) |",
            "|---|---|---|---|---|---|---|---|---|",
        ]
        for other in self.at_lengths():
            p = other.parameters
            mean = math.degrees(other.orientation.mean)
            lines.append(
                f"| {other.sampling_length:.3g} | {other.asperities.depth.size} | "
                f"{other.asperities.density:.3g} | {mean:.1f} | {p['a']:.2f} | {p['b']:.2f} | "
                f"{p['c']:.3f} | {p['alpha']:.2f} | {p['beta']:.3g} |"
            )
        return "\n".join(lines) + "\n"

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw data against fit (needs matplotlib: extra `plot`)."""
        figure, (scan, heights, inclinations) = pyplot().subplots(
            1, 3, figsize=(12.5, 3.9), layout="constrained"
        )
        found, h, d, mm = self.asperities, self.heights, self.directions, 1e3 * self.spacing
        scan.set(xlabel="along azimuth 0° (mm)", title=f"{found.depth.size} summits")
        if self.is_profile:
            scan.plot(mm * np.arange(self.z.size), 1e6 * self.z, lw=0.8)
            at = found.places[:, 0]
            scan.plot(mm * at, 1e6 * self.z[at], "v", color="C3", ms=4)
            scan.set_ylabel("height (µm)")
        else:
            ny, nx = self.z.shape
            extent = (0, mm * nx, 0, mm * ny)
            image = scan.imshow(1e6 * self.z, extent=extent, origin="lower", cmap="cividis")
            figure.colorbar(image, ax=scan, label="height (µm)", shrink=0.85)
            y, x = found.places.T
            scan.plot(mm * x, mm * y, ".", color="C3", ms=2)
            scan.set_ylabel("along azimuth 90° (mm)")
        depth = found.depth + h.overlap
        heights.hist(1e6 * depth, bins="auto", density=True, color="0.8", label="measured")
        r = np.linspace(0, 1.05 * float(depth.max()), 300)
        heights.plot(1e6 * r, h.pdf(r) / 1e6, color="C1", label="gamma density, Eq. 12")
        heights.set(
            ylim=(0, 1.25 * heights.get_ylim()[1]),
            xlabel="asperity height below the highest possible (µm)",
            ylabel="density (1/µm)",
            title=f"α = {h.alpha:.2f}, β = {1e6 * h.beta:.3g} µm",
        )
        heights.legend()
        theta, seen, model = (
            x[: x.size - x.size % CLASSES].reshape(-1, CLASSES)
            for x in (np.degrees(d.inclination), d.measured, d.fitted)
        )
        middle = theta.mean(axis=1)
        width = np.gradient(middle)
        label = "density of Eq. 14, error of the slopes included"
        inclinations.bar(
            middle,
            seen.sum(axis=1) / width,
            width=width,
            color="0.8",
            edgecolor="0.8",
            label="measured",
        )
        inclinations.plot(middle, model.sum(axis=1) / width, color="C1", label=label)
        inclinations.set(
            ylim=(0, 1.3 * inclinations.get_ylim()[1]),
            xlabel="inclination of facets (°)",
            ylabel="density (1/°)",
            title=f"a = {d.a:.2f}, b = {d.b:.2f}" + ("" if self.is_profile else f", c = {d.c:.3f}"),
        )
        inclinations.legend(loc="upper left", fontsize="small")
        figure.suptitle(f"Sampling length {1e6 * self.sampling_length:.3g} µm")
        return written(figure, path)


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
    described in `asperities` and `densities`.
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
