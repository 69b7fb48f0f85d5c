"""Tables in the pages are those that make_accuracy.py and make_extremes.py in docs compute."""

import re
import sys
from pathlib import Path

import pytest

from dem_demo.scene import names

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def made():
    """docs/make_accuracy.py, and with it the other modules of that folder."""
    sys.path.insert(0, str(DOCS))
    try:
        import make_accuracy

        yield make_accuracy
    finally:
        sys.path.remove(str(DOCS))


def cells(table):
    """Cells of a table in Markdown, row by row."""
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def test_each_part_has_its_place_and_each_place_its_part(made):
    import make_all

    marks = [
        key
        for page in made.PAGES
        for key in re.findall(r"<!-- end of (.+) -->", (DOCS / page).read_text(encoding="utf-8"))
    ]
    assert sorted(marks) == sorted(made.PARTS)
    for key, (page, _) in (make_all.PRINTED | make_all.PRINTED_TIMES).items():
        assert made.has(page, key)


def test_all_shipped_scenes_are_ablated(made):
    assert set(made.SCENES) == {name for name in names() if not name.endswith("-full")}


@pytest.mark.parametrize("key", ["ingredients", "slip", "plane"])
def test_printed_tables_are_the_computed_ones(made, key):
    """From the files of docs/data ("ingredients") and from the law."""
    from _pages import read

    page = next(page for page in made.PAGES if made.has(page, key))
    printed, computed = cells(read(page, key)), cells(made.PARTS[key]())
    assert len(printed) == len(computed)
    for old, new in zip(printed, computed, strict=True):
        for a, b in zip(old, new, strict=True):
            rounding = b.endswith(("e-15", "e-16"))  # differs between machines
            assert a == b or (rounding and float(a) < 1e-14), (old, new)


def test_the_page_on_extremes_has_the_worst_of_its_file(made):
    import make_extremes
    from _pages import read, table

    text = table(["check", "worst", "at"], make_extremes.worst_rows())
    assert read("extremes.md", "matrix") == text
