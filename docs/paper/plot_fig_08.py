"""
Figure 8: elastic stiffness ratio of the interface
==================================================

C₂₂/C₁₁ by the closed forms of Table 1 (here for every a and b), c = 0. As a grows the ratio tends
to that of one asperity, Kₛ/Kₙ; at b = −1 it can exceed 1. The bands in (b) are the ranges quoted in
the text: 0.78 to 1.1 measured, 0.67 to 1 of Hertz-Mindlin contacts. The paper does not print which
a and b it draws in (b); ours are in the legend.
"""

import math

import numpy as np
from _common import LEGEND_BELOW, draw, print_comparison

from jointlaw import Asperity
from jointlaw.paper.closed_form import Shape, elastic


def stiffness_ratio(a, b, kappa):
    """C22/C11 at K_n = 1, K_s = kappa."""
    c11, c22, _ = elastic(Shape(a, b), 1.0, kappa)
    return c22 / c11


a, kappa = np.geomspace(1.0, 30.0, 200), np.linspace(0.3, 1.2, 91)
panel_a = {
    f"b = {b}".replace("-", "−"): (a, [stiffness_ratio(x, b, 0.5) for x in a]) for b in (-1, 0, 2)
}
panel_b = {
    f"a = {a_:g}, b = {b}".replace("-", "−"): (kappa, [stiffness_ratio(a_, b, k) for k in kappa])
    for a_, b in ((1, -1), (1, 0), (1, 2), (2, 0), (3, 0))
}
left_limit = {"a = ∞: Kₛ/Kₙ": (a, np.full(a.shape, 0.5))}
right_limit = {"a = ∞": (kappa, [stiffness_ratio(math.inf, 0, k) for k in kappa])}
panels = {"(a) Kₛ/Kₙ = 0.5": panel_a | left_limit, "(b)": panel_b | right_limit}

first, second = draw(panels, ("C0", "C1", "C2", "C3", "C4", "C5"), ylabel="C₂₂/C₁₁")
ticks = (1, 2, 3, 6, 10, 20, 30)
first.set(xlabel="a", xscale="log", xticks=ticks, xticklabels=ticks)
first.minorticks_off()
second.set(xlabel="asperity stiffness ratio Kₛ/Kₙ", ylim=(0, 1.4))
second.axhspan(0.78, 1.1, color="C7", alpha=0.16, lw=0, label="measured")
second.axvspan(0.67, 1.0, color="C9", alpha=0.16, lw=0, label="Hertz-Mindlin, ν = 0.5 to 0")
second.legend(**LEGEND_BELOW, fontsize=7, ncols=2)

print_comparison(
    ("(a) C₂₂/C₁₁ at a = 1, b = −1", "above 1", f"{stiffness_ratio(1, -1, 0.5):.4f}"),
    ("(a) C₂₂/C₁₁ at a = ∞", "Kₛ/Kₙ = 0.5", f"{stiffness_ratio(math.inf, 0, 0.5):.4f}"),
    (
        "(b) Kₛ/Kₙ of Hertz-Mindlin, ν = 0.3, Eq. 27",
        "0.83",
        f"{1 / Asperity.hertz_mindlin(1.0, 0.3, 1.0, 0.0).lam:.4f}",
    ),
)
