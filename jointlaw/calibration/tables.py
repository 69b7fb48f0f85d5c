"""Tables in the files of laboratories, text and spreadsheets: their columns and odd rows.

- Names stand in one line, units in it or in the next one: "tau [kPa]", "tau (kPa)", "tau /kPa",
  "tau in kPa", "tau_kPa". A column without a unit is asked for, never guessed.
- Lines of text above the names are skipped. A sheet holds several tests if the names come again,
  beside the first ones or below them; a workbook holds those of all its sheets.
- Separators, decimal marks and marks between thousands: `jointlaw.support.text_numbers`, also for
  cells of text in a workbook.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import permutations
from pathlib import Path
from typing import Any, NamedTuple
from zipfile import ZipFile

import numpy as np
from numpy.typing import NDArray

from ..support import units
from ..support.checks import Array
from ..support.text_numbers import (
    AMBIGUITY_REMEDY,
    AMBIGUOUS_NUMBER,
    NumberFormat,
    detect_format,
    find_table_separator,
    read_lines,
    split_cells,
)

_UNIT = r"(?:[numkcMGµμ]?(?:Pa|m)|N/mm[2²]|[kM]N/m[2²]|bar|[kmg]pa|[kM]N)"
_ROW_UNIT = re.compile(rf"[\[(].*[\])]|/?\s*{_UNIT}|N|-?")
_TITLE = re.compile(
    rf"(.*?)(?:\s*[\[(]\s*([^\])]*?)\s*[\])]|(?:\s*/\s*|\s+in\s+|,\s*|_|\s+)({_UNIT}))\s*"
)
_LETTERS = re.compile(r"[^\W\d_]")
# what loggers write where they read nothing, or more than they can
_SENTINEL = re.compile(r"-99\.0|-?(9{3,}(\.0|\.9+|\.25)|(3276[78]|65535)\.0)")
_WORD = re.compile(r"(?i)(?!nan|none|null).*[^\W\d_]{3}.*")
# a formula in a sheet of a workbook, saved by a program that cannot compute
_NO_VALUE = re.compile(
    rb'<c(?![^>]*t="str")[^>]*><f[^>]*(?:/>|>[^<]*</f>)\s*(?:<v\s*/>|<v></v>)?\s*</c>'
)
APART = 0.1  # of the range of all others: how far from them such a number stands
JUMP, STILL = 0.2, 0.1  # of the range; of the jump, what the other column is off by
RUN = 5  # equal values that may jump together, a quarter of the rows at most
Rows = dict[int, list[str]]


class Column(NamedTuple):
    """A column: its title as written, its name and unit ("" if it gives none).

    values: (n,), NaN where a cell is empty; wrong: what is wrong with the first cell that is
    neither empty nor a number, with its line; odd: lines whose value stands for none, such as -999.
    """

    title: str
    name: str
    unit: str
    values: Array
    wrong: str
    odd: dict[int, str]


class Asked(NamedTuple):
    """A quantity to look for: what it is, its SI unit, names it goes by, the option that names it.

    The names are tried in their order, in small letters with _ for all that is no letter or digit.
    Names in `vague` count only where no other column has a unit of the same kind.
    """

    what: str
    base: str
    names: tuple[str, ...]
    option: str
    vague: tuple[str, ...] = ()


class Table(NamedTuple):
    """One test of a file: what to call it, its columns, the line (or row) of each of their values,
    lines that are no measurement, with the reason, and notes on what else is in the file.
    """

    name: str
    columns: list[Column]
    lines: list[int]
    odd: dict[int, str]
    notes: tuple[str, ...] = ()

    def column(self, asked: Asked, given: str | None = None) -> Column:
        """The column of a quantity, in SI units. Raises ValueError with the option that helps.

        given: name and unit from the command line, "Disp:mm", or None.
        """
        unit, found = (given or "").partition(":")[2], self.named(asked, given)
        example = f'{asked.option} "NAME:{units.COMMON[asked.base]}"'
        if len(found) != 1:
            many = f"{len(found)} columns of one name: " if found else ""
            raise ValueError(
                f"{self.name}: which column is the {asked.what}, and in which unit? The file has "
                f"{many}{', '.join(c.title for c in self.columns)}; write for example {example}"
            )
        column = found[0]
        if column.wrong:
            raise ValueError(f"{self.name}: column {column.title!r}, {column.wrong}")
        unit = unit or column.unit
        factor = _factor(unit, asked.base)
        if factor is None:
            trouble = f"has the unit {unit!r}, none of {asked.base}" if unit else "gives no unit"
            raise ValueError(
                f"{self.name}: column {column.title!r} {trouble}; name it, for example "
                f"{example.replace('NAME', column.name)}"
            )
        return column._replace(values=column.values * factor)

    def named(self, asked: Asked, given: str | None = None) -> list[Column]:
        """The columns of that name given, or of the first of its names that any column has."""
        alike = sum(_factor(c.unit, asked.base) is not None for c in self.columns)
        vague = asked.vague if alike < 2 else ()  # not one of several displacements
        wanted = (*asked.names, *vague) if given is None else (_plain(given.partition(":")[0]),)
        matches = (
            [c for c in self.columns if w in (_plain(c.name), _plain(c.title))] for w in wanted
        )
        return next((match for match in matches if match), [])

    def rows(
        self, columns: Sequence[Column], outliers: str | None
    ) -> tuple[list[Array], list[str]]:
        """The rows in which all these columns hold a number, and what was left out of them.

        Odd rows are those of `odd_rows`, and points where one column jumps and returns while
        another stands still. Raises ValueError as that, and for fewer than three rows.
        """
        whole = np.isfinite([c.values for c in columns]).all(axis=0)
        lines, values = np.array(self.lines)[whole], [c.values[whole] for c in columns]
        seen = ~np.isin(lines, [*self.odd, *(n for c in columns for n in c.odd)])
        jumps = dict[int, str]()
        for (_, x), (c, y) in permutations(zip(columns, values, strict=True), 2):
            there = lines[seen][_jumps(x[seen], y[seen])].tolist()
            jumps |= dict.fromkeys(there, f"{c.title} jumps and returns")
        skipped, told = self.odd_rows(columns, outliers, lines.tolist(), jumps)
        values = [x[~np.isin(lines, skipped)] for x in values]
        empty, notes = int(np.sum(~whole)), [*self.notes]
        if empty:
            notes.append(f"{empty} of {whole.size} rows without all numbers are not used")
        notes += told
        if values[0].size < 3:
            raise ValueError(
                f"{self.name}: has {values[0].size} rows with both numbers; give 3 or more"
            )
        return values, notes

    def odd_rows(
        self,
        columns: Sequence[Column],
        outliers: str | None,
        lines: Iterable[int],
        more: dict[int, str],
    ) -> tuple[list[int], list[str]]:
        """Those of these lines to leave out as no measurement, and a note of them if there are any.

        They are those of `odd`, values such as -999, and `more` with its reasons. outliers: what to
        do with them, "skip" or "keep". Raises ValueError naming them without it.
        """
        odd = self.odd | {n: why for c in columns for n, why in c.odd.items()} | more
        odd = {n: odd[n] for n in sorted(odd.keys() & set(lines))}
        told = "; ".join(f"line {n}: {why}" for n, why in [*odd.items()][:3])
        told += f"; and {len(odd) - 3} more" if len(odd) > 3 else ""
        if odd and outliers is None:
            raise ValueError(
                f"{self.name}: {told}. Are these measurements? Write --outliers skip to leave such "
                "rows out, or --outliers keep"
            )
        if not odd or outliers == "keep":
            return [], []
        return [*odd], [f"{len(odd)} rows are left out as outliers ({told})"]


def read_tables(
    path: Path, needed: Sequence[tuple[Asked, str | None]], decimal: str | None = None
) -> list[Table]:
    """The tests of a file, by the rules above.

    needed: quantities and what is given for them, as `Table.column` takes them: a table with none
    of them is no test, and left out with a note, if another has one. decimal: the decimal mark,
    "comma" or "point"; None finds it, if a number of the file shows it. Raises ValueError naming
    file, line and remedy.
    """
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        sheets = _workbook(path, decimal)
    else:
        lines = read_lines(path)
        mark = find_table_separator(lines)
        sheets = {"": dict(zip(lines, split_cells([*lines.values()], mark), strict=True))}
    tables: list[Table] = []
    for sheet, rows in sheets.items():
        marks = detect_format((cell for row in rows.values() for cell in row), decimal)
        name = f"{path}{', sheet ' * bool(sheet)}{sheet}"
        blocks = [one for block in _below(rows, marks) for one in _beside(*block)]
        for k, (titles, below, numbers) in enumerate(blocks, 1):
            several = f", test {k}" if len(blocks) > 1 else ""
            tables.append(_table(name + several, titles, below, numbers, marks))
    if not tables:
        raise ValueError(
            f"{path}: must hold a line of names with units, such as us [mm],tau [MPa], and numbers "
            "in the lines below it"
        )
    tests = [table for table in tables if any(table.named(*one) for one in needed)] or tables
    names = {table.name for table in tests}
    notes = [f"{one.name}: no test, not read" for one in tables if one.name not in names]
    return [tests[0]._replace(notes=tuple(notes)), *tests[1:]]


def _workbook(path: Path, decimal: str | None) -> dict[str, Rows]:
    """The cells of all sheets as text. Raises ImportError with the remedy without openpyxl."""
    try:
        from openpyxl import load_workbook
    except ImportError as error:
        raise ImportError(
            f"{path}: spreadsheets need openpyxl: pip install 'jointlaw[xlsx]', or save it as CSV"
        ) from error
    try:
        book = load_workbook(path, read_only=True, data_only=True)
        with ZipFile(path) as parts:
            sheets = [one for one in parts.namelist() if one.startswith("xl/worksheets/")]
            bare = any(_NO_VALUE.search(parts.read(one)) for one in sheets)
    except Exception as error:  # of many kinds, for a file that is none
        raise ValueError(f"{path}: cannot be read as a spreadsheet ({error})") from None
    if bare:
        raise ValueError(
            f"{path}: holds formulas without their values; open it in a spreadsheet program and "
            "save it again"
        )
    found = dict[str, Rows]()
    for sheet in book.worksheets:
        cells = [*enumerate(sheet.iter_rows(values_only=True), 1)]
        texts = (cell.strip() for _, row in cells for cell in row if isinstance(cell, str))
        comma = detect_format(texts, decimal).decimal == ","
        rows = {n: [_text(cell, comma) for cell in row] for n, row in cells}
        found[sheet.title] = {n: row for n, row in rows.items() if any(row)}
    return found


def _text(cell: Any, comma: bool) -> str:
    """A cell of a workbook as a text file would have it, with decimal commas or without."""
    text = "" if cell is None else str(cell).strip()
    if isinstance(cell, float):
        # the decimal mark of a spreadsheet's number is a point: 1.2010 shows it, 1.201 does not
        text += "0" * bool(AMBIGUOUS_NUMBER.fullmatch(text))
        text = text.replace(".", ",") if comma else text
    return text


def _below(rows: Rows, marks: NumberFormat) -> list[tuple[list[str], list[str], Rows]]:
    """Names, units and rows of the tables that stand below one another."""
    found: list[tuple[list[str], list[str], Rows]] = []
    for line, row in rows.items():
        numeric = any(
            np.isfinite(marks.value(cell)) or AMBIGUOUS_NUMBER.fullmatch(cell) for cell in row
        )
        words = [cell for cell in row if _LETTERS.search(cell)]
        if found and not found[-1][2] and not numeric and all(map(_ROW_UNIT.fullmatch, row)):
            found[-1] = (found[-1][0], [cell.strip("[]()/- ") for cell in row], {})
        elif not numeric and len(words) > 1 and not (found and found[-1][2]):
            found[-1:] = [(row, [], {})]  # lines of text above it were no names
        elif not numeric and found and row == found[-1][0]:
            found.append((row, [], {}))
        elif found:
            found[-1][2][line] = row
    return [block for block in found if block[2]]


def _beside(
    titles: list[str], below: list[str], rows: Rows
) -> list[tuple[list[str], list[str], Rows]]:
    """The tables that stand beside one another: the same names come again."""
    names = [_plain(title) for title in titles]
    starts = [k for k, name in enumerate(names) if name and name == names[0]]
    parts = [slice(a, b) for a, b in zip(starts, [*starts[1:], len(names)], strict=True)]
    same = {tuple(name for name in names[part] if name) for part in parts}
    if len(parts) < 2 or len(same) > 1 or len(next(iter(same))) < 2:
        return [(titles, below, rows)]
    return [
        (
            titles[part],
            below[part],
            {n: cells for n, row in rows.items() if any(cells := row[part])},
        )
        for part in parts
    ]


def _table(
    name: str, titles: list[str], below: list[str], rows: Rows, marks: NumberFormat
) -> Table:
    """The columns of one test."""
    wide = len(titles)
    for line, row in rows.items():
        if any(row[wide:]):
            raise ValueError(
                f"{name}: line {line} has {len(row)} cells under {wide} names; give each column a "
                "name and separate all lines alike; if the decimal mark is a comma, separate the "
                "columns by semicolons"
            )
    columns, odd = [], dict[int, str]()
    padded = ([*row, *[""] * wide][:wide] for row in (below, *rows.values()))
    for title, unit, *cells in zip(titles, *padded, strict=True):
        column, summaries = _column(title, unit, dict(zip(rows, cells, strict=True)), marks)
        columns.append(column)
        odd |= summaries
    return Table(name, columns, [*rows], odd)


def _number_fault(cell: str) -> str:
    """Why a cell is not read as a number, for a message."""
    return AMBIGUITY_REMEDY if AMBIGUOUS_NUMBER.fullmatch(cell) else "is no number"


def _column(
    title: str, unit: str, cells: dict[int, str], marks: NumberFormat
) -> tuple[Column, dict[int, str]]:
    """A column from its cells by line; and lines that hold a word, such as Max, among numbers."""
    found = {n: marks.value(cell) for n, cell in cells.items()}
    known = {n: x for n, x in found.items() if np.isfinite(x)}
    texts = {n: cell for n, cell in cells.items() if cell and n not in known}
    wrong = (f"line {n} holds {cell!r}, which {_number_fault(cell)}" for n, cell in texts.items())
    words = {n: f"{title} is {cell!r}" for n, cell in texts.items() if _WORD.fullmatch(cell)}
    sent = {n: x for n, x in known.items() if _SENTINEL.fullmatch(str(x))}
    others = np.array([x for n, x in known.items() if n not in sent])
    near = {x for x in set(sent.values()) if others.size and _near(x, others)}
    odd = {n: f"{title} is {cells[n]}" for n, x in sent.items() if x not in near}
    values = np.array([*found.values()])
    column = Column(title, *_read_title(title, unit), values, next(wrong, ""), odd)
    return column, words if len(texts) < len(known) else {}


def _near(x: float, others: Array) -> bool:
    """Whether a number stands so near the others (n,) that it may be a measurement as they are."""
    return bool(np.min(np.abs(others - x)) <= APART * _scale(others))


def _scale(y: Array) -> float:
    """Range of values; what hardly changes scatters, and a fifth of its size counts."""
    return float(max(np.ptp(y), 0.2 * np.max(np.abs(y))))


def _jumps(x: Array, y: Array) -> NDArray[np.bool_]:
    """Points (n,) where y leaves its neighbours, which agree, while x goes on between its own.

    Up to `RUN` points of equal y leave them together, as where a logger repeats what it lost.
    """
    found = np.zeros(x.size, bool)
    if x.size < 5 or not np.ptp(x) or not np.ptp(y):
        return found
    first = np.flatnonzero(np.diff(y, prepend=np.nan) != 0)  # rows of each run of equal values
    last = np.append(first[1:], x.size) - 1
    size, first, last = (last - first + 1)[1:-1], first[1:-1], last[1:-1]
    before, after = first - 1, last + 1
    off_y = np.abs(y[first] - (y[after] + y[before]) / 2) / _scale(y)
    off_x = np.abs(x[first] + x[last] - x[after] - x[before]) / 2 / np.ptp(x)
    apart = np.abs(y[after] - y[before]) / _scale(y)
    # and does not turn, as at the end of unloading
    turns = np.append(0, np.cumsum(np.diff(x)[1:] * np.diff(x)[:-1] < 0))
    jump = (off_y > JUMP) & (apart < 0.25 * off_y) & (off_x < STILL * off_y)
    jump &= (size <= min(RUN, x.size / 4)) & (turns[last] == turns[before])
    for one, end in zip(first[jump], last[jump], strict=True):
        found[one : end + 1] = True
    return found


def _factor(unit: str, base: str) -> float | None:
    """SI units per unit; a quantity, -1mm, turns a sign; None for one of another kind."""
    unit = re.sub("^([kmg])pa$", lambda match: f"{match[1].upper().replace('K', 'k')}Pa", unit)
    try:
        return units.parse(unit if re.match(r"[-+.\d]", unit) else f"1{unit or '?'}", base)
    except ValueError:
        return None


def _read_title(title: str, unit: str) -> tuple[str, str]:
    """Name and unit of a title, which goes before the row of units: "tau [kPa]", "closure_mm"."""
    match = _TITLE.fullmatch(title)
    if match is None:
        return title, unit
    return match[1].strip(" _,") or title, (match[2] or match[3] or "").strip("-") or unit


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name.strip().lower()).strip("_")
