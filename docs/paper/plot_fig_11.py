"""
Figure 11: normal closure of Westerly granite
=============================================

All parameters of section 4.1 except the friction, which the paper does not print here (0.3, from
section 4.3). The paper finds the smooth interface stiffer and hardening more. Here it is softer at
first, since fewer of its asperities touch at zero closure, and stiffer beyond the crossing. The two
forms differ little, and only in the shear force of inclined contacts (Eq. 35 against exact oblique
loading). Dotted: the compression of each asperity begins when it touches. Measured points and the
range of the axes are not printed.
"""

from dataclasses import replace

import numpy as np
from _common import (
    LAW,
    TOTAL,
    WESTERLY,
    contact_fraction,
    draw,
    preset_law,
    print_comparison,
    unit_secant,
)


def by_total_form(law, closure):
    """Normal stress (Pa) at a closure (m) without shear."""
    scale = contact_fraction(law, closure) * closure ** (1 + law.asperity.eta)
    return unit_secant(law, 0.0)[0].F[0] * scale


panels = {TOTAL: {}, LAW: {}, "both, first 20 MPa": {}}
total_lines, incremental_lines, first_20_mpa = panels.values()
for name, label in WESTERLY:
    law = preset_law(name)
    individual = replace(law, heights=replace(law.heights, formation="individual"))
    to_50_mpa = np.linspace(0.0, float(law.closure(50e6)), 101)
    to_20_mpa = np.linspace(0.0, float(law.closure(20e6)), 101)
    individual_closure = np.linspace(0.0, float(individual.closure(50e6)), 101)
    total_lines[label] = to_50_mpa * 1e6, by_total_form(law, to_50_mpa) * 1e-6
    incremental_lines[label] = to_50_mpa * 1e6, law.normal_stress(to_50_mpa) * 1e-6
    incremental_lines[f"{label}, formation individual"] = (
        individual_closure * 1e6,
        individual.normal_stress(individual_closure) * 1e-6,
    )
    first_20_mpa[f"{label}, total"] = to_20_mpa * 1e6, by_total_form(law, to_20_mpa) * 1e-6
    first_20_mpa[label] = to_20_mpa * 1e6, law.normal_stress(to_20_mpa) * 1e-6

styles = [("C0", "C1"), ("C0", "C0:", "C1", "C1:"), ("C0--", "C0", "C1--", "C1")]
axes = draw(panels, styles, xlabel="closure δ₁ (µm)", ylabel="normal stress F₁ (MPa)")
axes[1].set_ylim(0.0, 75.0)  # room for the legend

for stress in (1e6, 50e6):
    closures = (1e6 * float(preset_law(name).closure(stress)) for name, _ in WESTERLY)
    text = " µm and ".join(f"{closure:.4f}" for closure in closures)
    print_comparison(
        (f"closure at {stress * 1e-6:g} MPa, smooth and rough", "smooth stiffer", f"{text} µm")
    )
