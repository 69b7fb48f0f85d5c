r"""
Damping against amplitude
=========================

Damping ratio and secant stiffness of small shear cycles, as earthquake engineers plot them.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl

# %%
# A batch of joints, one for each amplitude, closed to a normal stress and sheared to and fro at
# that closure. The loss of a cycle is the area of its loop; the damping ratio is the loss over
# 4 pi times the energy of a spring with the secant stiffness of the cycle.


def cycles(law, stress, amplitudes, count=3, steps=20):
    """Damping ratio and secant stiffness (Pa/m) of the last cycle at each amplitude (m)."""
    joints = law.joints(len(amplitudes), normal_stress=stress)
    quarter = np.stack([0 * amplitudes, amplitudes / steps], axis=1)
    signs = np.repeat([1, *[-1, -1, 1, 1] * count], steps)
    shear = np.array([joints.update(sign * quarter, tangent=False)[0][:, 1] for sign in signs])
    place = np.cumsum(signs)[:, None] * quarter[:, 1]
    last = slice(-4 * steps - 1, None)
    loss = trapezoid(shear[last], place[last], axis=0)
    secant = (shear[-1] - shear[-1 - 2 * steps]) / (2 * amplitudes)
    return loss / (2 * np.pi * secant * amplitudes**2), secant


# %%
# Asperities that have just touched slip first, in the smallest cycles already. Their slip is seen
# by thin cells of touch depth only: 300 of them here.

law = replace(jl.presets.load("westerly-smooth"), plane=0.0)
fine = replace(law, resolution=jl.Resolution(3, 6, 300))
amplitudes = np.geomspace(2e-9, 500e-9, 25)
damping, stiffness = {}, {}
for stress in (5e6, 10e6, 20e6):
    damping[stress], stiffness[stress] = cycles(fine, stress, amplitudes)

# %%
# With the few cells of `balanced` the stiffness is about right, and so is the damping of large
# cycles. Small cycles have next to none. More depth cells cure it; see *Limitations and pitfalls*.

coarse, softer = cycles(law, 10e6, amplitudes)
figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 3.8), layout="constrained")
for stress in damping:
    label = f"{stress / 1e6:g} MPa"
    left.loglog(amplitudes * 1e9, 100 * damping[stress], label=label)
    right.semilogx(amplitudes * 1e9, 100 * stiffness[stress] / stiffness[stress][0], label=label)
left.loglog(amplitudes * 1e9, 100 * coarse, "C1--", label="10 MPa, balanced")
right.semilogx(amplitudes * 1e9, 100 * softer / stiffness[10e6][0], "C1--")
left.set(xlabel="shear amplitude (nm)", ylabel="damping ratio (%)", ylim=(0.01, 100))
right.set(xlabel="shear amplitude (nm)", ylabel="secant stiffness (% of its largest)")
for axes in (left, right):
    axes.grid(alpha=0.3)
left.legend()
plt.show()

# %%
# The higher the normal stress, the later the joint softens, and the less a given cycle damps.

for stress, ratio in damping.items():
    at = np.interp(100e-9, amplitudes, ratio)
    print(f"{stress / 1e6:g} MPa: damping ratio at 100 nm {100 * at:.1f} %")
