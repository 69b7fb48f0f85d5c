"""
Figure 17: shear resistance of Westerly granite at a normal stress of 10 MPa
============================================================================

Parameters of section 4.3; the contact density is taken from section 4.1. The paper finds the smooth
interface stronger and hardening more. In the right panel dotted lines repeat the total form;
circles mark where all asperities in contact slide. In the total form the rough interface is stiffer
at first and the smooth one stronger later; in the incremental law the smooth one is above from the
start. Measured points and the end of the axis are not printed.
"""

import numpy as np
from _common import (
    LAW,
    SHEAR,
    TOTAL,
    draw,
    first_sliding,
    incremental,
    print_comparison,
    ratio,
    total,
)

to = 1.5e-6  # m
normal = 10e6  # Pa
panels = {TOTAL: {}, LAW: {}}
total_lines, incremental_lines = panels.values()
for label in ("smooth", "rough"):
    tests = [run(f"biegel-{label}", to, normal) for run in (total, incremental)]
    total_lines[label], incremental_lines[label] = (
        (test.shear * 1e6, ratio(test)) for test in tests
    )
    row = first_sliding(tests[1])
    incremental_lines[f"_{label}, total"] = total_lines[label]
    incremental_lines[f"{label}: all in contact slide"] = tuple(
        column[row : row + 1] for column in incremental_lines[label]
    )

styles = [("C0", "C1"), ("C0", "C0:", "C0o", "C1", "C1:", "C1o")]
labels = {"xlabel": SHEAR, "ylabel": "F₂/F₁", "xlim": (0.0, to * 1e6), "ylim": (0.0, 0.85)}
draw(panels, styles, **labels)

for shear in (0.1, 0.5, 1.5):  # um
    values = [
        "/".join(f"{np.interp(shear, *lines[label]):.3f}" for label in ("smooth", "rough"))
        for lines in (total_lines, incremental_lines)
    ]
    text = "{} (total form), {} (incremental law)".format(*values)
    print_comparison((f"F₂/F₁ at {shear} µm, smooth/rough", "smooth larger", text))
