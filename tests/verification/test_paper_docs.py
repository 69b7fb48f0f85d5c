"""The claims table of the docs is the one that the package computes, and every claim has a test."""

import re
from pathlib import Path

import pytest

from jointlaw.paper import claims

ROOT = Path(__file__).parents[2]
NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
PRINTED = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
TABLE = PRINTED.split("<!-- claims -->")[1].split("<!-- end of claims -->")[0]
COMMAND = re.compile(r"--claims ([\w-]+)`")
ROWS = {found[1]: line for line in TABLE.splitlines() if (found := COMMAND.search(line))}


def test_every_claim_is_in_the_docs_in_the_order_of_the_paper():
    assert list(ROWS) == claims.keys()


@pytest.mark.parametrize("key", claims.keys())
def test_printed_row_is_the_computed_one(key):
    printed, computed = ROWS[key], claims.row(key)
    assert NUMBER.sub("#", printed) == NUMBER.sub("#", computed), "run `jointlaw figures --claims`"
    for old, new in zip(NUMBER.findall(printed), NUMBER.findall(computed), strict=True):
        a, b = (float(text.replace("−", "-")) for text in (old, new))
        # numbers below 1e-3 measure rounding or quadrature and may move; others by a last digit
        assert a == pytest.approx(b, rel=0.02, abs=0.011 if abs(a) >= 1e-3 else 1e-3)


@pytest.mark.parametrize("key", claims.keys())
def test_every_claim_is_tested(key):
    sources = [
        path.read_text(encoding="utf-8")
        for path in Path(__file__).parent.glob("test_paper_*.py")
        if path.name != Path(__file__).name
    ]
    assert any(f'"{key}"' in source for source in sources)


def test_unknown_claim_is_named():
    with pytest.raises(ValueError, match="no-such-claim"):
        claims.measure("no-such-claim")


def test_equations_are_all_placed():
    section = PRINTED.split("## Equation by equation")[1].split("## Errata")[0]
    placed = set()
    for line in section.splitlines():
        for first, last in re.findall(
            r"(\d+)(?:-(\d+))?", line.split("|")[1] if "|" in line else ""
        ):
            placed |= set(range(int(first), int(last or first) + 1))
    assert placed >= set(range(1, 38))


def test_the_example_of_the_page_runs():
    space = {}
    exec(PRINTED.split("```python")[1].split("```")[0], space)
    # F2/F1 depends on shear/closure alone: 0.476 at 2, as in the shear test at 10 MPa
    assert space["result"].F[1] / space["result"].F[0] == pytest.approx(0.476, abs=5e-4)
