"""
Figures 4 and 6: axes and signs
===============================

Replaces the paper's two sketches. Axis 1 is the interface normal, along the closing motion;
n = (cos θ, sin θ cos φ, sin θ sin φ) is the facet normal, s and t span the facet (Eq. 25). δ₁ > 0
closes, F₁ > 0 presses; F is the resistance in the sense of δ. A facet that leans towards the shear
is loaded by it; one that leans away unloads and may separate.
"""

import math

import matplotlib.pyplot as plt
import numpy as np

theta = math.radians(28)
phi = math.radians(38)
theta_arc = np.linspace(-math.pi / 2, theta - math.pi / 2, 40)
phi_arc = np.linspace(0.0, phi, 40)
n = (math.sin(theta), -math.cos(theta))
s = (math.cos(theta), math.sin(theta))
rise = 0.7 * math.tan(theta)
joint = [-1.9, -0.7, 0.7, 1.9], [-rise, -rise, rise, rise]
panels = {
    "section along an asperity's azimuth": {
        "joint": joint,
        "theta": (0.5 * np.cos(theta_arc), 0.5 * np.sin(theta_arc)),
    },
    "plan, seen along axis 1": {"phi": (0.5 * np.cos(phi_arc), 0.5 * np.sin(phi_arc))},
}
figure, (side, plan) = plt.subplots(
    1, 2, figsize=(7.8, 4.2), width_ratios=(3.8, 3.4), layout="constrained"
)
for axes, (title, lines) in zip((side, plan), panels.items(), strict=True):
    for line in lines.values():
        axes.plot(*line, "k", lw=2)
    axes.set_title(title, fontsize=14)
    axes.set_aspect("equal")
    axes.axis("off")
side.set(xlim=(-1.9, 1.9), ylim=(-1.75, 1.75))
plan.set(xlim=(-0.8, 2.6), ylim=(-0.85, 2.65))
for edge, color in ((-1.75, "#c9c2b6"), (1.75, "#e6e1d8")):  # body at rest, moving body
    side.fill_between(*joint, edge, color=color, lw=0)

MOTION = "#c95500"
FACET = "#1f6fd0"
AXIS = "0.35"
# arrows, each with its name at the tip; then the texts
for axes, tail, vector, name, color in (
    (side, (0.0, 0.0), (0.0, -1.0), "1", AXIS),
    (side, (0.0, 0.0), np.multiply(1.15, n), "n", FACET),
    (side, (0.0, 0.0), np.multiply(1.05, s), "s", FACET),
    (side, (-1.4, 1.3), (0.0, -0.8), "", MOTION),
    (side, (-1.4, 1.3), (0.8, 0.0), "", MOTION),
    (plan, (0.0, 0.0), (2.2, 0.0), "2", AXIS),
    (plan, (0.0, 0.0), (0.0, 2.2), "3", AXIS),
    (plan, (0.0, 0.0), (1.7 * math.cos(phi), 1.7 * math.sin(phi)), "n, s", FACET),
    (plan, (0.0, 0.0), (-0.9 * math.sin(phi), 0.9 * math.cos(phi)), "t", FACET),
):
    head = np.add(tail, vector)
    axes.annotate("", head, tail, arrowprops={"arrowstyle": "-|>", "color": color, "lw": 2.5})
    place = head + 0.16 * np.array(vector) / math.hypot(*vector)
    axes.text(*place, name, color=color, ha="center", va="center", fontsize=14)
for axes, x, y, text, color in (
    (side, 0.66 * math.sin(theta / 2), -0.66 * math.cos(theta / 2), "θ", "k"),
    (side, 0.2, 1.3, "shear δ₂, δ₃ > 0", MOTION),
    (side, -0.6, 0.45, "closure δ₁ > 0", MOTION),
    (side, 0.75, 1.58, "moving body feels −F", "k"),
    (side, -0.9, -1.6, "body at rest feels +F", "k"),
    (plan, 0.66 * math.cos(phi / 2), 0.66 * math.sin(phi / 2), "φ", "k"),
):
    axes.text(x, y, text, color=color, ha="center", va="center", fontsize=14)
