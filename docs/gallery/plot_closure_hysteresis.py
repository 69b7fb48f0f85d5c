r"""
Closure and unloading
=====================

Inclined asperities slide as the joint closes, and slide back late as it opens: a loop without any
plastic contact.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl

# %%
# Three surfaces of one rock, from gentle to steep. Small hysteresis lives in thin cells of touch
# depth, so it asks for the finest resolution.

base = replace(jl.presets.load("westerly-smooth"), resolution="reference", plane=0.0)
figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 3.8), layout="constrained")
steps, loss = 80, {}
for a in (3.0, 2.0, 1.5):
    law = replace(base, orientation=jl.Orientation(a))
    record = jl.closure_test(law.joint(), [10e6, 20e6], steps=steps)
    start, top, end = 2 * steps, 3 * steps, 4 * steps  # rows of the second cycle, to 20 MPa
    spent = trapezoid(record.F1[start : top + 1], record.closure[start : top + 1])
    loss[a] = (record.dissipated[end] - record.dissipated[start]) / spent
    label = f"facets up to {90 / a:.0f}° (a = {a:g})"
    left.plot(record.closure * 1e6, record.F1 / 1e6, label=label)
    right.plot(np.arange(len(record)) / steps, record.dissipated, label=label)
    print(f"{label}: the second cycle loses {100 * loss[a]:.1f} % of its work of loading")

left.set(xlabel="closure (µm)", ylabel="normal stress (MPa)")
left.legend()
right.set(xlabel="branch: 10 MPa and back, then 20", ylabel="energy lost to friction (J/m²)",
          xticks=range(5))  # fmt: skip
plt.show()

# %%
# Rock loses more than that: see *A loop and a set*, and *Unloading* on the page *Fit
# tests and scans*.
