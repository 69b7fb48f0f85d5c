"""The paper's figures drawn with matplotlib (extra `plot`), and their curves as CSV."""

from __future__ import annotations

import csv
import io
import textwrap
from typing import Any

import numpy as np

from ..support.pyplot import pyplot
from .section import Figure

TOTAL, LAW = "total form (as printed)", "incremental law (this package)"
QUOTED = {"alpha": 0.16, "lw": 0}  # style of a range that the paper's text quotes
_STYLE: dict[Any, Any] = {
    "font.size": 9, "font.family": "sans-serif", "figure.titlesize": 11, "axes.titlesize": 9,
    "axes.labelsize": 9, "xtick.labelsize": 8, "ytick.labelsize": 8, "legend.fontsize": 7,
    "legend.framealpha": 0.85, "lines.linewidth": 1.4, "lines.markersize": 3.5, "savefig.dpi": 130,
    "axes.grid": True, "grid.alpha": 0.3, "grid.linewidth": 0.5, "axes.xmargin": 0,
}  # fmt: skip


def rendered(figure: Figure) -> tuple[bytes, str]:
    """The figure as PNG, and its curves as CSV. Raises ImportError without matplotlib."""
    out = io.BytesIO()
    with pyplot().rc_context(_STYLE):
        page = drawn(figure)
        page.savefig(out, format="png")
    return out.getvalue(), points(page)


def drawn(figure: Figure) -> Any:
    """The matplotlib figure with its panels, legends and, below, its caption."""
    from matplotlib.figure import Figure as Page

    columns = min(figure.panels, 3 if figure.panels != 4 else 2)
    rows = -(-figure.panels // columns)
    width = 5.2 * columns if columns > 1 else 7.0
    caption = textwrap.fill(figure.caption, int(width * 16.5))
    below = 0.18 * (caption.count("\n") + 1) + 0.2
    height = 4.3 * rows + below + 0.4
    page: Any = Page(figsize=(width, height), layout="constrained")
    page.get_layout_engine().set(rect=(0, below / height, 1, 1 - below / height))
    kind = {"polar": figure.polar}
    panels = page.subplots(rows, columns, squeeze=False, subplot_kw=kind).ravel()
    figure.draw(*panels)
    place = {"loc": "upper center", "bbox_to_anchor": (0.5, -0.16)} if figure.polar else {}
    for panel in panels:
        if figure.polar:
            panel.set_thetagrids(range(0, 360, 30))
            panel.yaxis.labelpad = 32
        if panel.get_legend_handles_labels()[1]:
            panel.legend(**place)
    shown = "Figure " if len(figure.numbers) == 1 else "Figures "
    page.suptitle(f"{shown}{' and '.join(map(str, figure.numbers))}: {figure.title}")
    page.text(0.02, 0.1 / height, caption, fontsize=8, va="bottom")
    return page


def points(page: Any) -> str:
    """Every point of every curve as CSV: panel, curve, the two axes with their units, x and y.

    Angles in degrees. A curve whose label begins with "_" is here, but not in the legend.
    """
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(["panel", "curve", "x_axis", "y_axis", "x", "y"])
    for panel in page.axes:
        axes = (panel.get_xlabel(), panel.get_ylabel())
        for line in panel.get_lines():
            x = np.degrees(line.get_xdata()) if panel.name == "polar" else line.get_xdata()
            for point in zip(x, line.get_ydata(), strict=True):
                curve = line.get_label().lstrip("_")
                rows.writerow([panel.get_title(), curve, *axes, *(f"{v:.8g}" for v in point)])
    return out.getvalue()
