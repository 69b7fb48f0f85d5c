"""Tables in the pages are those that the scripts of docs print."""

import re
import subprocess
import sys

import pytest
from pages import PAGES, ROOT, text

from dem_demo.scene import names

DOCS = ROOT / "docs"


def printed(*command):
    """What `python COMMAND` prints."""
    done = subprocess.run([sys.executable, *command], cwd=ROOT, check=True, text=True,
                          stdout=subprocess.PIPE)  # fmt: skip
    return done.stdout


def cells(table):
    """Cells of a table in Markdown, row by row."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def test_each_table_has_its_place_and_each_place_its_table():
    listed = [line.split("\t") for line in printed("docs/make_all.py", "--list").splitlines()]
    tables = {(line[0], f"docs/{line[1]}") for line in listed if line[1].endswith(".md")}
    marks = {
        (key, page) for page in PAGES for key in re.findall(r"<!-- end of (.+) -->", text(page))
    }
    assert tables == marks
    for line in listed:
        if len(line) > 2:
            assert (ROOT / line[2].split()[0]).exists()


def test_all_shipped_scenes_are_ablated():
    ablated = {path.stem.removeprefix("ablation-") for path in DOCS.glob("data/ablation-*.csv")}
    assert ablated == {name for name in names() if not name.endswith("-full")}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("key", "command"),
    [("ingredients", "docs/measure/ablations.py"), ("plane", "docs/measure/plane.py")],
)
def test_printed_tables_are_the_computed_ones(key, command):
    """From the files of docs/data ("ingredients") and from the law."""
    page = text("docs/accuracy.md").split(f"<!-- {key} -->\n")[1].split("<!-- end")[0]
    old, new = cells(page), cells(printed(command))
    assert len(old) == len(new)
    for rows in zip(old, new, strict=True):
        for a, b in zip(*rows, strict=True):
            rounding = b.endswith(("e-15", "e-16"))  # differs between machines
            assert a == b or (rounding and float(a) < 1e-14), rows
