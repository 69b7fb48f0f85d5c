"""docs/make_all.py makes every table, figure and picture of the pages, and its commands exist."""

import ast
import re
import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PARTS = runpy.run_path(str(DOCS / "make_all.py"))["PARTS"]
PAGES = [ROOT / "README.md", *sorted(DOCS.glob("*.md"))]
SCRIPTS = sorted(
    path
    for folder in ("measure", "draw")
    for path in DOCS.glob(f"{folder}/*.py")
    if '__name__ == "__main__"' in path.read_text(encoding="utf-8")
)


def words_of(page):
    """The text of a page in one line."""
    return " ".join(page.read_text(encoding="utf-8").split())


def commands_of(script):
    """Names of the commands that a script of docs/measure passes to `run_command`."""
    for node in ast.walk(ast.parse(script.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "run_command":
            return [argument.id.replace("_", "-") for argument in node.args[1:]]
    return []


def test_every_command_of_every_script_is_a_part():
    commands = [part.command for part in PARTS.values()]
    for script in SCRIPTS:
        name = str(script.relative_to(ROOT))
        subcommands = commands_of(script)
        for subcommand in subcommands if len(subcommands) > 1 else [""]:
            beginning = f"{name} {subcommand}".strip()
            assert any(re.match(rf"{re.escape(beginning)}( |$)", one) for one in commands), (
                beginning
            )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_parts_that_a_page_names_exist(page):
    names = re.findall(r"docs/make_all\.py ([a-z][\w-]*)", words_of(page))
    assert set(names) <= {*PARTS, "timed"}


def test_every_mark_of_a_page_is_filled_by_a_part():
    for name, part in PARTS.items():
        if part.page:
            text = (DOCS / part.page).read_text(encoding="utf-8")
            assert text.index(f"<!-- {name} -->\n|") < text.index(f"|\n<!-- end of {name} -->")
    marks = {
        mark
        for page in PAGES
        for mark in re.findall(r"\|\n<!-- end of ([\w-]+) -->", page.read_text(encoding="utf-8"))
    }
    assert marks == {name for name, part in PARTS.items() if part.page}


def test_every_picture_of_the_docs_is_drawn_by_a_part():
    drawn = [picture for part in PARTS.values() for picture in part.pictures]
    assert sorted(drawn) == sorted(path.name for path in DOCS.glob("pictures/*"))


def test_pages_that_quote_a_part_name_it_or_its_command():
    for name, part in PARTS.items():
        for page in part.quoted_in.split():
            if page.endswith(".md"):
                text = words_of(DOCS / page)
                command = part.command.replace("-m ", "").partition(" --out")[0]
                assert f"docs/make_all.py {name}" in text or command in text, (name, page)


def test_a_table_replaces_the_text_between_its_marks(tmp_path, monkeypatch):
    module = runpy.run_path(str(DOCS / "make_all.py"))
    write_table = module["write_table"]
    monkeypatch.setitem(write_table.__globals__, "DOCS", tmp_path)
    page = tmp_path / "page.md"
    page.write_text("before\n<!-- x -->\n| old |\n<!-- end of x -->\nafter\n", encoding="utf-8")
    write_table("page.md", "x", module["first_table"]("law\n| new |\n| --- |\nend\n"))
    assert page.read_text() == "before\n<!-- x -->\n| new |\n| --- |\n<!-- end of x -->\nafter\n"
    with pytest.raises(ValueError, match="no mark <!-- y -->"):
        write_table("page.md", "y", "| new |")


def test_an_unknown_part_is_refused(monkeypatch):
    module = runpy.run_path(str(DOCS / "make_all.py"))
    monkeypatch.setattr(sys, "argv", ["make_all.py", "nope"])
    with pytest.raises(SystemExit, match="no part nope; --list prints all"):
        module["main"]()
