"""
Figure 5: orientation densities of smooth and rough interfaces
==============================================================

Eq. 14 with b = c = 0. The paper sketches this figure without values; a = 3 and a = 6 are the
values that it later uses for its rough and smooth interface. Asperities of a smooth interface face
its normal, asperities of a very rough interface face all directions.
"""

import math

from _common import density_curve, draw, print_comparison

import jointlaw as jl

kinds = ((6, "smooth"), (3, "rough"), (1, "very rough, all directions"))
lines = {f"a = {a}: {text}": density_curve(jl.Orientation(a), 90.0) for a, text in kinds}
panels = {"b = c = 0": lines}
draw(panels, ("C0", "C1", "C2"), xlabel="inclination θ (°)", ylabel="density ξ (1/sr)")

# %%
# The paper gives the mean inclination of two of them in sections 4.1 and 4.3.

for a, printed in ((3, "19°"), (6, "10°")):
    mean = f"{math.degrees(jl.Orientation(a).mean):.2f}°"
    print_comparison((f"mean inclination at a = {a}, Eq. 17", printed, mean))
