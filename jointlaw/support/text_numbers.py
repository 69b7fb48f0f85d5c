"""Numbers in text files of laboratories: separators, decimal marks, marks between thousands.

- A file is in UTF-8, in UTF-16 if it begins so, or else in Latin-1 (Windows).
- Lines that are empty or begin with # are skipped; a line such as sep=; names the separator.
- Else this is a semicolon, tab or comma: the first of these in the line of names; or blanks.
- The decimal mark is what a number shows: 0,25 and 1.201,5 show a comma, 0.25 and 1,201.5 a point.
  The last two also show that the other mark stands between thousands.
- Apostrophes and (hard) blanks between thousands, as in 1'201.5 and 1 201,5, are left out.
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
_GROUPED = re.compile(r"(?<=\d)['’ \u00a0\u202f\u2009](?=\d{3}(?!\d))")
_NUMBER = re.compile(r"[-+−]?[\d.'’]*\d[.]?(?:[eE][-+]?\d+)?")  # between commas and blanks
_SEPARATORS = ";\t,"
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
        text = _GROUPED.sub("", cell.replace("−", "-"))
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
    seen = {_GROUPED.sub("", cell) for cell in cells}
    shown = [mark for mark, of in _SHOWN.items() if any(of.fullmatch(cell) for cell in seen)]
    if not shown:
        return Marks(None, False)
    other = "." if shown[0] == "," else ","
    return Marks(shown[0], any(other in cell and _SHOWN[shown[0]].fullmatch(cell) for cell in seen))


def lines_of(path: Path) -> dict[int, str]:
    """The lines of a text file that hold something, by their number.

    Raises ValueError naming file and remedy.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error}); give a CSV file") from None
    if data.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):  # .ods and others, .xls
        raise ValueError(f"{path}: is no text but a spreadsheet; save it as CSV, or as .xlsx")
    wide = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if wide else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return {
        number: line
        for number, line in enumerate(text.replace("\0", "").splitlines(), 1)
        if line.strip(" \t,;") and not line.lstrip().startswith("#")
    }


def separator(line: str) -> str | None:
    """What separates the columns in this line: ; or a tab or a comma; None for blanks."""
    return next((mark for mark in _SEPARATORS if mark in line), None)


def table_separator(lines: dict[int, str]) -> str | None:
    """The separator of a table with lines of text above it; a line sep=; is taken out."""
    for number, line in lines.items():
        if line.lower().startswith("sep="):
            del lines[number]
            return line[4:5]
    texts = list(lines.values())
    # the names are in the last line of letters above the first two lines that hold numbers most
    first = next((k for k in range(len(texts)) if all(map(_numeric, texts[k : k + 2]))), 0)
    above = [line for line in texts[:first] if re.search(r"[^\W\d_]", line) and not _numeric(line)]
    marks = map(separator, reversed(above[-2:]))  # below the names may stand a line of units
    return next((mark for mark in marks if mark), None)


def _numeric(line: str) -> bool:
    """Whether more cells of a line are numbers than not."""
    cells = [cell for cell in re.split(r"[;,\s\"]+", line) if cell]
    numbers = sum(_NUMBER.fullmatch(cell) is not None for cell in cells)
    return 2 * numbers > len(cells)


def cells_of(lines: Sequence[str], mark: str | None) -> list[list[str]]:
    """Cells of all lines, without empty ones at the end; blanks before a unit separate nothing."""
    if mark is None:
        return [re.split(r"[ \t]+(?![\[(/])", line.strip()) for line in lines]
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
    return [row[: max((k + 1 for k, cell in enumerate(row) if cell), default=0)] for row in rows]
