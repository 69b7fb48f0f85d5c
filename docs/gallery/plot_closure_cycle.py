r"""
Closure and unloading
=====================

Inclined asperities slide as the joint closes, and slide back late as it opens: a loop without any
plastic contact. Where asperities yield, the loop is larger, and a part of the closure remains.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl
from jointlaw.calibration import datasets


def loss(record, start=0, steps=80):
    """Share (%) of the work of loading that the cycle loses which begins at this row."""
    top, end = start + steps, start + 2 * steps
    up = trapezoid(record.F1[start : top + 1], record.closure[start : top + 1])
    return 100 * (1 + trapezoid(record.F1[top : end + 1], record.closure[top : end + 1]) / up)


# %%
# Three surfaces of one rock, from gentle to steep. Small hysteresis lives in thin cells of touch
# depth, so it asks for the finest resolution.

base = replace(jl.presets.load("westerly-smooth"), resolution="reference", plane=0.0)
figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 3.8), layout="constrained")
for a in (3.0, 2.0, 1.5):
    law = replace(base, orientation=jl.Orientation(a))
    record = jl.closure_test(law.joint(), [10e6, 20e6], steps=80)
    label = f"facets up to {90 / a:.0f}° (a = {a:g})"
    left.plot(record.closure * 1e6, record.F1 / 1e6, label=label)
    right.plot(np.arange(len(record)) / 80, record.dissipated, label=label)
    print(f"{label}: the second cycle loses {loss(record, 160):.1f} % of its work of loading")

left.set(xlabel="closure (µm)", ylabel="normal stress (MPa)")
left.legend()
right.set(xlabel="branch: 10 MPa and back, then 20", ylabel="energy lost to friction (J/m²)",
          xticks=range(5))  # fmt: skip
plt.show()

# %%
# Rock loses more than that. The next law is that of ``jointlaw fit grimsel_vd1_closure --cycle``:
# one length, the yield interference, makes the loop. Without it the same joint is stiffer, and
# loses little, by friction.

law = jl.JointLaw(
    orientation=jl.Orientation(3.0),
    asperity=jl.Asperity(K=9.637e8, lam=1.167, eta=0.5, mu=0.6, yield_interference=78.5e-6),
    heights=jl.GammaHeights(2.048, 53.3e-6, 0.0, "individual"),
    asperity_density=1.658e4,
    closure_only=True,
)
elastic = replace(law, asperity=replace(law.asperity, yield_interference=np.inf))
stress, closure = datasets.load("grimsel_vd1_closure")
seating = 70.4e-6  # m, closure of the law where the test began

figure, axis = plt.subplots(layout="constrained")
axis.plot(closure * 1e6, stress / 1e6, "ko", ms=4, label="measured")
for label, one in (("yields", law), ("elastic", elastic)):
    record = jl.closure_test(one.joint(), stress.max(), steps=80)
    axis.plot((record.closure - seating) * 1e6, record.F1 / 1e6, label=label)
    print(f"{label}: the cycle loses {loss(record):.1f} % of its work of loading")
axis.set(xlabel="closure since the test began (µm)", ylabel="normal stress (MPa)")
axis.legend()
plt.show()

# %%
# Cycles of growing stress. Each begins where the last one ended and is elastic up to the largest
# stress so far.

record = jl.closure_test(law.joint(), [3e6, 6e6, 10e6], steps=60)
kept = record.closure[120::120]
figure, axis = plt.subplots(layout="constrained")
for k in range(3):
    rows = slice(120 * k, 120 * (k + 1) + 1)
    label = f"cycle {k + 1}, keeps {kept[k] * 1e6:.0f} µm in all"
    axis.plot(record.closure[rows] * 1e6, record.F1[rows] / 1e6, label=label)
axis.set(xlabel="closure from first touch (µm)", ylabel="normal stress (MPa)")
axis.legend(loc="upper left")
plt.show()
