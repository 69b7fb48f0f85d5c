"""
Figure 10: asperities that slide in closure
===========================================

Left: fraction of asperities per degree of inclination for a = 2, b = c = 0; asperities beyond
θₛ = arctan(μ Kₙ/Kₛ), Eq. 30, slide at μ = 0.6 and Kₛ = Kₙ (the paper's sketch prints no values).
Right: sliding fraction against μ. Lines: total form; dots: incremental law, whose orientations
are discrete (96 inclinations).
"""

import math

import numpy as np
from _common import draw, print_comparison

import jointlaw as jl


def sliding(a, mu):
    """Sliding fraction in closure for K_s = K_n: total form, incremental law."""
    law = jl.JointLaw(
        orientation=jl.Orientation(a),
        asperity=jl.Asperity(K=1.0, lam=1.0, eta=0.0, mu=mu),
        asperity_density=1.0,
        closure_range=1.0,
        resolution=jl.Resolution(96, 3, 1),
    )
    joint = law.joint()
    joint.update([1.0, 0.0, 0.0])
    return jl.secant(law, [1.0, 0.0, 0.0]).sliding, joint.measures().sliding


start = math.degrees(jl.closed_form.sliding_angle(1.0, 1.0, 0.6))
theta = np.linspace(0.0, 45.0, 181)
friction = np.linspace(0.0, 1.2, 25)
fraction_per_degree = 2 * np.sin(2 * np.radians(theta)) * math.pi / 180
slides = theta >= start
inclined = {
    "all asperities": (theta, fraction_per_degree),
    "sliding, θ ≥ θₛ": (theta[slides], fraction_per_degree[slides]),
    f"θₛ = {start:.1f}°": ([start, start], [0.0, fraction_per_degree[slides][0]]),
}
fractions = {}
for a in (1, 2, 3):
    total, incremental = np.transpose([sliding(a, mu) for mu in friction])
    fractions[f"a = {a}, total"] = friction, total
    fractions[f"a = {a}, incremental"] = friction, incremental
panels = {"all asperities by inclination": inclined, "sliding fraction, Kₛ = Kₙ": fractions}

density_axes, fraction_axes = draw(
    panels, [("C0", "C3", "C3:"), ("C0", "C0o", "C1", "C1o", "C2", "C2o")]
)
density_axes.set(xlabel="inclination θ (°)", ylabel="fraction per degree (1/°)")
fraction_axes.set(xlabel="asperity friction μ", ylabel="sliding fraction", ylim=(-0.03, 1.5))
fraction_axes.legend(ncols=2, loc="upper center", fontsize=8)
print_comparison(
    ("sliding fraction at a = 2, μ = 0.6", "cos 2θₛ = 0.4706", f"{sliding(2, 0.6)[0]:.4f}")
)
