r"""
Direct shear: CNL, CNS, constant closure
========================================

At a constant normal load (CNL) a joint dilates freely. At a constant normal stiffness (CNS) of the
surrounding rock dilation increases the normal stress, and the joint becomes stronger.

`Shear this rock in the browser <../browser.html#rock=biegel-rough&play=shear>`__.
"""

import math

import matplotlib.pyplot as plt

import jointlaw as jl

law = jl.presets.load("biegel-rough")

# %%
# The boundary conditions: a constant normal stress (CNL), rock that deforms by 1 µm per 20 MPa
# (CNS), or rigid walls (constant closure).

boundary_stiffness = {
    "constant normal stress (CNL)": 0.0,
    "stiffness 20 MPa/µm (CNS)": 2e13,
    "constant closure": math.inf,
}
records = {
    label: jl.direct_shear(law.joint(), 1e-6, normal=10e6, stiffness=stiffness, steps=120)
    for label, stiffness in boundary_stiffness.items()
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
figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=3)
plt.show()

# %%
for label, record in records.items():
    print(
        f"{label:28s} largest friction angle {record.peak_friction_angle:.1f}°, "
        f"dilation angle {record.peak_dilation_angle:.1f}°, "
        f"shear stress {record.shear_stress[-1] / 1e6:.1f} MPa"
    )

# %%
# Unlimited dilation is a property of the paper's model, in which asperity pairs remain in contact
# at any slip; a mating length limits it (example *Loss of interlock with slip*).
