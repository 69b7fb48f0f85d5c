"""A scan as a picture: summits, heights, inclinations (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..support.pyplot import pyplot, written
from .estimate import SurfaceEstimate

CLASSES = 5  # of the fit's classes of inclination, drawn as one


def plot_surface(fit: SurfaceEstimate, path: str | Path | None = None) -> Any:
    """The scan with its summits, heights and inclinations against their fits."""
    figure, (scan, heights, inclinations) = pyplot().subplots(
        1, 3, figsize=(12.5, 3.9), layout="constrained"
    )
    found, h, d, mm = fit.asperities, fit.heights, fit.directions, 1e3 * fit.spacing
    scan.set(xlabel="along azimuth 0° (mm)", title=f"{found.depth.size} summits")
    if fit.is_profile:
        scan.plot(mm * np.arange(fit.z.size), 1e6 * fit.z, lw=0.8)
        at = found.places[:, 0]
        scan.plot(mm * at, 1e6 * fit.z[at], "v", color="C3", ms=4)
        scan.set_ylabel("height (µm)")
    else:
        ny, nx = fit.z.shape
        extent = (0, mm * nx, 0, mm * ny)
        image = scan.imshow(1e6 * fit.z, extent=extent, origin="lower", cmap="cividis")
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
    inclinations.bar(middle, seen.sum(axis=1) / width, width=width, color="0.8", label="measured")
    inclinations.plot(middle, model.sum(axis=1) / width, color="C1", label=label)
    inclinations.set(
        ylim=(0, 1.3 * inclinations.get_ylim()[1]),
        xlabel="inclination of facets (°)",
        ylabel="density (1/°)",
        title=f"a = {d.a:.2f}, b = {d.b:.2f}" + ("" if fit.is_profile else f", c = {d.c:.3f}"),
    )
    inclinations.legend(loc="upper left", fontsize="small")
    figure.suptitle(f"Sampling length {1e6 * fit.sampling_length:.3g} µm")
    return written(figure, path)
