r"""
Mated, sheared, mated again
===========================

Peak, dilation and residual belong together: friction is that of the asperities' faces plus the
angle at which the joint rises. Away from the mated position both the rise and its strength fade.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# A sandstone joint (profile JA of `the validation <../validation.html#peak-and-residual>`_), whose
# slopes fade over a ``mating_length`` of 7.5 mm.

mu, length = 0.747, 7.46e-3
law = jl.JointLaw(
    orientation=jl.Orientation(4.31),
    asperity=jl.Asperity(K=1.68e6, lam=1.17, eta=0.5, mu=mu),
    asperity_density=1e6,
    closure_range=1e-3,
    resolution=jl.Resolution(5, 3, 2),
    plane=0.0,
    mating_length=length,
)
phi_b = np.degrees(np.arctan(mu))
stress = np.array([0.3, 1.0, 3.0, 10.0, 30.0])  # MPa
tests = [jl.direct_shear(law.joint(), 20 * length, normal=1e6 * s, steps=2000) for s in stress]
peak = np.array([test.peak_friction_angle for test in tests])
rise = np.array([test.dilation_angle[np.argmax(test.friction_angle)] for test in tests])
residual = np.array([test.residual_friction_angle for test in tests])

# %%
# Barton-Bandis, phi_b + JRC log10(JCS/stress), with an assumed wall strength of 60 MPa and the JRC
# that fits these peaks best.

decades = np.log10(60 / stress)
JRC = decades @ (peak - phi_b) / (decades @ decades)
for s, top, up, end in zip(stress, peak, rise, residual, strict=True):
    print(f"{s:4g} MPa: peak {top:.1f}°, dilation {up:.1f}°, residual {end:.1f}°")

# %%
# Forward by ten mating lengths and back: the joint rises, and sinks to where it was. Slopes that
# wear (``slope_wear``) rise less in every cycle.

back = jl.direct_shear(law.joint(), [10 * length, 0.0], normal=1e6, steps=500)
worn = replace(law, slope_wear=2e5)
cycles = jl.direct_shear(worn.joint(), [5 * length, 0.0] * 7, normal=1e6, steps=150)

figure, axes = plt.subplots(3, 1, figsize=(6, 10), layout="constrained")
axes[0].semilogx(stress, peak, "o-", label="peak")
axes[0].semilogx(stress, phi_b + rise, "s", mfc="w", label="faces + dilation at the peak")
axes[0].semilogx(stress, residual, "v-", label="residual, 20 mating lengths")
axes[0].semilogx(stress, phi_b + JRC * decades, "--k", label=f"Barton-Bandis, JRC {JRC:.1f}")
axes[0].set(xlabel="normal stress (MPa)", ylabel="friction angle (°)", ylim=(30, 68))
axes[0].legend(loc="upper right")
for axis, test, title in (
    (axes[1], back, "forward and back"),
    (axes[2], cycles, "seven cycles, slopes wear"),
):
    axis.plot(1e3 * test.shear, 1e3 * (test.closure[0] - test.closure), "C2")
    axis.set(xlabel="shear displacement (mm)", ylabel="dilation (mm)", title=title)
plt.show()

# %%
left = back.closure[0] - back.closure[-1]
lift = [np.ptp(cycles.closure[300 * k : 300 * (k + 1)]) for k in range(7)]
print(f"after ten mating lengths and back {1e6 * left:.1f} µm of the lift are left")
print(f"lift in each cycle (mm): {np.round(1e3 * np.array(lift), 2)}")
