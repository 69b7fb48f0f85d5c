"""
Figure 3: asperity heights
==========================

Gamma densities of Eq. 12 with the parameters printed for Westerly granite (smooth: α = 3.82,
β = 1.15 µm; rough: α = 6.14, β = 3.52 µm) and, right, the fraction of asperities in contact, Eq. 11
over N. Dots: the overlap r₀ at zero closure. A smooth interface has the narrow distribution. The
measured heights of the figure are not printed as numbers.
"""

import numpy as np
from _common import WESTERLY, draw, print_comparison

import jointlaw as jl

r = np.linspace(0.0, 60e-6, 401)  # m
panels = {"height density": {}, "asperities in contact": {}}
densities, fractions = panels.values()
for name, label in WESTERLY:
    heights = jl.presets.load(name).heights
    text = f"{label}, r₀ = {heights.overlap * 1e6:g} µm"
    r0 = np.array([heights.overlap])
    for lines, function, scale in ((densities, heights.pdf, 1e-6), (fractions, heights.cdf, 1.0)):
        lines[text] = r * 1e6, function(r) * scale
        lines[f"_{label} at r0"] = r0 * 1e6, function(r0) * scale
    printed = {"smooth": "1.15 × 4.82 = 5.54", "rough": "3.52 × 7.14 = 25.13"}[label]
    print_comparison((f"mean height β (α + 1) (µm), {label}", printed, f"{heights.mean * 1e6:.2f}"))

density_axes, fraction_axes = draw(panels, ("C0", "C0o", "C1", "C1o"), xlabel="overlap r (µm)")
density_axes.set_ylabel("H(r) (1/µm)")
fraction_axes.set_ylabel("Nᵣ/N (fraction)")
