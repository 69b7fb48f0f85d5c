r"""
From a scanned surface to a law
===============================

Heights and orientations of asperities from a scan, with confidence intervals, and the joint law.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# A synthetic scan: composite heights in m, 20 µm apart, of 24 x 24 asperities. Their depths follow
# Eq. 12 with alpha = 4 and beta = 10 µm; each has one plane in each quadrant, with orientations by
# Eq. 14 with a = 3 and b = c = 0.

true_orientation = jl.Orientation(3.0)
rng = np.random.default_rng(0)
x = np.arange(20) - 10  # points of one asperity
quadrant = (x >= 0).astype(int)
depth = rng.gamma(4.0 + 1, 10e-6, (24, 24, 1, 1))
slope = np.tan(np.arccos(rng.uniform(size=(24, 24, 2, 2))) / true_orientation.a)
azimuth = rng.uniform(0, np.pi / 2, (24, 24, 2, 2))
along, across = (
    (slope * part)[:, :, quadrant][..., quadrant] for part in (np.cos(azimuth), np.sin(azimuth))
)
z = -depth - 20e-6 * (along * abs(x) + across * abs(x)[:, None])
z = z.swapaxes(1, 2).reshape(480, 480) + 0.3e-6 * rng.standard_normal((480, 480))
scan = jl.from_surface(z, spacing=20e-6)
for name in ("a", "b", "c", "alpha", "beta"):
    estimate = scan.estimates[name]
    interval = f"{estimate.low:.3g} to {estimate.high:.3g}"
    print(f"{name:6s} {estimate.value:.3g}, 95 % confidence interval {interval}")

# %%
# A scan gives the geometry, not the stiffness: it follows from the rock, by Hertz's theory.

law = scan.law(jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6))

# %%
figure, axes = plt.subplots(3, 1, figsize=(6, 10), layout="constrained")
extent = 1e3 * 20e-6 * np.array([0, z.shape[1], 0, z.shape[0]])
image = axes[0].imshow(z * 1e6, extent=extent, origin="lower", cmap="cividis")
figure.colorbar(image, ax=axes[0], label="height (µm)", shrink=0.8)
axes[0].set(xlabel="along rows (mm)", ylabel="along columns (mm)", title="scan")
theta = np.degrees(np.arctan(np.linalg.norm(scan.asperities.slope.reshape(-1, 2), axis=1)))
axes[1].hist(theta, bins=30, density=True, alpha=0.4, label="facets")
x = np.linspace(0, 90 / scan.orientation.a, 100)
ring = np.linspace(0, np.pi, 16, endpoint=False)
density = scan.orientation.density(np.radians(x)[:, None], ring).mean(axis=1)
axes[1].plot(x, 2 * np.pi * np.sin(np.radians(x)) * density * np.pi / 180, label="Eq. 14, fitted")
axes[1].set(xlabel="inclination (°)", ylabel="density (1/°)", title="orientations")
axes[1].set_ylim(top=1.35 * axes[1].get_ylim()[1])
axes[1].legend(loc="upper left")
u = np.linspace(0, law.closure(20e6), 100)
axes[2].plot(u * 1e6, law.normal_stress(u) / 1e6)
axes[2].set(xlabel="closure (µm)", ylabel="normal stress (MPa)", title="first loading")
plt.show()
