"""
Figure 10: asperities that slide in closure
===========================================

Left: share of asperities per degree of inclination for a = 2, b = c = 0, and those beyond
θₛ = arctan(μ Kₙ/Kₛ), Eq. 30, at μ = 0.6 and Kₛ = Kₙ (the paper's sketch prints no values). Right:
share of those that slide against μ. Lines: total form; dots: incremental law, whose orientations
are discrete (96 inclinations).
"""

import math

import numpy as np
from _common import beside, draw

import jointlaw as jl


def sliding(a, mu):
    """Sliding share in closure: total form, incremental law; K_s = K_n."""
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
theta, friction = np.linspace(0.0, 45.0, 181), np.linspace(0.0, 1.2, 25)
count = 2 * np.sin(2 * np.radians(theta)) * math.pi / 180
slides = theta >= start
inclined = {
    "all asperities": (theta, count),
    "sliding, θ ≥ θₛ": (theta[slides], count[slides]),
    f"θₛ = {start:.1f}°": ([start, start], [0.0, count[slides][0]]),
}
shares = {}
for a in (1, 2, 3):
    total, ours = np.transpose([sliding(a, mu) for mu in friction])
    shares |= {f"a = {a}, total": (friction, total), f"a = {a}, incremental": (friction, ours)}
panels = {"all asperities by inclination": inclined, "share that slides, Kₛ = Kₙ": shares}

left, right = draw(panels, [("C0", "C3", "C3:"), ("C0", "C0o", "C1", "C1o", "C2", "C2o")])
left.set(xlabel="inclination θ (°)", ylabel="share per degree (1/°)")
right.set(xlabel="asperity friction μ", ylabel="sliding share", ylim=(-0.03, 1.5))
right.legend(ncols=2, loc="upper center", fontsize=8)
beside(("sliding share at a = 2, μ = 0.6", "cos 2θₛ = 0.4706", f"{sliding(2, 0.6)[0]:.4f}"))
