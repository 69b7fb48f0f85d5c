r"""
Path dependence: snapshot, restore, checkpoint
==============================================

The traction depends on the path; a snapshot contains the whole state, in memory or in a file.

`Turn the direction of slip of this rock in the browser
<../browser.html#rock=westerly-rough&step=6>`__.
"""

import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

law = jl.presets.load("westerly-rough")
joint = law.joint()


def follow(joint, *corners, steps=40):
    """Displacements and tractions along straight legs (m)."""
    rows = []
    for corner in corners:
        step = (np.array(corner) - joint.delta) / steps
        for _ in range(steps):
            F, _ = joint.update(step, tangent=False)
            rows.append([*joint.delta, *F])
    return np.array(rows)


# %%
# The same displacement, reached on two paths: shear first or closure first.

virgin = joint.snapshot()
u = 0.2e-6  # m, closure
s = 0.15e-6  # m, shear
closed_first = follow(joint, [u, 0, 0], [u, s, 0])
joint.restore(virgin)
sheared_first = follow(joint, [0.25 * u, 0, 0], [0.25 * u, s, 0], [u, s, 0])
print(
    "F at the same displacement:", closed_first[-1, 3:5] / 1e6, sheared_first[-1, 3:5] / 1e6, "MPa"
)

# %%
# A step is rejected and undone; a run is interrupted and restarted from a file, bitwise identical.

before = joint.snapshot()
joint.update([u, -s, 0.0])
joint.restore(before)
with tempfile.TemporaryDirectory() as folder:
    path = Path(folder) / "joint.npz"
    joint.snapshot().save(path)
    restarted = law.joint()
    restarted.restore(jl.load_state(path))
uninterrupted = follow(joint, [u, -s, 0.0])
restarted_rows = follow(restarted, [u, -s, 0.0])
print("largest difference of the restarted run:", np.abs(uninterrupted - restarted_rows).max())

# %%
figure, axis = plt.subplots(layout="constrained")
for rows, label in (
    (closed_first, "closed, then sheared"),
    (sheared_first, "sheared, then closed"),
    (uninterrupted, "reversed, after the snapshot"),
):
    axis.plot(rows[:, 1] * 1e6, rows[:, 4] / 1e6, label=label)
axis.plot(closed_first[-1, 1] * 1e6, closed_first[-1, 4] / 1e6, "C0o")
axis.plot(sheared_first[-1, 1] * 1e6, sheared_first[-1, 4] / 1e6, "C1o")
axis.set(xlabel="shear displacement (µm)", ylabel="shear stress (MPa)")
axis.legend()
plt.show()
