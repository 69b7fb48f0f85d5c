"""A scan as a picture: summits, heights, inclinations (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..support.pyplot import pyplot
from .direction_fit import model_inclination
from .estimate import SurfaceEstimate


def plot_surface(fit: SurfaceEstimate, path: str | Path | None = None) -> Any:
    """The scan with its summits, heights and inclinations against their fits."""
    plt = pyplot()
    figure, axes = plt.subplots(1, 3, figsize=(12.5, 3.9), layout="constrained")
    found, mm = fit.asperities, 1e3 * fit.spacing
    if fit.is_profile:
        axes[0].plot(mm * np.arange(fit.z.size), 1e6 * fit.z, lw=0.8)
        at = found.places[:, 0]
        axes[0].plot(mm * at, 1e6 * fit.z[at], "v", color="C3", ms=4)
        axes[0].set_ylabel("height (µm)")
    else:
        ny, nx = fit.z.shape
        image = axes[0].imshow(
            1e6 * fit.z, extent=(0, mm * nx, 0, mm * ny), origin="lower", cmap="cividis"
        )
        figure.colorbar(image, ax=axes[0], label="height (µm)", shrink=0.85)
        y, x = found.places.T
        axes[0].plot(mm * x, mm * y, ".", color="C3", ms=2)
        axes[0].set_ylabel("along azimuth 90° (mm)")
    axes[0].set_xlabel("along azimuth 0° (mm)")
    axes[0].set_title(f"{found.depth.size} summits")
    depth, h = found.depth + fit.heights.overlap, fit.heights
    axes[1].hist(1e6 * depth, bins="auto", density=True, color="0.8", label="measured")
    r = np.linspace(0, 1.05 * float(depth.max()), 300)
    axes[1].plot(1e6 * r, h.pdf(r) / 1e6, color="C1", label="gamma density, Eq. 12")
    axes[1].set_ylim(0, 1.25 * axes[1].get_ylim()[1])
    axes[1].set_xlabel("asperity height below the highest possible (µm)")
    axes[1].set_ylabel("density (1/µm)")
    axes[1].set_title(f"α = {h.alpha:.2f}, β = {1e6 * h.beta:.3g} µm")
    axes[1].legend()
    theta, seen, model = model_inclination(fit.directions, found.slope, found.slope_noise)
    group = 5
    edges = np.degrees(theta[: theta.size - theta.size % group].reshape(-1, group))
    width = np.gradient(edges.mean(axis=1))
    for share, options in (
        (seen, {"color": "0.8", "label": "measured"}),
        (model, {"color": "C1", "label": "density of Eq. 14, error of the slopes included"}),
    ):
        total = share[: edges.size].reshape(-1, group).sum(axis=1) / width
        if share is seen:
            axes[2].bar(edges.mean(axis=1), total, width=width, **options)
        else:
            axes[2].plot(edges.mean(axis=1), total, **options)
    axes[2].set_ylim(0, 1.3 * axes[2].get_ylim()[1])
    axes[2].set_xlabel("inclination of facets (°)")
    axes[2].set_ylabel("density (1/°)")
    d = fit.directions
    c = "" if fit.is_profile else f", c = {d.c:.3f}"
    axes[2].set_title(f"a = {d.a:.2f}, b = {d.b:.2f}{c}")
    axes[2].legend(loc="upper left", fontsize="small")
    figure.suptitle(f"Sampling length {1e6 * fit.sampling_length:.3g} µm")
    if path is not None:
        figure.savefig(path, dpi=150)
        plt.close(figure)
    return figure
