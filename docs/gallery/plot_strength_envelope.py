r"""
Strength envelope
=================

Mohr envelope: strength, friction angle and dilation against normal stress, for elastic asperities
and for asperities that yield.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# The contacts of lapped Westerly granite, on inclinations up to 30 degrees. Dilation decays over
# 2 µm of slip, so that the shear stress reaches a residual value.

base = replace(
    jl.presets.load("westerly-smooth"), orientation=jl.Orientation(3.0), plane=0.0,
    mating_length=2e-6,
)  # fmt: skip
normal = np.geomspace(0.1e6, 50e6, 12)  # Pa

figure, axes = plt.subplots(3, 1, figsize=(6, 9), layout="constrained")
strength_axes, friction_axes, dilation_axes = axes
friction = {}
dilation = {}
for length in (np.inf, 0.2e-6, 0.1e-6, 0.05e-6):
    law = replace(base, asperity=replace(base.asperity, mu=0.4, yield_interference=length))
    records = [jl.direct_shear(law.joint(), 16e-6, stress, steps=150) for stress in normal]
    label = "elastic" if np.isinf(length) else f"yields beyond {length * 1e6:g} µm"
    strength = np.array([r.shear_stress.max() for r in records])
    friction[label] = np.array([r.peak_friction_angle for r in records])
    dilation[label] = np.array([r.peak_dilation_angle for r in records])
    strength_axes.plot(normal / 1e6, strength / 1e6, "o-", ms=3, label=label)
    friction_axes.semilogx(normal / 1e6, friction[label], "o-", ms=3, label=label)
    dilation_axes.semilogx(normal / 1e6, dilation[label], "o-", ms=3, label=label)
names = "shear strength (MPa)", "largest friction angle (°)", "largest dilation angle (°)"
for axis, name in zip(axes, names, strict=True):
    axis.set(xlabel="normal stress (MPa)", ylabel=name)
strength_axes.legend()
plt.show()

# %%
# At low stress a yield interference of 0.2 µm changes nothing. At high stress even the elastic
# joint loses some of its friction angle, since dilation decays before all asperities slide.
# Yielding flattens the steep asperities.

for label, angles in friction.items():
    print(f"{label}: friction angle {angles[0]:.1f}° at 0.1 MPa, {angles[-1]:.1f}° at 50 MPa")
