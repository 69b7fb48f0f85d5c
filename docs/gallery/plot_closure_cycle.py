r"""
Closure and unloading
=====================

Inclined asperities slide as the joint closes, and stick at first as it opens: hysteresis without
plastic contact. Where asperities yield, the loop is larger, and a part of the closure is permanent.

`Close and open this rock in the browser <../browser.html#rock=westerly-smooth&play=closure>`__.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl
from jointlaw.calibration import datasets


def dissipated_percentage(record, start=0, steps=80):
    """Energy that a cycle dissipates, in % of its work of loading; the cycle starts at a row."""
    loading = slice(start, start + steps + 1)
    unloading = slice(start + steps, start + 2 * steps + 1)
    work = trapezoid(record.F1[loading], record.closure[loading])
    return 100 * (1 + trapezoid(record.F1[unloading], record.closure[unloading]) / work)


# %%
# Three surfaces of one rock, from gentle to steep. Small hysteresis occurs in cells of asperities
# that have just touched, so it needs the finest resolution.

base = replace(jl.presets.load("westerly-smooth"), resolution="reference", plane=0.0)
figure, (loops, energy) = plt.subplots(1, 2, figsize=(7.5, 4.2), layout="constrained")
for a in (3.0, 2.0, 1.5):
    law = replace(base, orientation=jl.Orientation(a))
    record = jl.closure_test(law.joint(), [10e6, 20e6], steps=80)
    label = f"up to {90 / a:.0f}° (a = {a:g})"
    loops.plot(record.closure * 1e6, record.F1 / 1e6, label=label)
    energy.plot(np.arange(len(record)) / 80, record.dissipated, label=label)
    percentage = dissipated_percentage(record, 160)
    print(f"{label}: the second cycle dissipates {percentage:.1f} % of its work")

loops.set(xlabel="closure (µm)", ylabel="normal stress (MPa)")
figure.legend(*loops.get_legend_handles_labels(), loc="outside upper center", ncols=3)
energy.set(xlabel="branch: 10 MPa and back, then 20", ylabel="dissipated energy (J/m²)",
           xticks=range(5))  # fmt: skip
plt.show()

# %%
# Rock dissipates more. ``jointlaw fit grimsel_vd1_closure --cycle`` fits the next law: a single
# length, the yield interference, gives the loop. Without it the same joint is stiffer, and its
# friction dissipates little.

law = jl.JointLaw(
    orientation=jl.Orientation(3.0),
    asperity=jl.Asperity(K=9.637e8, lam=1.167, eta=0.5, mu=0.6, yield_interference=78.7e-6),
    heights=jl.GammaHeights(1.938, 61.2e-6, 0.0, "individual"),
    asperity_density=1.893e4,
    closure_only=True,
)
elastic = replace(law, asperity=replace(law.asperity, yield_interference=np.inf))
stress, closure = datasets.load("grimsel_vd1_closure")
preload_closure = 71.9e-6  # m, closure of the law where the test starts

figure, axis = plt.subplots(layout="constrained")
axis.plot(closure * 1e6, stress / 1e6, "ko", ms=4, label="measured")
for label, variant in (("yields", law), ("elastic", elastic)):
    record = jl.closure_test(variant.joint(), stress.max(), steps=80)
    axis.plot((record.closure - preload_closure) * 1e6, record.F1 / 1e6, label=label)
    print(f"{label}: the cycle dissipates {dissipated_percentage(record):.1f} % of its work")
axis.set(xlabel="closure since the start of the test (µm)", ylabel="normal stress (MPa)")
axis.legend()
plt.show()

# %%
# Cycles of increasing stress. Each starts from the permanent closure of the one before and is
# elastic up to the largest previous stress.

record = jl.closure_test(law.joint(), [3e6, 6e6, 10e6], steps=60)
permanent = record.closure[120::120]
figure, axis = plt.subplots(layout="constrained")
for k in range(3):
    rows = slice(120 * k, 120 * (k + 1) + 1)
    label = f"cycle {k + 1}, {permanent[k] * 1e6:.0f} µm permanent"
    axis.plot(record.closure[rows] * 1e6, record.F1[rows] / 1e6, label=label)
axis.set(xlabel="closure from first touch (µm)", ylabel="normal stress (MPa)")
axis.legend(loc="upper left")
plt.show()
