r"""
Loss of interlock with slip
===========================

Post-peak softening: the friction angle is the friction angle of the asperities plus the dilation
angle. With slip from the interlocked (mated) position the dilation decays, and the strength with
it.

`Shear a joint to and fro in the browser, and change its mating length
<../browser.html#rock=westerly-rough&play=cycle>`__.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# A sandstone joint (profile JA, `validation <../validation.html#held-out-shear-tests>`_), whose
# dilation decays over a ``mating_length`` of 7.5 mm.

mu = 0.747
mating_length = 7.46e-3  # m
law = jl.JointLaw(
    orientation=jl.Orientation(4.31),
    asperity=jl.Asperity(K=1.68e6, lam=1.17, eta=0.5, mu=mu),
    asperity_density=1e6,
    closure_range=1e-3,
    resolution=jl.Resolution(5, 3, 2),
    plane=0.0,
    mating_length=mating_length,
)
phi_b = np.degrees(np.arctan(mu))
stress = np.array([0.3, 1.0, 3.0, 10.0, 30.0])  # MPa
tests = [
    jl.direct_shear(law.joint(), 20 * mating_length, normal=1e6 * s, steps=2000) for s in stress
]
peak = np.array([test.peak_friction_angle for test in tests])
dilation = np.array([test.dilation_angle[np.argmax(test.friction_angle)] for test in tests])
residual = np.array([test.residual_friction_angle for test in tests])

# %%
# Barton-Bandis, phi_b + JRC log10(JCS/stress), with an assumed wall strength of 60 MPa and the JRC
# that fits these peaks best.

decades = np.log10(60 / stress)
JRC = decades @ (peak - phi_b) / (decades @ decades)
for i, s in enumerate(stress):
    print(
        f"{s:4g} MPa: peak {peak[i]:.1f}°, dilation {dilation[i]:.1f}°, residual {residual[i]:.1f}°"
    )

# %%
# Forward by ten mating lengths and back: the joint dilates, and closes to its first position. With
# asperity degradation (``slope_wear``) it dilates less in every cycle.

round_trip = jl.direct_shear(law.joint(), [10 * mating_length, 0.0], normal=1e6, steps=500)
degrading_law = replace(law, slope_wear=2e5)
cycles = jl.direct_shear(degrading_law.joint(), [5 * mating_length, 0.0] * 7, normal=1e6, steps=150)

figure, axes = plt.subplots(3, 1, figsize=(6, 10), layout="constrained")
axes[0].semilogx(stress, peak, "o-", label="peak")
axes[0].semilogx(stress, phi_b + dilation, "s", mfc="w", label="asperities + dilation at the peak")
axes[0].semilogx(stress, residual, "v-", label="residual, 20 mating lengths")
axes[0].semilogx(stress, phi_b + JRC * decades, "--k", label=f"Barton-Bandis, JRC {JRC:.1f}")
axes[0].set(xlabel="normal stress (MPa)", ylabel="friction angle (°)", ylim=(30, 68))
axes[0].legend(loc="upper right")
for axis, test, title in (
    (axes[1], round_trip, "forward and back"),
    (axes[2], cycles, "seven cycles with asperity degradation"),
):
    axis.plot(1e3 * test.shear, 1e3 * (test.closure[0] - test.closure), "C2")
    axis.set(xlabel="shear displacement (mm)", ylabel="dilation (mm)", title=title)
plt.show()

# %%
remaining = round_trip.closure[0] - round_trip.closure[-1]
largest_dilation = [np.ptp(cycles.closure[300 * k : 300 * (k + 1)]) for k in range(7)]
print(f"after ten mating lengths and back {1e6 * remaining:.1f} µm of the dilation remain")
print(f"dilation in each cycle (mm): {np.round(1e3 * np.array(largest_dilation), 2)}")
