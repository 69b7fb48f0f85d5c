r"""
Fit a measured closure curve
============================

Eight points of a fracture in Grimsel granodiorite, fitted; five more, up to twice the stress,
predicted.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointlaw as jl
from jointlaw.calibration import datasets
from jointlaw.calibration.measured import first_loading

# %%
# The curve comes with the package (Vogler et al. 2018). Only the loading up to 5.3 MPa is fitted,
# and the fit says what eight points leave open.

every_stress, every_closure = datasets.load("grimsel_vd1_closure")
stress, closure = first_loading(every_stress, every_closure)
seen = stress <= 5.3e6
fit = jl.fit_curves([jl.ClosureCurve(stress[seen], closure[seen])])
for name in fit.parameters:
    if name in fit.not_identifiable:
        print(f"{name}: {fit.not_identifiable[name]}")

# %%
# Held out: everything above.

error = fit.predict(closure[-1]) / stress[-1] - 1
print(f"predicted stress at {stress[-1] / 1e6:.1f} MPa: {100 * error:+.1f} %")

# %%
u = np.linspace(closure[0], closure[-1], 80)
low, high = fit.band(u)
figure, axis = plt.subplots(layout="constrained")
axis.fill_between(u * 1e6, low / 1e6, high / 1e6, alpha=0.25, label="95 % band of the law")
axis.plot(u * 1e6, fit.predict(u) / 1e6, label="joint law")
axis.plot(closure[seen] * 1e6, stress[seen] / 1e6, "ko", label="measured, fitted")
axis.plot(closure[~seen] * 1e6, stress[~seen] / 1e6, "ko", mfc="w", label="measured, predicted")
back = slice(stress.size, None)
axis.plot(
    every_closure[back] * 1e6, every_stress[back] / 1e6, "k.", ms=3, label="measured, unloading"
)
axis.set_xlabel("closure since the test began (µm)")
axis.set_ylabel("normal stress (MPa)")
axis.legend()
plt.show()

# %%
# Without yielding the law unloads almost along its loading curve; the rock does not. What friction
# and yielding explain of that loop is said on the page *Fit tests and scans*.
