"""Every Python block of README.md and of the docs runs as printed, and says what is printed."""

import contextlib
import io
import re

import numpy as np
import pytest
from pages import PAGES, blocks, text

import jointlaw as jl

# needs YADE's own Python: tests/hosts/test_yade_page.py runs it there; test_recipes.py
ELSEWHERE = {"docs/yade.md", "docs/recipes.md"}
# the first block of README.md is one line of a host's loop
GIVEN = {"README.md": lambda: {"joint": jl.presets.load("linear-a3").joint(), "d": [1e-9, 0, 0]}}


def run(page):
    """Names and printed text after all blocks of a page, in one namespace as in a notebook."""
    space = {"__name__": "__main__"} | GIVEN.get(page, dict)()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for number, block in enumerate(blocks(page, "python")):
            exec(compile(block, f"{page}, block {number + 1}", "exec"), space)
    return space, printed.getvalue().splitlines()


def readme(space, printed):
    closure, shear, _ = space["joint"].delta
    assert (closure, shear) == pytest.approx((2e-7, 1e-7))
    assert space["F"].shape == (10_000, 3)
    assert "J/m2 lost to friction" in printed[0]


def start(space, printed):
    assert printed[:3] == blocks("docs/start.md", "text")[0].splitlines()
    # 20 um of closure at 100 steps of 0.2 um
    assert space["joint"].delta[0] == pytest.approx(20e-6)


def sharp_bits(space, printed):
    shown = [line.split()[1] for line in printed]
    assert shown == re.search(r"# ([\d.%, ]+)\n", text("docs/sharp-bits.md"))[1].split(", ")
    losses = [float(value.rstrip("%")) for value in shown]
    assert losses == sorted(losses, reverse=True)  # finer cells lose less


def field(space, printed):
    for line in printed[:-1]:
        assert line in text("docs/field.md")
    # fifteen passes of a fixed point that gains a third of the gap or more in each
    assert space["stiffness"](space["guess"]) == pytest.approx(100e9, rel=0.01)


def measurements(space, printed):
    assert space["fit"].predict(100e-6) == pytest.approx(6.4e6, rel=0.02)  # a point of the data
    # the shear curve was made by the law with these: no noise, so the fit finds them
    assert space["shear_fit"].law.asperity.mu == pytest.approx(space["law"].asperity.mu, rel=0.05)


def speed(space, printed):
    assert (space["stiffness"] > 0).sum() == 9_999  # all joints but the new and the lost one
    assert len(space["stiffness"]) == 12_000


def paper(space, printed):
    # F2/F1 depends on shear/closure alone: 0.476 at 2, as in the shear test at 10 MPa
    F = space["result"].F
    assert F[1] / F[0] == pytest.approx(0.476, abs=5e-4)


def embed(space, printed):
    assert space["slid"] > 1e-3  # 41 degrees is beyond its friction


def index(space, printed):
    assert np.isfinite(space["C"]).all()


def only_what_is_needed(space, printed):
    assert printed == ["True"]


CHECKS = {
    "README.md": readme, "docs/start.md": start, "docs/sharp-bits.md": sharp_bits,
    "docs/field.md": field, "docs/measurements.md": measurements, "docs/speed.md": speed,
    "docs/paper.md": paper, "docs/embed.md": embed, "docs/index.md": index,
    "docs/only-what-is-needed.md": only_what_is_needed,
}  # fmt: skip


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python") and p not in ELSEWHERE])
def test_blocks_run_as_printed(page):
    found = run(page)
    if page in CHECKS:
        CHECKS[page](*found)
