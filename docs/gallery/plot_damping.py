r"""
Damping against amplitude
=========================

Damping ratio and secant stiffness of small cyclic shear, as in earthquake engineering.

`Shear this rock to and fro in the browser <../browser.html#rock=westerly-smooth&play=cycle>`__.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from scipy.integrate import trapezoid

import jointlaw as jl

# %%
# A batch of joints, one for each amplitude, closed to a normal stress and sheared forward and back
# at that closure. A cycle dissipates the area of its loop; the damping ratio is the dissipated
# energy over 4 pi times the energy of a spring with the secant stiffness of the cycle.


def shear_cycles(law, stress, amplitudes, count=3, steps=20):
    """Damping ratio and secant stiffness (Pa/m) of the last cycle at each amplitude (m)."""
    joints = law.joints(len(amplitudes), normal_stress=stress)
    quarter = np.stack([0 * amplitudes, amplitudes / steps], axis=1)
    signs = np.repeat([1, *[-1, -1, 1, 1] * count], steps)  # four quarters a cycle
    shear = np.array([joints.update(sign * quarter, tangent=False)[0][:, 1] for sign in signs])
    slip = np.cumsum(signs)[:, None] * quarter[:, 1]
    last_cycle = slice(-4 * steps - 1, None)
    dissipated = trapezoid(shear[last_cycle], slip[last_cycle], axis=0)
    secant = (shear[-1] - shear[-1 - 2 * steps]) / (2 * amplitudes)
    return dissipated / (2 * np.pi * secant * amplitudes**2), secant


# %%
# Asperities that have just touched slip first, even in the smallest cycles. Only thin cells of
# touch depth resolve their slip: 300 of them here.

law = replace(jl.presets.load("westerly-smooth"), plane=0.0)
fine_law = replace(law, resolution=jl.Resolution(3, 6, 300))
amplitudes = np.geomspace(2e-9, 500e-9, 25)
damping = {}
stiffness = {}
for stress in (5e6, 10e6, 20e6):
    damping[stress], stiffness[stress] = shear_cycles(fine_law, stress, amplitudes)

# %%
# With the few cells of `balanced` the stiffness is about right, and the damping of large cycles
# too. Small cycles have almost no damping. More cells correct it; see *Limitations and pitfalls*.

coarse_damping, coarse_stiffness = shear_cycles(law, 10e6, amplitudes)
figure, (damping_axes, stiffness_axes) = plt.subplots(
    1, 2, figsize=(7.5, 3.8), layout="constrained"
)
for stress in damping:
    label = f"{stress / 1e6:g} MPa"
    damping_axes.loglog(amplitudes * 1e9, 100 * damping[stress], label=label)
    stiffness_axes.semilogx(
        amplitudes * 1e9, 100 * stiffness[stress] / stiffness[stress][0], label=label
    )
damping_axes.loglog(amplitudes * 1e9, 100 * coarse_damping, "C1--", label="10 MPa, balanced")
stiffness_axes.semilogx(amplitudes * 1e9, 100 * coarse_stiffness / stiffness[10e6][0], "C1--")
damping_axes.set(xlabel="shear amplitude (nm)", ylabel="damping ratio (%)", ylim=(0.01, 100))
stiffness_axes.set(xlabel="shear amplitude (nm)", ylabel="secant stiffness (% of its largest)")
for axis in (damping_axes, stiffness_axes):
    axis.grid(alpha=0.3)
damping_axes.legend()
plt.show()

# %%
# At a higher normal stress the joint softens at a larger amplitude, and a given cycle has less
# damping.

for stress, ratio in damping.items():
    ratio_at_100_nm = np.interp(100e-9, amplitudes, ratio)
    print(f"{stress / 1e6:g} MPa: damping ratio at 100 nm {100 * ratio_at_100_nm:.1f} %")
