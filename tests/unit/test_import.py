"""`import jointlaw` needs numpy and scipy alone, and leaves the slow parts until they are asked."""

import re
import subprocess
import sys
from pathlib import Path

import jointlaw as jl

HEAVY = ("matplotlib", "pymunk", "tqdm", "pandas", "scipy.stats")


def modules_after(code):
    listing = subprocess.run(
        [sys.executable, "-c", f"import sys; {code}; print(*sys.modules)"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return set(listing.stdout.split())


def test_a_code_that_embeds_the_law_loads_no_tools_for_measurements():
    modules = modules_after("import jointlaw")
    assert not modules.intersection((*HEAVY, "scipy.optimize", "scipy.spatial"))
    assert not {
        m
        for m in modules
        if m.startswith(("jointlaw.calibration", "jointlaw.surface", "jointlaw.tables.tabulate"))
    }


def test_every_public_name_loads_and_stands_on_the_api_page():
    page = (Path(jl.__file__).parents[1] / "docs/api.md").read_text(encoding="utf-8")
    own = re.split(r"currentmodule:: (\w+)", page)[1:]
    named = "".join(
        text for name, text in zip(own[::2], own[1::2], strict=True) if name == "jointlaw"
    )
    shown = set(re.findall(r"auto(?:class|function|exception):: (\w+)\n", named))
    assert shown | {"presets", "closed_form"} == set(jl.__all__)
    for name in jl.__all__:
        assert getattr(jl, name).__name__.rpartition(".")[2] == name
    for module in ("presets", "closed_form"):
        assert f"automodule:: jointlaw.{module}" in page
