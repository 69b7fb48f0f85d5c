r"""
Direct shear: constant stress, constant stiffness
=================================================

A joint that may rise dilates; one between stiff walls turns its dilation into normal stress and
becomes stronger.
"""

import math

import matplotlib.pyplot as plt

import jointlaw as jl

law = jl.presets.load("biegel-rough")

# %%
# The surroundings: a load that follows (constant stress), rock that yields by 1 µm per 20 MPa
# (constant stiffness), or walls that do not move (constant closure).

tests = {
    "constant normal stress": 0.0,
    "stiffness 2e13 Pa/m": 2e13,
    "constant closure": math.inf,
}
records = {
    label: jl.direct_shear(law.joint(), 1e-6, normal=10e6, stiffness=stiffness, steps=120)
    for label, stiffness in tests.items()
}

figure, axes = plt.subplots(2, 2, figsize=(7.5, 6.2), layout="constrained", sharex=True)
for label, record in records.items():
    shear = record.shear * 1e6
    axes[0, 0].plot(shear, record.shear_stress / 1e6, label=label)
    axes[0, 1].plot(shear, record.F1 / 1e6)
    axes[1, 0].plot(shear, (record.closure[0] - record.closure) * 1e9)
    axes[1, 1].plot(shear, record.friction_angle)
names = ("shear stress (MPa)", "normal stress (MPa)", "dilation (nm)",
         "mobilised friction angle (°)")  # fmt: skip
for axis, name in zip(axes.flat, names, strict=True):
    axis.set_ylabel(name)
for axis in axes[1]:
    axis.set_xlabel("shear displacement (µm)")
axes[0, 0].legend()
plt.show()

# %%
for label, record in records.items():
    print(
        f"{label:24s} largest friction angle {record.peak_friction_angle:.1f}°, "
        f"dilation angle {record.peak_dilation_angle:.1f}°, "
        f"shear stress {record.shear_stress[-1] / 1e6:.1f} MPa"
    )

# %%
# Dilation without end is a property of the paper's model, in which asperity pairs stay together for
# ever; a mating length ends it (example *Mated, sheared, mated again*).
