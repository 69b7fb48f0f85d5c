"""Tables of numbers as laboratories write them: any separator, decimal commas, units in any style.

Units are read, never guessed: a column without one is asked for.
"""

import csv
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..support import units
from ..support.checks import Array

UNIT = r"(?:[numkcMGµμ]?(?:Pa|m)|N/mm[2²]|[kM]N/m[2²]|bar|%|per ?cent)"
_ROW_UNIT = re.compile(rf"[\[(].*[\])]|/?\s*{UNIT}|-?")
_NORMAL = re.compile(r"(?:\bat\b|@)?\s*(?:\w+\s*=\s*)?(\d+(?:[.,]\d+)?)\s*([kMG]?Pa)\b")
_BRACKETS = re.compile(r"\s*[\[(]\s*([^\])]*?)\s*[\])]\s*")
_ENDING = re.compile(rf"(.*?)(?:\s*/\s*|\s+in\s+|,\s*|_|\s+)({UNIT})")


class Column(NamedTuple):
    """A column: its title as written, its name and unit ("" if it gives none).

    normal: the normal stress (Pa) that the title states, "tau at 3 MPa", or None; values: (n,), NaN
    where a cell is empty; wrong: the first cell that holds something else, with its line.
    """

    title: str
    name: str
    unit: str
    normal: float | None
    values: Array
    wrong: str


class Asked(NamedTuple):
    """A quantity to look for: what it is, its SI unit, names it goes by, the option that names it.

    The names are tried in their order, in small letters with _ for all that is no letter or digit.
    """

    what: str
    base: str
    names: tuple[str, ...]
    option: str


def read_columns(path: str | Path) -> list[Column]:
    """The columns of a text file. Raises ValueError naming file, line and remedy.

    The last row before the numbers holds the names, or units under a row of names; what stands
    above is skipped, as are lines that begin with #. Without names the columns are "1", "2", ...
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror}); give a CSV file") from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: is no CSV file in UTF-8 ({error}); save it as one") from None
    lines = [
        (number, line)
        for number, line in enumerate(text.replace("\0", "").splitlines(), 1)
        if line.strip(" \t,;") and not line.lstrip().startswith("#")
    ]
    splits = [_split([line for _, line in lines], mark) for mark in (";", "\t", ",", None)]
    rows = max(splits, key=lambda rows: sum(map(_excess, rows)))  # the first of equals
    first = next((k for k, row in enumerate(rows) if _excess(row)), None)
    if first is None:
        raise ValueError(
            f"{path}: has no row of two numbers or more; separate columns by commas, or by "
            "semicolons where the decimal mark is a comma"
        )
    data, names = rows[first:], rows[first - 1] if first else []
    while not any(np.isfinite(_number(cell)) for cell in data[-1]):
        data.pop()  # "end of test"
    given: list[str] = []
    if first > 1 and all(_ROW_UNIT.fullmatch(cell) for cell in names):
        given, names = [cell.strip("[]()/- ") for cell in names], rows[first - 2]
    width = max(len(row) for row in (names, *data))
    if first and len(names) < width:
        raise ValueError(
            f"{path}: line {lines[first][0]} has {len(data[0])} cells under {len(names)} names; "
            "is the decimal mark a comma? Then separate the columns by semicolons"
        )
    names = names or [str(k + 1) for k in range(width)]
    values, wrong = np.full((width, len(data)), np.nan), [""] * width
    for k, row in enumerate(data):
        for at, cell in enumerate(row):
            values[at, k] = _number(cell)
            if cell and not np.isfinite(values[at, k]):
                wrong[at] = wrong[at] or f"line {lines[first + k][0]} holds {cell!r}"
    given += [""] * (width - len(given))
    return [
        Column(title, *_read_title(title, given[at]), values[at], wrong[at])
        for at, title in enumerate(names)
    ]


def find(
    columns: Sequence[Column], asked: Asked, given: str | None, path: Path, required: bool = True
) -> list[Column]:
    """All columns of one quantity, in SI units. Raises ValueError with the option that helps.

    given: name and unit from the command line, "Disp:mm", or None; required: False to return no
        column where there is none.
    """
    name, _, unit = (given or "").partition(":")
    wanted = asked.names if given is None else (_plain(name),)
    matches = ([c for c in columns if w in (_plain(c.name), _plain(c.title))] for w in wanted)
    found = next((match for match in matches if match), [])
    if required and not found:
        titles, example = ", ".join(c.title for c in columns), "NAME"
        if titles.replace(", ", "").isdigit():
            titles, example = f"no row of names over its {len(columns)} columns", "1"
        raise ValueError(
            f"{path}: which column is the {asked.what}, and in which unit? The file has {titles}; "
            f'write for example {asked.option} "{example}:{units.COMMON[asked.base]}"'
        )
    for column in found:
        if column.wrong:
            raise ValueError(f"{path}: column {column.title!r}, {column.wrong}, which is no number")
    return [c._replace(values=c.values * _factor(c, unit, asked, path)) for c in found]


def _factor(column: Column, given: str, asked: Asked, path: Path) -> float:
    """What turns a column into SI units; `given` may be a quantity: -1mm, or 0.032MPa per cent."""
    unit, cure = given or column.unit, units.COMMON[asked.base]
    trouble, example = f"gives no unit; name it, for example {asked.option}", cure
    if re.match("%|per ?cent", unit):
        trouble = f"is in per cent: say what 1 % is, for a peak of 3.2 {cure} {asked.option}"
        example = f"0.032{cure}"
    elif unit:
        try:
            return units.parse(unit if unit[0] in "+-.0123456789" else f"1{unit}", asked.base)
        except ValueError:
            trouble = f"has the unit {unit!r}, none of {asked.base}; name it: {asked.option}"
    raise ValueError(f'{path}: column {column.title!r} {trouble} "{column.name}:{example}"')


def _split(lines: Sequence[str], mark: str | None) -> list[list[str]]:
    """Cells of all lines, without empty ones at the end."""
    if mark is None:
        return [re.split(r"\s+(?![\[(/])", line.strip()) for line in lines]
    rows = [[cell.strip() for cell in row] for row in csv.reader(lines, delimiter=mark)]
    return [row[: max((k + 1 for k, cell in enumerate(row) if cell), default=0)] for row in rows]


def _excess(row: Sequence[str]) -> int:
    """How many more cells hold numbers than texts, plus one; 0 for a row that is no data."""
    numbers = sum(bool(np.isfinite(_number(cell))) for cell in row)
    return max(2 * numbers - sum(map(bool, row)) + 1, 0) if numbers >= 2 else 0


def _number(cell: str) -> float:
    """The number in a cell, its decimal mark a point or a comma; NaN for any other text."""
    try:
        return float(cell.replace("−", "-").replace(",", ".", 1))
    except ValueError:
        return np.nan


def _read_title(title: str, unit: str) -> tuple[str, str, float | None]:
    """Name, unit and stated normal stress of a title: "tau at 3 MPa [kPa]", "closure_mm"."""
    normal, rest = None, title
    if match := _NORMAL.search(title):
        normal = units.parse(match[1].replace(",", ".") + match[2], "Pa")
        rest = title[: match.start()] + title[match.end() :]
    if match := _BRACKETS.search(rest):
        rest, unit = rest[: match.start()] + " " + rest[match.end() :], match[1].strip("-") or unit
    elif match := _ENDING.fullmatch(rest):
        rest, unit = match[1], match[2]
    return rest.strip(" _,()[]") or title, unit, normal


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name.strip().lower()).strip("_")
