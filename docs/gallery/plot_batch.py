r"""
A batch in a DEM-like loop
==========================

Two thousand contacts that open, close, come and go: one call of the law per time step.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# The host owns motion: here every contact breathes and slides at its own frequency.

rng = np.random.default_rng(1)
n, steps = 2000, 200
law = jl.presets.load("westerly-smooth")
joints = law.joints(n)
depth = law.closure(rng.uniform(1e6, 20e6, n))
rate, direction = rng.uniform(1, 3, n), rng.uniform(0, 2 * np.pi, n)
position = np.zeros((n, 3))


def place(share):
    """Where each contact is at a share of the run (n, 3), m."""
    closure = depth * (0.6 - np.cos(2 * np.pi * rate * share))
    slide = depth * np.sin(2 * np.pi * rate * share)
    return np.column_stack([closure, slide * np.cos(direction), slide * np.sin(direction)])


# %%
# The loop: increments in, tractions out; a contact that is lost starts anew.

pressure, friction, touching = [], [], []
for step in range(1, steps + 1):
    new = place(step / steps)
    F, _ = joints.update(new - position, tangent=False)
    position = new
    touching.append(np.mean(F[:, 0] > 0))
    pressure.append(F[:, 0].mean())
    friction.append(np.hypot(F[:, 1], F[:, 2]).mean())
    gone = rng.random(n) < 0.002  # other neighbours took their place
    joints.reset(gone)
    position[gone] = 0.0

# %%
# What an explicit host asks besides: the stiffness that bounds its step, and where energy went.

print(f"stiffest contact {joints.max_stiffness().max() / 1e12:.0f} MPa/µm")
print(f"lost to friction {joints.dissipated_energy.mean():.2f} J/m² per contact, on average")

time = np.arange(1, steps + 1) / steps
figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 5.5), layout="constrained", sharex=True)
top.plot(100 * time, np.array(pressure) / 1e6, label="normal")
top.plot(100 * time, np.array(friction) / 1e6, label="shear")
top.set_ylabel("mean stress (MPa)")
top.legend()
bottom.plot(100 * time, 100 * np.array(touching), color="C2")
bottom.set(xlabel="share of the run (%)", ylabel="contacts that carry (%)")
plt.show()
