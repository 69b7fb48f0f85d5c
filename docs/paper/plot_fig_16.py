"""
Figure 16: sliding and separated asperities during shear
========================================================

Linear asperities at a constant closure of 1 µm, λ = 1, μ = 0.6. Dotted ticks: separation begins at
δ₂ = δ₁ cot(π/2a), later for a = 6, as the paper says. Sliding begins earlier for a = 3 but is
complete earlier for a = 6. The fractions of the incremental law change in steps, one for each
orientation.
"""

import math

from _common import LAW, SHEAR, TOTAL, draw, first_sliding, incremental, print_comparison, total

closure = 1e-6  # m
panels = {TOTAL: {}, LAW: {}}
for (title, lines), run in zip(panels.items(), (total, incremental), strict=True):
    for a in (3, 6):
        test = run(f"linear-a{a}", 4e-6, closure=closure)
        onset = 1 / math.tan(0.5 * math.pi / a)
        x = test.shear * 1e6
        for name, fraction in (("sliding", test.sliding), ("separated", test.separated)):
            lines[f"{name}, a = {a}"] = x, fraction
        lines[f"_onset cot(pi/2a), a = {a}"] = [onset, onset], [0.0, 0.08]
        row = first_sliding(test)
        text = f"{x[row]:.2f} µm at F₂/F₁ = {test.shear_stress[row] / test.F1[row]:.3f}"
        claim = "earlier, and at a resistance close to μ = 0.6, for a = 6"
        print_comparison((f"all in contact slide, a = {a}, {title}", claim, text))

styles = ("C0", "C0--", "C0:", "C1", "C1--", "C1:")
draw(panels, styles, xlabel=SHEAR, ylabel="fraction of asperities", ylim=(-0.02, 1.05))
