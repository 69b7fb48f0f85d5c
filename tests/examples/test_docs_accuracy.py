"""docs/make_accuracy.py writes the tables that the pages on accuracy print."""

import re
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def made():
    pytest.importorskip("numba")  # the benchmarks time the compiled kernel
    sys.path.insert(0, str(DOCS))
    try:
        import make_accuracy

        yield make_accuracy
    finally:
        sys.path.remove(str(DOCS))


def test_each_part_has_its_place_and_each_place_its_part(made):
    marks = [
        key
        for page in made.PAGES
        for key in re.findall(r"<!-- end of (.+) -->", (DOCS / page).read_text(encoding="utf-8"))
    ]
    assert sorted(marks) == sorted(made.PARTS)


def test_all_short_scenes_are_ablated(made):
    shipped = {name for name in made.names() if not name.endswith("-full")}
    assert set(made.SCENES) == shipped


@pytest.mark.parametrize("key", ["ingredients", "slip", "plane"])
def test_printed_tables_are_the_computed_ones(made, key):
    from _ablations import rows_of  # on the path of `made`

    page = next(page for page in made.PAGES if made.has(page, key))
    printed, computed = (rows_of(t) for t in (made.read(page, key), made.PARTS[key]()))
    assert len(printed) == len(computed)
    for old, new in zip(printed, computed, strict=True):
        for title, value in new.items():
            if value.endswith(("e-15", "e-16")):
                assert float(old[title]) < 1e-14, (old, title)  # rounding, as the computed one
            else:
                assert old[title] == value, (old, title)


def test_changes_are_gathered_over_scenes(made):
    head = "| without | slab, slips at (deg) | friction (kJ) | end, apart (mm) | steps | time |\n"
    rule = "| --- | ---: | ---: | ---: | ---: | ---: |\n"
    first = "| whole scene | 40 | 200 | - | 5 | 1.00 |\n| c = 0 (1) | -1.5 | +20 | 3 | 5 | 0.90 |\n"
    other = "| whole scene | 30 | 100 | - | 5 | 1.00 |\n| c = 0 | none | -40 | 700.4 | 5 | 1.10 |\n"
    tables = {"one": head + rule + first + "\n(1) a note\n", "two": head + rule + other}
    found = made.by_ingredient(tables)
    assert found == [["c = 0", "2", "1.50", "40%", "3 to 700", "1", "0.90 to 1.10"]]


def test_rules_for_nodes_are_measured_against_each_other(made):
    from _ablations import rows_of

    law = made.jl.presets.load("westerly-rough")
    laws = made.nodes.Laws([(law, made.nodes.standard_suite(law))], [])
    now, staggered = rows_of(laws.azimuths())
    pairs = {t: [float(row[t].split()[0]) for row in (now, staggered)] for t in list(now)[1:]}
    assert all(a == b for t, (a, b) in pairs.items() if t.startswith("1 x"))  # one ring: no other
    assert any(a != b for a, b in pairs.values())
    assert all(b < 1.6 * a for a, b in pairs.values())
