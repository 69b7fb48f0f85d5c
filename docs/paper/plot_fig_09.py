"""
Figure 9: directional elastic shear stiffness
=============================================

Resultant Cₛ of Eq. 28 over C₁₁ for a = 1, b = 0, Kₛ/Kₙ = 0.5. All parameters are printed. At
c = 1/3 the interface is stiffer along axis 2, which is at 0 degrees, than along axis 3; at c = 0
the curve is a circle. The paper prints no values.
"""

import numpy as np
from _common import draw, print_comparison

import jointlaw as jl

azimuth = np.linspace(0.0, 360.0, 181)
lines = {}
for c, label in ((1 / 3, "c = 1/3"), (0.0, "c = 0")):
    shape = jl.closed_form.Shape(1.0, 0.0, c)
    c11 = jl.closed_form.elastic(shape, 1.0, 0.5)[0]
    stiffness = [
        jl.closed_form.shear_stiffness(shape, 1.0, 0.5, x) / c11 for x in np.radians(azimuth)
    ]
    lines[label] = azimuth, np.array(stiffness)
panels = {"": lines}
(axes,) = draw(panels, ("C0", "C1"), polar=True, xlabel="azimuth φ (°)", ylabel="Cₛ/C₁₁")
axes.set_ylim(0.0, 1.2)

anisotropic, isotropic = (y for _, y in lines.values())
print_comparison(
    (
        "c = 1/3",
        "larger along axis 2",
        f"{anisotropic[0]:.3f} along axis 2, {anisotropic[45]:.3f} along 3",
    ),
    ("c = 0", "a circle", f"{isotropic.min():.3f} to {isotropic.max():.3f}"),
)
