r"""
Export a table, and compare it with the law
===========================================

A host that needs stiffnesses and friction instead of a law can read a table, which is not
path-dependent.

`Shear this rock in the browser <../browser.html#rock=jing-replica&play=shear>`__.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

law = jl.presets.load("jing-replica")
table = jl.tabulate(law, shear_limit=10 * law.closure_range, azimuths=6, steps=30)

# %%
# A text file; its first line has the names of the columns.

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "joint.txt"
    table.save(path)
    columns = np.genfromtxt(path, names=True)
    print(path.name, "has", len(columns), "rows and the columns", *columns.dtype.names[:8], "...")

# %%
# The same path, closed and sheared forward and back, by the law and by a host that reads the table.

closure = 0.5 * law.closure_range
amplitude = 0.5 * law.closure_range
phase = np.linspace(0, 2 * np.pi, 161)
path = np.zeros((181, 3))
path[:21, 0] = np.linspace(0, closure, 21)
path[21:, 0] = closure
path[20:, 1] = amplitude * np.sin(phase)

batch = law.joints(1)
exact = [batch.update(step[None], tangent=False)[0][0] for step in np.diff(path, axis=0)]
exact = np.array([np.zeros(3), *exact])
host = table.follow(path[1:])
error = np.abs(host - exact[1:]).max() / np.abs(exact).max()
print(f"largest error of the table on this path: {100 * error:.0f} % of the largest traction")

# %%
# The columns of the table against closure, and the path by the law and by the host.

figure, (stiffness_axes, path_axes) = plt.subplots(1, 2, figsize=(7.5, 4.2), layout="constrained")
stiffness_axes.plot(table.closure * 1e3, table.kn_tangent / 1e9, label="normal")
for k in (0, 3):
    azimuth = f"shear, {np.degrees(table.azimuth[k]):.0f}°"
    stiffness_axes.plot(table.closure * 1e3, table.shear_stiffness[:, k] / 1e9, "--", label=azimuth)
stiffness_axes.set(xlabel="closure (mm)", ylabel="tangent stiffness (GPa/m)")
path_axes.plot(path[20:, 1] * 1e3, exact[20:, 1] / 1e6, label="law")
path_axes.plot(path[20:, 1] * 1e3, host[19:, 1] / 1e6, label="table in a host")
path_axes.set(xlabel="shear displacement (mm)", ylabel="shear stress (MPa)")
for axis in (stiffness_axes, path_axes):
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
plt.show()
