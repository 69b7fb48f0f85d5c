"""Tests on joints in files: those that come with the package, and CSV files of laboratories."""

import tomllib
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..parameters.rock import require_rock
from ..support.checks import Array, remedy
from .columns import Asked, Column, find, read_columns

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
    "normal stress", "Pa", ("normal_stress", "sigma_n", "σn", "σ_n", "sigma", "sn", "f1"),
    "--normal-column",
)  # fmt: skip
STEADY = 0.05  # largest change of a normal stress that is one level of a test, as a share of it


class ClosureData(NamedTuple):
    """Stress (Pa) and closure (m), (n,), in the order measured."""

    stress: Array
    closure: Array


class ShearData(NamedTuple):
    """Shear displacement (m) and stress (Pa), (n,), in the order measured, at a normal stress (Pa).

    normal: NaN where the file does not say; name: of the file, and of the column if it has several.
    """

    shear: Array
    shear_stress: Array
    normal: float
    name: str


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
    path: the file; its first row names the columns, with their units ("closure_mm",
        "closure [mm]", "closure (mm)", "closure /mm", or in a row of their own).
    stress, closure: names of the two columns, with a unit if the file gives none ("Disp:mm", or
        "Disp:-1mm" where closing counts negative); None finds those of the usual names.

    Raises ValueError naming file, column or row, and the option of the command that helps.
    """
    path, columns = Path(path), read_columns(path)
    s, u = find(columns, STRESS, stress, path)[0], find(columns, CLOSURE, closure, path)[0]
    pressed, closed = _pair(s.values, u.values, path)
    top = int(np.argmax(np.abs(pressed)))
    _require(pressed[top] > 0, s, STRESS, "has compression negative", path)
    _require(closed[top] >= closed[0], u, CLOSURE, "falls while the stress rises", path)
    require_rock({"stress": pressed[top], "closure": float(np.ptp(closed))}, f"{path}: ")
    return ClosureData(pressed, closed)


def read_shear(
    path: str | Path,
    shear: str | None = None,
    stress: str | None = None,
    normal: str | None = None,
    known: bool = False,
) -> list[ShearData]:
    """Direct shear curves from a CSV file, one for each column of shear stress or normal stress.

    Parameters
    ----------
    path: the file, as in `read_closure`.
    shear, stress, normal: names of the columns of shear displacement, shear stress and normal
        stress, with units if the file gives none ("tau:MPa", or "tau:-1MPa" to turn a sign).
    known: whether the normal stress is known otherwise; the file is then not asked for it.

    The normal stress is that of a title "tau at 3 MPa [MPa]", or of a column; where this holds
    several levels there is a test for each. Raises ValueError as `read_closure`.
    """
    path, columns = Path(path), read_columns(path)
    moved, sheared = (
        find(columns, SHEAR, shear, path), find(columns, SHEAR_STRESS, stress, path)
    )  # fmt: skip
    if len(moved) not in (1, len(sheared)):
        raise ValueError(
            f"{path}: has {len(moved)} columns of shear displacement for {len(sheared)} of shear "
            "stress; give one for all or one for each"
        )
    pressed = [] if known else find(columns, NORMAL, normal, path, required=normal is not None)
    tests = []
    for u, tau in zip(moved * (len(sheared) // len(moved)), sheared, strict=True):
        name = path.name if len(sheared) == 1 else f"{path.name}, {tau.title}"
        level = np.nan if tau.normal is None or known else tau.normal
        levels = [(np.ones(tau.values.size, bool), level)]
        if tau.normal is None and pressed:
            levels = _levels(pressed[0], path)
        for here, level in levels:
            x, y = _pair(u.values[here], tau.values[here], path)
            x = x - x[0] if abs(y[0]) < STEADY * np.abs(y).max() else x
            work = float(np.sum(np.diff(x) * (y[1:] + y[:-1])))
            _require(work > 0, tau, SHEAR_STRESS, "opposes the displacement", path)
            span, largest = float(np.ptp(x)), float(np.abs(y).max())
            require_rock({"shear displacement": span, "shear stress": largest}, f"{path}: ")
            tests.append(ShearData(x, y, level, name))
    return tests


def _levels(pressed: Column, path: Path) -> list[tuple[Array, float]]:
    """Rows of each level of normal stress in a column, with the level (Pa)."""
    values = pressed.values
    mean = float(np.nanmean(values))
    _require(mean > 0, pressed, NORMAL, "has compression negative", path)
    if np.nanmax(values) - np.nanmin(values) <= STEADY * mean:
        return [(np.isfinite(values), mean)]
    levels = np.unique(values[np.isfinite(values)])
    if 3 * levels.size > values.size:
        raise ValueError(
            f"{path}: the normal stress of column {pressed.title!r} runs from {levels[0]:.4g} to "
            f"{levels[-1]:.4g} Pa, but only tests at constant normal stress are fitted; cut the "
            f"file, or give the one to take, for example --normal-stress {mean / 1e6:.3g}MPa"
        )
    return [(values == level, float(level)) for level in levels]


def _pair(x: Array, y: Array, path: Path) -> tuple[Array, Array]:
    """The rows in which both columns hold a number."""
    both = np.isfinite(x) & np.isfinite(y)
    if both.sum() < 3:
        raise ValueError(f"{path}: has {int(both.sum())} rows with both numbers; give 3 or more")
    return x[both], y[both]


def _require(right: bool, column: Column, asked: Asked, what: str, path: Path) -> None:
    """Refuse a column whose sign is not ours, with the option that turns it."""
    if not right:
        raise ValueError(
            f"{path}: column {column.title!r} {what}; turn its sign: "
            f'{asked.option} "{column.name}:-1{column.unit or "UNIT"}"'
        )


def _known(name: str) -> None:
    if name not in names():
        raise ValueError(f"data set {name!r} is unknown; {remedy(name, names())}")
