"""Pictures of fits: data, law, bands (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..support.pyplot import pyplot as _pyplot
from ..surface.direction_fit import model_inclination
from .measured import ClosureCurve, build

if TYPE_CHECKING:
    from ..surface.fit import SurfaceFit
    from .baselines import Comparison
    from .fit import Fit


def plot_fit(fit: Fit, path: str | Path | None = None, held_out: Comparison | None = None) -> Any:
    """One panel per curve: points, law and 95 % band; with `held_out` the points not fitted."""
    pyplot = _pyplot()
    curves = fit.problem.curves
    figure, axes = pyplot.subplots(
        1, len(curves), figsize=(5.2 * len(curves) + 0.8, 4.4), layout="constrained", squeeze=False
    )
    closures = 0
    for axis, curve in zip(axes[0], curves, strict=True):
        if not isinstance(curve, ClosureCurve):
            model = curve.predict(build(fit.parameters, fit.problem.settings, curve.azimuth))
            axis.plot(1e6 * curve.shear, curve.shear_stress / 1e6, "o", ms=4, label="measured")
            axis.plot(1e6 * curve.shear, model / 1e6, color="C1", label="law")
            axis.set_xlabel("shear displacement (µm)")
            axis.set_ylabel(f"shear stress (MPa) at {curve.normal / 1e6:.3g} MPa")
            axis.legend()
            continue
        closures += 1
        top = float(curve.closure[-1])
        if held_out is not None and closures == 1:
            top = float(held_out.closure[-1])
            axis.plot(
                1e6 * held_out.closure, held_out.stress / 1e6, "o", mfc="none", mec="C0", ms=5,
                label="measured, not fitted", zorder=3,
            )  # fmt: skip
        u = np.linspace(float(curve.closure[0]), 1.03 * top, 120)
        low, high = fit.band(u, curve=closures)
        axis.fill_between(1e6 * u, low / 1e6, high / 1e6, color="C1", alpha=0.25, label="95 % band")
        axis.plot(1e6 * u, fit.predict(u, closures) / 1e6, color="C1", label="law")
        axis.plot(
            1e6 * curve.closure,
            curve.stress / 1e6,
            "o",
            color="C0",
            ms=4,
            label="measured",
            zorder=3,
        )
        axis.set_xlabel("closure since the test began (µm)")
        axis.set_ylabel("normal stress (MPa)")
        axis.legend(loc="upper left")
    return _finish(pyplot, figure, path)


def plot_surface(fit: SurfaceFit, path: str | Path | None = None) -> Any:
    """The scan with its summits, heights and inclinations against their fits."""
    pyplot = _pyplot()
    figure, axes = pyplot.subplots(1, 3, figsize=(12.5, 3.9), layout="constrained")
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
    return _finish(pyplot, figure, path)


def _finish(pyplot: Any, figure: Any, path: str | Path | None) -> Any:
    if path is not None:
        figure.savefig(path, dpi=150)
        pyplot.close(figure)
    return figure
