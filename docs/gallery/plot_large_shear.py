r"""
Metres of shear
===============

``mating_length`` renews the asperity contacts: dilation ends, friction settles, reversal starts it
anew.
"""

from dataclasses import replace

import matplotlib.pyplot as plt

import jointlaw as jl

# %%
# The critical slip distance D_c is the field's: the sliding that it takes to renew the population
# of contacts. Without it the joint rises for ever.

kept = replace(jl.presets.load("biegel-rough"), plane=0.0, resolution="fine")
renewed = replace(kept, mating_length=2e-6)
turns = (15e-6, 5e-6)

figure, (top, bottom) = plt.subplots(2, 1, figsize=(7, 6), layout="constrained", sharex=True)
records = {}
for label, law in (
    ("pairs kept for ever", kept),
    ("renewed, critical slip 2 µm", renewed),
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
steady = records["renewed, critical slip 2 µm"]
before, end = steady.shear_stress[100] / steady.F1[100], steady.shear_stress[150] / steady.F1[150]
rise = steady.closure[100] - steady.closure[150]
print(f"friction at 10 and 15 µm: {before:.4f}, {end:.4f}; it rises by {rise * 1e9:.2f} nm between")
