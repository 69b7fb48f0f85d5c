"""Every Python block of README.md and of the docs runs as printed, and says what is printed."""

import contextlib
import io

import pytest
from pages import PAGES, blocks, text

import jointlaw as jl

ELSEWHERE = {"docs/particles.md"}  # runs in YADE's own Python: tests/hosts/test_yade_table.py
# the first block of README.md is one line of a host's loop
GIVEN = {"README.md": lambda: {"joint": jl.presets.load("linear-a3").joint(), "d": [1e-9, 0, 0]}}


def run(page, code=None):
    """Names and printed text after all blocks of a page, in one namespace as in a notebook."""
    space = {"__name__": "__main__"} | GIVEN.get(page, dict)()
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        for number, block in enumerate(code or blocks(page, "python")):
            exec(compile(block, f"{page}, block {number + 1}", "exec"), space)
    return space, printed.getvalue().splitlines()


def readme(space, printed):
    assert space["joint"].delta[:2] == pytest.approx([2e-7, 1e-7])
    assert "J/m2 lost to friction" in printed[0]


def field(space, printed):
    for line in printed:
        assert line in text("docs/field.md")


def fits(space, printed):
    assert space["fit"].predict(100e-6) == pytest.approx(6.4e6, rel=0.02)  # a point of the data


def embed(space, printed):
    assert space["slid"] > 1e-3  # 41 degrees is beyond its friction


CHECKS = {
    "README.md": readme, "docs/field.md": field, "docs/fits.md": fits,
    "docs/embed.md": embed,
}  # fmt: skip


QUICK = ("README.md", "docs/start.md", "docs/embed.md")
RUN = [
    pytest.param(page, marks=[pytest.mark.slow] * (page not in QUICK))
    for page in PAGES
    if blocks(page, "python") and page not in ELSEWHERE
]


@pytest.mark.parametrize("page", RUN)
def test_blocks_run_as_printed(page):
    found = run(page)
    if page in CHECKS:
        CHECKS[page](*found)
