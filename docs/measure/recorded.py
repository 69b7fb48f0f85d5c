"""Tables of figures that tests record: `python docs/measure/recorded.py TABLE`.

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

from tables import ROOT, asked, table

CHECKS = "slope / bound", "units, F", "units, energy"


def figures(tests):
    """What these tests record: key -> values, in the order of the tests."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        files = [f"tests/verification/test_{name}" for name in tests]
        command = [sys.executable, "-m", "pytest", "-q", "-m", "", "-n", "0", *files]
        command += ["-o", "junit_family=xunit1"]  # which takes properties
        done = subprocess.run([*command, f"--junitxml={report}"], cwd=ROOT, text=True,
                              env=os.environ | {"JOINTLAW_FULL": "1"},
                              stdout=subprocess.PIPE)  # fmt: skip
        if done.returncode:
            raise SystemExit(done.stdout)
        found = defaultdict(list)
        for one in ElementTree.parse(report).iter("property"):
            found[one.get("name")].append(json.loads(one.get("value")))
    return found


def matrix(found):
    alone = [held for (held,) in found["alone"]]
    held, refused, count = (sum(row) for row in zip(*found["pairs"], strict=True))
    rows = [["every check after every step", f"holds in {sum(alone)} of {len(alone)}", ""]]
    for check in CHECKS:
        worst, at = max(found[check])
        rows.append([check, f"{worst:.3f}" if check == CHECKS[0] else f"{worst:.0e}", at])
    rows.append(["pairs that hold", f"{held} of {count}, {refused} refused when built", ""])
    return table(["check", "worst", "at"], rows)


def exact(found):
    worst = defaultdict(float)
    for *case, gap in found["exact"]:
        worst[tuple(case)] = max(worst[tuple(case)], gap)
    rows = [[*(f"{value:g}" for value in case), f"{gap:.0e}"] for case, gap in worst.items()]
    return table(["a", "mu", "lam", "cells", "largest error of F"], rows)


def forgetting(found):
    rows = [[depth, *(f"{share:.4f}" for share in left)] for depth, *left in found["forgetting"]]
    return table(["cells", "1 cycle", "10", "100", "1000", "10 000"], rows)


def impact(found):
    rows = [[share, f"{2 / share:.0f}", f"{least:+.1e} to {most:+.1e}"]
            for share, least, most in found["impact"]]  # fmt: skip
    return table(["of the critical step", "samples of an impact", "change of energy"], rows)


MATRIX = "alone", "in_pairs", "force_is_lipschitz", "results_scale"
FORGETTING = "test_small_normal_cycles_forget_locked_in_shear_at_a_known_rate"
# name: what makes it of the figures, tests that record them
TABLES = {
    "matrix": (matrix, [f"extremes.py::test_{name}" for name in MATRIX]),
    "exact": (exact, ["extremes_exact.py"]),
    "forgetting": (forgetting, [f"slow_bed.py::{FORGETTING}"]),
    "impact": (impact, ["extremes_exact.py"]),
}  # fmt: skip

if __name__ == "__main__":
    make, names = TABLES[asked(__doc__, name=tuple(TABLES)).name]
    print(make(figures(names)))
