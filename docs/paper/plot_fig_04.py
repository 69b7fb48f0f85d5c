"""
Figures 4 and 6: axes and signs
===============================

In place of the paper's two sketches. Axis 1 is the interface normal, along the closing motion;
n = (cos θ, sin θ cos φ, sin θ sin φ) is the facet normal, s and t span the facet (Eq. 25). δ₁ > 0
closes, F₁ > 0 presses; F is the resistance in the sense of δ. A facet that leans towards the shear
is loaded by it; one that leans away unloads and may separate.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

theta, phi = math.radians(32), math.radians(40)
n, s = (math.sin(theta), -math.cos(theta)), (math.cos(theta), math.sin(theta))
arc, turn = np.radians(np.linspace(-90, -90 + 32, 30)), np.radians(np.linspace(0, 40, 30))
x, y = np.outer(s, [-0.62, 0.62])
panels = {
    "section along the azimuth of the asperity": {
        "facet": (x, y),
        "left": ([-1.7, x[0]], [y[0], y[0]]),
        "right": ([x[1], 1.7], [y[1], y[1]]),
        "theta": (0.55 * np.cos(arc), 0.55 * np.sin(arc)),
    },
    "plan of the interface, seen along axis 1": {"phi": (0.45 * np.cos(turn), 0.45 * np.sin(turn))},
}
figure, (side, plan) = plt.subplots(2, 1, figsize=(6, 8.4), layout="constrained")
for axes, (title, lines) in zip((side, plan), panels.items(), strict=True):
    for name, line in lines.items():
        axes.plot(*line, color="0.4" if name in ("theta", "phi") else "0.1")
    axes.set(title=title, xlim=(-1.8, 1.8), ylim=(-1.4, 1.4), aspect="equal")
    axes.set_axis_off()

# arrows, each with its text beyond the head; then the other texts
for axes, tail, head, text, color in (
    (side, (0.0, 0.0), (0.0, -1.0), "1", "0.4"),
    (side, (0.0, 0.0), n, "n", "C0"),
    (side, (0.0, 0.0), s, "s", "C0"),
    (side, (-1.15, 0.95), (-1.15, 0.35), "δ₁ > 0", "C3"),
    (side, (-1.0, 1.0), (-0.45, 1.0), "shear > 0", "C3"),
    (plan, (0.0, 0.0), (1.1, 0.0), "2", "0.4"),
    (plan, (0.0, 0.0), (0.0, 1.1), "3", "0.4"),
    (plan, (0.0, 0.0), (0.9 * math.cos(phi), 0.9 * math.sin(phi)), "n", "C0"),
    (plan, (0.0, 0.0), (-0.8 * math.sin(phi), 0.8 * math.cos(phi)), "t", "C0"),
):
    axes.annotate("", head, tail, arrowprops={"arrowstyle": "-|>", "color": color, "lw": 1.4})
    along = np.subtract(head, tail) / math.dist(head, tail)
    place = "left" if along[0] > 0.9 else "center"
    axes.text(*(head + along * [0.08, 0.11]), text, color=color, ha=place, va="center")
for axes, x, y, text, color in (
    (side, 0.16, -0.72, "θ", "0.2"),
    (side, 0.9, 1.25, "moving body: gets traction −F", "C3"),
    (side, 0.85, -1.15, "body at rest: gets +F", "0.2"),
    (plan, 0.56, 0.2, "φ", "0.2"),
    (plan, 0.55, -0.3, "azimuth turns from 2 to 3", "0.2"),
):
    axes.text(x, y, text, color=color, ha="center")
