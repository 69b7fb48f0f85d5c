r"""
Blocks in two dimensions
========================

A block is pushed along its bed and back: pymunk integrates the motion, the law computes every
contact force.
"""

import matplotlib.pyplot as plt

import jointlaw as jl
from dem_demo import Simulation, parse, run

# %%
# A scene is TOML, here as text. The drive pushes the block 2 mm and back.

SCENE = """
title = "A block on its bed"
[laws.replica]
asperity_density = 1e4
mating_length = 1e-3
orientation = { a = 4.0, c = 0.3 }
asperity = { K = 9.5e6, lam = 1.2, eta = 0.5, mu = 0.4 }
heights = { alpha = 3.82, beta = 1.15e-3, overlap = 3e-3 }

[[block]]
name = "bed"
box = [1.4, 0.3]
at = [0.0, -0.15]
fixed = true

[[block]]
name = "block"
box = [1.0, 0.5]
at = [0.0, 0.25]
fixed_motions = ["turn"]

[[drive]]
block = "block"
motion = "x"
times = [0.0, 1.0, 3.0]
values = [0.0, 2e-3, -2e-3]
ramp = 0.3

[monitor]
shear = [["block", "bed"]]

[run]
end = 3.1
fraction = 0.4
record = 0.01
"""
record, summary = run(Simulation(parse(SCENE)))
print(f"{summary['steps']} steps, energy balanced to {summary['max_energy_error']:.0e}")

# %%
# The record contains the motion of all blocks, the energies, and the joints that the scene
# monitors. A direct shear test of the law alone, on the same path, gives the same curve: rigid
# blocks add no compliance.

slip = record.series("block: slip_m")
shear = record.series("block: shear_Pa")
normal = record.series("block: normal_Pa")
closure = record.series("block: closure_m")
law_test = jl.direct_shear(record.scene.laws["replica"].joint(), slip[1:], normal[0], steps=1)

figure, (stress_axes, dilation_axes) = plt.subplots(1, 2, figsize=(7.5, 3.8), layout="constrained")
stress_axes.plot(slip * 1e3, shear / 1e3, label="shear")
stress_axes.plot(slip * 1e3, law_test.shear_stress / 1e3, "k:", label="shear, the law alone")
stress_axes.plot(slip * 1e3, normal / 1e3, "--", color="0.5", label="normal")
stress_axes.set(xlabel="shear displacement (mm)", ylabel="stress on the joint (kPa)")
figure.legend(loc="outside upper center", ncols=3)
dilation_axes.plot(slip * 1e3, (closure[0] - closure) * 1e3, color="C2")
dilation_axes.plot(slip * 1e3, (law_test.closure[0] - law_test.closure) * 1e3, "k:")
dilation_axes.set(xlabel="shear displacement (mm)", ylabel="dilation (mm)")
plt.show()
