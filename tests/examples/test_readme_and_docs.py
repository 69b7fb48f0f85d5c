"""The Python of README.md and of the docs runs as printed, and its figures are true."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def code(page):
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(), re.DOTALL)


def test_readme_example_runs(capsys):
    block = next(text for text in code("README.md") if "batch = law.joints" in text)
    space = {}
    exec(block, space)
    closure, shear, _ = space["joint"].delta
    assert (closure, shear) == pytest.approx((2e-7, 1e-7))
    assert space["F"].shape == (10_000, 3)
    assert "J/m2 lost to friction" in capsys.readouterr().out


def test_lumping_loss_is_as_printed(capsys):
    (block,) = code("docs/sharp-bits.md")
    printed = re.search(r"# ([\d.%, ]+)\n", block).group(1).split(", ")
    exec(block, {})
    shown = [line.split()[1] for line in capsys.readouterr().out.splitlines()]
    assert shown == printed
    losses = [float(value.rstrip("%")) for value in shown]
    assert losses == sorted(losses, reverse=True)  # finer cells lose less


def test_a_law_that_only_closes_is_as_printed(capsys):
    (block,) = code("docs/only-what-is-needed.md")
    exec(block, {})
    assert capsys.readouterr().out == "True\n"
