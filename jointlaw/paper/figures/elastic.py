"""Figures 8 and 9: elastic stiffness ratios, from the closed forms."""

from __future__ import annotations

import math

import numpy as np

from ..closed_form import Shape, elastic, shear_stiffness
from .sheet import Band, Curve, Panel, Sheet, sheet


def figure_8() -> Sheet:
    """Elastic stiffness ratio against a, and against the asperities' own ratio."""
    a = np.geomspace(1.0, 30.0, 200)
    left = [
        Curve(f"b = {b}", a, np.array([_ratio(Shape(x, b), 0.5) for x in a])) for b in (-1, 0, 2)
    ]
    left.append(Curve("a = ∞: K_s/K_n", a, np.full(a.shape, 0.5), ":", "0.4"))
    kappa = np.linspace(0.3, 1.2, 91)
    shapes = (
        (Shape(1, -1), "a = 1, b = −1"),
        (Shape(1), "a = 1, b = 0"),
        (Shape(1, 2), "a = 1, b = 2"),
        (Shape(2), "a = 2, b = 0"),
        (Shape(3), "a = 3, b = 0"),
        (Shape(math.inf), "a = ∞"),
    )
    right = [
        Curve(label, kappa, np.array([_ratio(shape, k) for k in kappa])) for shape, label in shapes
    ]
    bands = [
        Band("y", 0.78, 1.1, "measured, Krolikowski and Szczepek"),
        Band("x", 0.67, 1.0, "Hertz-Mindlin, ν = 0.5 to 0"),
    ]
    return sheet(
        "08",
        [
            Panel("(a) K_s/K_n = 0.5", "a", "C22/C11", left, log_ticks=(1, 2, 3, 6, 10, 20, 30)),
            Panel("(b)", "asperity stiffness ratio K_s/K_n", "C22/C11", right, bands=bands),
        ],
    )


def figure_9() -> Sheet:
    """Directional dependence of the elastic shear stiffness, Eq. 28."""
    phi = np.linspace(0.0, 360.0, 181)
    curves = []
    for c, label in ((1 / 3, "c = 1/3"), (0.0, "c = 0")):
        shape = Shape(1.0, 0.0, c)
        c11 = elastic(shape, 1.0, 0.5)[0]
        ratio = [shear_stiffness(shape, 1.0, 0.5, math.radians(x)) / c11 for x in phi]
        curves.append(Curve(label, phi, np.array(ratio)))
    return sheet(
        "09",
        [Panel("C_s/C11", "azimuth φ (°)", "C_s/C11", curves, polar=True, ylim=(0.0, 1.2))],
    )


def _ratio(shape: Shape, kappa: float) -> float:
    """C22/C11 at K_n = 1, K_s = kappa."""
    c11, c22, _ = elastic(shape, 1.0, kappa)
    return float(c22 / c11)
