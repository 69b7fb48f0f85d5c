"""Records of earthquakes and of machines: a CSV file of time and of what the rock does then."""

import re

import numpy as np
from scipy.interpolate import make_interp_spline

from jointlaw.support.checks import finite

from .keys import Tables
from .laws import Files

UNITS = {  # of the second column: which time derivative of the motion it is, and its SI unit
    "m": (0, 1.0), "cm": (0, 1e-2), "mm": (0, 1e-3),
    "m/s": (1, 1.0), "cm/s": (1, 1e-2), "mm/s": (1, 1e-3),
    "m/s2": (2, 1.0), "cm/s2": (2, 1e-2), "gal": (2, 1e-2), "g": (2, 9.80665),
}  # fmt: skip


def read_record(files: Files, name: str, table: Tables) -> Tables:
    """Times and values of the CSV file of a `[[drive]]` table, as keys of a `Drive`.

    Raises ValueError naming a line that is wrong.
    """
    where = f"{name}: {table['file']}"
    try:
        lines = files[table["file"]].splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"{where} cannot be read ({error}); give a CSV file in UTF-8") from None
    units = [_unit(title) for title in lines[0].split(",")] if lines else []
    if len(units) != 2 or units[0] != "s" or units[1] not in UNITS or len(lines) < 3:
        raise ValueError(
            f"{where}: must be a line such as 'time_s,velocity_m/s' or 'Time (s),Acc (g)', then "
            f"numbers; the second unit is one of {', '.join(UNITS)}"
        )
    order, unit = UNITS[units[1]]
    times, values = _numbers(lines, where)
    if order < 2 and values[0]:
        raise ValueError(f"{where}, line 2: the first value must be 0, because the blocks rest")
    values *= unit * table.get("scale", 1.0)
    if table.get("baseline") and order:  # a displacement ends at rest in any case
        values = _at_rest(times, values, order)
    return {"times": tuple(times.tolist()), "values": tuple(values.tolist()), "order": order,
            "smooth": order == 0}  # fmt: skip


def _unit(title: str) -> str:
    """What a title of a column ends in: time_s, Time (s), Acc [m/s^2]."""
    return re.split(r"[\s_(\[]", title.strip(" \t\"')]").lower())[-1].replace("^", "")


def _numbers(lines: list[str], where: str) -> np.ndarray:
    """Times and values (2, n) of the lines below the first."""
    rows: list[np.ndarray] = []
    for n, line in enumerate(lines[1:], 2):
        try:
            row = finite("line", [float(part) for part in line.split(",")], "SI units")
        except ValueError:
            row = np.zeros(0)
        if len(row) != 2:
            raise ValueError(f"{where}, line {n}: {line!r} must be two numbers")
        if row[0] < 0 or (rows and row[0] <= rows[-1][0]):
            raise ValueError(f"{where}, line {n}: time {row[0]:g} s must be >= 0 and increase")
        rows.append(row)
    return np.transpose(rows)


def _at_rest(times: np.ndarray, values: np.ndarray, order: int) -> np.ndarray:
    """Values less a straight line in acceleration (a parabola in velocity), so that the motion ends
    at rest where it began."""
    since = times - times[0]
    parts = since ** (2 - order), since ** (3 - order)

    def end(column):
        path = make_interp_spline(times, column, k=1).antiderivative(order)
        return [path(times[-1], nu=1), path(times[-1])]

    share = np.linalg.solve(np.transpose([end(part) for part in parts]), end(values))
    return values - share @ parts
