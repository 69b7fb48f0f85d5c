"""Numbers on README and the pages are those that their commands printed.

docs/make_all.py stores what each command printed (docs/data/printed). A table between marks is the
table there. A paragraph or table that names commands has numbers of their stored outputs or of
their sources (settings, bounds of tests), rounded to the digits on the page. Which numbers these
are follows from the pages alone. Slow tests run the commands that take up to `QUICK` again.
"""

import re
import runpy
from functools import cache
from pathlib import Path

import pytest
from output_faults import NOT_PROSE, NUMBER, pages, printed_parts

ROOT = Path(__file__).parents[2]
MAKE_ALL = runpy.run_path(str(ROOT / "docs" / "make_all.py"))
PARTS = MAKE_ALL["PARTS"]
PRINTED = ROOT / "docs" / "data" / "printed"
SCALES = 1.0, 100.0  # as it is, and in per cent
QUICK = 60  # s of processor time
ROUNDING = 1e-12  # of numbers that would be zero without rounding
SLACK = 1e-6  # relative, of half a unit of the last digit


def stored(name):
    """The stored output of a part, empty if it has not been stored."""
    path = PRINTED / f"{name}.txt"
    return path.read_text(encoding="utf-8") if path.exists() else ""


def marked_tables():
    """Page, name and text of each table between marks."""
    for page in pages():
        text = page.read_text(encoding="utf-8")
        for match in re.finditer(r"<!-- ([\w-]+) -->\n(.*?)<!-- end of \1 -->", text, re.DOTALL):
            yield page, match[1], match[2].strip()


def paragraphs_with_commands():
    """Paragraphs and tables outside marks that name commands: place, text, parts, files of tests.

    A table also has the commands of the paragraph above it.
    """
    for page in pages():
        text = page.read_text(encoding="utf-8")
        for start, end in printed_parts(text):
            if text[:start].endswith("-->\n"):
                continue
            own = text[start:end]
            above = text[:start].rstrip().rpartition("\n\n")[2] if own.startswith("|") else ""
            words = " ".join((above + own).split())
            parts = [name for name in re.findall(r"make_all\.py ([\w-]+)", words) if name in PARTS]
            tests = re.findall(r"tests/[\w/]+\.py", words)
            if parts or tests:
                line = text[:start].count("\n") + 1
                yield pytest.param(own, parts, tests, id=f"{page.name}:{line}")


@cache
def numbers_of(text):
    """Values of all numbers in a text; digits in groups of three are one number."""
    found = re.findall(r"\d+(?:[_ ]\d{3})*(?:\.\d+)?(?:e[+-]?\d+)?", text)
    found += re.findall(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?", text)
    return frozenset(float(number.replace("_", "").replace(" ", "")) for number in found)


def has_number(values, number, exponent):
    """Whether one of the values, rounded to the digits of the number as written, is the number."""
    unit = 10.0 ** (int(exponent[1:] or 0) - len(number.partition(".")[2]))
    value = float(number + exponent)
    return any(
        abs(scale * one - value) <= (0.5 + SLACK) * unit for one in values for scale in SCALES
    )


PARAGRAPHS = [*paragraphs_with_commands()]
MARKED = [pytest.param(*one, id=one[1]) for one in marked_tables() if one[1] in PARTS]


@pytest.mark.parametrize(("page", "name", "table"), MARKED)
def test_tables_are_as_printed(page, name, table):
    assert table == MAKE_ALL["first_table"](stored(name))


@pytest.mark.parametrize(("text", "parts", "tests"), PARAGRAPHS)
def test_numbers_are_of_the_outputs_of_their_commands(text, parts, tests):
    missing = [name for name in parts if not stored(name)]
    if missing:
        pytest.skip(f"not stored yet: python docs/make_all.py {' '.join(missing)}")
    sources = [stored(name) + PARTS[name].command for name in parts]
    scripts = [PARTS[name].command.split()[0] for name in parts]
    files = [*tests, *(script for script in scripts if script.startswith("docs/"))]
    sources += [(ROOT / file).read_text(encoding="utf-8") for file in files]
    values = numbers_of("\n".join(sources))
    prose = NOT_PROSE.sub(lambda match: " " * len(match[0]), text)
    # Digits in groups of three, and small whole numbers (two laws), which are words
    prose = re.sub(r"(?<=\d) (?=\d{3}\b)", "_", prose)
    absent = []
    for match in NUMBER.finditer(prose):
        exponent = re.match(r"(?:e-?\d+)?", prose[match.end() :])[0]
        is_word = len(match[0]) == 1 and not exponent
        if not is_word and not has_number(values, match[0], exponent):
            absent.append(match[0] + exponent)
    assert absent == []


QUICK_PARTS = [
    name
    for name, part in PARTS.items()
    if (took := re.match(r".*# (\d+) s of processor time\n", stored(name)))
    and int(took[1]) <= QUICK
    and not part.is_timed
    and "FOLDER" not in part.command
]


@pytest.mark.slow
@pytest.mark.parametrize("name", QUICK_PARTS)
def test_commands_print_what_is_stored(name, tmp_path):
    """Numbers may differ by one unit of the last digit printed, and rounding errors entirely."""
    expected = stored(name).partition("\n")[2].strip()
    actual = MAKE_ALL["run"](PARTS[name], str(tmp_path))[0].strip()
    number = r"(?<![\w.])\d+(?:\.\d+)?(?:e[+-]?\d+)?"
    assert re.sub(number, "0", actual) == re.sub(number, "0", expected)
    for one, other in zip(re.findall(number, actual), re.findall(number, expected), strict=True):
        digits, _, exponent = other.partition("e")
        unit = 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
        assert float(one) == pytest.approx(float(other), rel=0, abs=max(1.01 * unit, ROUNDING))
