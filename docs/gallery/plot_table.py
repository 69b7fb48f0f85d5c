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
# The table against closure, along two azimuths; and the path, by the law and by the host.

figure, ((top, stiff), (angles, sheared)) = plt.subplots(2, 2, figsize=(9, 7), layout="constrained")
closures = table.closure * 1e3
top.plot(closures, table.normal_stress / 1e6)
top.set_ylabel("normal stress (MPa)")
stiff.plot(closures, table.kn_secant / 1e9, label="normal, secant")
stiff.plot(closures, table.kn_tangent / 1e9, label="normal, tangent")
stiff.set_ylabel("stiffness (GPa/m)")
for k in (0, 3):
    azimuth = f"{np.degrees(table.azimuth[k]):.0f}°"
    stiff.plot(closures, table.shear_stiffness[:, k] / 1e9, "--", label=f"shear tangent, {azimuth}")
    friction = np.degrees(np.arctan(table.peak_friction[:, k]))
    dilation = np.degrees(np.arctan(table.dilation[:, k]))
    angles.plot(closures, friction, f"C{k}", label=f"friction, {azimuth}")
    angles.plot(closures, dilation, f"C{k}--", label=f"dilation, {azimuth}")
angles.set_ylabel("friction, dilation (°)")
angles.set_ylim(bottom=0)
for axis in (top, stiff, angles):
    axis.set_xlabel("closure (mm)")
sheared.plot(path[20:, 1] * 1e3, exact[20:, 1] / 1e6, label="law")
sheared.plot(path[20:, 1] * 1e3, host[19:, 1] / 1e6, label="table in a host")
sheared.set_xlabel("shear displacement (mm)")
sheared.set_ylabel("shear stress (MPa)")
sheared.set_ylim(top=9)
for axis in (stiff, angles, sheared):
    axis.legend(fontsize="small")
plt.show()
