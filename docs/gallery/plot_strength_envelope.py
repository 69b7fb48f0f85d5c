r"""
Strength envelope
=================

Friction angle and dilation against normal stress: elastic asperities stay sharp at any stress,
asperities that yield do not.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# The contacts of lapped Westerly granite, on inclinations up to 30 degrees. Slopes fade
# over 2 µm of slip, so that shear becomes steady.

base = replace(
    jl.presets.load("westerly-smooth"), orientation=jl.Orientation(3.0), plane=0.0,
    mating_length=2e-6,
)  # fmt: skip
normal = np.geomspace(0.1e6, 50e6, 12)  # Pa

figure, (left, middle, right) = plt.subplots(3, 1, figsize=(6, 9), layout="constrained")
angles, dilation = {}, {}
for length in (np.inf, 0.2e-6, 0.1e-6, 0.05e-6):
    law = replace(base, asperity=replace(base.asperity, mu=0.4, yield_interference=length))
    records = [jl.direct_shear(law.joint(), 16e-6, stress, steps=150) for stress in normal]
    label = "elastic" if np.isinf(length) else f"yields beyond {length * 1e6:g} µm"
    strength = np.array([r.shear_stress.max() for r in records])
    angles[label] = np.array([r.peak_friction_angle for r in records])
    dilation[label] = np.array([r.peak_dilation_angle for r in records])
    left.plot(normal / 1e6, strength / 1e6, "o-", ms=3, label=label)
    middle.semilogx(normal / 1e6, angles[label], "o-", ms=3, label=label)
    right.semilogx(normal / 1e6, dilation[label], "o-", ms=3, label=label)
names = "shear strength (MPa)", "largest friction angle (°)", "largest dilation angle (°)"
for axis, name in zip((left, middle, right), names, strict=True):
    axis.set(xlabel="normal stress (MPa)", ylabel=name)
left.legend()
plt.show()

# %%
# At low stress a yield interference of 0.2 µm changes nothing. At high stress even the elastic
# joint loses some of its friction angle, since slopes fade before all asperities slide.
# Yielding presses the steep ones flat.

for label, found in angles.items():
    print(f"{label}: friction angle {found[0]:.1f}° at 0.1 MPa, {found[-1]:.1f}° at 50 MPa")
