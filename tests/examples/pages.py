"""The pages of the documentation, and what of them can be run."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = {str(p.relative_to(ROOT)): p for p in [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md"))]}


def text(page):
    return PAGES[page].read_text(encoding="utf-8")


def blocks(page, *languages):
    """Fenced blocks of a page in these languages."""
    found = re.findall(r"^```(\w*)\n(.*?)^```$", text(page), re.DOTALL | re.MULTILINE)
    return [block for language, block in found if language in languages]


def commands(page):
    """Command lines of a page, fenced or indented, as typed in an activated environment."""
    shell = "\n".join(blocks(page, "bash", "console", ""))
    indented = re.findall(r"^    ((?:jointlaw|python) .*)$", text(page), re.MULTILINE)
    lines = [line.split("  #")[0].strip() for line in [*shell.splitlines(), *indented]]
    lines = [part.strip() for line in lines for part in line.split("&&")]
    return [line.replace(".venv/bin/", "") for line in lines]
