r"""
Memory: snapshot, restore, save
===============================

The traction depends on the way; a snapshot keeps all of it, in memory or in a file.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

law = jl.presets.load("westerly-rough")
joint = law.joint()


def walk(joint, *corners, steps=40):
    """Displacements and tractions along straight legs (m)."""
    rows = []
    for corner in corners:
        step = (np.array(corner) - joint.delta) / steps
        for _ in range(steps):
            F, _ = joint.update(step, tangent=False)
            rows.append([*joint.delta, *F])
    return np.array(rows)


# %%
# The same displacement, reached on two ways: shear first or closure first.

virgin = joint.snapshot()
u, s = 0.2e-6, 0.15e-6
closed_first = walk(joint, [u, 0, 0], [u, s, 0])
joint.restore(virgin)
sheared_first = walk(joint, [0.25 * u, 0, 0], [0.25 * u, s, 0], [u, s, 0])
print("F at the same place:", closed_first[-1, 3:5] / 1e6, sheared_first[-1, 3:5] / 1e6, "MPa")

# %%
# A step that was a mistake is taken back; a run is broken off and goes on from a file, to the bit.

before = joint.snapshot()
joint.update([u, -s, 0.0])
joint.restore(before)
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "joint.npz"
    joint.snapshot().save(path)
    again = law.joint()
    again.restore(jl.load_state(path))
unbroken = walk(joint, [u, -s, 0.0])
resumed = walk(again, [u, -s, 0.0])
print("largest difference of the resumed run:", np.abs(unbroken - resumed).max())

# %%
figure, axis = plt.subplots(layout="constrained")
for rows, label in (
    (closed_first, "closed, then sheared"),
    (sheared_first, "sheared, then closed"),
    (unbroken, "back, after a snapshot"),
):
    axis.plot(rows[:, 1] * 1e6, rows[:, 4] / 1e6, label=label)
axis.plot(closed_first[-1, 1] * 1e6, closed_first[-1, 4] / 1e6, "C0o")
axis.plot(sheared_first[-1, 1] * 1e6, sheared_first[-1, 4] / 1e6, "C1o")
axis.set(xlabel="shear displacement (µm)", ylabel="shear stress (MPa)")
axis.legend()
plt.show()
