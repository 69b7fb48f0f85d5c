"""
Figure 15: effect of asperity nonlinearity on shear resistance
==============================================================

F₂/F₁ at a constant closure of 1 µm for linear (η = 0) and nonlinear (η = 1/2) asperities, λ = 1,
μ = 0.6. The paper finds the nonlinear ones stronger, more so at a = 3. In the right panel dotted
lines repeat the total form. At small shear the total form is softer for η = 1/2: closure has
already moved inclined asperities along Eq. 35, while new shear in the incremental law begins with
the full initial stiffness.
"""

from _common import LAW, SHEAR, TOTAL, draw, incremental, print_comparison, ratio, total

to = 4e-6  # m
closure = 1e-6  # m
panels = {TOTAL: {}, LAW: {}}
total_lines, incremental_lines = panels.values()
for a in (3, 6):
    for kind in ("linear", "nonlinear"):
        label = f"{kind}, a = {a}"
        tests = [run(f"{kind}-a{a}", to, closure=closure) for run in (total, incremental)]
        total_lines[label], incremental_lines[label] = (
            (test.shear * 1e6, ratio(test)) for test in tests
        )
        incremental_lines[f"_{label}, total"] = total_lines[label]
    excess = [
        lines[f"nonlinear, a = {a}"][1][-1] - lines[f"linear, a = {a}"][1][-1]
        for lines in (total_lines, incremental_lines)
    ]
    text = f"{excess[0]:+.3f} (total form), {excess[1]:+.3f} (incremental law)"
    print_comparison((f"nonlinear less linear at 4 µm, a = {a}", "above 0, more for a = 3", text))
for lines in panels.values():
    lines["μ"] = [0.0, to * 1e6], [0.6, 0.6]

styles = [
    ("C0", "C3", "C2", "C1", "k:"),
    ("C0", "C0:", "C3", "C3:", "C2", "C2:", "C1", "C1:", "k:"),
]
for axes in draw(panels, styles, xlabel=SHEAR, ylabel="F₂/F₁", ylim=(0.0, 1.15)):
    axes.legend(loc="lower right", fontsize=8)
