"""The picture of a scanned surface: heights with summits, inclinations by direction, depths."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..support.checks import Array
from ..support.pyplot import pyplot, style, written
from .roughness import rms_slope

if TYPE_CHECKING:
    from .fit import SurfaceFit

MAX_PIXELS = 600  # along an edge of the hillshade
MAX_POINTS = 3000  # facets and summits that are drawn
SUN = (315.0, 45.0)  # azimuth and altitude of the light in degrees


@style()
def plot_surface(fit: "SurfaceFit", path: str | Path | None = None) -> Any:
    """Plot a scanned surface and the law fitted to it (needs matplotlib: extra `plot`).

    The first panel has the surface with light from one side, and its summits; the second the
    inclinations of the facets by their direction, with the root mean square slope along each
    direction, measured and of the law; the third the depths of the summits and their density.

    path: file to save the figure to, or None. Returns the figure.
    """
    plt = pyplot()
    figure = plt.figure(figsize=(13, 5.2))
    figure.get_layout_engine().set(rect=(0, 0.02, 1, 0.95))  # the title of the polar axis is above
    _plot_hillshade(figure.add_subplot(1, 3, 1), fit, plt)
    _plot_inclinations(figure.add_subplot(1, 3, 2, projection="polar"), fit)
    _plot_depths(figure.add_subplot(1, 3, 3), fit)
    return written(figure, path)


def _plot_hillshade(axis: Any, fit: "SurfaceFit", plt: Any) -> None:
    """Plot the surface with light from one side, and its summits."""
    from matplotlib.colors import LightSource

    z = fit.heights_of_scan
    stride = max(1, -(-max(z.shape) // MAX_PIXELS))
    coarse = z[::stride, ::stride]
    light = LightSource(*SUN)
    slope = max(float(np.sqrt(np.mean(np.square(fit.slopes)))), 1e-12)
    step = stride * fit.spacing
    shade = light.shade(
        coarse,
        cmap=plt.get_cmap("cividis"),
        blend_mode="soft",
        vert_exag=0.5 / slope,  # so that gentle surfaces are seen as well
        dx=step,
        dy=step,
    )
    extent = 1e3 * fit.spacing * np.array([0, z.shape[1], 0, z.shape[0]])
    axis.imshow(shade, extent=extent, origin="lower")
    image = axis.imshow(1e6 * coarse, extent=extent, origin="lower", cmap="cividis", alpha=0.0)
    colorbar = axis.figure.colorbar(image, ax=axis, shrink=0.8, label="height (µm)")
    colorbar.solids.set_alpha(1.0)
    rows, columns = fit.asperities.grid_indices[_some(len(fit.asperities.grid_indices))].T
    axis.plot(
        1e3 * fit.spacing * (columns + 0.5),
        1e3 * fit.spacing * (rows + 0.5),
        ".",
        color="C3",
        ms=2,
        label=f"{fit.asperities.depth.size} summits",
    )
    axis.set(xlabel="along the rows (mm)", ylabel="along the columns (mm)")
    axis.legend(loc="upper right", markerscale=4)


def _plot_inclinations(axis: Any, fit: "SurfaceFit") -> None:
    """Plot the inclinations of facets by direction, and rms slopes, in degrees."""
    from matplotlib.ticker import MaxNLocator

    slope = fit.asperities.slope
    azimuth = np.arctan2(slope[:, 0], slope[:, 1])
    inclination = np.degrees(np.arctan(np.linalg.norm(slope, axis=-1)))
    few = _some(len(slope))
    axis.plot(azimuth[few], inclination[few], ".", color="0.7", ms=2, label="facets")
    directions = np.linspace(0.0, 2 * np.pi, 73)
    along = slope[:, 1, None] * np.cos(directions) + slope[:, 0, None] * np.sin(directions)
    measured = np.degrees(np.arctan(np.sqrt(np.mean(along**2, axis=0))))
    law = [np.degrees(np.arctan(rms_slope(fit.orientation, one))) for one in directions]
    axis.plot(directions, measured, color="C0", label="rms slope of the facets")
    axis.plot(directions, law, "--", color="C1", label="rms slope of the law")
    limit = 90 / fit.orientation.a
    axis.plot(directions, np.full(73, limit), ":", color="C1", label=f"90°/a = {limit:.0f}°")
    axis.set_ylim(0.0, 1.15 * max(limit, float(np.percentile(inclination, 99))))
    axis.yaxis.set_major_locator(MaxNLocator(4))
    axis.set_rlabel_position(67.5)
    axis.set_title("inclination (°) by direction from the rows", fontsize="medium")
    axis.legend(loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2, fontsize="small")


def _plot_depths(axis: Any, fit: "SurfaceFit") -> None:
    """Plot the depths of the summits and the density of the law."""
    depth = fit.asperities.depth
    bins = int(np.clip(np.sqrt(depth.size), 8, 40))
    axis.hist(1e6 * depth, bins, density=True, color="C0", alpha=0.4, label="summits")
    x = np.linspace(0.0, float(depth.max()), 200)
    heights = fit.heights
    cdf = np.asarray(heights.cdf(heights.overlap + x))
    axis.plot(1e6 * x, np.gradient(cdf, 1e6 * x), color="C1", label="density of the law")
    axis.set(xlabel="depth below the highest summit (µm)", ylabel="density (1/µm)")
    axis.set_ylim(top=1.3 * axis.get_ylim()[1])
    axis.legend(loc="upper right")


def _some(n: int) -> Array:
    """At most `MAX_POINTS` of n indices, evenly spaced."""
    return np.unique(np.linspace(0, n - 1, min(n, MAX_POINTS)).astype(int))
