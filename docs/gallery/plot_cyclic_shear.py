r"""
Cyclic shear
============

Reversals, growing amplitudes, and what each cycle loses.
"""

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl

law = replace(jl.presets.load("westerly-smooth"), plane=0.0)
law = replace(law, resolution=jl.Resolution(4, 6, 10))

# %%
# Five amplitudes, two cycles each, at a constant normal stress.

amplitudes = np.array([20e-9, 50e-9, 100e-9, 200e-9, 400e-9])
turns = [sign * x for x in amplitudes for sign in (1, -1, 1, -1)]
steps = 60
record = jl.direct_shear(law.joint(), [*turns, 0.0], normal=10e6, steps=steps)

# %%
# Loss per cycle, and the secant stiffness of the cycle, from turning point to turning point.

corner = steps * np.arange(len(turns) + 1)  # rows at the turning points, the first at zero
lost, stiffness = [], []
for k in range(len(amplitudes)):
    first, last = corner[4 * k + 2], corner[4 * k + 4]  # the second cycle: - to + to -
    lost.append(record.dissipated[last] - record.dissipated[first])
    top = corner[4 * k + 3]
    span = record.shear[top] - record.shear[first]
    stiffness.append((record.shear_stress[top] - record.shear_stress[first]) / span)
lost, stiffness = np.array(lost), np.array(stiffness)

figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 3.8), layout="constrained")
left.plot(record.shear * 1e9, record.shear_stress / 1e6, lw=0.9)
left.set_xlabel("shear displacement (nm)")
left.set_ylabel("shear stress (MPa)")
right.loglog(amplitudes * 1e9, lost, "o-", label="loss per cycle")
right.set_xlabel("amplitude (nm)")
right.set_ylabel("energy lost per cycle (J/m²)")
right.set_xticks(amplitudes * 1e9, [f"{x * 1e9:g}" for x in amplitudes], minor=False)
right.minorticks_off()
other = right.twinx()
other.plot(amplitudes * 1e9, stiffness / 1e12, "s--", color="C1", label="secant stiffness")
other.set_ylabel("secant shear stiffness (MPa/µm)")
other.set_ylim(bottom=0)
figure.legend(loc="outside upper right", ncols=2)
plt.show()

# %%
# Small cycles are nearly elastic: the loss grows faster than the square of the amplitude.

growth = np.log(lost[1] / lost[0]) / np.log(amplitudes[1] / amplitudes[0])
print(f"loss ~ amplitude^{growth:.1f} at the smallest, stiffness {stiffness / 1e12} MPa/µm")

# %%
# Asperities that yield or wear, in six cycles of a rough joint whose slopes fade. An
# elastic joint repeats itself. One that wears loses strength from cycle to cycle. One that yields
# is weaker at first, and is compacted at every reversal, each time by less.

rough = replace(jl.presets.load("biegel-rough"), plane=0.0, mating_length=2e-6)
kinds = {
    "elastic": rough,
    "yields beyond 0.1 µm": replace(
        rough, asperity=replace(rough.asperity, yield_interference=0.1e-6)
    ),
    "wears over 100 J/m²": replace(rough, slope_wear=100.0),
}
figure, (left, right) = plt.subplots(1, 2, figsize=(7.5, 3.8), layout="constrained")
peaks = {}
for label, kind in kinds.items():
    cycles = jl.direct_shear(kind.joint(), [8e-6, -8e-6] * 6 + [0.0], normal=10e6, steps=steps)
    ratio = cycles.shear_stress / cycles.F1
    peaks[label] = [ratio[2 * steps * k : 2 * steps * (k + 1)].max() for k in range(6)]
    style = {"ls": "--", "zorder": 3} if label == "elastic" else {}
    for first, strong in ((0, 0.35), (10 * steps, 1.0)):  # the first cycle pale, the last one full
        cycle = slice(first, first + 2 * steps + 1)
        (line,) = left.plot(cycles.shear[cycle] * 1e6, ratio[cycle], alpha=strong, **style)
        style["color"] = line.get_color()
    travel = np.cumsum(np.abs(np.diff(cycles.shear, prepend=0.0)))
    right.plot(travel * 1e6, (cycles.closure - cycles.closure[0]) * 1e6, label=label, **style)
    print(f"{label}: largest F2/F1 of each cycle {np.round(peaks[label], 3)}")
left.set_xlabel("shear displacement (µm)")
left.set_ylabel("shear over normal stress")
left.set_title("first cycle pale, last one full")
right.set_xlabel("distance sheared (µm)")
right.set_ylabel("closure since seating (µm)")
right.legend(loc="center right")
plt.show()
