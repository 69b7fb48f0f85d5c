"""Numbers in text files of laboratories: separators, decimal marks, marks between thousands.

- Lines that are empty or begin with # are skipped.
- The separator is a semicolon, tab or comma: the first of these in the first line; else blanks.
- The decimal mark is what a number shows: 0,25 and 1.201,5 show a comma, 0.25 and 1,201.5 a point.
  The last two also show that the other mark stands between thousands.
- 1,201 and 1.201 show nothing. Such a number is read if others show what its mark is, else refused.
"""

import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

DECIMAL = {"comma": ",", "point": "."}  # what the option --decimal may say
AMBIGUOUS = (
    "may have a mark between its thousands: say what the decimal mark is, --decimal comma or "
    "--decimal point"
)
SWAPPED = str.maketrans(",.", ".,")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?")  # where a point is decimal
EITHER = re.compile(r"[-+−]?[1-9]\d{0,2}[.,]\d{3}")
# m: the decimal mark; g: the mark between thousands
_SHOWS = r"""[-+−]?(?: 0?[m]\d+ | \d{4,}[m]\d* | \d+[m](?:\d{0,2}|\d{4,}) | \d+[m]\d+(?=e)
    | [1-9]\d{0,2}(?:(?:[g]\d{3})+[m]\d* | (?:[g]\d{3}){2,}) ) (?:e[-+]?\d+)?"""
_SHOWN = {
    mark: re.compile(_SHOWS.replace("[m]", f"[{mark}]").replace("[g]", f"[{other}]"), re.I | re.X)
    for mark, other in (",.", ".,")
}


class Marks(NamedTuple):
    """The decimal mark of a file, None where nothing shows it; whether thousands are marked."""

    decimal: str | None
    grouped: bool

    def value(self, cell: str) -> float:
        """The number in a cell; NaN for any other text, and for a number of two meanings."""
        text = cell.replace("−", "-")
        if self.decimal is None and EITHER.fullmatch(text):
            return np.nan
        text = text.translate(SWAPPED) if self.decimal == "," else text
        if self.grouped and _THOUSANDS.fullmatch(text):
            text = text.replace(",", "")
        try:
            return float(text)
        except ValueError:
            return np.nan


def marks_of(cells: Iterable[str], decimal: str | None = None) -> Marks:
    """The marks that these cells show, or those of `decimal`, "comma" or "point"."""
    if decimal is not None:
        return Marks(DECIMAL[decimal], True)
    seen = set(cells)
    shown = [mark for mark, of in _SHOWN.items() if any(of.fullmatch(cell) for cell in seen)]
    if not shown:
        return Marks(None, False)
    other = "." if shown[0] == "," else ","
    return Marks(shown[0], any(other in cell and _SHOWN[shown[0]].fullmatch(cell) for cell in seen))


def lines_of(path: Path) -> dict[int, str]:
    """The lines of a text file in UTF-8 that hold something, by their number.

    Raises ValueError naming file and remedy.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: cannot be read ({error}); give a CSV file in UTF-8") from None
    return {
        number: line
        for number, line in enumerate(text.replace("\0", "").splitlines(), 1)
        if line.strip(" \t,;") and not line.lstrip().startswith("#")
    }


def separator(line: str) -> str | None:
    """What separates the columns in this line: ; or a tab or a comma; None for blanks."""
    return next((mark for mark in ";\t," if mark in line), None)


def cells_of(lines: Sequence[str], mark: str | None) -> list[list[str]]:
    """Cells of all lines, without empty ones at the end; blanks before a unit separate nothing."""
    if mark is None:
        return [re.split(r"\s+(?![\[(/])", line.strip()) for line in lines]
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
    return [row[: max((k + 1 for k, cell in enumerate(row) if cell), default=0)] for row in rows]
