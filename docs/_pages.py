"""Tables in the pages, the places where they go, and the CSV files in docs/data behind them."""

import csv
import fcntl
from pathlib import Path

HERE = Path(__file__).parent
DATA = HERE / "data"


def table(head, rows):
    """A table in Markdown, all columns but the first aligned to the right."""
    lines = [head, ["---", *["---:"] * (len(head) - 1)], *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in lines) + "\n"


def read(page, key):
    """What stands in the page between the marks `key` and `end of key`."""
    return _parts(page, key)[1]


def fill(page, key, text):
    """Put text between the marks `key` and `end of key` of the page."""
    with (HERE / page).open() as stream:
        fcntl.flock(stream, fcntl.LOCK_EX)  # others may fill other places
        before, _, after = _parts(page, key)
        (HERE / page).write_text(before + text.rstrip() + "\n" + after, encoding="utf-8")


def has(page, key):
    """Whether the page has these marks."""
    return f"<!-- {key} -->\n" in (HERE / page).read_text(encoding="utf-8")


def load(path):
    """Rows of a CSV file as dicts."""
    with path.open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def save(path, rows):
    """Write rows, dicts with the same keys, as CSV."""
    with path.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, rows[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def _parts(page, key):
    text = (HERE / page).read_text(encoding="utf-8")
    before, found, rest = text.partition(f"<!-- {key} -->\n")
    end = rest.index(f"<!-- end of {key} -->")
    return before + found, rest[:end], rest[end:]
