r"""
Fit a measured closure curve
============================

Eight points of a fracture in Grimsel granodiorite, fitted; five more, up to twice the stress,
predicted.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl
from jointlaw.calibration import baselines, datasets
from jointlaw.calibration.measured import first_loading

# %%
# The curve comes with the package (Vogler et al. 2018). Only the loading up to 5.3 MPa is fitted,
# and the fit says what eight points leave open.

stress, closure, stress_back, closure_back = first_loading(*datasets.load("grimsel_vd1_closure"))
seen = stress <= 5.3e6
fit = jl.fit_closure(stress[seen], closure[seen])
for name in fit.parameters:
    if name in fit.not_identifiable:
        print(f"{name}: {fit.not_identifiable[name]}")

# %%
# Held out: everything above. The empirical laws are fitted to the same points.

comparison = baselines.compare(stress, closure, limit=5.3e6)
print(comparison.table())

# %%
u = np.linspace(closure[0], closure[-1], 80)
low, high = fit.band(u)
figure, axis = plt.subplots(layout="constrained")
axis.fill_between(u * 1e6, low / 1e6, high / 1e6, alpha=0.25, label="95 % band")
axis.plot(u * 1e6, fit.predict(u) / 1e6, label="joint law")
for baseline in (baselines.fit_power_law, baselines.fit_barton_bandis):
    other = baseline(stress[seen], closure[seen])
    axis.plot(u * 1e6, other.predict(u) / 1e6, "--", lw=1, label=other.name)
axis.plot(closure[seen] * 1e6, stress[seen] / 1e6, "ko", label="measured, fitted")
axis.plot(closure[~seen] * 1e6, stress[~seen] / 1e6, "ko", mfc="w", label="measured, predicted")
axis.plot(closure_back * 1e6, stress_back / 1e6, "k.", ms=3, label="measured, unloading")
axis.set_ylim(0, 16)
axis.set_xlabel("closure since the test began (µm)")
axis.set_ylabel("normal stress (MPa)")
axis.legend()
plt.show()

# %%
# Without yielding the law unloads almost along its loading curve; the rock does not. What friction
# and yielding explain of that loop is said on the page *From measurements to a law*.

error = float(comparison.errors["jointlaw"][-1])
