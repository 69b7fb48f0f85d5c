"""Pictures of test records (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..support.checks import Array
from ..support.pyplot import pyplot

_LENGTHS = ((1e-9, "nm"), (1e-6, "µm"), (1e-3, "mm"), (1.0, "m"))
_STRESSES = ((1.0, "Pa"), (1e3, "kPa"), (1e6, "MPa"), (1e9, "GPa"))
_ENERGIES = ((1e-6, "µJ/m²"), (1e-3, "mJ/m²"), (1.0, "J/m²"), (1e3, "kJ/m²"))


def plot_record(curves: Mapping[str, Array], azimuth: float, path: str | Path | None = None) -> Any:
    """Draw a closure test or a direct shear test; returns the matplotlib figure.

    curves: the columns of a record with its shear, shear_stress and friction_angle, arrays
    (rows,); azimuth of the shear in rad. With `path` the figure is also written there and closed.
    """
    sheared = bool(np.any(curves["shear"] != curves["shear"][0]))
    figure = _shear_figure(curves, azimuth) if sheared else _closure_figure(curves)
    if path is not None:
        figure.savefig(path, dpi=150)
        pyplot().close(figure)
    return figure


def _scaled(values: Array, units: tuple[tuple[float, str], ...]) -> tuple[Array, str]:
    """Values in the largest unit that leaves their peak at one or more."""
    peak = float(np.max(np.abs(values)))
    factor, name = next(((f, n) for f, n in reversed(units) if peak >= f), units[0])
    return values / factor, name


def _shear_figure(curves: Mapping[str, Array], azimuth: float) -> Any:
    shear, length = _scaled(curves["shear"], _LENGTHS)
    figure, axes = pyplot().subplots(2, 2, figsize=(9, 6.5), layout="constrained", sharex=True)
    stress, unit = _scaled(np.stack([curves["shear_stress"], curves["F1"]]), _STRESSES)
    axes[0, 0].plot(shear, stress[0], label="shear stress")
    axes[0, 0].plot(shear, stress[1], "--", color="0.5", label="normal stress")
    axes[0, 0].set_ylabel(f"stress ({unit})")
    axes[0, 0].legend()
    axes[0, 1].plot(shear, curves["friction_angle"], color="C3")
    axes[0, 1].set_ylabel("mobilised friction angle (°)")
    dilation, small = _scaled(curves["closure"][0] - curves["closure"], _LENGTHS)
    axes[1, 0].plot(shear, dilation, color="C2")
    axes[1, 0].set_ylabel(f"dilation ({small})")
    axes[1, 1].plot(shear, 100 * curves["sliding"], label="sliding")
    axes[1, 1].plot(shear, 100 * curves["separated"], label="separated")
    axes[1, 1].set_ylabel("share of facet orientations (%)")
    axes[1, 1].set_ylim(-3, 103)
    axes[1, 1].legend(loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=2, frameon=False)
    for axis in axes[1]:
        axis.set_xlabel(f"shear displacement ({length})")
    peak = np.max(np.abs(curves["friction_angle"]))
    figure.suptitle(
        f"Direct shear at azimuth {np.degrees(azimuth):.0f}°, peak friction angle {peak:.1f}°"
    )
    return figure


def _closure_figure(curves: Mapping[str, Array]) -> Any:
    closure, length = _scaled(curves["closure"], _LENGTHS)
    stress, unit = _scaled(curves["F1"], _STRESSES)
    energy, joule = _scaled(np.stack([curves["stored"], curves["dissipated"]]), _ENERGIES)
    figure, axes = pyplot().subplots(1, 2, figsize=(9, 4), layout="constrained")
    axes[0].plot(closure, stress)
    axes[0].set_xlabel(f"closure ({length})")
    axes[0].set_ylabel(f"normal stress ({unit})")
    axes[1].plot(closure, energy[0], label="stored")
    axes[1].plot(closure, energy[1], label="dissipated by friction")
    axes[1].set_xlabel(f"closure ({length})")
    axes[1].set_ylabel(f"energy ({joule})")
    axes[1].legend()
    figure.suptitle("Closure test")
    return figure
