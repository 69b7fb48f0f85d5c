"""
Figure 7: dependence of the orientation density on a, b and c
=============================================================

Eq. 14 per solid angle, 0 ≤ θ ≤ π/2a. All parameters are printed. b = −1 crowds the asperities
towards the horizon, b = 2 towards the normal; c makes them depend on the azimuth. For b = 0 the
density is constant at a = 1 only; at a = 2 it is constant in cos aθ, not per solid angle.
"""

from _common import density_curve, draw, print_comparison

import jointlaw as jl

skewed = jl.Orientation(1.0, 0.0, 1 / 3)
panels = {
    f"({letter}) a = {a}, c = 0": {
        f"b = {b:g}".replace("-", "−"): density_curve(jl.Orientation(a, b), 90 / a)
        for b in (-1, 0, 2)
    }
    for letter, a in (("a", 1), ("b", 2))
}
turned = {f"φ = {phi}°": density_curve(skewed, 90, phi) for phi in (0, 45, 90)}
panels["(c) a = 1, b = 0, c = 1/3"] = turned
draw(panels, ("C0", "C1", "C2"), xlabel="inclination θ (°)", ylabel="density ξ (1/sr)")

for title, printed in zip(panels, ("90° (π/2)", "45° (π/4)"), strict=False):
    theta, density = panels[title]["b = 0"]
    print_comparison((f"{title}: largest inclination", printed, f"{theta[density > 0][-1]:.2f}°"))
