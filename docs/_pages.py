"""Tables in Markdown, and the places in the pages where they go."""

from pathlib import Path

HERE = Path(__file__).parent


def table(head, rows):
    """A table in Markdown, all columns but the first aligned to the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in lines) + "\n"


def read(page, key):
    """What stands in the page between the marks `key` and `end of key`."""
    return _parts(page, key)[1]


def fill(page, key, text):
    """Put text between the marks `key` and `end of key` of the page."""
    before, _, after = _parts(page, key)
    (HERE / page).write_text(before + text.rstrip() + "\n" + after, encoding="utf-8")


def has(page, key):
    """Whether the page has these marks."""
    return f"<!-- {key} -->\n" in (HERE / page).read_text(encoding="utf-8")


def _parts(page, key):
    text = (HERE / page).read_text(encoding="utf-8")
    before, found, rest = text.partition(f"<!-- {key} -->\n")
    end = rest.index(f"<!-- end of {key} -->")
    return before + found, rest[:end], rest[end:]
