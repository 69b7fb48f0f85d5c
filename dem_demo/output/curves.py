"""Curves of a run: where the energy went, and the monitored joints against the law alone."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..dynamics.energy import COLUMNS
from .monitors import shear_curve
from .record import Record

LABELS = {
    "potential": "potential (gravity)", "work": "work of drives and loads",
    "kinetic": "kinetic", "stored": "stored in joints", "friction": "friction in joints",
    "dashpots": "dashpots", "dropped": "lost with contacts that end",
}  # fmt: skip


def energy(record: Record, path: Path) -> None:
    """Where the energy is, where it went, and how well it balances."""
    t, of = np.array(record.times), dict(zip([*COLUMNS, "error"], zip(*record.energy), strict=True))  # noqa: B905
    figure, (top, low) = _figure(6.5, 2)
    for name, label in LABELS.items():
        top.plot(t, 1e-3 * np.array(of[name]), label=label)
    low.plot(t, 1e6 * np.array(of["error"]), color="k")
    low.set(ylabel="imbalance (ppm of the\nenergy turned over)", xlabel="time (s)")
    top.set_ylabel("energy (kJ)")
    _finish(figure, top, record, path)


def joints(record: Record, path: Path) -> None:
    """Stress and dilation of the watched joints against sliding; of those in shear, which keep
    their normal stress, also by the law alone."""
    figure, (upper, lower) = _figure(7, 2)
    for (moving, base), law in record.laws.items():
        name = record.scene.blocks[moving].name
        keys = ("slid_m", "closure_m", "normal_Pa", "shear_Pa")
        slid, closure, stress, tau = (record.column(f"{name}: {key}") for key in keys)
        upper.plot(1e3 * slid, 1e-3 * tau, label=f"{name} (blocks)")
        lower.plot(1e3 * slid, 1e3 * (closure[0] - closure))
        alone = None
        if (moving, base) in record.scene.monitors.shear:
            alone = shear_curve(record.scene.laws[law], float(stress[0]), slid)
        if alone:
            style = {"color": "k", "ls": ":", "lw": 1.5}
            label = "law alone, at the normal stress of the start"
            upper.plot(1e3 * alone.shear_2, 1e-3 * alone.F2, label=label, **style)
            lower.plot(1e3 * alone.shear_2, 1e3 * (alone.closure[0] - alone.closure), **style)
    upper.set_ylabel("shear stress (kPa)")
    lower.set(ylabel="dilation since seating (mm)", xlabel="shear displacement (mm)")
    _finish(figure, upper, record, path)


def _figure(high: float, rows: int):
    figure = Figure(figsize=(8, high), dpi=120, layout="constrained")
    return figure, figure.subplots(rows, sharex=True, squeeze=False)[:, 0]


def _finish(figure: Figure, first, record: Record, path: Path) -> None:
    first.set_title(record.scene.title)
    figure.legend(fontsize=8, ncols=3, loc="outside lower center")
    for axes in figure.axes:
        axes.grid(alpha=0.3)
    figure.savefig(path)
