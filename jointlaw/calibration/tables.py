"""Tables in laboratory files, text and spreadsheets: their tests, columns and outliers.

Laboratories have no common file format. This module reads any table with a line of names, and its
principle is that a value is never guessed where two readings are possible: the file is refused, and
the message names the option of the command that decides. The reasons behind the rules:

- **Names.** A column is found by the aliases of its quantity, tried in order. If two columns have
  the same name, or none has a known one, the user names the column.
- **Units** are part of the name ("tau [kPa]", "tau (kPa)", "tau /kPa", "tau in kPa", "tau_kPa") or
  are in the next line. A column without a unit is refused: a stress in kPa that was read as MPa
  gives a law, and no later check detects the error.
- **Several tests.** A table ends where its line of names is repeated below it (`_split_stacked`),
  and is divided where its first name is repeated beside it (`_split_side_by_side`). A workbook has
  the tests of all its sheets. Text above the names is skipped. Hidden sheets are not read, which
  is noted; hidden rows of a sheet, as of a filter, are refused: they may be outliers, or not.
- **Outliers.** Data loggers write numbers such as -999 for a lost reading, repeat the last value,
  produce single jumps, or write rows again after a restart; spreadsheets end with a summary row
  ("Max"). All of these are numbers, and fits would follow them. They are detected by these tests: a
  sentinel value far from the other values of the column; a jump that returns while another column
  continues (`_find_jumps`); a word, or an error such as #DIV/0!, in a column of numbers; a word
  such as Max in one of the last rows; rows that repeat earlier rows (`_find_repeats`). Because a
  real event may look the same, detected rows are refused until the user decides (`--outliers skip`
  or `keep`).
- **Numbers.** Separators, decimal marks and thousands separators: `support.text_numbers`. Cells of
  text in a workbook follow the same rules.
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

_UNIT = (
    r"(?:[numkcMGµμ]?(?:Pa|m)|k?N/[mc]?m(?:\^|\*\*)?[2²]|[kM]N/m(?:\^|\*\*)?[2²]|m?bar|[kmg]pa|[kM]N"
    r"|[KMG]PA|MM|CM|UM|psi|ksi|psf|inch|inches|lbf|kips?|kgf|daN|kp|kgf?/[cm]m2|tf?/m2|kp/cm2)"
)
_UNIT_CELL = re.compile(rf"[\[(].*[\])]|/?\s*{_UNIT}|N|-?")
# units in a row of units, of columns that are no length, stress or force
_ANY_UNIT = re.compile(
    r"[\[(].*[\])]|[-–—]*|%|‰|\d?\s*/.*|s|secs?|seconds?|sek|ms|min|mins|minutes?|h|hrs?|hours?"
    r"|days?|[°º]\s?[CF]|deg\s?[CF]|C|K|celsius|degrees?( celsius)?|deg|rad|°|[mu]?V(/V)?|volts?"
    r"|[mk]?A|k?Hz|n/?a|none|text|date|time|hh?:mm(:ss)?.*|dd[./-].*|yyyy.*|#|m[lL]|l|cm3|k?J|k?g"
    rf"|t|N|in|{_UNIT}|\S{{1,6}}/(s|min|h|mm|m|sec)",
    re.I,
)
_TITLE = re.compile(
    rf"(.*?)(?:\s*[\[(]\s*([^\])]*?)\s*[\])]|(?:\s*/\s*|\s+in\s+|,\s*|_|\s+)({_UNIT})\.?)\s*"
)
# unambiguous spellings of units in capitals, Cyrillic letters and full-width brackets
_SPELLINGS = {
    "KPA": "kPa", "KPa": "kPa", "Kpa": "kPa", "kpa": "kPa", "MPA": "MPa", "Mpa": "MPa",
    "mpa": "MPa", "GPA": "GPa", "Gpa": "GPa", "gpa": "GPa", "PA": "Pa", "MM": "mm", "CM": "cm",
    "UM": "um", "KN": "kN", "BAR": "bar", "мм": "mm", "мкм": "um", "см": "cm", "кПа": "kPa",
    "МПа": "MPa", "Па": "Pa", "кН": "kN", "Н": "N",
}  # fmt: skip
_FULL_WIDTH = str.maketrans("（）［］／", "()[]/")
_LETTERS = re.compile(r"[^\W\d_]")
# numbers that loggers write for a lost reading or an overflow
_SENTINEL = re.compile(r"-99\.0|-?(9{3,}(\.0|\.9+|\.25)|(3276[78]|65535)\.0)")
_WORD = re.compile(r"(?i)(?!nan|none|null).*[^\W\d_]{3}.*")
_SUMMARY = re.compile(
    r"(?i)(max|min|mean|avg|std|sum|med|mittel|moyenne|media|desv|total|range|count|average|peak)"
    r"[\w.]*\s*[.:]?|s\.?d\.?|cv|σ"
)
# what loggers and spreadsheets write instead of a number that is lost
_LOST = re.compile(r"(?i)#.*|[-+]?inf.*|[-*x?]+|1\.#.*|[-+]?o\.?l\.?|ovr.*|n/?a|nan\(.*|true|false")
_DECIMALS = re.compile(r"[-+−]?\d+[.,](\d+)")
_END_OF_HEADER = re.compile(r"(?i)\W*end[ _]of[ _]header\W*")
# a formula in a sheet of a workbook, saved by a program that cannot compute
_FORMULA_WITHOUT_VALUE = re.compile(
    rb'<c(?![^>]*t="str")[^>]*><f[^>]*(?:/>|>[^<]*</f>)\s*(?:<v\s*/>|<v></v>)?\s*</c>'
)
MAX_SENTINEL_DISTANCE = 0.1  # of the range of the other values: a nearer number is a measurement
MIN_JUMP = 0.2  # of the range of the column
MAX_OTHER_DEVIATION = 0.1  # of the jump: deviation of another column in the same row
MAX_RETURN_DIFFERENCE = 0.25  # of the jump: difference of the values before and after it
MAX_JUMP_ROWS = 5  # equal values that a jump may have, at most a quarter of the rows
MIN_FIXED_ROWS = 8  # with the same number of decimals, to call a shorter number cut
MIN_REPEATED_ROWS = 3  # one after the other, to be rows that were written again
MIN_ROWS = 3  # of a test
Rows = dict[int, list[str]]  # cells by the number of the line


class Column(NamedTuple):
    """A column of a table.

    title: as written in the file; name and unit: its two parts, unit "" if it has none.
    values: (n,), NaN where a cell is empty.
    error: the problem of the first cell that holds text instead of a number, or "".
    sentinels: lines whose value stands for a lost reading, such as -999, each with the reason.
    lost: lines with a word or an error instead of a number, in a column of numbers, likewise.
    """

    title: str
    name: str
    unit: str
    values: Array
    error: str
    sentinels: dict[int, str]
    lost: dict[int, str]


class Quantity(NamedTuple):
    """A measured quantity, and how to find its column.

    description: of the quantity, in messages.
    si_unit: its unit in SI.
    aliases: names of its column, tried in order; lower case, with _ for all characters
        except letters and digits.
    option: the command-line option that names its column.
    ambiguous_aliases: names that count only if no other column has a unit of the same kind.
    """

    description: str
    si_unit: str
    aliases: tuple[str, ...]
    option: str
    ambiguous_aliases: tuple[str, ...] = ()


class CompleteRows(NamedTuple):
    """The rows of a test in which all columns have a number.

    values: of each column, (n,).
    lines: line (or row) number of each row.
    notes: on the rows left out.
    """

    values: list[Array]
    lines: list[int]
    notes: list[str]


class FileTable(NamedTuple):
    """One test in a file.

    name: of file, sheet and test, in messages.
    columns: its columns.
    lines: line (or row) number of each value.
    summary_rows: lines without a measurement, such as "Max", each with the reason.
    notes: on other contents of the file.
    """

    name: str
    columns: list[Column]
    lines: list[int]
    summary_rows: dict[int, str]
    notes: tuple[str, ...] = ()

    def column(self, quantity: Quantity, override: str | None = None) -> Column:
        """The column of a quantity, with its values in SI units.

        override: name and unit from the command line, "Disp:mm", or None. Raises ValueError with
        the option that helps.
        """
        matches = self.find_columns(quantity, override)
        example = f'{quantity.option} "NAME:{units.COMMON[quantity.si_unit]}"'
        if len(matches) != 1:
            several = f"{len(matches)} columns of one name: " if matches else ""
            titles = ", ".join(column.title for column in self.columns)
            raise ValueError(
                f"{self.name}: which column is the {quantity.description}, and in which unit? The "
                f"file has {several}{titles}; write for example {example}"
            )
        column = matches[0]
        if column.error:
            raise ValueError(f"{self.name}: column {column.title!r}, {column.error}")
        chosen_unit = (override or "").partition(":")[2]
        self._require_same_unit(column, chosen_unit, quantity)
        unit = chosen_unit or column.unit
        factor = _si_factor(unit, quantity.si_unit)
        if factor is None:
            raise ValueError(
                f"{self.name}: column {column.title!r} {_unit_problem(column, unit, quantity)}"
            )
        return column._replace(values=column.values * factor)

    def _require_same_unit(self, column: Column, chosen: str, quantity: Quantity) -> None:
        """Raise ValueError if an option names another unit than the file."""
        stated = units.OTHER_UNITS.get(units.plain_exponents(column.unit), column.unit)
        size = _si_factor(stated, quantity.si_unit)
        if size is None or not chosen or re.match(r"[-+.\d]", chosen):
            return
        chosen_size = _si_factor(chosen, quantity.si_unit)
        if chosen_size is not None and abs(chosen_size - size) > 1e-6 * size:
            option = f'{quantity.option} "{column.name}:{stated}"'
            raise ValueError(
                f"{self.name}: column {column.title!r} has the unit {column.unit!r}, the option "
                f"names {chosen!r}; write {option}, or correct the unit in the file"
            )

    def gauges(self, quantity: Quantity, override: str | None = None) -> list[Column]:
        """The columns of a quantity that several gauges measure, with values in SI units.

        override: names and units of one column or of several, "A,B:mm"; the last unit is the unit
        of all names without one. Raises ValueError as `column`.
        """
        names = [] if override is None else override.split(",")
        if override is None or len(names) < 2 or self.find_columns(quantity, override):
            return [self.column(quantity, override)]
        unit = names[-1].partition(":")[2]
        overrides = [one if ":" in one or not unit else f"{one}:{unit}" for one in names]
        return [self.column(quantity, one) for one in overrides]

    def unused_lengths(self, used: Iterable[Column]) -> list[str]:
        """Titles of the columns with a unit of length that are not among the used columns."""
        titles = {column.title for column in used}
        return [
            column.title
            for column in self.columns
            if column.title not in titles and _si_factor(column.unit, "m") is not None
        ]

    def find_columns(self, quantity: Quantity, override: str | None = None) -> list[Column]:
        """All columns that hold a quantity, in the order of the file; several if the file has
        several.

        override: name, and perhaps unit, from the command line, "Disp:mm": only columns with this
        name. Without it the aliases of the quantity are tried in turn, and the columns of the first
        alias that any column has are returned. Ambiguous aliases are tried last, and only if no
        more than one column has a unit of this quantity. Empty if no column matches.
        """
        aliases: tuple[str, ...]
        if override is not None:
            aliases = (_normalised(override.partition(":")[0]),)
        else:
            same_kind = [
                column
                for column in self.columns
                if _si_factor(column.unit, quantity.si_unit) is not None
            ]
            aliases = quantity.aliases
            if len(same_kind) < 2:
                aliases = (*aliases, *quantity.ambiguous_aliases)
        for alias in aliases:
            matches = [
                column
                for column in self.columns
                if alias in (_normalised(column.name), _normalised(column.title))
            ]
            if matches:
                return matches
        return []

    def complete_rows(self, columns: Sequence[Column], outliers: str | None) -> CompleteRows:
        """The rows in which all these columns have a number.

        Outliers are the rows of `outlier_rows`, rows that repeat earlier rows, and jumps of one
        column that return while another column continues. Raises ValueError as `outlier_rows`, and
        for fewer than three rows.
        """
        is_complete = np.isfinite([column.values for column in columns]).all(axis=0)
        lines = np.array(self.lines)[is_complete]
        values = [column.values[is_complete] for column in columns]
        sentinel_lines = [line for column in columns for line in column.sentinels]
        lost_lines = {line for column in columns for line in column.lost}
        is_measurement = ~np.isin(lines, [*self.summary_rows, *sentinel_lines])
        measured = [x[is_measurement] for x in values]
        measured_lines = lines[is_measurement]
        unusual = {
            int(measured_lines[row]): f"repeats line {measured_lines[first]}"
            for row, first in _find_repeats(measured).items()
        }
        is_first = ~np.isin(measured_lines, [*unusual])
        for (_, x), (column, y) in permutations(zip(columns, measured, strict=True), 2):
            is_jump = _find_jumps(x[is_first], y[is_first])
            jump_lines = measured_lines[is_first][is_jump].tolist()
            unusual |= dict.fromkeys(jump_lines, f"{column.title} jumps and returns")
        candidates = {*lines.tolist(), *lost_lines}
        skipped, outlier_notes = self.outlier_rows(columns, outliers, candidates, unusual)
        is_kept = ~np.isin(lines, skipped)
        notes = [*self.notes]
        incomplete = is_complete.size - len(candidates)
        if incomplete:
            notes.append(
                f"{incomplete} of {is_complete.size} rows without all numbers are not used"
            )
        notes += outlier_notes
        if np.sum(is_kept) < MIN_ROWS:
            raise ValueError(
                f"{self.name}: has {np.sum(is_kept)} rows with all numbers; give {MIN_ROWS} or more"
            )
        return CompleteRows([x[is_kept] for x in values], lines[is_kept].tolist(), notes)

    def outlier_rows(
        self,
        columns: Sequence[Column],
        outliers: str | None,
        lines: Iterable[int],
        unusual: dict[int, str],
    ) -> tuple[list[int], list[str]]:
        """The outliers to leave out among some lines, and a note on them.

        Parameters
        ----------
        columns: columns whose sentinel values and lost numbers are outliers.
        outliers: "skip" or "keep" for the treatment of outliers, or None.
        lines: the lines to look at.
        unusual: lines with a jump or repeated numbers, each with the reason.

        Raises ValueError naming the outliers if `outliers` is None, or if they are kept and have no
        number.
        """
        lines = set(lines)
        lost = {line: why for column in columns for line, why in column.lost.items()}
        sentinels = {line: why for column in columns for line, why in column.sentinels.items()}
        reasons = unusual | self.summary_rows | sentinels | lost
        reasons = {line: reasons[line] for line in sorted(reasons.keys() & lines)}
        if outliers == "keep" and lost.keys() & lines:
            line = min(lost.keys() & lines)
            raise ValueError(
                f"{self.name}: line {line}: {lost[line]}, which is no number: it cannot be kept; "
                "write --outliers skip, or correct it"
            )
        listed = "; ".join(f"line {line}: {why}" for line, why in [*reasons.items()][:3])
        if len(reasons) > 3:
            listed += f"; and {len(reasons) - 3} more"
        if reasons and outliers is None:
            raise ValueError(
                f"{self.name}: {listed}. Are these measurements? Write --outliers skip to leave "
                "such rows out, or --outliers keep"
            )
        if not reasons or outliers == "keep":
            return [], []
        return [*reasons], [f"{len(reasons)} rows are left out as outliers ({listed})"]


def read_tables(
    path: Path, quantities: Sequence[tuple[Quantity, str | None]], decimal: str | None = None
) -> list[FileTable]:
    """Read the tests of a file.

    Parameters
    ----------
    path: text file or workbook.
    quantities: quantities of a test, each with the override that `FileTable.column` takes. A table
        with none of them is no test: it is left out with a note, if another table has one.
    decimal: decimal mark, "comma" or "point"; None detects it from the numbers of the file.

    Raises ValueError naming file, line and remedy.
    """
    notes = list[str]()
    if path.suffix.lower() in (".xlsx", ".xlsm"):
        sheets, notes = _read_workbook(path, decimal)
    else:
        lines = read_lines(path)
        mark = find_table_separator(lines)
        sheets = {"": dict(zip(lines, split_cells([*lines.values()], mark), strict=True))}
    tables: list[FileTable] = []
    for sheet, rows in sheets.items():
        number_format = detect_format((cell for row in rows.values() for cell in row), decimal)
        sheet_name = f"{path}, sheet {sheet}" if sheet else f"{path}"
        blocks = [
            part
            for block in _split_stacked(rows, number_format)
            for part in _split_side_by_side(block)
        ]
        for k, block in enumerate(blocks, 1):
            name = f"{sheet_name}, test {k}" if len(blocks) > 1 else sheet_name
            tables.append(_make_table(name, block, number_format))
    if not tables:
        raise ValueError(
            f"{path}: must hold a line of names with units, such as us [mm],tau [MPa], and numbers "
            "in the lines below it"
        )
    tests = [table for table in tables if any(table.find_columns(*one) for one in quantities)]
    tests = tests or tables
    test_names = {table.name for table in tests}
    notes += [
        f"{table.name}: no test, not read" for table in tables if table.name not in test_names
    ]
    return [tests[0]._replace(notes=tuple(notes)), *tests[1:]]


def _read_workbook(path: Path, decimal: str | None) -> tuple[dict[str, Rows], list[str]]:
    """The cells of all visible sheets as text, and notes on the others.

    Raises ImportError with the remedy without openpyxl, and ValueError for hidden rows.
    """
    try:
        from openpyxl import load_workbook
    except ImportError as error:
        raise ImportError(
            f"{path}: spreadsheets need openpyxl: pip install 'jointlaw[xlsx]', or save it as CSV"
        ) from error
    try:
        book = load_workbook(path, data_only=True)
        with ZipFile(path) as parts:
            sheets = [part for part in parts.namelist() if part.startswith("xl/worksheets/")]
            lacks_values = any(_FORMULA_WITHOUT_VALUE.search(parts.read(one)) for one in sheets)
    except Exception as error:  # openpyxl raises many types for an invalid file
        raise ValueError(f"{path}: cannot be read as a spreadsheet ({error})") from None
    if lacks_values:
        raise ValueError(
            f"{path}: holds formulas without their values; open it in a spreadsheet program and "
            "save it again"
        )
    workbook = dict[str, Rows]()
    notes = list[str]()
    for sheet in book.worksheets:
        if sheet.sheet_state != "visible":
            notes.append(f"sheet {sheet.title} is hidden: it is not read")
            continue
        cells = [*enumerate(sheet.iter_rows(values_only=True), 1)]
        texts = (cell.strip() for _, row in cells for cell in row if isinstance(cell, str))
        comma = detect_format(texts, decimal).decimal == ","
        rows = {n: [_cell_text(cell, comma) for cell in row] for n, row in cells}
        rows = {n: row for n, row in rows.items() if any(row)}
        hidden = [n for n in rows if n in sheet.row_dimensions and sheet.row_dimensions[n].hidden]
        if hidden:
            raise ValueError(
                f"{path}, sheet {sheet.title}: {len(hidden)} rows are hidden, as by a filter, from "
                f"row {hidden[0]} on: show all rows, or delete the hidden ones"
            )
        workbook[sheet.title] = rows
    return workbook, notes


def _cell_text(cell: Any, comma: bool) -> str:
    """A cell of a workbook as text, with a decimal comma or a decimal point."""
    text = "" if cell is None else str(cell).strip()
    if isinstance(cell, float):
        text += "0" * bool(AMBIGUOUS_NUMBER.fullmatch(text))  # 1.2010 cannot be read as 1201
        text = text.replace(".", ",") if comma else text
    return text


class _Block(NamedTuple):
    """A table of text: titles, the row of units below them (empty if there is none), and rows."""

    titles: list[str]
    units: list[str]
    rows: Rows


def _split_stacked(rows: Rows, number_format: NumberFormat) -> list[_Block]:
    """Split the rows of a sheet into tables below one another, each with its line of names.

    A table begins at its line of names: two words or more and no number, before any row of numbers;
    or the same line again below a table. A line of units may follow it. Text above is left out.

    A form above the names, such as the header of a testing machine, is no table: its lines are text
    and single numbers. It ends with a line of names, or with the words End_of_Header.
    """
    blocks: list[_Block] = []
    for line, row in rows.items():
        has_numbers = any(
            np.isfinite(number_format.value(cell)) or AMBIGUOUS_NUMBER.fullmatch(cell)
            for cell in row
        )
        words = [cell for cell in row if _LETTERS.search(cell)]
        if _END_OF_HEADER.fullmatch(row[0] if row else ""):
            _remove_form(blocks)
            continue
        is_names = not has_numbers and len(words) > 1
        if is_names and blocks and row != blocks[-1].titles:
            numeric = [one for one in blocks[-1].rows.values() if _is_numeric(one, number_format)]
            if len(numeric) < min(MIN_ROWS, len(blocks[-1].rows)):
                blocks.pop()  # a form, not a table
        is_in_table = bool(blocks) and bool(blocks[-1].rows)
        is_below_titles = bool(blocks) and not is_in_table
        if is_below_titles and not has_numbers and _is_units(row):
            blocks[-1] = blocks[-1]._replace(units=[cell.strip("[]()/- ") for cell in row])
        elif is_names and not is_in_table:
            # earlier lines of text were no names, or units
            above = blocks.pop().titles if blocks else []
            unit_row = [cell.strip("[]()/- ") for cell in above] if _is_units(above) else []
            blocks.append(_Block(row, unit_row, {}))
        elif not has_numbers and blocks and row == blocks[-1].titles:
            blocks.append(_Block(row, [], {}))
        elif blocks:
            blocks[-1].rows[line] = row
    return [block for block in blocks if block.rows]


def _remove_form(blocks: list[_Block]) -> None:
    """Remove the lines of a form from the end of the last block, or this block."""
    if not blocks:
        return
    kept = blocks[-1].rows
    while kept and _LETTERS.search(next((cell for cell in [*kept.values()][-1] if cell), "")):
        kept.popitem()
    if len(kept) < MIN_ROWS:
        blocks.pop()


def _is_numeric(row: list[str], number_format: NumberFormat) -> bool:
    """Whether more than half of the cells of a row are numbers."""
    cells = [cell for cell in row if cell]
    return 2 * sum(np.isfinite(number_format.value(cell)) for cell in cells) > len(cells)


def _is_units(row: list[str]) -> bool:
    """Whether a row of text holds units: at least one of a length, stress or force."""
    cells = [cell for cell in row if cell]
    if all(map(_UNIT_CELL.fullmatch, row)):
        return bool(cells)
    known = [cell for cell in cells if _ANY_UNIT.fullmatch(cell)]
    measured = [cell for cell in cells if len(cell) > 1 and _is_measured(cell.strip("[]()/- "))]
    return bool(measured) and 2 * len(known) > len(cells)


def _is_measured(unit: str) -> bool:
    """Whether a unit is one of lengths, stresses or forces."""
    kinds = (_si_factor(unit, si_unit) for si_unit in ("m", "Pa", "N"))
    return any(factor is not None for factor in kinds) or unit in units.OTHER_UNITS


def _split_side_by_side(block: _Block) -> list[_Block]:
    """Split a table into tests beside one another, if its names repeat.

    They repeat where the first name occurs again and all parts have the same two names or more;
    else the block itself is returned.
    """
    names = [_normalised(title) for title in block.titles]
    first = next((name for name in names if name), "")
    starts = [k for k, name in enumerate(names) if name and name == first]
    starts[:1] = [0]  # a column without a name, such as an index, may be before the first
    parts = [slice(a, b) for a, b in zip(starts, [*starts[1:], len(names)], strict=True)]
    distinct = {tuple(name for name in names[part] if name) for part in parts}
    if len(parts) < 2 or len(distinct) > 1 or len(next(iter(distinct))) < 2:
        return [block]
    return [
        _Block(
            block.titles[part],
            block.units[part],
            {line: cells for line, row in block.rows.items() if any(cells := row[part])},
        )
        for part in parts
    ]


def _make_table(name: str, block: _Block, number_format: NumberFormat) -> FileTable:
    """The table of one test. Raises ValueError for a row with more cells than names."""
    width = len(block.titles)
    for line, row in block.rows.items():
        if any(row[width:]):
            raise ValueError(
                f"{name}: line {line} has {len(row)} cells under {width} names; give each column a "
                "name and separate all lines alike; if the decimal mark is a comma, separate the "
                "columns by semicolons"
            )
    columns = []
    summary_rows = dict[int, str]()
    padded = ([*row, *[""] * width][:width] for row in (block.units, *block.rows.values()))
    for title, unit, *cells in zip(block.titles, *padded, strict=True):
        column, summaries = _make_column(
            title, unit, dict(zip(block.rows, cells, strict=True)), number_format
        )
        columns.append(column)
        summary_rows |= summaries
    summary_rows |= _find_summary_rows(block, number_format) | _find_cut_row(block)
    return FileTable(name, columns, [*block.rows], summary_rows)


def _find_summary_rows(block: _Block, number_format: NumberFormat) -> dict[int, str]:
    """The last rows of a table with numbers and a word such as Max, each with the reason."""
    summaries = dict[int, str]()
    for line, row in reversed(block.rows.items()):
        if not any(np.isfinite(number_format.value(cell)) for cell in row):
            continue
        cells = zip(block.titles, row, strict=False)
        word = next((one for one in cells if _SUMMARY.fullmatch(one[1])), None)
        if word is None:
            break
        summaries[line] = f"{word[0] or 'a cell'} is {word[1]!r}"
    return summaries


def _find_cut_row(block: _Block) -> dict[int, str]:
    """The last row, if its last number has fewer decimals than all other rows, with the reason.

    A logger that loses its power writes part of a line.
    """
    *others, (line, row) = block.rows.items()
    column = max((k for k, cell in enumerate(row) if cell), default=0)
    cells = [other[column] if column < len(other) else "" for _, other in others]
    decimals = {len(match[1]) for cell in cells if (match := _DECIMALS.fullmatch(cell))}
    last = re.fullmatch(r"[-+]?\d+[.,]?(\d*)", row[column]) if row else None
    if last is None or len(cells) < MIN_FIXED_ROWS or len(decimals) != 1:
        return {}
    is_fixed = all(map(_DECIMALS.fullmatch, cells))
    if not is_fixed or len(last[1]) >= min(decimals):
        return {}
    title = block.titles[column] if column < len(block.titles) else "a cell"
    return {line: f"{title} is {row[column]!r}, cut short"}


def _make_column(
    title: str, unit: str, cells: dict[int, str], number_format: NumberFormat
) -> tuple[Column, dict[int, str]]:
    """A column from its cells by line, and lines with a word such as Max in a column of numbers."""
    parsed = {line: number_format.value(cell) for line, cell in cells.items()}
    numbers = {line: x for line, x in parsed.items() if np.isfinite(x)}
    texts = {line: cell for line, cell in cells.items() if cell and line not in numbers}
    is_column_of_numbers = len(texts) < len(numbers)
    words = {line: f"{title} is {cell!r}" for line, cell in texts.items() if _WORD.fullmatch(cell)}
    lost = {
        line: f"{title} is {cell!r}"
        for line, cell in texts.items()
        if is_column_of_numbers and (line in words or _LOST.fullmatch(cell))
    }
    errors = (
        f"line {line} holds {cell!r}, which {_number_error(cell)}"
        for line, cell in texts.items()
        if line not in lost
    )
    candidates = {line: x for line, x in numbers.items() if _SENTINEL.fullmatch(str(x))}
    others = np.array([x for line, x in numbers.items() if line not in candidates])
    plausible = {x for x in set(candidates.values()) if others.size and _is_plausible(x, others)}
    sentinels = {
        line: f"{title} is {cells[line]}" for line, x in candidates.items() if x not in plausible
    }
    values = np.array([*parsed.values()])
    name, column_unit = _split_title(title, unit)
    column = Column(title, name, column_unit, values, next(errors, ""), sentinels, lost)
    return column, words if is_column_of_numbers else {}


def _number_error(cell: str) -> str:
    """Why a cell is not read as a number, for a message."""
    return AMBIGUITY_REMEDY if AMBIGUOUS_NUMBER.fullmatch(cell) else "is no number"


def _is_plausible(x: float, others: Array) -> bool:
    """Whether a sentinel value is so close to the others (n,) that it may be a measurement."""
    return bool(np.min(np.abs(others - x)) <= MAX_SENTINEL_DISTANCE * _value_range(others))


def _value_range(y: Array) -> float:
    """Range of values, at least a fifth of the largest: nearly constant values only scatter."""
    return float(max(np.ptp(y), 0.2 * np.max(np.abs(y))))


def _find_repeats(columns: Sequence[Array]) -> dict[int, int]:
    """Rows of equal numbers as earlier rows, three or more different ones in the same order.

    columns: (n,) each. Returns the earlier row of each repeated row.
    """
    rows = [*zip(*(column.tolist() for column in columns), strict=True)]
    first = dict[tuple[float, ...], int]()
    earlier = [first.setdefault(row, k) for k, row in enumerate(rows)]
    repeats = dict[int, int]()
    run = dict[int, int]()
    for k in range(1, len(rows) + 1):
        is_repeated = k < len(rows) and earlier[k] < k
        if is_repeated and (not run or earlier[k] == earlier[k - 1] + 1):
            run[k] = earlier[k]
            continue
        if len(run) >= MIN_REPEATED_ROWS:
            repeats |= run
        run = {k: earlier[k]} if is_repeated else {}
    return repeats


def _find_jumps(x: Array, y: Array) -> NDArray[np.bool_]:
    """Points (n,) where y jumps and returns, while x continues between its neighbours.

    A jump may have several points of equal y, as where a logger repeats its last value.
    """
    is_outlier = np.zeros(x.size, bool)
    if x.size < 5 or not np.ptp(x) or not np.ptp(y):
        return is_outlier
    first = np.flatnonzero(np.diff(y, prepend=np.nan) != 0)  # rows of each run of equal values
    last = np.append(first[1:], x.size) - 1
    size = (last - first + 1)[1:-1]
    first = first[1:-1]
    last = last[1:-1]
    before = first - 1
    after = last + 1
    deviation_y = np.abs(y[first] - (y[after] + y[before]) / 2) / _value_range(y)
    deviation_x = np.abs(x[first] + x[last] - x[after] - x[before]) / 2 / np.ptp(x)
    difference = np.abs(y[after] - y[before]) / _value_range(y)
    # a reversal of x, as at the end of unloading, is no jump
    reversals = np.append(0, np.cumsum(np.diff(x)[1:] * np.diff(x)[:-1] < 0))
    is_jump = (deviation_y > MIN_JUMP) & (difference < MAX_RETURN_DIFFERENCE * deviation_y)
    is_jump &= deviation_x < MAX_OTHER_DEVIATION * deviation_y
    is_jump &= size <= min(MAX_JUMP_ROWS, x.size / 4)
    is_jump &= reversals[last] == reversals[before]
    for start, end in zip(first[is_jump], last[is_jump], strict=True):
        is_outlier[start : end + 1] = True
    return is_outlier


def _si_factor(unit: str, si_unit: str) -> float | None:
    """SI units per unit; None for a unit of another kind.

    A quantity such as -1mm is a factor that changes the sign.
    """
    unit = unit.translate(_FULL_WIDTH).strip(" .")
    unit = _SPELLINGS.get(unit, unit)
    try:
        return units.parse(unit if re.match(r"[-+.\d]", unit) else f"1{unit or '?'}", si_unit)
    except ValueError:
        return None


def _unit_problem(column: Column, unit: str, quantity: Quantity) -> str:
    """What is wrong with the unit of a column, and the remedy, for a message.

    A remedy for an unknown unit must not name another unit: it would be obeyed.
    """
    if not unit:
        example = f'{quantity.option} "{column.name}:{units.COMMON[quantity.si_unit]}"'
        return f"gives no unit; give the unit that it was measured in, for example {example}"
    size = units.OTHER_UNITS.get(units.plain_exponents(unit))
    if size is not None and _si_factor(size, quantity.si_unit) is not None:
        remedy = f'give its size: {quantity.option} "{column.name}:{size}"'
    elif quantity.si_unit == "Pa" and _si_factor(unit, "N") is not None:
        remedy = "of forces give the area, such as --area 100cm2"
    else:
        remedy = "correct it in the file"
    return f"has the unit {unit!r}, none of {quantity.si_unit}; {remedy}"


def _split_title(title: str, unit: str) -> tuple[str, str]:
    """Name and unit of a title such as "tau [kPa]" or "closure_mm".

    unit: of the row of units, used if the title has none.
    """
    match = _TITLE.fullmatch(title.translate(_FULL_WIDTH))
    if match is None:
        return title, unit
    return match[1].strip(" _,") or title, (match[2] or match[3] or "").strip("-") or unit


def _normalised(name: str) -> str:
    """A name in lower case with _ for all characters
    except letters and digits."""
    return re.sub(r"\W+", "_", name.strip().lower()).strip("_")
