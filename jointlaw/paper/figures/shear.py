"""Figures 14 to 16: shear at a kept closure of 1 um."""

from __future__ import annotations

import math

import numpy as np

from .runs import incremental, law, ratio, total
from .sheet import LAW, TOTAL, Curve, Panel, Sheet, sheet

CLOSURE, TO = 1e-6, 4e-6  # m; the closure is printed, the end of the axis is not
AXIS = "shear displacement δ₂ (µm)"


def figure_14() -> Sheet:
    """Shear resistance for a = 2, 3, 6, 9."""
    names = [(f"linear-a{a}", f"a = {a}", f"C{i}") for i, a in enumerate((2, 3, 6, 9))]
    return sheet(
        "14",
        _side_by_side(names, friction=0.6),
    )


def figure_15() -> Sheet:
    """Linear against Hertzian asperities."""
    names = [
        ("linear-a3", "linear, a = 3", "C0"),
        ("nonlinear-a3", "nonlinear, a = 3", "C3"),
        ("linear-a6", "linear, a = 6", "C2"),
        ("nonlinear-a6", "nonlinear, a = 6", "C1"),
    ]
    return sheet(
        "15",
        _side_by_side(names, friction=0.6),
    )


def figure_16() -> Sheet:
    """Sliding and separation during shear."""
    panels = []
    for kind in (TOTAL, LAW):
        curves = []
        for a, color in ((3, "C0"), (6, "C1")):
            name = f"linear-a{a}"
            run = (total if kind == TOTAL else incremental)(name, TO, closure=CLOSURE)
            x = run.shear * 1e6
            curves.append(Curve(f"sliding, a = {a}", x, run.sliding, "-", color))
            curves.append(Curve(f"separated, a = {a}", x, run.separated, "--", color))
            onset = CLOSURE * 1e6 / math.tan(0.5 * math.pi / a)
            mark = np.full(2, onset)
            curves.append(
                Curve(f"_onset cot(pi/2a), a = {a}", mark, np.array([0.0, 0.08]), ":", color)
            )
        panels.append(Panel(kind, AXIS, "share of asperities", curves, ylim=(-0.02, 1.05)))
    return sheet(
        "16",
        panels,
    )


def _side_by_side(names: list[tuple[str, str, str]], friction: float) -> list[Panel]:
    """Total form left; incremental law right, with the total form thin behind it."""
    left, right = [], []
    for name, label, color in names:
        printed = total(name, TO, closure=CLOSURE)
        ours = incremental(name, TO, closure=CLOSURE)
        left.append(Curve(label, printed.shear * 1e6, ratio(printed), "-", color))
        right.append(Curve(label, ours.shear * 1e6, ratio(ours), "-", color))
        right.append(Curve(f"_{label}, total", printed.shear * 1e6, ratio(printed), ":", color))
    assert all(law(name).asperity.mu == friction for name, _, _ in names)
    level = Curve("μ", np.array([0.0, TO * 1e6]), np.full(2, friction), ":", "0.4")
    top = 1.1 * max(float(np.max(curve.y)) for curve in left + right)
    return [
        Panel(TOTAL, AXIS, "F₂/F₁", [*left, level], ylim=(0.0, top)),
        Panel(LAW, AXIS, "F₂/F₁", [*right, level], ylim=(0.0, top)),
    ]
