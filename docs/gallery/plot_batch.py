r"""
A batch in a DEM-like loop
==========================

Two thousand contacts that close, slide, open and are replaced: one call of the law per time step.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

# %%
# The host computes the motion: here the closure and the slip of every contact oscillate at a
# frequency of its own.

rng = np.random.default_rng(1)
n = 2000
steps = 200
law = jl.presets.load("westerly-smooth")
joints = law.joints(n)
amplitude = law.closure(rng.uniform(1e6, 20e6, n))
frequency = rng.uniform(1, 3, n)  # per run
direction = rng.uniform(0, 2 * np.pi, n)
position = np.zeros((n, 3))


def contact_position(fraction):
    """Closure and slip (n, 3) in m of each contact at a fraction of the run."""
    phase = 2 * np.pi * frequency * fraction
    closure = amplitude * (0.6 - np.cos(phase))
    slip = amplitude * np.sin(phase)
    return np.column_stack([closure, slip * np.cos(direction), slip * np.sin(direction)])


# %%
# The loop: increments in, tractions out; a contact between other bodies starts from the virgin
# state.

normal_stress = []
shear_stress = []
touching_fraction = []
for step in range(1, steps + 1):
    new_position = contact_position(step / steps)
    F, _ = joints.update(new_position - position, tangent=False)
    position = new_position
    normal_stress.append(F[:, 0].mean())
    shear_stress.append(np.hypot(F[:, 1], F[:, 2]).mean())
    touching_fraction.append(np.mean(F[:, 0] > 0))
    is_replaced = rng.random(n) < 0.002  # other bodies are in contact from now on
    joints.reset(is_replaced)
    position[is_replaced] = 0.0

# %%
# An explicit host also needs the largest stiffness, which bounds its time step, and the energy that
# the contacts dissipate.

print(f"stiffest contact {joints.max_stiffness().max() / 1e12:.0f} MPa/µm")
print(f"dissipated by friction {joints.dissipated_energy.mean():.2f} J/m² per contact, on average")

time = np.arange(1, steps + 1) / steps
figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 5.5), layout="constrained", sharex=True)
top.plot(100 * time, np.array(normal_stress) / 1e6, label="normal")
top.plot(100 * time, np.array(shear_stress) / 1e6, label="shear")
top.set_ylabel("mean stress (MPa)")
top.legend()
bottom.plot(100 * time, 100 * np.array(touching_fraction), color="C2")
bottom.set(xlabel="time (% of the run)", ylabel="contacts under stress (%)")
plt.show()
