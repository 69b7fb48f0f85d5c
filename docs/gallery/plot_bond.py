r"""
A bonded joint
==============

Rock bridges or cement across a joint: cohesion and tensile strength in addition to the friction of
asperities, and the residual strength after they have broken.
"""

import itertools
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# A replica of a rock joint, without a bond and with one of 2 MPa in shear and 0.5 MPa in tension.
# Its fracture energy is twenty times its largest elastic energy in shear, five times in tension.

unbonded = replace(jl.presets.load("jing-replica"), plane=0.0)
bond = jl.Bond(
    normal_stiffness=2e9, shear_stiffness=4e9, tension=0.5e6, cohesion=2e6,
    energy_I=5 * 0.5e6**2 / (2 * 2e9), energy_II=20 * 2e6**2 / (2 * 4e9),
)  # fmt: skip
bonded = replace(unbonded, bond=bond)

# %%
# Direct shear at three normal stresses. The shear stress of the asperities is the stress of the
# unbonded joint on the same path; the shear stress of the bond is the remainder.


def split_shear_stress(record):
    """Shear stress (MPa) of the asperities and of the bond along a test."""
    path = np.stack([record.closure, record.shear], axis=1)
    joint = unbonded.joint()
    increments = np.diff(path, axis=0, prepend=0.0)
    asperities = np.array([joint.update(d, tangent=False)[0][1] for d in increments])
    return asperities / 1e6, (record.shear_stress - asperities) / 1e6


figure, axes = plt.subplots(3, 1, figsize=(6, 9), layout="constrained")
for axis, stress in zip(axes, (0.3e6, 1e6, 3e6), strict=True):
    record = jl.direct_shear(bonded.joint(), 15e-3, stress, steps=600)
    asperities, bond_stress = split_shear_stress(record)
    axis.plot(record.shear * 1e3, asperities, "--", label="asperities")
    axis.plot(record.shear * 1e3, bond_stress, ":", label="bond")
    axis.plot(record.shear * 1e3, record.shear_stress / 1e6, label="sum")
    axis.set(xlabel="shear displacement (mm)", ylabel="shear stress (MPa)",
             title=f"normal stress {stress / 1e6:g} MPa")  # fmt: skip
axes[0].legend()
plt.show()

# %%
# The two stresses peak at different slips, and the joint dilates, which puts the bond in tension
# and increases the normal stress on the asperities. So the peak lies between the friction alone and
# the bound by the tension, friction + :math:`\sqrt{c^2 + (T\tan\varphi)^2}`.

normal = np.geomspace(0.1e6, 10e6, 9)  # Pa
friction = []
strength = []
residual = []
for stress in normal:
    with_bond = jl.direct_shear(bonded.joint(), 15e-3, stress, steps=400).shear_stress
    friction.append(jl.direct_shear(unbonded.joint(), 15e-3, stress, steps=400).shear_stress.max())
    strength.append(with_bond.max())
    residual.append(with_bond[-1])
friction = np.array(friction)
tan_phi = friction / normal
bound = friction + np.hypot(bond.cohesion, bond.tension * tan_phi)
figure, axis = plt.subplots(figsize=(6, 4.2), layout="constrained")
axis.plot(normal / 1e6, bound / 1e6, "k:", label="bound")
axis.plot(normal / 1e6, np.array(strength) / 1e6, "o-", ms=3, label="bonded, peak")
axis.plot(normal / 1e6, friction / 1e6, "--", label="without a bond, peak")
axis.plot(normal / 1e6, np.array(residual) / 1e6, "s", ms=3, label="bonded, at 15 mm")
axis.set(xlabel="normal stress (MPa)", ylabel="shear stress (MPa)")
axis.legend()
plt.show()

# %%
# Tension: the joint is opened, closed and opened further. The bond unloads towards its stress-free
# position, and on closing the asperities touch. The area under the curve is the fracture energy.

figure, axis = plt.subplots(figsize=(6, 4.2), layout="constrained")
reversals = (0.0, 0.7, -0.02, 1.6)  # mm
opening = np.concatenate([np.linspace(*ends, 100) for ends in itertools.pairwise(reversals)])
for label, energy in {"5": bond.energy_I, "1 (brittle)": None}.items():
    joint = replace(unbonded, bond=replace(bond, energy_I=energy)).joint()
    increments = np.diff(-1e-3 * opening, prepend=0.0)
    F = [joint.update([d, 0.0], tangent=False)[0][0] for d in increments]
    axis.plot(opening, -np.array(F) / 1e6, label=label)
    print(f"energy ratio {label}: breaking the bond dissipates {joint.dissipated_energy:.1f} J/m2")
axis.set(xlabel="opening (mm)", ylabel="tensile stress (MPa)", ylim=(-0.1, 0.55))
axis.legend(title="fracture energy over\nelastic energy at the peak")
plt.show()
