"""Numbers in text files of laboratories: separators, decimal marks and thousands marks.

- Encoding: UTF-16 if the file begins with its byte order mark, else UTF-8, else Latin-1 (Windows).
- Lines that begin with #, or have no letter or digit, are skipped; a line such as sep=; names the
  separator.
- Otherwise the separator is a semicolon, tab or comma, the first of these in the line of names;
  or blanks.
- The decimal mark is the one that any number shows: 0,25 and 1.201,5 show a comma, 0.25 and 1,201.5
  a point. 1.201,5 and 1,201.5 also show that the other mark separates thousands.
- Apostrophes and (hard) blanks between thousands, as in 1'201.5 and 1 201,5, are removed.
- 1,201 and 1.201 are ambiguous. They are read if other numbers show the decimal mark, else refused.
"""

import csv
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

DECIMAL_MARKS = {"comma": ",", "point": "."}  # values of the option --decimal
AMBIGUITY_REMEDY = (
    "may have a mark between its thousands: say what the decimal mark is, --decimal comma or "
    "--decimal point"
)
SWAP_MARKS = str.maketrans(",.", ".,")
AMBIGUOUS_NUMBER = re.compile(r"[-+−]?[1-9]\d{0,2}[.,]\d{3}")
_FORTRAN_EXPONENT = re.compile(r"(?<=[\d.])[dD](?=[-+]?\d+$)")
_GROUPED = re.compile(r"(?<=\d)['’ \u00a0\u202f\u2009](?=\d{3}(?!\d))")
_NUMBER = re.compile(r"[-+−]?[\d.'’]*\d[.]?(?:[eEdD][-+]?\d+)?")  # between commas and blanks
_SEPARATORS = ";\t,"
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?")  # where a point is decimal
# m: the decimal mark; g: the mark between thousands
_SHOWS = r"""[-+−]?(?: 0?[m]\d+ | \d{4,}[m]\d* | \d+[m](?:\d{0,2}|\d{4,}) | \d+[m]\d+(?=e)
    | [1-9]\d{0,2}(?:(?:[g]\d{3})+[m]\d* | (?:[g]\d{3}){2,}) ) (?:e[-+]?\d+)?"""
_SHOWS_MARK = {
    mark: re.compile(_SHOWS.replace("[m]", f"[{mark}]").replace("[g]", f"[{group}]"), re.I | re.X)
    for mark, group in (",.", ".,")
}


class NumberFormat(NamedTuple):
    """Decimal mark of a file, None where no number shows it; whether thousands may be marked."""

    decimal: str | None
    grouped: bool

    def value(self, cell: str) -> float:
        """The number in a cell of this format.

        NaN for a cell that is no number, and for one such as 1,234 that may have thousands or
        decimals while the decimal mark is unknown.
        """
        text = _GROUPED.sub("", cell.replace("−", "-"))
        if self.decimal is None and AMBIGUOUS_NUMBER.fullmatch(text):
            return np.nan
        text = text.translate(SWAP_MARKS) if self.decimal == "," else text
        text = _FORTRAN_EXPONENT.sub("e", text)
        if self.grouped and _THOUSANDS.fullmatch(text):
            text = text.replace(",", "")
        try:
            return float(text)
        except ValueError:
            return np.nan


def detect_format(cells: Iterable[str], decimal: str | None = None) -> NumberFormat:
    """The decimal mark and the grouping of thousands that the numbers in these cells use.

    A mark is detected where a cell has one that cannot separate thousands; the point takes
    precedence where both appear as decimal marks. The format has the decimal mark None where no
    cell decides. decimal: "comma" or "point" overrides detection.
    """
    if decimal is not None:
        return NumberFormat(DECIMAL_MARKS[decimal], True)
    texts = {_GROUPED.sub("", cell) for cell in cells}
    candidates = [
        mark
        for mark, pattern in _SHOWS_MARK.items()
        if any(pattern.fullmatch(text) for text in texts)
    ]
    if not candidates:
        return NumberFormat(None, False)
    mark = candidates[0]
    group = "." if mark == "," else ","
    grouped = any(group in text and _SHOWS_MARK[mark].fullmatch(text) for text in texts)
    return NumberFormat(mark, grouped)


def read_lines(path: Path) -> dict[int, str]:
    """The lines of a text file by their number, without empty lines and comments.

    Raises ValueError naming file and remedy.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error}); give a CSV file") from None
    if data.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):  # .ods and others, .xls
        raise ValueError(f"{path}: is a spreadsheet, not text; save it as CSV, or as .xlsx")
    is_utf16 = data[:2] in (b"\xff\xfe", b"\xfe\xff")
    try:
        text = data.decode("utf-16" if is_utf16 else "utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    return {
        number: line
        for number, line in enumerate(text.replace("\0", "").splitlines(), 1)
        if any(map(str.isalnum, line)) and not line.lstrip().startswith("#")
    }


def find_separator(line: str) -> str | None:
    """The separator of the columns in this line: ; or a tab or a comma; None for blanks."""
    return next((mark for mark in _SEPARATORS if mark in line), None)


def find_table_separator(lines: dict[int, str]) -> str | None:
    """The separator of the columns of a table that has lines of text above it.

    A line `sep=;` decides, and is removed from `lines`. Else the separator is that of the line of
    names, the last line of letters above the first two rows of numbers, or of the line before it,
    if that is a row of units. None where neither has one: then blanks separate.
    """
    for number, line in lines.items():
        if line.lower().startswith("sep="):
            del lines[number]
            return line[4:5]
    texts = list(lines.values())
    # the names are in the last line of letters above the first two lines that are mostly numbers
    first = next((k for k in range(len(texts)) if all(map(_is_numeric, texts[k : k + 2]))), 0)
    above = [
        line for line in texts[:first] if re.search(r"[^\W\d_]", line) and not _is_numeric(line)
    ]
    # a line of units may follow the names
    marks = map(find_separator, reversed(above[-2:]))
    return next((mark for mark in marks if mark), None)


def _is_numeric(line: str) -> bool:
    """Whether more than half of the cells of a line are numbers."""
    cells = [cell for cell in re.split(r"[;,\s\"]+", line) if cell]
    numbers = sum(_NUMBER.fullmatch(cell) is not None for cell in cells)
    return 2 * numbers > len(cells)


def split_cells(lines: Sequence[str], separator: str | None) -> list[list[str]]:
    """Cells of all lines, without empty cells at the end; a blank before a unit does not split."""
    if separator is None:
        return [re.split(r"[ \t]+(?![\[(/])", line.strip()) for line in lines]
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=separator)]
    return [row[: max((k + 1 for k, cell in enumerate(row) if cell), default=0)] for row in rows]
