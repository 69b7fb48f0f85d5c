r"""
Metres of shear
===============

With ``mating_length`` slopes fade with the distance from mate: dilation ends, friction
falls to that of the asperities, and the way back ends mated.
"""

from dataclasses import replace

import matplotlib.pyplot as plt

import jointlaw as jl

# %%
# The mating length is the slip over which faces lose their fit. Without it the joint always rises.

kept = replace(jl.presets.load("biegel-rough"), plane=0.0, resolution="fine")
fading = replace(kept, mating_length=2e-6)
turns = (15e-6, 0.0)

figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 6), layout="constrained", sharex=True)
records = {}
for label, law in (
    ("pairs kept for ever", kept),
    ("mating length 2 µm", fading),
):
    record = records[label] = jl.direct_shear(law.joint(), turns, normal=10e6, steps=150)
    top.plot(record.shear * 1e6, record.shear_stress / record.F1, label=label)
    bottom.plot(record.shear * 1e6, (record.closure[0] - record.closure) * 1e6, label=label)
top.set_ylabel("shear over normal stress")
bottom.set_ylabel("dilation (µm)")
bottom.set_xlabel("shear displacement (µm)")
top.legend(loc="lower left")
plt.show()

# %%
steady = records["mating length 2 µm"]
before, end = steady.shear_stress[100] / steady.F1[100], steady.shear_stress[150] / steady.F1[150]
rise = steady.closure[100] - steady.closure[150]
print(f"friction at 10 and 15 µm: {before:.4f}, {end:.4f}; it rises by {rise * 1e9:.2f} nm between")
