"""Tests on joints in text files, those of the package and those of laboratories, by these rules.

- Names stand in the first line, units in it or in the second one: "tau [kPa]", "tau (kPa)",
  "tau /kPa", "tau in kPa", "tau_kPa". A column without a unit is asked for, never guessed.
- Separators, decimal marks and marks between thousands are found: `jointlaw.support.text_numbers`.
"""

import re
from collections.abc import Sequence
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..parameters.rock import require_rock
from ..support import units
from ..support.checks import Array, one_of
from ..support.text_numbers import AMBIGUOUS, EITHER, cells_of, lines_of, marks_of, separator
from .measured import ShearCurve

_UNIT = r"(?:[numkcMGµμ]?(?:Pa|m)|N/mm[2²]|[kM]N/m[2²]|bar)"
_ROW_UNIT = re.compile(rf"[\[(].*[\])]|/?\s*{_UNIT}|-?")
_TITLE = re.compile(
    rf"(.*?)(?:\s*[\[(]\s*([^\])]*?)\s*[\])]|(?:\s*/\s*|\s+in\s+|,\s*|_|\s+)({_UNIT}))\s*"
)


class Column(NamedTuple):
    """A column: its title as written, its name and unit ("" if it gives none).

    values: (n,), NaN where a cell is empty; wrong: what is wrong with the first cell that is
    neither empty nor a number, with its line.
    """

    title: str
    name: str
    unit: str
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


_FOLDER = resources.files(__package__) / "data"
STRESS = Asked(
    "normal stress of the closure test (a direct shear test goes after --shear)", "Pa",
    ("stress", "normal_stress", "sigma", "sigmaz", "sigma_n", "σ", "σn", "σ_n", "f1"),
    "--stress-column",
)  # fmt: skip
CLOSURE = Asked(
    "closure", "m",
    ("closure", "normal_closure", "disp", "displacement", "normal_displacement"),
    "--closure-column",
)  # fmt: skip
SHEAR = Asked(
    "shear displacement (a closure test goes before --shear)", "m",
    ("shear", "shear_displacement", "shear_disp", "us", "u_s", "ds", "horizontal_displacement",
     "displacement", "disp", "shear_2", "u"),
    "--shear-column",
)  # fmt: skip
SHEAR_STRESS = Asked(
    "shear stress", "Pa", ("shear_stress", "tau", "τ", "f2"), "--shear-stress-column"
)
NORMAL = Asked(
    "normal stress (or give it: --normal-stress 1MPa)", "Pa",
    ("normal_stress", "sigma_n", "σn", "σ_n", "sigma", "sn", "f1"),
    "--normal-column",
)  # fmt: skip
STEADY = 0.05  # largest change of a normal stress that counts as constant, as a share of it


def names() -> list[str]:
    """Names of all data sets."""
    return sorted(entry.name[:-4] for entry in _FOLDER.iterdir() if entry.name.endswith(".csv"))


def load(name: str) -> tuple[Array, Array]:
    """Stress (Pa) and closure (m) of a data set, loading and unloading in the order measured."""
    one_of("data set", name, tuple(names()))
    with resources.as_file(_FOLDER / f"{name}.csv") as path:
        return read_closure(path)


def read_closure(
    path: str | Path,
    stress: str | None = None,
    closure: str | None = None,
    decimal: str | None = None,
) -> tuple[Array, Array]:
    """A closure test from a text file.

    Parameters
    ----------
    path: the file.
    stress, closure: names of the two columns, with a unit if the file gives none ("Disp:mm", or
        "Disp:-1mm" where closing counts negative); None finds those of the usual names.
    decimal: the decimal mark, "comma" or "point"; None finds it, if a number of the file shows it.

    Raises ValueError naming file, column or line, and the option of the command that helps.
    """
    path = Path(path)
    columns = read_columns(path, decimal)
    s, u = find(columns, STRESS, stress, path), find(columns, CLOSURE, closure, path)
    pressed, closed = _complete_rows(path, s, u)
    top = int(np.argmax(np.abs(pressed)))
    _require_sign(pressed[top] > 0, s, STRESS, "has compression negative", path)
    _require_sign(closed[top] >= closed[0], u, CLOSURE, "falls while the stress rises", path)
    require_rock({"stress": pressed[top], "closure": float(np.ptp(closed))}, f"{path}: ")
    return pressed, closed


def read_shear(
    path: str | Path,
    shear: str | None = None,
    stress: str | None = None,
    normal: str | None = None,
    normal_stress: float | None = None,
    decimal: str | None = None,
) -> ShearCurve:
    """A direct shear test at constant normal stress from a text file.

    Parameters
    ----------
    path: the file, which holds this one test.
    shear, stress, normal: names of the columns of shear displacement, shear stress and normal
        stress, with units if the file gives none ("tau:MPa", or "tau:-1MPa" to turn a sign).
    normal_stress: Pa; None takes the mean of the column.
    decimal: as in `read_closure`.

    Raises ValueError as `read_closure`.
    """
    path = Path(path)
    columns = read_columns(path, decimal)
    u, tau = find(columns, SHEAR, shear, path), find(columns, SHEAR_STRESS, stress, path)
    if normal_stress is None:
        pressed = find(columns, NORMAL, normal, path)
        normal_stress = _constant(pressed, path)
    x, y = _complete_rows(path, u, tau)
    largest = float(np.abs(y).max())
    if abs(y[0]) < STEADY * largest:  # the gauge need not begin at zero
        x = x - x[0]
    work = float(np.sum(np.diff(x) * (y[1:] + y[:-1])))
    _require_sign(work > 0, tau, SHEAR_STRESS, "opposes the displacement", path)
    require_rock({"shear displacement": float(np.ptp(x)), "shear stress": largest}, f"{path}: ")
    require_rock({"peak shear stress over normal stress": largest / normal_stress}, f"{path}: ")
    return ShearCurve(x, y, normal_stress)


def _constant(pressed: Column, path: Path) -> float:
    """The mean (Pa) of a column of normal stress, which may change by `STEADY` at most."""
    low, mean, high = (float(f(pressed.values)) for f in (np.nanmin, np.nanmean, np.nanmax))
    _require_sign(mean > 0, pressed, NORMAL, "has compression negative", path)
    if high - low > STEADY * mean:
        raise ValueError(
            f"{path}: the normal stress of column {pressed.title!r} runs from {low:.4g} to "
            f"{high:.4g} Pa, but a file is one test at constant normal stress; cut the file, or "
            f"give the stress to take, for example --normal-stress {mean / 1e6:.3g}MPa"
        )
    return mean


def _complete_rows(path: Path, first: Column, second: Column) -> tuple[Array, Array]:
    """The rows in which both columns hold a number."""
    both = np.isfinite(first.values) & np.isfinite(second.values)
    if both.sum() < 3:
        raise ValueError(f"{path}: has {int(both.sum())} rows with both numbers; give 3 or more")
    return first.values[both], second.values[both]


def _require_sign(right: bool, column: Column, asked: Asked, what: str, path: Path) -> None:
    """Refuse a column whose sign is not ours, with the option that turns it."""
    if not right:
        raise ValueError(
            f"{path}: column {column.title!r} {what}; turn its sign: "
            f'{asked.option} "{column.name}:-1{column.unit or "UNIT"}"'
        )


def read_columns(path: Path, decimal: str | None = None) -> list[Column]:
    """The columns of a text file in UTF-8, by the rules above.

    decimal: as in `read_closure`. Raises ValueError naming file, line and remedy.
    """
    numbered = lines_of(path)
    mark = separator(next(iter(numbered.values()), ""))
    (names, *rows), at = cells_of([*numbered.values()] or [""], mark), [*numbered]
    marks = marks_of((cell for row in rows for cell in row), decimal)
    if len(rows) < 2 or any(np.isfinite(marks.value(cell)) for cell in names):
        raise ValueError(
            f"{path}: must hold a line of names with units, such as us [mm],tau [MPa], and numbers "
            "in the lines below it"
        )
    units_below = all(_ROW_UNIT.fullmatch(cell) for cell in rows[0])
    given = [cell.strip("[]()/- ") for cell in rows.pop(0)] if units_below else []
    at = at[-len(rows) :]
    given += [""] * (len(names) - len(given))
    values, wrong = np.full((len(names), len(rows)), np.nan), [""] * len(names)
    for k, row in enumerate(rows):
        if len(row) > len(names):
            remedy = "give each column a name and separate all lines alike"
            if mark == ",":
                remedy = "if the decimal mark is a comma, separate the columns by semicolons"
            raise ValueError(
                f"{path}: line {at[k]} has {len(row)} cells under {len(names)} names; {remedy}"
            )
        for column, cell in enumerate(row):
            values[column, k] = marks.value(cell)
            if cell and not np.isfinite(values[column, k]) and not wrong[column]:
                why = AMBIGUOUS if EITHER.fullmatch(cell) else "is no number"
                wrong[column] = f"line {at[k]} holds {cell!r}, which {why}"
    return [
        Column(title, *_read_title(title, given[k]), values[k], wrong[k])
        for k, title in enumerate(names)
    ]


def find(columns: Sequence[Column], asked: Asked, given: str | None, path: Path) -> Column:
    """The column of a quantity, in SI units. Raises ValueError with the option that helps.

    given: name and unit from the command line, "Disp:mm", or None.
    """
    name, _, unit = (given or "").partition(":")
    wanted = asked.names if given is None else (_plain(name),)
    matches = ([c for c in columns if w in (_plain(c.name), _plain(c.title))] for w in wanted)
    found = next((match for match in matches if match), [])
    example = f'{asked.option} "NAME:{units.COMMON[asked.base]}"'
    if len(found) != 1:
        many = f"{len(found)} columns of one name: " if found else ""
        raise ValueError(
            f"{path}: which column is the {asked.what}, and in which unit? The file has {many}"
            f"{', '.join(c.title for c in columns)}; write for example {example}"
        )
    column = found[0]
    if column.wrong:
        raise ValueError(f"{path}: column {column.title!r}, {column.wrong}")
    unit, example = unit or column.unit, example.replace("NAME", column.name)
    try:  # a quantity, -1mm, turns a sign
        factor = units.parse(unit if re.match(r"[-+.\d]", unit) else f"1{unit or '?'}", asked.base)
    except ValueError:
        trouble = f"has the unit {unit!r}, none of {asked.base}" if unit else "gives no unit"
        raise ValueError(
            f"{path}: column {column.title!r} {trouble}; name it, for example {example}"
        ) from None
    return column._replace(values=column.values * factor)


def _read_title(title: str, unit: str) -> tuple[str, str]:
    """Name and unit of a title, which goes before the row of units: "tau [kPa]", "closure_mm"."""
    match = _TITLE.fullmatch(title)
    if match is None:
        return title, unit
    return match[1].strip(" _,") or title, (match[2] or match[3] or "").strip("-") or unit


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name.strip().lower()).strip("_")
