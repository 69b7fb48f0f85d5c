r"""
Export a table, and see what it drops
=====================================

A host that takes stiffnesses and friction instead of a law can be given a table; it has no memory.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

law = jl.presets.load("jing-replica")
table = jl.tabulate(law, shear_limit=10 * law.closure_range, azimuths=6, steps=30)

# %%
# Text for any program, first line the names of the columns.

with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "joint.txt"
    table.save(path)
    again = np.genfromtxt(path, names=True)
    print(path.name, "has", len(again), "rows and the columns", *again.dtype.names[:8], "...")

# %%
# The same path, closed and sheared to and fro, by the law and by a host that reads the table.

closure, amplitude = 0.5 * law.closure_range, 0.5 * law.closure_range
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
# What the table holds: stiffness against closure. And the path, by the law and by the host.

figure, (stiff, sheared) = plt.subplots(1, 2, figsize=(7.5, 4.2), layout="constrained")
stiff.plot(table.closure * 1e3, table.kn_tangent / 1e9, label="normal")
for k in (0, 3):
    azimuth = f"shear, {np.degrees(table.azimuth[k]):.0f}°"
    stiff.plot(table.closure * 1e3, table.shear_stiffness[:, k] / 1e9, "--", label=azimuth)
stiff.set(xlabel="closure (mm)", ylabel="tangent stiffness (GPa/m)")
sheared.plot(path[20:, 1] * 1e3, exact[20:, 1] / 1e6, label="law")
sheared.plot(path[20:, 1] * 1e3, host[19:, 1] / 1e6, label="table in a host")
sheared.set(xlabel="shear displacement (mm)", ylabel="shear stress (MPa)")
for axis in (stiff, sheared):
    axis.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), frameon=False)
plt.show()
