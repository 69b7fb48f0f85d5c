"""The scripts of the pages docs/browser.md and docs/match.md."""

import csv
import json
from dataclasses import replace
from pathlib import Path

from jointlaw.calibration.forward import (
    DEFAULT_BETA,
    DEFAULT_STIFFNESS,
    DEFAULT_STIFFNESS_STRESS,
    default_law,
    density_for_stiffness,
)
from jointlaw.hosts.browser import export

HERE = Path(__file__).parent
SANDSTONE = HERE.parent / "data/sandstone-ja-dry.csv"
FITTED_STRESSES = (1.0, 3.0, 5.0)  # MPa
LAST_DISPLACEMENT = 10.0  # mm
LARGEST_STRESS = 20e6  # Pa: the cells are placed up to the closure at it


def match_script():
    """JavaScript of the page on shear tests that are matched by hand."""
    names = {"normal_stress_MPa": "stress", "peak_MPa": "peak", "peak_at_mm": "at",
             "last_MPa": "last", "last_at_mm": "end"}  # fmt: skip
    with SANDSTONE.open(encoding="utf-8") as file:
        tests = [
            {names[key]: float(text) for key, text in row.items()} for row in csv.DictReader(file)
        ]
    for test in tests:
        test["fitted"] = test["stress"] in FITTED_STRESSES
    data = {"end": LAST_DISPLACEMENT, "tests": tests}
    browser = Path(export.__file__).parent
    return "".join(
        [
            export.constant({"sandstone": match_law()}),
            f"const MATCH = {json.dumps(data)};\n",
            (browser / "law.js").read_text(encoding="utf-8"),
            (HERE / "match.js").read_text(encoding="utf-8"),
        ]
    )


def match_law():
    """The law of the fits without a closure test: their default contacts, heights and stiffness."""
    heights = replace(default_law().heights, beta=DEFAULT_BETA)
    law = replace(default_law(), heights=heights, closure_range=None)
    density = density_for_stiffness(law, DEFAULT_STIFFNESS, DEFAULT_STIFFNESS_STRESS)
    law = replace(law, asperity_density=density)
    return replace(law, closure_range=law.closure(LARGEST_STRESS))


def add(app, failed):
    """Write the scripts into the static files of a site whose build succeeded."""
    if failed is None and app.builder.format == "html":
        static = Path(app.outdir) / "_static"
        (static / "joint.js").write_text(export.script(), encoding="utf-8")
        (static / "match.js").write_text(match_script(), encoding="utf-8")


def setup(app):
    app.connect("build-finished", add)
    return {"parallel_read_safe": True}
