r"""
A bonded joint
==============

Rock bridges or cement across a joint: cohesion and tension beside the friction of asperities, and
what is left of the strength once they have broken.
"""

import itertools
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# A replica of a rock joint, and the same with a bond that holds 2 MPa in shear and 0.5 MPa in
# tension. It takes twenty times its elastic energy to break in shear, five times in tension.

plain = replace(jl.presets.load("jing-replica"), plane=0.0)
bond = jl.Bond(
    normal_stiffness=2e9, shear_stiffness=4e9, tension=0.5e6, cohesion=2e6,
    energy_I=5 * 0.5e6**2 / (2 * 2e9), energy_II=20 * 2e6**2 / (2 * 4e9),
)  # fmt: skip
bonded = replace(plain, bond=bond)

# %%
# Direct shear at three normal stresses. The asperities' share is that of a joint without a bond
# that is moved along the same path; the bond's share is the rest.


def shares(record):
    """Shear stress of the asperities and of the bond along a test, in MPa."""
    path = np.stack([record.closure, record.shear], axis=1)
    joint = plain.joint()
    F = [joint.update(d, tangent=False)[0][1] for d in np.diff(path, axis=0, prepend=0.0)]
    return np.array(F) / 1e6, (record.shear_stress - F) / 1e6


figure, axes = plt.subplots(3, 1, figsize=(6, 9), layout="constrained")
for axis, stress in zip(axes, (0.3e6, 1e6, 3e6), strict=True):
    record = jl.direct_shear(bonded.joint(), 15e-3, stress, steps=600)
    asperities, cement = shares(record)
    axis.plot(record.shear * 1e3, asperities, "--", label="asperities")
    axis.plot(record.shear * 1e3, cement, ":", label="bond")
    axis.plot(record.shear * 1e3, record.shear_stress / 1e6, label="sum")
    axis.set(xlabel="shear displacement (mm)", ylabel="shear stress (MPa)",
             title=f"normal stress {stress / 1e6:g} MPa")  # fmt: skip
axes[0].legend()
plt.show()

# %%
# The two shares peak at different slips, and the joint dilates, which puts the bond in tension and
# presses the asperities. So the peak lies between the friction alone and the bound that the
# tension sets, friction + :math:`\sqrt{c^2 + (T\tan\varphi)^2}`.

normal = np.geomspace(0.1e6, 10e6, 9)  # Pa
friction, strength, residual = [], [], []
for stress in normal:
    with_bond = jl.direct_shear(bonded.joint(), 15e-3, stress, steps=400).shear_stress
    friction.append(jl.direct_shear(plain.joint(), 15e-3, stress, steps=400).shear_stress.max())
    strength.append(with_bond.max())
    residual.append(with_bond[-1])
friction, slope = np.array(friction), np.array(friction) / normal  # slope: tan(phi)
bound = friction + np.hypot(bond.cohesion, bond.tension * slope)
figure, axis = plt.subplots(figsize=(6, 4.2), layout="constrained")
axis.plot(normal / 1e6, bound / 1e6, "k:", label="bound")
axis.plot(normal / 1e6, np.array(strength) / 1e6, "o-", ms=3, label="bonded, peak")
axis.plot(normal / 1e6, friction / 1e6, "--", label="without a bond, peak")
axis.plot(normal / 1e6, np.array(residual) / 1e6, "s", ms=3, label="bonded, at 15 mm")
axis.set(xlabel="normal stress (MPa)", ylabel="shear stress (MPa)")
axis.legend()
plt.show()

# %%
# Tension: the joint is pulled open, shut and pulled on. The bond unloads to where it was made, and
# closing meets the asperities. The area under the curve is the energy of fracture.

figure, axis = plt.subplots(figsize=(6, 4.2), layout="constrained")
turns = (0.0, 0.7, -0.02, 1.6)  # mm
pulled = np.concatenate([np.linspace(*ends, 100) for ends in itertools.pairwise(turns)])
for label, energy in {"5": bond.energy_I, "1 (brittle)": None}.items():
    joint = replace(plain, bond=replace(bond, energy_I=energy)).joint()
    F = [joint.update([d, 0.0], tangent=False)[0][0] for d in np.diff(-1e-3 * pulled, prepend=0.0)]
    axis.plot(pulled, -np.array(F) / 1e6, label=label)
    print(f"energy ratio {label}: {joint.dissipated_energy:.1f} J/m2 to break it")
axis.set(xlabel="opening (mm)", ylabel="tension (MPa)", ylim=(-0.1, 0.55))
axis.legend(title="energy of fracture over\nelastic energy at the peak")
plt.show()
