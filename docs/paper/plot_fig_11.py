"""
Figure 11: normal closure of Westerly granite
=============================================

All parameters of section 4.1 except the friction, which the paper does not print here (0.3, from
section 4.3). The paper finds the smooth interface stiffer and hardening more. Here it is softer at
first, since fewer of its asperities touch at zero closure, and stiffer beyond the crossing. The two
forms part little: only in the shear force of inclined contacts (Eq. 35 against exact oblique
loading). Dotted: each asperity feels only the closure since it touched. Measured points and the
range of the axes are not printed.
"""

from dataclasses import replace

import numpy as np
from _common import LAW, TOTAL, WESTERLY, beside, draw, law, touching, unit_secant


def by_total_form(found, closure):
    """Normal stress (Pa) at a closure (m) without shear."""
    share = touching(found, closure) * closure ** (1 + found.asperity.eta)
    return unit_secant(found, 0.0)[0].F[0] * share


panels = {TOTAL: {}, LAW: {}, "both, first 20 MPa": {}}
printed, ours, both = panels.values()
for name, label in WESTERLY:
    found = law(name)
    single = replace(found, heights=replace(found.heights, formation="individual"))
    wide, low = (np.linspace(0.0, float(found.closure(top)), 101) for top in (50e6, 20e6))
    alone = np.linspace(0.0, float(single.closure(50e6)), 101)
    printed[label] = wide * 1e6, by_total_form(found, wide) * 1e-6
    ours[label] = wide * 1e6, found.normal_stress(wide) * 1e-6
    ours[f"{label}, formation individual"] = alone * 1e6, single.normal_stress(alone) * 1e-6
    both[f"{label}, total"] = low * 1e6, by_total_form(found, low) * 1e-6
    both[label] = low * 1e6, found.normal_stress(low) * 1e-6

styles = [("C0", "C1"), ("C0", "C0:", "C1", "C1:"), ("C0--", "C0", "C1--", "C1")]
axes = draw(panels, styles, xlabel="closure δ₁ (µm)", ylabel="normal stress F₁ (MPa)")
axes[1].set_ylim(0.0, 75.0)  # room for the legend

for stress in (1e6, 50e6):
    closures = (1e6 * float(law(name).closure(stress)) for name, _ in WESTERLY)
    text = " µm and ".join(f"{closure:.4f}" for closure in closures)
    beside((f"closure at {stress * 1e-6:g} MPa, smooth and rough", "smooth stiffer", f"{text} µm"))
