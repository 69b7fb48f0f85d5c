"""Sheets drawn with matplotlib (extra `plot`)."""

from __future__ import annotations

import io
import textwrap
from typing import Any

import numpy as np

from .sheet import Mark, Panel, Sheet


def require_matplotlib() -> None:
    """Raise ImportError, with the remedy, if matplotlib is missing."""
    try:
        import matplotlib.figure  # noqa: F401
    except ImportError as error:
        raise ImportError("figures need matplotlib: pip install 'jointlaw[plot]'") from error


def png(sheet: Sheet, dpi: int = 130) -> bytes:
    """The figure as PNG, its caption below. Raises ImportError without matplotlib."""
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns = min(len(sheet.panels), 3 if len(sheet.panels) != 4 else 2)
    rows = -(-len(sheet.panels) // columns)
    width = 5.2 * columns if columns > 1 else 7.0
    caption = textwrap.fill(sheet.caption, int(width * 16.5))
    below = 0.18 * (caption.count("\n") + 1) + 0.2
    figure: Any = Figure(figsize=(width, 4.3 * rows + below + 0.4), layout="constrained")
    FigureCanvasAgg(figure)
    height = float(figure.get_size_inches()[1])
    figure.get_layout_engine().set(rect=(0, below / height, 1, 1 - below / height))
    for place, panel in enumerate(sheet.panels, 1):
        axes = figure.add_subplot(rows, columns, place, polar=panel.polar)
        _draw(axes, panel)
    figure.suptitle(f"{sheet.shown}: {sheet.title}", fontsize=11)
    figure.text(0.02, 0.1 / height, caption, fontsize=8, va="bottom", family="sans-serif")
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=dpi)
    return out.getvalue()


def _draw(axes: Any, panel: Panel) -> None:
    for curve in panel.curves:
        x = np.radians(curve.x) if panel.polar else curve.x
        label = curve.label if not curve.label.startswith("_") else None
        axes.plot(x, curve.y, curve.style, color=curve.color, label=label, ms=3.5, lw=1.4)
    for number, band in enumerate(panel.bands):
        span = axes.axhspan if band.axis == "y" else axes.axvspan
        span(band.low, band.high, color=f"C{7 + 2 * number}", alpha=0.16, lw=0, label=band.label)
    for mark in panel.marks:
        _mark(axes, mark)
    axes.set_title(panel.title, fontsize=9)
    if panel.xlim is not None:
        axes.set_xlim(*panel.xlim)
    if panel.ylim is not None:
        axes.set_ylim(*panel.ylim)
    if panel.picture:
        axes.set_aspect("equal")
        axes.set_axis_off()
        return
    if panel.polar:
        axes.set_thetagrids(range(0, 360, 30))
        axes.set_xlabel(f"{panel.y}; angle: {panel.x}", fontsize=8)
    else:
        axes.set_xlabel(panel.x, fontsize=9)
        axes.set_ylabel(panel.y, fontsize=9)
        axes.grid(alpha=0.3, lw=0.5)
        if panel.xlim is None:
            axes.margins(x=0)
    if panel.log_ticks:
        axes.set_xscale("log")
        axes.set_xticks(panel.log_ticks, [f"{tick:g}" for tick in panel.log_ticks])
        axes.minorticks_off()
    axes.tick_params(labelsize=8)
    if any(not curve.label.startswith("_") for curve in panel.curves) or panel.bands:
        outside = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16)} if panel.polar else {}
        axes.legend(fontsize=7, framealpha=0.85, **outside)


def _mark(axes: Any, mark: Mark) -> None:
    if mark.tail is None:
        axes.text(mark.x, mark.y, mark.text, fontsize=8, color=mark.color, ha="center")
        return
    arrow = {"arrowstyle": "-|>", "color": mark.color, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=(mark.x, mark.y), xytext=mark.tail, arrowprops=arrow)
    dx, dy = mark.x - mark.tail[0], mark.y - mark.tail[1]
    length = max((dx**2 + dy**2) ** 0.5, 1e-12)
    at = (mark.x + 0.08 * dx / length, mark.y + 0.11 * dy / length)
    side = "center" if abs(dx) < 0.9 * length else "left" if dx > 0 else "right"
    axes.text(*at, mark.text, fontsize=9, color=mark.color, ha=side, va="center")
