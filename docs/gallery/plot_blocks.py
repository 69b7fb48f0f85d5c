r"""
Blocks in two dimensions
========================

A block is pushed along its bed and lets go: pymunk moves it, every contact force is the law's.
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
print(f"{summary['steps']} steps, energy balanced to {summary['largest_energy_error']:.0e}")

# %%
# The record holds the motion of all blocks, the energies, and the joints that the scene watches.
# A direct shear test of the law alone, on the same path, draws the same curve: the blocks add
# nothing of their own.

slid = record.column("block: slid_m")
shear, normal = record.column("block: shear_Pa"), record.column("block: normal_Pa")
closure = record.column("block: closure_m")
alone = jl.direct_shear(record.scene.laws["replica"].joint(), slid[1:], normal[0], steps=1)

figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 3.8), layout="constrained")
left.plot(slid * 1e3, shear / 1e3, label="shear")
left.plot(slid * 1e3, alone.shear_stress / 1e3, "k:", label="shear, the law alone")
left.plot(slid * 1e3, normal / 1e3, "--", color="0.5", label="normal")
left.set(xlabel="shear displacement (mm)", ylabel="stress on the joint (kPa)")
figure.legend(loc="outside upper center", ncols=3)
right.plot(slid * 1e3, (closure[0] - closure) * 1e3, color="C2")
right.plot(slid * 1e3, (alone.closure[0] - alone.closure) * 1e3, "k:")
right.set(xlabel="shear displacement (mm)", ylabel="dilation (mm)")
plt.show()
