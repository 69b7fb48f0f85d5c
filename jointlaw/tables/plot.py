"""Picture of a joint table (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..support.pyplot import pyplot as _pyplot

if TYPE_CHECKING:
    from .table import JointTable


def plot_table(table: JointTable, path: str | Path | None = None) -> Any:
    """Normal stress, stiffnesses, friction and dilation against closure, by azimuth."""
    pyplot = _pyplot()
    figure, axes = pyplot.subplots(2, 2, figsize=(9, 6.5), layout="constrained", sharex=True)
    u = table.closure * 1e6
    axes[0, 0].plot(u, table.normal_stress / 1e6, "o-", ms=2.5)
    axes[0, 0].set_ylabel("normal stress (MPa)")
    for name, values in (
        ("normal, secant", table.kn_secant),
        ("normal, tangent", table.kn_tangent),
    ):
        axes[0, 1].plot(u, values / 1e9, label=name)
    places = [0, len(table.azimuth) // 4, len(table.azimuth) // 2]
    for k in places:
        label = f"{np.degrees(table.azimuth[k]):.0f}°"
        axes[0, 1].plot(u, table.shear_stiffness[:, k] / 1e9, "--", label=f"shear, {label}")
        axes[1, 0].plot(u, table.peak_friction[:, k], label=f"peak, {label}")
        axes[1, 1].plot(u, np.degrees(np.arctan(table.dilation[:, k])), label=label)
    axes[0, 1].set_ylabel("stiffness (GPa/m)")
    axes[1, 0].set_ylabel("friction coefficient")
    axes[1, 1].set_ylabel("dilation angle (°)")
    for axis in (axes[0, 1], axes[1, 0], axes[1, 1]):
        axis.legend(fontsize="small")
    for axis in axes[1]:
        axis.set_xlabel("closure (µm)")
    if path is not None:
        figure.savefig(path, dpi=150)
        pyplot.close(figure)
    return figure
