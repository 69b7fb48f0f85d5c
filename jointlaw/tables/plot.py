"""Picture of a joint table (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..support.checks import Array
from ..support.pyplot import pyplot


def plot_table(columns: Mapping[str, Array], path: str | Path | None = None) -> Any:
    """Normal stress, stiffnesses, friction and dilation of a table's columns against closure."""
    figure, axes = pyplot().subplots(2, 2, figsize=(9, 6.5), layout="constrained", sharex=True)
    u = columns["un"] * 1e6
    axes[0, 0].plot(u, columns["sn"] / 1e6, "o-", ms=2.5)
    axes[0, 0].set_ylabel("normal stress (MPa)")
    for kind in ("secant", "tangent"):
        axes[0, 1].plot(u, columns[f"kn_{kind}"] / 1e9, label=f"normal, {kind}")
    azimuths = [name[3:] for name in columns if name.startswith("kt_")]
    for k in (0, len(azimuths) // 4, len(azimuths) // 2):
        azimuth, label = azimuths[k], f"{int(azimuths[k])}°"
        axes[0, 1].plot(u, columns[f"kt_{azimuth}"] / 1e9, "--", label=f"shear, {label}")
        axes[1, 0].plot(u, columns[f"mu_{azimuth}"], label=f"peak, {label}")
        axes[1, 1].plot(u, np.degrees(np.arctan(columns[f"dil_{azimuth}"])), label=label)
    axes[0, 1].set_ylabel("stiffness (GPa/m)")
    axes[1, 0].set_ylabel("friction coefficient")
    axes[1, 1].set_ylabel("dilation angle (°)")
    for axis in (axes[0, 1], axes[1, 0], axes[1, 1]):
        axis.legend(fontsize="small")
    for axis in axes[1]:
        axis.set_xlabel("closure (µm)")
    if path is not None:
        figure.savefig(path, dpi=150)
        pyplot().close(figure)
    return figure
