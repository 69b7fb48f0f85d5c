"""
Figure 14: effect of the orientation parameter a on shear resistance
====================================================================

F₂/F₁ at a constant closure of 1 µm for linear asperities, λ = 1, μ = 0.6, b = c = 0. Neither K nor
the contact density enters. Resistance tends to the friction of the asperities as a grows. In the
right panel dotted lines repeat the total form. The paper does not print the end of its axis.
"""

from _common import LAW, SHEAR, TOTAL, draw, incremental, print_comparison, ratio, total

to = 4e-6  # m
closure = 1e-6  # m
panels = {TOTAL: {}, LAW: {}}
total_lines, incremental_lines = panels.values()
for a in (2, 3, 6, 9):
    label = f"a = {a}"
    tests = [run(f"linear-a{a}", to, closure=closure) for run in (total, incremental)]
    total_lines[label], incremental_lines[label] = (
        (test.shear * 1e6, ratio(test)) for test in tests
    )
    incremental_lines[f"_{label}, total"] = total_lines[label]
    ends = f"{ratio(tests[0])[-1]:.3f} (total form), {ratio(tests[1])[-1]:.3f} (incremental law)"
    print_comparison((f"F₂/F₁ at 4 µm, {label}", "tends to μ = 0.6 as a grows", ends))
for lines in panels.values():
    lines["μ"] = [0.0, to * 1e6], [0.6, 0.6]

styles = [
    ("C0", "C1", "C2", "C3", "k:"),
    ("C0", "C0:", "C1", "C1:", "C2", "C2:", "C3", "C3:", "k:"),
]
draw(panels, styles, xlabel=SHEAR, ylabel="F₂/F₁", ylim=(0.0, 1.45))
