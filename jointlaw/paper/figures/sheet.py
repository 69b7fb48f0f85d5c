"""A figure as data: panels of curves, from which both the PNG and the CSV are written."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ...support.checks import Array
from .captions import CAPTIONS

TOTAL, LAW = "total form (as printed)", "incremental law (this package)"


class Curve(NamedTuple):
    """One line: its points, its name in the legend and its matplotlib style."""

    label: str
    x: Array
    y: Array
    style: str = "-"
    color: str | None = None


class Band(NamedTuple):
    """A range that the paper's text quotes, drawn across one axis ("x" or "y")."""

    axis: str
    low: float
    high: float
    label: str


class Mark(NamedTuple):
    """Text at a point, or, with a tail, an arrow from the tail to the point and its text."""

    x: float
    y: float
    text: str
    tail: tuple[float, float] | None = None
    color: str = "0.2"


@dataclass(frozen=True)
class Panel:
    """One pair of axes; `polar` panels take x in degrees."""

    title: str
    x: str
    y: str
    curves: list[Curve]
    polar: bool = False
    log_ticks: tuple[float, ...] = ()  # given: x is logarithmic, with these ticks
    xlim: tuple[float, float] | None = None
    ylim: tuple[float, float] | None = None
    bands: list[Band] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    picture: bool = False  # a sketch: equal scales, no axes


@dataclass(frozen=True)
class Sheet:
    """A whole figure with its caption: what is computed, and what the paper does not print."""

    number: str
    title: str
    caption: str
    panels: list[Panel]

    @property
    def name(self) -> str:
        """File name without its ending."""
        return f"figure-{self.number}"

    @property
    def shown(self) -> str:
        """What the paper calls it."""
        parts = [str(int(part)) for part in self.number.split("-")]
        return f"Figure{'s' if len(parts) > 1 else ''} {' and '.join(parts)}"

    def csv(self) -> str:
        """Every point of every curve: panel, curve, the two axes with their units, x and y."""
        out = io.StringIO()
        rows = csv.writer(out, lineterminator="\n")
        rows.writerow(["panel", "curve", "x_axis", "y_axis", "x", "y"])
        for panel in self.panels:
            for curve in panel.curves:
                for x, y in zip(np.asarray(curve.x), np.asarray(curve.y), strict=True):
                    place = [panel.title, curve.label.lstrip("_"), panel.x, panel.y]
                    rows.writerow([*place, f"{x:.8g}", f"{y:.8g}"])
        return out.getvalue()


def sheet(number: str, panels: list[Panel]) -> Sheet:
    """The figure of this number with its title and caption."""
    title, caption = CAPTIONS[number]
    return Sheet(number, title, caption, panels)
