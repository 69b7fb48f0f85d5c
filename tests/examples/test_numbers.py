"""Numbers on README and the pages are those that their commands printed.

docs/make_all.py stores what each command printed (docs/data/printed). A table between marks is the
table there. A paragraph that names commands, or a row of a table, has numbers of their stored
outputs or of the parts of their sources that they run (settings, bounds of tests), rounded to the
digits on the page. README has numbers of a table of validation.md, which names their commands, or
of its own code. Which numbers these are follows from the pages alone. Slow tests run the commands
that take up to `QUICK` again.
"""

import ast
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
README = ROOT / "README.md"
SCALES = {  # commands print SI units and fractions, too
    "%": 100.0, "per cent": 100.0, "mm": 1e3, "um": 1e6, "kPa": 1e-3, "MPa": 1e-6, "GPa": 1e-9,
}  # fmt: skip
# Other numbers may stand between a number and the unit that they share
UNIT_BELOW = re.compile(rf"(?:[\d.,\s~-]|and|to|or)*({'|'.join(SCALES)})(?!\w)")
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
    """Paragraphs, and rows of tables, outside marks that name commands: text and their sources.

    A row without a command has the commands of the paragraph above its table.
    """
    for page in pages():
        if page == README:
            continue
        text = page.read_text(encoding="utf-8")
        for start, end in printed_parts(text):
            if text[:start].endswith("-->\n"):
                continue
            own = text[start:end]
            line = text[:start].count("\n") + 1
            if not own.startswith("|"):
                yield from with_sources(own, own, f"{page.name}:{line}")
                continue
            above = text[:start].rstrip().rpartition("\n\n")[2]
            for i, row in enumerate(own.splitlines()):
                yield from with_sources(row, row, f"{page.name}:{line + i}", otherwise=above)


def with_sources(own, words, place, otherwise=""):
    """A parameter of a test: text, names of parts, and tests, that its commands name, if any."""
    for where in (words, otherwise):
        commands = [" ".join(span.split()) for span in re.findall(r"`([^`]*)`", where)]
        parts = [name for command in commands for name in parts_of(command)]
        tests = [test for command in commands for test in selected_tests(command)]
        if parts or tests:
            yield pytest.param(own, parts, tests, id=place)
            return


def parts_of(command):
    """Names of the parts of docs/make_all.py that a command makes, or that run it."""
    if named := re.fullmatch(r"python docs/make_all\.py ([\w -]+)", command):
        return [name for name in named[1].split() if name in PARTS]
    command = command.replace("DIR", "FOLDER").removeprefix("python ")
    return [name for name, part in PARTS.items() if part.command == command]


def selected_tests(command):
    """Pairs of a file of tests that a command names and its words of `-k`."""
    selected = re.search(r'-k (?:"([^"]*)"|(\w+))', command)
    expression = selected and (selected[1] or selected[2])
    words = [word for word in (expression or "").split() if word not in ("and", "or", "not")]
    return [(file, tuple(words)) for file in re.findall(r"tests/[\w/]+\.py", command)]


@cache
def source_run_by(file, words):
    """Source of the functions that have one of the words in their name (all if none has), and of
    everything of the module that they name, with the comments above."""
    text = (ROOT / file).read_text(encoding="utf-8")
    lines = text.splitlines()
    definitions = {}  # lines, and the names in them, by name
    end = 0
    functions = []
    for node in ast.parse(text).body:
        source = "\n".join(lines[end : node.end_lineno])
        end = node.end_lineno
        names = [one for one in ast.walk(node) if isinstance(one, ast.Name)]
        used = {one.id for one in names}
        if isinstance(node, ast.FunctionDef):
            functions.append(node.name)
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            definitions[node.name] = source, used
        elif isinstance(node, ast.Assign):
            assigned = [one.id for one in names if isinstance(one.ctx, ast.Store)]
            definitions |= dict.fromkeys(assigned, (source, used))
    queue = [name for name in functions if any(word in name for word in words)] or [*definitions]
    found = {}
    while queue:
        name = queue.pop()
        if name in definitions and name not in found:
            found[name], used = definitions[name]
            queue += used
    return "\n".join(found.values())


@cache
def source_of_part(name):
    """Source of the command of a part, as far as its subcommand runs it, and of the tests that it
    runs."""
    script, *words = PARTS[name].command.split()
    if not script.startswith("docs/"):
        return ""
    subcommand = words[0].replace("-", "_") if words else ""
    source = source_run_by(script, (subcommand,) if subcommand.islower() else ())
    names = re.findall(r'"(\w+\.py)\b', source)
    files = [
        file for name in names if (ROOT / (file := f"tests/verification/test_{name}")).exists()
    ]
    return "\n".join([source, *(source_run_by(file, ()) for file in files)])


@cache
def numbers_of(text):
    """Values of all numbers in a text; digits in groups of three are one number."""
    found = re.findall(r"\d+(?:[_ ]\d{3})*(?:\.\d+)?(?:e[+-]?\d+)?", text)
    found += re.findall(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?", text)
    return frozenset(float(number.replace("_", "").replace(" ", "")) for number in found)


def has_number(values, number, exponent, scales, rounding=0.5):
    """Whether one of the values, by one of the scales, is the number.

    rounding: largest difference in units of the last digit of the number.
    """
    unit = 10.0 ** (int(exponent[1:] or 0) - len(number.partition(".")[2]))
    value = float(number + exponent)
    return any(
        abs(scale * one - value) <= (rounding + SLACK) * unit for one in values for scale in scales
    )


def numbers_in_prose(text):
    """Numbers of a text, without code and formulas: digits, exponent, and the values in the output
    of a command over the number.

    Small whole numbers (two laws) are words.
    """
    prose = NOT_PROSE.sub(lambda match: " " * len(match[0]), text)
    prose = re.sub(r"(?<=\d) (?=\d{3}\b)", "_", prose)  # digits in groups of three
    for match in NUMBER.finditer(prose):
        exponent = re.match(r"(?:e-?\d+)?", prose[match.end() :])[0]
        if len(match[0]) > 1 or exponent:
            unit = UNIT_BELOW.match(prose[match.end() + len(exponent) :])
            yield match[0], exponent, (1.0, SCALES[unit[1]]) if unit else (1.0,)


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
    printed = numbers_of("\n".join(stored(name) for name in parts))
    sources = [PARTS[name].command + source_of_part(name) for name in parts]
    settings = numbers_of("\n".join(sources + [source_run_by(*test) for test in tests]))
    absent = [
        number + exponent
        for number, exponent, scales in numbers_in_prose(text)
        if not has_number(printed, number, exponent, scales)
        and not has_number(settings, number, exponent, scales, rounding=0.0)
    ]
    assert absent == []


def test_numbers_of_the_readme_have_a_command():
    """They are in a table of validation.md, whose rows are compared with their commands.

    Quantities of its own code, the oldest Python and the citation need none.
    """
    text = README.read_text(encoding="utf-8")
    code = re.findall(r"^```.*?^```$", text, re.DOTALL | re.MULTILINE)
    validation = (ROOT / "docs" / "validation.md").read_text(encoding="utf-8")
    table = validation.split("## Numbers of the README")[1].split("\n## ")[0]
    rows = [line for line in table.splitlines() if line.startswith("|")]
    named = " ".join(row.split("|")[1] for row in rows)
    settings = re.findall(r"\d+(?:\.\d+)?(?=[a-zA-Z])", "\n".join(code))
    others = (ROOT / "pyproject.toml").read_text() + (ROOT / "CITATION.cff").read_text()
    others = re.findall(r"^requires-python.*$|^ +(?:volume|year):.*$", others, re.MULTILINE)
    values = numbers_of("\n".join([*settings, named, *others]))
    for start, end in printed_parts(text):
        for number, exponent, _ in numbers_in_prose(text[start:end]):
            assert float(number + exponent) in values, number + exponent


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
