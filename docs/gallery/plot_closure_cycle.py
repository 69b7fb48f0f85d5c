r"""
A loop and a set
================

Asperities that yield: a closure cycle loses work, and the joint keeps a part of its closure.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl
from jointlaw.calibration import datasets

# %%
# The law is that of ``jointlaw fit grimsel_vd1_closure --cycle``: one length, the yield
# interference, makes the loop. Without it the same joint is stiffer, and loses little, by friction.

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
loss = {}
for label, one in (("yields", law), ("elastic", elastic)):
    record = jl.closure_test(one.joint(), stress.max(), steps=80)
    top = len(record) // 2
    up = trapezoid(record.F1[: top + 1], record.closure[: top + 1])
    loss[label] = 1 + trapezoid(record.F1[top:], record.closure[top:]) / up
    axis.plot((record.closure - seating) * 1e6, record.F1 / 1e6, label=label)
    print(f"{label}: the cycle loses {100 * loss[label]:.1f} % of its work of loading")
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
