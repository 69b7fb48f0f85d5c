"""Laboratory tests in files: the data sets of the package, and files of laboratories.

- **Tare.** An initial shear stress of 2 to 10 % of the largest is subtracted as tare; a smaller one
  is scatter. In both cases displacement and opening count from the first row. With a larger initial
  shear stress, shear began before the first row: displacements that do not begin near zero are then
  refused.
- **Normal stress.** If it varies by less than 5 %, its mean is used, otherwise the value of each
  row.
- **Notes.** All changes to a record, and unused rows, are in the `notes` of its curve.
"""

import re
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..parameters.rock import require_rock
from ..support.checks import Array, one_of
from .measured import ShearCurve
from .tables import Column, FileTable, Quantity, read_tables

_FOLDER = Path(__file__).with_name("data")
STRESS = Quantity(
    "normal stress of the closure test (a direct shear test goes after --shear)",
    "Pa",
    ("stress", "normal_stress", "sigma", "sigmaz", "sigma_n", "σ", "σn", "σ_n", "f1"),
    "--stress-column",
)
CLOSURE = Quantity(
    "closure",
    "m",
    ("closure", "normal_closure", "normal_displacement"),
    "--closure-column",
    ambiguous_aliases=("disp", "displacement"),
)
SHEAR = Quantity(
    "shear displacement (a closure test goes before --shear)",
    "m",
    (
        "shear",
        "shear_displacement",
        "shear_disp",
        "us",
        "u_s",
        "ds",
        "horizontal_displacement",
        "shear_2",
    ),
    "--shear-column",
    ambiguous_aliases=("displacement", "disp", "u"),
)
SHEAR_STRESS = Quantity(
    "shear stress (of a force give the area: --area 100cm2)",
    "Pa",
    ("shear_stress", "tau", "τ", "f2"),
    "--shear-stress-column",
)
NORMAL = Quantity(
    "normal stress (or give it: --normal-stress 1MPa)",
    "Pa",
    ("normal_stress", "sigma_n", "σn", "σ_n", "sigma", "sn", "f1"),
    "--normal-column",
)
SHEAR_FORCE = Quantity(
    "shear force",
    "N",
    ("shear_force", "horizontal_force", "fs", "t"),
    "--shear-stress-column",
)
NORMAL_FORCE = Quantity(
    "normal force (or give the stress: --normal-stress 1MPa)",
    "N",
    ("normal_force", "vertical_force", "fn", "n"),
    "--normal-column",
)
OPENING = Quantity(
    "opening",
    "m",
    (
        "opening",
        "dilation",
        "dilatancy",
        "normal_displacement",
        "vertical_displacement",
        "normal_disp",
        "un",
        "u_n",
        "dn",
        "uv",
    ),
    "--opening-column",
)
PEAKS = (
    Quantity(
        "peak shear stress",
        "Pa",
        ("peak_shear_stress", "peak", "tau_p", "taup"),
        "a title",
    ),
    Quantity(
        "displacement at the peak",
        "m",
        ("peak_shear_displacement", "peak_displacement", "u_p", "up"),
        "a title",
    ),
    Quantity(
        "residual shear stress",
        "Pa",
        ("final_shear_stress", "residual_shear_stress", "residual", "tau_r", "taur"),
        "a title",
    ),
    Quantity(
        "displacement at the residual",
        "m",
        (
            "final_shear_displacement",
            "residual_shear_displacement",
            "residual_displacement",
            "u_r",
            "ur",
        ),
        "a title",
    ),
)
MAX_CONSTANT_STRESS_CHANGE = 0.05  # of the mean normal stress
MAX_SCATTER = 0.02  # of the largest shear stress: a larger initial shear stress is tare
MAX_TARE = 0.1  # of the largest shear stress
MAX_INITIAL_READING = {"shear": 0.1, "opening": 0.5}  # of the range, if shear began earlier


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
    """Read the closure test of a text file or spreadsheet.

    Parameters
    ----------
    path: the file; it holds one test.
    stress, closure: names of the two columns, with a unit if the file gives none ("Disp:mm", or
        "Disp:-1mm" if closing counts negative). None finds columns with the usual names.
    decimal: decimal mark, "comma" or "point"; None detects it from the numbers of the file.
    outliers: "skip" or "keep" for rows that may be no measurement; None refuses them.

    Returns stress (Pa), closure (m), (n,) each, and notes on unused rows. Raises
    ValueError naming file, column or line, and the command-line option that helps.
    """
    quantities = [(STRESS, stress), (CLOSURE, closure)]
    table, *more = read_tables(Path(path), quantities, decimal)
    if more:
        raise ValueError(f"{path}: holds {1 + len(more)} tests; give a file with one closure test")
    stress_column = table.column(STRESS, stress)
    closure_column = table.column(CLOSURE, closure)
    (s, u), notes = table.complete_rows([stress_column, closure_column], outliers)
    peak_row = int(np.argmax(np.abs(s)))
    _require_sign(s[peak_row] > 0, stress_column, STRESS, "has compression negative", table)
    closes = u[peak_row] >= u[0]
    _require_sign(closes, closure_column, CLOSURE, "falls while the stress rises", table)
    require_rock({"stress": s[peak_row], "closure": float(np.ptp(u))}, f"{path}: ")
    return s, u, notes


def read_shear(path: str | Path, decimal: str | None = None, **options: Any) -> list[ShearCurve]:
    """Read the direct shear tests of a text file or spreadsheet.

    Parameters
    ----------
    path, decimal: as in `read_closure`.
    shear, stress, normal, opening: names of columns, with units if the file gives none ("tau:MPa",
        or "tau:-1MPa" to change the sign). None finds columns with the usual names. If the joint
        closes while it shears, a factor ("dn:1mm") confirms the sign of the opening.
    normal_stress: normal stress in Pa of all tests of the file, instead of a column.
    outliers: as in `read_closure`.
    area: area in m2 on which the forces act, if the file has forces.
    side: length in m of this area along the shear, if the area shrinks with the displacement.

    Returns a `ShearCurve` for each test. Raises ValueError as `read_closure`.
    """
    stress_quantity = SHEAR_STRESS if options.get("area") is None else SHEAR_FORCE
    quantities = [(SHEAR, options.get("shear")), (stress_quantity, options.get("stress"))]
    return [_shear_test(table, **options) for table in read_tables(Path(path), quantities, decimal)]


def _shear_test(
    table: FileTable,
    shear: str | None = None,
    stress: str | None = None,
    normal: str | None = None,
    opening: str | None = None,
    normal_stress: float | None = None,
    outliers: str | None = None,
    area: float | None = None,
    side: float | None = None,
) -> ShearCurve:
    """One direct shear test, by the rules at the top of this module."""
    has_forces = area is not None
    quantities = {
        "shear": (SHEAR, shear),
        "stress": (SHEAR_FORCE if has_forces else SHEAR_STRESS, stress),
    }
    if normal_stress is None:
        quantities["normal"] = (NORMAL_FORCE if has_forces else NORMAL, normal)
    if opening is not None or table.find_columns(OPENING):
        quantities["opening"] = (OPENING, opening)
    columns = {name: table.column(*quantity) for name, quantity in quantities.items()}
    values, notes = table.complete_rows([*columns.values()], outliers)
    readings = dict(zip(columns, values, strict=True))
    zeroed = _subtract_initial_readings(readings, columns, table)
    notes += zeroed.notes
    x, y, up = zeroed.shear, zeroed.stress, zeroed.opening
    sigma = readings.get("normal", np.full(x.shape, normal_stress))
    if area is not None:
        contact_area = area * (1 - np.abs(x) / (side or np.inf))
        y = y / contact_area
        sigma = sigma / (contact_area if normal_stress is None else 1.0)
    _require_signs(x, y, sigma, up, columns, quantities, table)
    mean = float(np.mean(sigma))
    _require_plausible_test(x, np.abs(y), sigma, f"{table.name}: ")
    label = f"{Path(table.name).name}, {mean / 1e6:.3g} MPa"
    is_constant = np.ptp(sigma) <= MAX_CONSTANT_STRESS_CHANGE * mean
    return ShearCurve(
        x, y, mean if is_constant else sigma, opening=up, name=label, notes=tuple(notes)
    )


class _Zeroed(NamedTuple):
    """Readings of a shear test from the start of shear."""

    shear: Array
    stress: Array
    opening: Array | None
    notes: list[str]


def _subtract_initial_readings(
    readings: dict[str, Array], columns: dict[str, Column], table: FileTable
) -> _Zeroed:
    """Subtract the readings of the first row, and a tare of the shear stress.

    Raises ValueError if shear began before the first row and a displacement is not near zero there.
    """
    x = readings["shear"]
    y = readings["stress"]
    up = readings.get("opening")
    notes = list[str]()
    largest = float(np.abs(y).max())
    initial_percent = 100 * abs(y[0]) / largest
    if abs(y[0]) <= MAX_TARE * largest:
        if abs(y[0]) > MAX_SCATTER * largest:
            notes.append(
                f"the shear stress begins at {initial_percent:.2g} % of its largest value, which "
                "is subtracted as tare"
            )
            y = y - y[0]
        x = x - x[0]
        up = None if up is None else up - up[0]
    for name, displacement in {"shear": x, "opening": up}.items():
        if displacement is None:
            continue
        if abs(displacement[0]) > MAX_INITIAL_READING[name] * np.ptp(displacement):
            raise ValueError(
                f"{table.name}: column {columns[name].title!r} begins at {displacement[0]:.4g} m, "
                f"with {initial_percent:.2g} % of the largest shear stress, so shear began before: "
                "add a first row with the readings there and zero shear stress"
            )
    return _Zeroed(x, y, up, notes)


def _require_signs(
    x: Array,
    y: Array,
    sigma: Array,
    up: Array | None,
    columns: dict[str, Column],
    quantities: dict[str, tuple[Quantity, str | None]],
    table: FileTable,
) -> None:
    """Raise ValueError for compression or opening counted negative, or shear stress that does
    negative work.
    """
    work = np.sum(np.diff(x) * (y[1:] + y[:-1]))
    _, override = quantities.get("opening", (OPENING, None))
    sign_is_confirmed = re.search(r":[-+.\d]", override or "")  # by a factor
    opens = up is None or sign_is_confirmed or up[np.argmax(np.abs(x))] >= 0
    signs = {
        "normal": (np.mean(sigma) > 0, "has compression negative"),
        "stress": (work > 0, "opposes the displacement"),
        "opening": (opens, "closes the joint by the end"),
    }
    for name, (is_right, problem) in signs.items():
        if name in columns:
            _require_sign(is_right, columns[name], quantities[name][0], problem, table)


def _require_plausible_test(x: Array, tau: Array, sigma: Array, where: str) -> None:
    """Raise ValueError for magnitudes that a test on rock cannot have: a wrong unit.

    Parameters
    ----------
    x: shear displacement in m, (n,).
    tau: absolute shear stress in Pa, (n,).
    sigma: normal stress in Pa, (n,).
    where: beginning of the message.
    """
    magnitudes = {
        "shear displacement": float(np.ptp(x)),
        "shear stress": float(tau.max()),
        "normal stress": float(np.mean(sigma)),
        "peak shear stress over normal stress": float(np.max(tau / sigma)),
    }
    require_rock(magnitudes, where)


def read_peaks(
    path: str | Path, decimal: str | None = None, outliers: str | None = None
) -> list[ShearCurve]:
    """Read direct shear tests with peak and residual shear stress, one test per row.

    The columns are normal stress, peak shear stress and its displacement, residual shear stress and
    its displacement; all > 0.

    Parameters
    ----------
    path, decimal, outliers: as in `read_closure`.

    Returns a `ShearCurve` of three points for each row. Raises ValueError as `read_closure`, and
    for a row with another test or an empty cell, naming its line.
    """
    curves = []
    for table in read_tables(Path(path), [(quantity, None) for quantity in PEAKS], decimal):
        columns = [table.column(quantity) for quantity in (NORMAL, *PEAKS)]
        skipped, outlier_notes = table.outlier_rows(columns, outliers, table.lines, {})
        notes = (*table.notes, *outlier_notes)
        rows = zip(table.lines, *(column.values for column in columns), strict=True)
        for line, *row in rows:
            if line not in skipped:
                curves.append(_peak_test(row, columns, f"{table.name}: line {line}", notes))
    return curves


def _peak_test(
    row: list[float], columns: list[Column], where: str, notes: tuple[str, ...]
) -> ShearCurve:
    """The test of one row of `read_peaks`."""
    for value, column in zip(row, columns, strict=True):
        if not value > 0:
            raise ValueError(
                f"{where}: {column.title!r} is empty or not > 0; give all five numbers of a test, "
                "or remove the row"
            )
    normal, peak, peak_displacement, residual, end = row
    is_reversed = peak_displacement > end or (peak_displacement == end and residual < peak)
    if residual > peak or is_reversed:
        raise ValueError(
            f"{where}: the peak, {peak:.4g} Pa at {peak_displacement:.4g} m, must be at least the "
            f"residual shear stress, {residual:.4g} Pa at {end:.4g} m, and come before it; are "
            "columns exchanged?"
        )
    x = np.array([0.0, peak_displacement, end])
    y = np.array([0.0, peak, residual])
    _require_plausible_test(x, y, np.full(x.shape, normal), f"{where}: ")
    name = f"{Path(where.partition(': ')[0]).name}, {normal / 1e6:.3g} MPa"
    return ShearCurve(x, y, normal, name=name, notes=notes)


def _require_sign(
    is_right: Any, column: Column, quantity: Quantity, problem: str, table: FileTable
) -> None:
    """Raise ValueError for a column of the wrong sign, with the option that changes the sign or
    confirms it.
    """
    if is_right:
        return
    change = f'{quantity.option} "{column.name}:-1{column.unit or "UNIT"}"'
    message = f"{table.name}: column {column.title!r} {problem}; change its sign: {change}"
    if quantity is OPENING:
        message += f"; if the joint does close, write {change.replace(':-1', ':1')}"
    raise ValueError(message)
