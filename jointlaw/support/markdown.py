"""Tables in the reports of commands (Markdown)."""

from collections.abc import Iterable


def table(head: str, rows: Iterable[str]) -> list[str]:
    """The lines of a table; `head` and rows have | between their cells."""
    rule = "|".join(["---"] * (1 + head.count("|")))
    return [f"| {head} |", f"|{rule}|", *(f"| {row} |" for row in rows)]
