"""Tables of figures that tests record.

    python docs/measure/test_figures.py extremes
    python docs/measure/test_figures.py exact-steps
    python docs/measure/test_figures.py forgetting
    python docs/measure/test_figures.py impacts

The tests run at full length (JOINTLAW_FULL=1) and write each figure as a property of their report,
a list in JSON. They also assert what the tables show. Each takes about a minute at most.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path
from xml.etree import ElementTree

from common import ROOT, print_table, run_command

EXTREME_CHECKS = "slope / bound", "units, F", "units, energy"


def recorded_figures(*tests):
    """Figures that these tests record: {name: values}, in the order of the tests."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        files = [f"tests/verification/test_{name}" for name in tests]
        command = [sys.executable, "-m", "pytest", "-q", "-m", "", "-n", "0", *files]
        command += ["-o", "junit_family=xunit1"]  # the family that has properties
        process = subprocess.run([*command, f"--junitxml={report}"], cwd=ROOT, text=True,
                                 env=os.environ | {"JOINTLAW_FULL": "1"},
                                 stdout=subprocess.PIPE)  # fmt: skip
        if process.returncode:
            raise SystemExit(process.stdout)
        figures = defaultdict(list)
        for element in ElementTree.parse(report).iter("property"):
            figures[element.get("name")].append(json.loads(element.get("value")))
    return figures


def extremes():
    """Extreme laws, alone and in pairs of extremes: how many pass every check, and the worst."""
    tests = (
        "one_extreme_parameter",
        "two_extreme_parameters",
        "force_is_lipschitz",
        "results_scale",
    )
    figures = recorded_figures(*(f"extremes.py::test_{name}" for name in tests))
    alone = [passes for (passes,) in figures["alone"]]
    passed, refused, count = (sum(column) for column in zip(*figures["pairs"], strict=True))
    rows = [["every check after every step", f"passes in {sum(alone)} of {len(alone)}", ""]]
    for check in EXTREME_CHECKS:
        worst, law = max(figures[check])
        rows.append([check, f"{worst:.3f}" if check == EXTREME_CHECKS[0] else f"{worst:.0e}", law])
    rows.append(["pairs that pass", f"{passed} of {count}, {refused} refused when built", ""])
    print_table(["check", "worst", "at"], rows)


def exact_steps():
    """Largest error of a step in 50 digits, by law."""
    figures = recorded_figures("extremes_exact.py")
    largest = defaultdict(float)
    for *case, error in figures["exact"]:
        largest[tuple(case)] = max(largest[tuple(case)], error)
    rows = [[*(f"{value:g}" for value in case), f"{error:.0e}"] for case, error in largest.items()]
    print_table(["a", "mu", "lam", "cells", "largest error of F"], rows)


def forgetting():
    """Fraction of the locked-in shear stress that is left after small cycles of closure."""
    test = "test_small_normal_cycles_forget_locked_in_shear_at_a_known_rate"
    figures = recorded_figures(f"spring_slider.py::{test}")
    rows = []
    for cells, *fractions in figures["forgetting"]:
        rows.append([cells, *(f"{fraction:.4f}" for fraction in fractions)])
    print_table(["cells", "1 cycle", "10", "100", "1000", "10 000"], rows)


def impacts():
    """Change of energy in an undamped impact, by time step over the critical one."""
    figures = recorded_figures("extremes_exact.py")
    rows = [
        [ratio, f"{2 / ratio:.0f}", f"{smallest:+.1e} to {largest:+.1e}"]
        for ratio, smallest, largest in figures["impact"]
    ]
    print_table(["time step / critical", "samples of an impact", "change of energy"], rows)


if __name__ == "__main__":
    run_command(__doc__, extremes, exact_steps, forgetting, impacts)
