"""Every Python block of README.md and of the docs runs as printed, and says what is printed."""

import contextlib
import io
import re

import numpy as np
import pytest
from pages import PAGES, blocks, text

import jointlaw as jl

ELSEWHERE = {"docs/yade.md"}  # needs YADE's own Python: tests/hosts/test_yade_page.py runs it there
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


def start(space, printed):
    assert printed[:3] == blocks("docs/start.md", "text")[0].splitlines()


def sharp_bits(space, printed):
    shown = [line.split()[1] for line in printed]
    assert shown == re.search(r"# ([\d.%, ]+)\n", text("docs/sharp-bits.md"))[1].split(", ")


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


def paper(space, printed):
    # F2/F1 depends on shear/closure alone: 0.476 at 2, as in the shear test at 10 MPa
    F = space["result"].F
    assert F[1] / F[0] == pytest.approx(0.476, abs=5e-4)


def embed(space, printed):
    assert space["slid"] > 1e-3  # 41 degrees is beyond its friction


def only_what_is_needed(space, printed):
    assert printed == ["True"]


def recipes(space, printed):
    """Columns for a host."""
    closure, stress, _ = np.loadtxt("joint-for-my-host/joint.txt").T
    expected = jl.presets.load("linear-a3").normal_stress(closure)
    np.testing.assert_allclose(stress, expected, rtol=1e-9)  # 18 digits in text


CHECKS = {
    "README.md": readme, "docs/start.md": start, "docs/sharp-bits.md": sharp_bits,
    "docs/field.md": field, "docs/measurements.md": measurements, "docs/speed.md": speed,
    "docs/paper.md": paper, "docs/embed.md": embed, "docs/recipes.md": recipes,
    "docs/only-what-is-needed.md": only_what_is_needed,
}  # fmt: skip


@pytest.mark.parametrize("page", [p for p in PAGES if blocks(p, "python") and p not in ELSEWHERE])
def test_blocks_run_as_printed(page):
    found = run(page)
    if page in CHECKS:
        CHECKS[page](*found)


@pytest.mark.parametrize(("share", "least", "most"), [(0.1, 5.0, 10.0), (0.01, 0.18, 0.25)])
def test_forces_between_two_steps_are_explicit_euler(share, least, most):
    """The numbers of docs/embed.md, "Rules for a host": closures after 20 periods."""
    (code,) = blocks("docs/embed.md", "python")
    code = code.replace("radians(41.0)", "radians(0.0)").replace("dt = 0.3 *", f"dt = {share} *")
    before, _, _ = code.partition("for _ in range(1500):")
    callback = "clock.max_force, clock.pre_solve = 0.0, forces\n"
    assert callback in before
    between = before.replace(callback, "clock.max_force = 0.0\n")
    amplitudes = []
    for host in (before, between):
        space, _ = run("docs/embed.md", [host])
        block, dt, seated = space["block"], space["dt"], space["seated"]
        top, lowest = block.position.y, 0.0
        # 40 periods of rocking, which limits dt, are 20 of the motion up and down
        block.velocity = 0.0, -0.05 * seated * 2 * share / dt
        for _ in range(round(40 * np.pi / share)):
            if host is between:
                space["forces"](None, None)
            space["space"].step(dt)
            lowest = max(lowest, abs(block.position.y - top) / seated)
        amplitudes.append(lowest)
    assert amplitudes[0] < 0.15
    assert least < amplitudes[1] < most
