"""The frontier as a picture (needs matplotlib: extra `plot`)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..parameters.resolution import NAMED
from ..support.checks import Array
from ..support.pyplot import pyplot
from .price import Price, frontier


def plot_prices(
    prices: Sequence[Price], uncertainty: Array, joints: int, how: str, path: str | Path | None
) -> Any:
    """Largest error against sliders and, where it was timed, against time per update.

    The arguments are the fields of a `Tradeoff`.
    """
    timed = bool(joints)
    size = (9.5, 4.6) if timed else (5.5, 4.6)
    figure, axes = pyplot().subplots(
        1, 1 + timed, figsize=size, layout="constrained", sharey=True, squeeze=False
    )
    best = frontier(prices)
    panels = [("sliders per joint", ["sliders"])]
    if timed:
        panels.append(("time per joint and update (ns)", ["ns", "ns_tangent"]))
    for axis, (label, costs) in zip(axes[0], panels, strict=True):
        for cost, color in zip(costs, ("C0", "C1"), strict=False):
            x, y = [getattr(r, cost) for r in prices], [100 * r.worst for r in prices]
            axis.loglog(x, y, ".", color=color, alpha=0.25, markeredgewidth=0)
            x, y = [getattr(r, cost) for r in best], [100 * r.worst for r in best]
            label_ = "traction and tangent" if cost == "ns_tangent" else "traction"
            axis.loglog(x, y, "o-", color=color, ms=4, lw=1.2, label=label_)
        for name, resolution in NAMED.items():
            for row in prices:
                if row.resolution == resolution:
                    at = (getattr(row, costs[0]), 100 * row.worst)
                    axis.plot(*at, "s", color="k", ms=6, mfc="none")
                    axis.annotate(name, at, (0, 6), textcoords="offset points", fontsize=8,
                                  ha="right" if name == "reference" else "left")  # fmt: skip
        floor = 100 * float(uncertainty.max())
        axis.axhline(floor, color="0.6", lw=1, ls=":")
        axis.set_xlabel(label)
        axis.grid(True, which="both", alpha=0.2)
    axes[0, 0].text(0.02, floor * 1.08, "uncertainty of the reference", fontsize=7, color="0.4",
                    transform=axes[0, 0].get_yaxis_transform())  # fmt: skip
    axes[0, 0].set_ylabel("largest error of the traction (% of the path's peak)")
    low = min(floor, 100 * min(r.worst for r in prices))
    axes[0, 0].set_ylim(0.7 * low, 150 * max(r.worst for r in prices))
    for axis in axes[0]:
        axis.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
    if timed:
        axes[0, 1].legend(title=f"{joints} joints, {how}", fontsize=8,
                          title_fontsize=8)  # fmt: skip
    if path is not None:
        figure.savefig(path, dpi=150)
        pyplot().close(figure)
    return figure
