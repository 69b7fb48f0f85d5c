"""Tests on joints in files, those of the package and those of laboratories, with stated rules.

- Shear stress that begins at 2 to 10 % of its largest value is taken as tare, and subtracted; less
  is scatter. Then, and below 2 %, displacement and opening count from the first row. If it begins
  higher, shear began before the first row: gauges that are not near zero there are refused.
- A normal stress that changes by 5 % at most is its mean, else that of each row.
- What is done to a record, and rows that are not used, are in the `notes` of a curve.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np

from ..parameters.rock import require_rock
from ..support.checks import Array, one_of
from .measured import ShearCurve
from .tables import Asked, Column, Table, read_tables

_FOLDER = Path(__file__).with_name("data")
STRESS = Asked(
    "normal stress of the closure test (a direct shear test goes after --shear)", "Pa",
    ("stress", "normal_stress", "sigma", "sigmaz", "sigma_n", "σ", "σn", "σ_n", "f1"),
    "--stress-column",
)  # fmt: skip
CLOSURE = Asked(
    "closure", "m", ("closure", "normal_closure", "normal_displacement"), "--closure-column",
    ("disp", "displacement"),
)  # fmt: skip
SHEAR = Asked(
    "shear displacement (a closure test goes before --shear)", "m",
    ("shear", "shear_displacement", "shear_disp", "us", "u_s", "ds", "horizontal_displacement",
     "shear_2"),
    "--shear-column", ("displacement", "disp", "u"),
)  # fmt: skip
SHEAR_STRESS = Asked(
    "shear stress (of a force give the area: --area 100cm2)", "Pa",
    ("shear_stress", "tau", "τ", "f2"), "--shear-stress-column",
)  # fmt: skip
NORMAL = Asked(
    "normal stress (or give it: --normal-stress 1MPa)", "Pa",
    ("normal_stress", "sigma_n", "σn", "σ_n", "sigma", "sn", "f1"), "--normal-column",
)  # fmt: skip
SHEAR_FORCE = Asked(
    "shear force", "N", ("shear_force", "horizontal_force", "fs", "t"), "--shear-stress-column"
)
NORMAL_FORCE = Asked(
    "normal force (or give the stress: --normal-stress 1MPa)", "N",
    ("normal_force", "vertical_force", "fn", "n"), "--normal-column",
)  # fmt: skip
OPENING = Asked(
    "opening", "m",
    ("opening", "dilation", "dilatancy", "normal_displacement", "vertical_displacement",
     "normal_disp", "un", "u_n", "dn", "uv"),
    "--opening-column",
)  # fmt: skip
PEAKS = (
    Asked("peak shear stress", "Pa", ("peak_shear_stress", "peak", "tau_p", "taup"), "a title"),
    Asked("displacement at the peak", "m",
          ("peak_shear_displacement", "peak_displacement", "u_p", "up"), "a title"),
    Asked("last shear stress", "Pa",
          ("final_shear_stress", "residual_shear_stress", "residual", "tau_r", "taur"), "a title"),
    Asked("displacement there", "m",
          ("final_shear_displacement", "residual_shear_displacement", "residual_displacement",
           "u_r", "ur"), "a title"),
)  # fmt: skip
STEADY = 0.05  # largest change of a normal stress that counts as constant, as a share of it
SCATTER, TARE = 0.02, 0.1  # of the largest shear stress: see above
# for a column of another unit than the one that was read
REMEDIES = {
    "stress": f'is the column in another unit? Name it: {STRESS.option} "NAME:MPa"',
    "closure": f'is the column in another unit? Name it: {CLOSURE.option} "NAME:um"',
    "shear stress": f'is the column in another unit? Name it: {SHEAR_STRESS.option} "NAME:MPa"',
    "shear displacement": f'is the column in another unit? Name it: {SHEAR.option} "NAME:mm"',
}
OFF = {"shear": 0.1, "opening": 0.5}  # of the range of a gauge: how far it begins from zero


def names() -> list[str]:
    """Names of all data sets."""
    return sorted(path.stem for path in _FOLDER.glob("*.csv"))


def load(name: str) -> tuple[Array, Array]:
    """Stress (Pa) and closure (m) of a data set, loading and unloading in the order measured."""
    one_of("data set", name, tuple(names()))
    return read_closure(_FOLDER / f"{name}.csv")[:2]


def read_closure(
    path: str | Path,
    stress: str | None = None,
    closure: str | None = None,
    decimal: str | None = None,
    outliers: str | None = None,
) -> tuple[Array, Array, list[str]]:
    """Stress (Pa) and closure (m) of a test in a text file or spreadsheet, (n,), and notes.

    Parameters
    ----------
    path: the file, which holds this one test.
    stress, closure: names of the two columns, with a unit if the file gives none ("Disp:mm", or
        "Disp:-1mm" where closing counts negative); None finds those of the usual names.
    decimal: the decimal mark, "comma" or "point"; None finds it, if a number of the file shows it.
    outliers: "skip" or "keep" for rows that may be no measurement; None refuses them.

    Raises ValueError naming file, column or line, and the option of the command that helps.
    """
    table, *more = read_tables(Path(path), [(STRESS, stress), (CLOSURE, closure)], decimal)
    if more:
        raise ValueError(f"{path}: holds {1 + len(more)} tests; give a file with one closure test")
    s, u = table.column(STRESS, stress), table.column(CLOSURE, closure)
    (pressed, closed), notes = table.rows([s, u], outliers)
    top = int(np.argmax(np.abs(pressed)))
    _require_sign(pressed[top] > 0, s, STRESS, "has compression negative", table)
    _require_sign(closed[top] >= closed[0], u, CLOSURE, "falls while the stress rises", table)
    require_rock({"stress": pressed[top], "closure": float(np.ptp(closed))}, f"{path}: ", REMEDIES)
    return pressed, closed, notes


def read_shear(path: str | Path, decimal: str | None = None, **how: Any) -> list[ShearCurve]:
    """The direct shear tests of a text file or spreadsheet.

    Parameters
    ----------
    path, decimal: as in `read_closure`.
    shear, stress, normal, opening: names of columns with units if the file gives none ("tau:MPa",
        or "tau:-1MPa" to turn a sign); by default those of the usual names. A joint may close
        while it shears: a factor, "dn:1mm", says that the sign of the opening is meant.
    normal_stress: Pa, of all tests of the file instead of a column.
    outliers: as in `read_closure`.
    area: m2 that the forces act on, of a file with forces; side: length (m) of that area along
        the shear, if it shrinks with the displacement.

    Raises ValueError as `read_closure`.
    """
    of_stress = SHEAR_STRESS if how.get("area") is None else SHEAR_FORCE
    needed = [(SHEAR, how.get("shear")), (of_stress, how.get("stress"))]
    return [_shear_test(table, **how) for table in read_tables(Path(path), needed, decimal)]


def _shear_test(
    table: Table,
    shear: str | None = None,
    stress: str | None = None,
    normal: str | None = None,
    opening: str | None = None,
    normal_stress: float | None = None,
    outliers: str | None = None,
    area: float | None = None,
    side: float | None = None,
) -> ShearCurve:
    """One test, by the rules above."""
    of_stress, of_normal = (SHEAR_STRESS, NORMAL) if area is None else (SHEAR_FORCE, NORMAL_FORCE)
    asked = {"shear": (SHEAR, shear), "stress": (of_stress, stress)}
    if normal_stress is None:
        asked["normal"] = of_normal, normal
    if opening is not None or table.named(OPENING):
        asked["opening"] = OPENING, opening
    columns = {name: table.column(*one) for name, one in asked.items()}
    values, notes = table.rows([*columns.values()], outliers)
    found = dict(zip(columns, values, strict=True))
    x, y, opened = found["shear"], found["stress"], found.get("opening")
    largest = float(np.abs(y).max())
    if abs(y[0]) <= TARE * largest:  # the gauges need not begin at zero
        if abs(y[0]) > SCATTER * largest:
            notes.append(
                f"the shear stress begins at {100 * abs(y[0]) / largest:.2g} % of its largest "
                "value, which is subtracted as tare"
            )
            y = y - y[0]
        x, opened = x - x[0], None if opened is None else opened - opened[0]
    for name, share in OFF.items():  # else
        gauge = {"shear": x, "opening": opened}[name]
        if gauge is not None and abs(gauge[0]) > share * np.ptp(gauge):
            raise ValueError(
                f"{table.name}: column {columns[name].title!r} begins at {gauge[0]:.4g} m, with "
                f"{100 * abs(y[0]) / largest:.2g} % of the largest shear stress, so shear began "
                "before: add a first row with the readings there and zero shear stress"
            )
    pressed = found.get("normal", np.full(x.shape, normal_stress))
    if area is not None:
        now = area * (1 - np.abs(x) / (side or np.inf))
        y, pressed = y / now, pressed / (now if normal_stress is None else 1.0)
    work = np.sum(np.diff(x) * (y[1:] + y[:-1]))
    meant = re.search(r":[-+.\d]", opening or "")  # a factor
    opens = opened is None or meant or opened[np.argmax(np.abs(x))] >= 0
    signs = {
        "normal": (np.mean(pressed) > 0, "has compression negative"),
        "stress": (work > 0, "opposes the displacement"),
        "opening": (opens, "closes the joint by the end"),
    }
    for name, (right, what) in signs.items():
        if name in columns:
            _require_sign(right, columns[name], asked[name][0], what, table)
    mean = float(np.mean(pressed))
    require_rock(
        {
            "shear displacement": float(np.ptp(x)),
            "shear stress": float(np.abs(y).max()),
            "normal stress": mean,
            "peak shear stress over normal stress": float(np.max(np.abs(y) / pressed)),
        },
        f"{table.name}: ",
        REMEDIES,
    )
    label = f"{Path(table.name).name}, {mean / 1e6:.3g} MPa"
    steady = mean if np.ptp(pressed) <= STEADY * mean else pressed
    return ShearCurve(x, y, steady, opening=opened, name=label, notes=tuple(notes))


def read_peaks(
    path: str | Path, decimal: str | None = None, outliers: str | None = None
) -> list[ShearCurve]:
    """Direct shear tests of which peak and last shear stress are known, one test a row.

    Columns: normal stress, peak shear stress, its displacement, last shear stress, its
    displacement; all > 0. decimal, outliers: as in `read_closure`. Raises ValueError as that, and
    for a row that is no such test or has an empty cell, naming its line.
    """
    found = []
    for table in read_tables(Path(path), [(one, None) for one in PEAKS], decimal):
        columns = [table.column(one) for one in (NORMAL, *PEAKS)]
        skipped, told = table.odd_rows(columns, outliers, table.lines, {})
        notes = *table.notes, *told
        for line, *row in zip(table.lines, *(column.values for column in columns), strict=True):
            if line not in skipped:
                found.append(_peak_test(row, columns, f"{table.name}: line {line}", notes))
    return found


def _peak_test(
    row: list[float], columns: list[Column], where: str, notes: tuple[str, ...]
) -> ShearCurve:
    """The test of one row, by `read_peaks`."""
    for value, column in zip(row, columns, strict=True):
        if not value > 0:
            raise ValueError(
                f"{where}: {column.title!r} is empty or not > 0; give all five numbers of a test, "
                "or remove the row"
            )
    normal, peak, at, last, end = row
    if last > peak or at > end or (at == end and last < peak):
        raise ValueError(
            f"{where}: the peak, {peak:.4g} Pa at {at:.4g} m, must be no less than the last shear "
            f"stress, {last:.4g} Pa at {end:.4g} m, and come before it; are columns exchanged?"
        )
    require_rock(
        {
            "shear displacement": end,
            "shear stress": peak,
            "normal stress": normal,
            "peak shear stress over normal stress": peak / normal,
        },
        f"{where}: ",
    )
    name = f"{Path(where.partition(': ')[0]).name}, {normal / 1e6:.3g} MPa"
    x, y = np.array([0.0, at, end]), np.array([0.0, peak, last])
    return ShearCurve(x, y, normal, name=name, notes=notes)


def _require_sign(right: Any, column: Column, asked: Asked, what: str, table: Table) -> None:
    """Refuse a column whose sign is not ours, with the option that turns it or means it."""
    if not right:
        turn = f'{asked.option} "{column.name}:-1{column.unit or "UNIT"}"'
        meant = f"; if the joint does close, write {turn.replace(':-1', ':1')}"
        raise ValueError(
            f"{table.name}: column {column.title!r} {what}; turn its sign: {turn}"
            + meant * (asked is OPENING)
        )
