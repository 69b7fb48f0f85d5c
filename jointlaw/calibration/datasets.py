"""Closure tests in files: those that come with the package, and CSV files of laboratories."""

import csv
import re
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..support import units
from ..support.checks import Array

_FOLDER = resources.files(__package__) / "data"
_COLUMNS = {  # unit, and the names that laboratories give it
    "stress": ("Pa", ("stress", "normal_stress", "sigma", "sigmaz", "sigma_n", "f1")),
    "closure": ("m", ("closure", "normal_closure", "disp", "displacement")),
}


class ClosureData(NamedTuple):
    """Stress (Pa) and closure (m), (n,), in the order measured."""

    stress: Array
    closure: Array


def names() -> list[str]:
    """Names of all data sets."""
    return sorted(entry.name[:-4] for entry in _FOLDER.iterdir() if entry.name.endswith(".csv"))


def about(name: str) -> dict[str, Any]:
    """Title, source and remarks of a data set."""
    _known(name)
    return tomllib.loads((_FOLDER / f"{name}.toml").read_text(encoding="utf-8"))


def load(name: str) -> ClosureData:
    """Stress (Pa) and closure (m) of a data set, loading and unloading in the order measured."""
    _known(name)
    with resources.as_file(_FOLDER / f"{name}.csv") as path:
        return read_closure(path)


def read_closure(
    path: str | Path, stress: str | None = None, closure: str | None = None
) -> ClosureData:
    """A closure curve from a CSV file.

    Parameters
    ----------
    path: the file. Its first row names the columns; the unit follows the name, "closure_mm" or
        "closure [mm]", or stands in a row of its own; without one it is SI.
    stress, closure: names of the two columns, with their unit if the file gives none ("Disp:mm");
        None finds closure, disp, stress, normal_stress, sigma, sigmaz or F1.

    Raises ValueError naming file, column or row.
    """
    path = Path(path)
    try:
        with path.open(newline="", encoding="utf-8-sig") as stream:
            rows = [row for row in csv.reader(stream) if row and not row[0].startswith("#")]
    except OSError as error:
        raise ValueError(f"{path}: cannot be read ({error.strerror}); give a CSV file") from None
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: is no CSV file in UTF-8 ({error}); save it as one") from None
    if len(rows) < 2:
        raise ValueError(f"{path}: has no rows of data under its first row of column names")
    header, second = ([cell.strip() for cell in row] for row in rows[:2])
    if all(re.fullmatch(r"\[.*\]|\(.*\)", cell) for cell in second):  # a row of units
        header = [f"{name} {unit}" for name, unit in zip(header, second, strict=False)]
        del rows[1]
    columns = []
    for kind, asked in (("stress", stress), ("closure", closure)):
        at, factor = _column(header, kind, asked, path)
        try:
            columns.append(np.array([float(row[at]) for row in rows[1:]]) * factor)
        except (ValueError, IndexError):
            raise ValueError(
                f"{path}: column {header[at]!r} holds something not a number"
            ) from None
    return ClosureData(*columns)


def _known(name: str) -> None:
    if name not in names():
        raise ValueError(f"data set {name!r} is unknown; choose one of {', '.join(names())}")


def _column(header: list[str], kind: str, asked: str | None, path: Path) -> tuple[int, float]:
    """Number of a column and the factor that turns it into SI units."""
    base, names = _COLUMNS[kind]
    name_asked, _, unit_asked = (asked or "").partition(":")
    wanted = names if asked is None else (name_asked.strip().lower(),)
    for at, title in enumerate(header):
        name, unit = _name_and_unit(title, base)
        if name.lower() in wanted or title.lower() in wanted:
            unit = unit_asked or unit
            return at, units.parse(f"1{unit}", base)
    unit = "MPa" if kind == "stress" else "mm"
    raise ValueError(
        f"{path}: no column of {kind} among {', '.join(header)}; name it with its unit, "
        f'for example --{kind}-column "{header[-1].split()[0]}:{unit}"'
    )


def _name_and_unit(title: str, base: str) -> tuple[str, str]:
    """ "closure_mm", "closure [mm]" and "closure (mm)" in two parts; no unit if there is none."""
    match = re.fullmatch(r"(.*?)\s*[\[(]\s*(.*?)\s*[\])]", title)
    if match:
        return match.group(1), match.group(2).strip("-")
    name, _, unit = title.rpartition("_")
    if name and re.fullmatch(rf"[numkcMGµμ]?{base}", unit):
        return name, unit
    return title, ""
