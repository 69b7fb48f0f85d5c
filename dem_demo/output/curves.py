"""Curves of a run: where the energy went, and the monitored joints against the law alone."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..dynamics.energy import COLUMNS
from .drawing import positive
from .law_alone import shear_curve
from .record import Record

LEAST = 0.01  # of the critical slip distance: what is less is not drawn on a logarithmic axis


def energy(record: Record, path: Path) -> None:
    """Where the energy is, where it went, and how well it balances."""
    t, table = np.array(record.times), np.array(record.energy)
    figure = Figure(figsize=(8, 7.5), dpi=120, layout="constrained")
    top, middle, low = figure.subplots(3, sharex=True, height_ratios=[3, 3, 2])
    of = dict(zip([*COLUMNS, "error"], table.T, strict=True))
    labels = {
        "potential": "potential (gravity)", "work": "work of drives and loads",
        "kinetic": "kinetic", "stored": "stored in joints", "friction": "friction in joints",
        "dashpots": "dashpots", "dropped": "lost with contacts that end",
    }  # fmt: skip
    for number, (name, label) in enumerate(labels.items()):
        top.plot(t, 1e-3 * of[name], label=label, color=f"C{number}")
        if name not in ("potential", "work"):
            middle.semilogy(t, positive(np.abs(of[name])), color=f"C{number}")
    top.set_ylabel("energy (kJ)")
    figure.legend(fontsize=8, ncols=4, loc="outside lower center")
    top.set_title(record.scene.title)
    middle.set_ylabel("size of energy (J)")
    peak = float(np.nanmax(np.abs(table[:, 2:6]), initial=1e-12))
    middle.set_ylim(max(1e-9 * peak, 1e-12), 3 * peak)
    low.plot(t, 1e6 * of["error"], color="k")
    low.set_ylabel("imbalance (ppm)")
    low.set_title("imbalance, as parts per million of the energy turned over", fontsize=8)
    low.set_xlabel("time (s)")
    for axes in (top, middle, low):
        axes.grid(alpha=0.3)
    figure.savefig(path)


def shear(record: Record, path: Path) -> None:
    """Stress and dilation of the monitored joints against sliding, and of the law alone."""
    figure = Figure(figsize=(8, 7), dpi=120, layout="constrained")
    upper, lower = figure.subplots(2, sharex=True)
    for moving, base in record.scene.monitors.shear:
        name = record.scene.blocks[moving].name
        slid = 1e3 * record.column(f"{name}: slid_m")
        upper.plot(slid, 1e-3 * record.column(f"{name}: shear_Pa"), label=f"{name} (blocks)")
        closure = record.column(f"{name}: closure_m")
        lower.plot(slid, 1e3 * (closure[0] - closure))
        law = record.scene.laws[record.laws[moving, base]]
        stress = float(record.column(f"{name}: normal_Pa")[0])
        if alone := shear_curve(law, stress, 1e-3 * slid):
            x, style = 1e3 * alone["slid"], {"color": "k", "ls": ":", "lw": 1.5}
            upper.plot(
                x,
                1e-3 * alone["shear"],
                label="law alone, at the normal stress of the start",
                **style,
            )
            lower.plot(x, 1e3 * alone["dilation"], **style)
    upper.set_ylabel("shear stress (kPa)")
    lower.set_ylabel("dilation since seating (mm)")
    lower.set_xlabel("shear displacement (mm)")
    lower.grid(alpha=0.3)
    _finish(figure, upper, record, path)


def tilt(record: Record, path: Path, slips: list[dict]) -> None:
    """Angle of the monitored bases against sliding, and the peak of the law alone."""
    figure = Figure(figsize=(8, 4.8), dpi=120, layout="constrained")
    axes = figure.subplots()
    for number, entry in enumerate(slips):
        name, colour = entry["block"], f"C{number}"
        slid = 1e3 * np.abs(record.column(f"{name}: slid_m"))
        angle = record.column(f"{name}: base angle_deg")
        still = np.flatnonzero(slid < LEAST * 1e3 * entry["slip_distance"])
        start = int(still[-1]) if len(still) else 0  # before it the block shakes to and fro
        axes.semilogx(slid[start:], angle[start:], color=colour, label=f"{name}, blocks")
        if entry["predicted_angle"] is not None:
            axes.axhline(
                entry["predicted_angle"], color=colour, ls="--", lw=1,
                label=f"{name}, peak of the law alone: {entry['predicted_angle']:.2f}°",
            )  # fmt: skip
        if entry["slip_angle"] is not None:
            axes.plot(1e3 * entry["slip_distance"], entry["slip_angle"], "o", color=colour)
    axes.axvline(1e3 * slips[0]["slip_distance"], color="0.5", lw=1, ls=":")
    axes.set_xlabel("shear displacement (mm); dotted: critical slip distance")
    axes.set_ylabel("angle of the base (degrees)")
    _finish(figure, axes, record, path)


def _finish(figure: Figure, axes, record: Record, path: Path) -> None:
    axes.set_title(record.scene.title)
    figure.legend(fontsize=8, ncols=2, loc="outside lower center")
    axes.grid(alpha=0.3)
    figure.savefig(path)
