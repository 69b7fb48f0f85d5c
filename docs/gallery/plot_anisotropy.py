r"""
Anisotropy: friction by direction
=================================

A joint whose facets lean more often along one direction is stronger there. Where a block slides
along its ridges it meets the weaker one: a strength from a test across them is then unsafe. Of a
law with ``c = 0`` the last tenths of a degree between two directions are those of its few azimuths.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# ``c > 0`` puts facets along axis 2 (azimuth 0). A law with a plane moves at one azimuth; here one
# law for each. To sweep azimuths with 3-D motion instead, use one law and ``direct_shear(...,
# azimuth=...)``.

base = jl.JointLaw(
    orientation=jl.Orientation(a=3.0, b=0.0, c=0.3),
    asperity=jl.Asperity(K=2.0e8, lam=1.2, eta=0.5, mu=0.5),
    heights=jl.GammaHeights(alpha=3.82, beta=1.15e-6, overlap=2e-6),
    asperity_density=1e10,
    resolution=jl.Resolution(4, 8, 4),
)
azimuth = np.radians(np.arange(0, 181, 15))
shears = (0.1e-6, 0.3e-6, 1e-6)

friction = []
for psi in azimuth:
    law = replace(base, plane=float(psi))
    record = jl.direct_shear(law.joint(), shears, normal=10e6, steps=25)
    friction.append(record.friction_angle[[25, 50, 75]])
friction = np.array(friction)

# %%
figure, axis = plt.subplots(figsize=(7.5, 4.5), layout="constrained")
for k, shear in enumerate(shears):
    axis.plot(np.degrees(azimuth), friction[:, k], "o-", label=f"{shear * 1e6:g} µm of shear")
axis.set(xlabel="azimuth of shear (°)", ylabel="mobilised friction angle (°)")
axis.set_xticks(range(0, 181, 30))
axis.set_ylim(bottom=0)
figure.legend(loc="outside upper center", ncols=3)
plt.show()

# %%
along, across = friction[0], friction[6]
for shear, strong, weak in zip(shears, along, across, strict=True):
    print(f"after {shear * 1e6:g} µm: {strong:.1f}° along, {weak:.1f}° across")
