"""A fit as a picture: data, law, bands (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..support.pyplot import pyplot
from .estimate import Estimate
from .forward import build
from .measured import ClosureCurve


def plot_fit(
    fit: Estimate,
    path: str | Path | None = None,
    held_out: tuple[ArrayLike, ArrayLike] | None = None,
) -> Any:
    """One panel per curve: points, law and 95 % band.

    held_out: stress (Pa) and closure (m) of points of the first closure curve that were not fitted.
    """
    plt = pyplot()
    curves = fit.problem.curves
    figure, axes = plt.subplots(
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
            stress, closure = (np.asarray(x, float) for x in held_out)
            top = float(closure[-1])
            axis.plot(
                1e6 * closure, stress / 1e6, "o", mfc="none", mec="C0", ms=5,
                label="measured, not fitted", zorder=3,
            )  # fmt: skip
        u = np.linspace(float(curve.closure[0]), 1.03 * top, 120)
        low, high = fit.band(u, curve=closures)
        axis.fill_between(1e6 * u, low / 1e6, high / 1e6, color="C1", alpha=0.25, label="95 % band")
        axis.plot(1e6 * u, fit.predict(u, closures) / 1e6, color="C1", label="law")
        axis.plot(
            1e6 * curve.closure, curve.stress / 1e6, "o", color="C0", ms=4, label="measured",
            zorder=3,
        )  # fmt: skip
        axis.set_xlabel("closure since the test began (µm)")
        axis.set_ylabel("normal stress (MPa)")
        axis.legend(loc="upper left")
    if path is not None:
        figure.savefig(path, dpi=150)
        plt.close(figure)
    return figure
