"""A fit as a picture: data, law, bands (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..support.pyplot import pyplot
from .estimate import Estimate
from .forward import build_for_shear
from .measured import ClosureCurve

Points = tuple[ArrayLike, ArrayLike]  # stress (Pa) and closure (m)


def plot_fit(fit: Estimate, path: str | Path | None = None, held_out: Points | None = None) -> Any:
    """One panel per curve: points, law and 95 % band.

    held_out: points of the first closure curve that were not fitted.
    """
    plt = pyplot()
    curves = fit.problem.curves
    figure, axes = plt.subplots(
        1, len(curves), figsize=(5.2 * len(curves) + 0.8, 4.4), layout="constrained", squeeze=False
    )
    closures = 0
    for axis, curve in zip(axes[0], curves, strict=True):
        if isinstance(curve, ClosureCurve):
            closures += 1
            _draw_closure(axis, fit, curve, closures, held_out if closures == 1 else None)
        else:
            model = curve.predict(
                build_for_shear(fit.parameters, fit.problem.settings, curve.azimuth)
            )
            axis.plot(1e6 * curve.shear, curve.shear_stress / 1e6, "o", ms=4, label="measured")
            axis.plot(1e6 * curve.shear, model / 1e6, color="C1", label="law")
            label = f"shear stress (MPa) at {curve.normal / 1e6:.3g} MPa"
            axis.set(xlabel="shear displacement (µm)", ylabel=label)
            axis.legend()
    if path is not None:
        figure.savefig(path, dpi=150)
        plt.close(figure)
    return figure


def _draw_closure(
    axis: Any, fit: Estimate, curve: ClosureCurve, number: int, held_out: Points | None
) -> None:
    top, points = (
        float(curve.closure[-1]),
        {"marker": "o", "ls": "none", "color": "C0", "zorder": 3},
    )
    if held_out is not None:
        stress, closure = (np.asarray(x, float) for x in held_out)
        top = float(closure[-1])
        label = "measured, not fitted"
        axis.plot(1e6 * closure, stress / 1e6, mfc="none", ms=5, label=label, **points)
    u = np.linspace(float(curve.closure[0]), 1.03 * top, 120)
    low, high = fit.band(u, curve=number)
    axis.fill_between(1e6 * u, low / 1e6, high / 1e6, color="C1", alpha=0.25, label="95 % band")
    axis.plot(1e6 * u, fit.predict(u, number) / 1e6, color="C1", label="law")
    axis.plot(1e6 * curve.closure, curve.stress / 1e6, ms=4, label="measured", **points)
    axis.set(xlabel="closure since the test began (µm)", ylabel="normal stress (MPa)")
    axis.legend(loc="upper left")
