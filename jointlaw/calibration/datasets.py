"""Laboratory tests in files: the data sets of the package, and files of laboratories.

- **Tare.** An initial shear stress of 2 to 10 % of the largest is subtracted as tare; a smaller one
  is scatter. In both cases displacement and opening count from the first row.
- **Initial load.** A larger shear stress at zero displacement is an initial load, as before an
  injection. With a displacement above zero shear began before the first row: displacements that do
  not begin near zero are refused.
- **One test.** A displacement that returns to its start in one row, without a shear stress against
  this motion, is the beginning of another test: the file is refused.
- **Unloading.** The last rows are left out where the shear stress falls by half without further
  displacement: their stress is not the residual shear stress.
- **Normal stress.** If it varies by less than 5 %, its mean is used, otherwise the value of each
  row.
- **Notes.** All changes to a record, and unused rows, are in the `notes` of its curve.
"""

import re
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..parameters.rock import require_rock
from ..support.checks import Array, one_of
from .measured import ShearCurve
from .tables import Column, FileTable, Quantity, read_tables

_FOLDER = Path(__file__).with_name("data")
SHEAR_TESTS = _FOLDER / "shear"  # synthetic: docs/measure/synthetic_shear.py
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
        "δs",
        "δ_s",
        "scherweg",
        "schubweg",
    ),
    "--shear-column",
    ambiguous_aliases=("displacement", "disp", "u"),
)
SHEAR_STRESS = Quantity(
    "shear stress (of a force give the area: --area 100cm2)",
    "Pa",
    ("shear_stress", "tau", "τ", "f2", "scherspannung", "schubspannung"),
    "--shear-stress-column",
)
NORMAL = Quantity(
    "normal stress (or give it: --normal-stress 1MPa)",
    "Pa",
    ("normal_stress", "sigma_n", "σn", "σ_n", "sigma", "sn", "f1", "normalspannung"),
    "--normal-column",
)
SHEAR_FORCE = Quantity(
    "shear force",
    "N",
    ("shear_force", "horizontal_force", "shear_load", "horizontal_load", "fs", "t", "scherkraft"),
    "--shear-stress-column",
)
NORMAL_FORCE = Quantity(
    "normal force (or give the stress: --normal-stress 1MPa)",
    "N",
    ("normal_force", "vertical_force", "normal_load", "vertical_load", "fn", "n", "normalkraft"),
    "--normal-column",
)
CLOSURE_FORCE = Quantity(
    "normal force of the closure test",
    "N",
    (*NORMAL_FORCE.aliases, "axial_force", "axial_load", "force", "load"),
    "--stress-column",
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
        "dilatation",
        "dilatanz",
        "vertical_disp",
        "normal_deformation",
        "vertical_deformation",
        "vertikalverschiebung",
        "vertikalweg",
        "δn",
        "δ_n",
        "dv",
        "v",
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
MAX_ZERO_READING = 1e-3  # of the range of the displacement: the displacement of an initial load
MIN_RESTART = 0.3  # of the range of the displacement, in one row
MAX_RESTART_STRESS = 0.05  # of the largest shear stress: less does not move a joint back
MAX_TAIL_DISPLACEMENT = 0.05  # of the range: while a test is unloaded at its end
MAX_TAIL_STRESS = 0.5  # of the shear stress before
MAX_LOADED_DROP = 0.1  # likewise: a row with less is still loaded
MAX_INITIAL_READING = {"shear": 0.1, "opening": 0.5}  # of the range, if shear began earlier


class ClosureRecord(NamedTuple):
    """A closure test from a file.

    stress: normal stress in Pa, (n,). closure: in m, (n,), in the order measured.
    notes: on unused rows.
    source: which column was read as which quantity.
    """

    stress: Array
    closure: Array
    notes: list[str]
    source: str


def names() -> list[str]:
    """Names of all data sets."""
    return sorted(path.stem for path in _FOLDER.glob("*.csv"))


def load(name: str) -> tuple[Array, Array]:
    """Stress (Pa) and closure (m) of a data set, loading and unloading in the order measured."""
    one_of("data set", name, tuple(names()))
    record = read_closure(_FOLDER / f"{name}.csv")
    return record.stress, record.closure


def copy_shear_tests(folder: str | Path) -> list[Path]:
    """Copy the synthetic direct shear tests of the package, to try a calibration with them.

    Three tests of one joint at 1, 3 and 5 MPa, computed from a law with noise
    (docs/tutorial-calibrate.md). folder: created if missing; files of the same name are replaced.
    Returns the paths of the copies.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    return [Path(shutil.copy(path, target)) for path in sorted(SHEAR_TESTS.glob("*.csv"))]


def read_closure(
    path: str | Path,
    stress: str | None = None,
    closure: str | None = None,
    decimal: str | None = None,
    outliers: str | None = None,
    area: float | None = None,
) -> ClosureRecord:
    """Read the closure test of a text file or spreadsheet.

    Parameters
    ----------
    path: the file; it holds one test.
    stress, closure: names of the two columns, with a unit if the file gives none ("Disp:mm", or
        "Disp:-1mm" if closing counts negative). None finds columns with the usual names.
    decimal: decimal mark, "comma" or "point"; None detects it from the numbers of the file.
    outliers: "skip" or "keep" for rows that may be no measurement; None refuses them.
    area: area in m2 on which the force acts, if the file has a force instead of a stress.

    Raises ValueError naming file, column or line, and the command-line option that helps.
    """
    load = STRESS if area is None else CLOSURE_FORCE
    table, *more = read_tables(Path(path), [(load, stress), (CLOSURE, closure)], decimal)
    if more:
        raise ValueError(f"{path}: holds {1 + len(more)} tests; give a file with one closure test")
    _require_area(table, area, STRESS, CLOSURE_FORCE, "--closure-area", stress)
    columns = [table.column(load, stress), table.column(CLOSURE, closure)]
    (s, u), _, notes = table.complete_rows(columns, outliers)
    peak_row = int(np.argmax(np.abs(s)))
    _require_sign(s[peak_row] > 0, columns[0], load, "has compression negative", table)
    closes = u[peak_row] >= u[0]
    _require_sign(closes, columns[1], CLOSURE, "falls while the stress rises", table)
    load_name = "normal stress" if area is None else "normal force"
    source = _describe_columns({load_name: columns[0], "closure": columns[1]})
    if area is not None:
        s = s / area
        notes.append(f"stress is force over an area of {1e4 * area:.6g} cm2")
    require_rock({"stress": s[peak_row], "closure": float(np.ptp(u))}, f"{path}: ")
    return ClosureRecord(s, u, notes, source)


def _require_area(
    table: FileTable,
    area: float | None,
    stress: Quantity,
    force: Quantity,
    option: str,
    override: str | None,
) -> None:
    """Raise ValueError for forces without an area, or an area without forces."""
    if override is not None:
        return
    has_stress = bool(table.find_columns(stress))
    has_force = bool(table.find_columns(force))
    if area is None and has_force and not has_stress:
        raise ValueError(f"{table.name}: has forces; give the area, {option} 100cm2")
    if area is not None and has_stress and not has_force:
        raise ValueError(f"{table.name}: has stresses, not forces: leave {option} out")


def _describe_columns(columns: Mapping[str, Column]) -> str:
    """Which column was read as which quantity, for a report."""
    return "; ".join(f"{name}: {_title_with_unit(column)}" for name, column in columns.items())


def _title_with_unit(column: Column) -> str:
    """The title of a column, with its unit from a row of units."""
    is_in_title = not column.unit or column.unit in column.title
    return column.title if is_in_title else f"{column.title} [{column.unit}]"


def read_shear(path: str | Path, decimal: str | None = None, **options: Any) -> list[ShearCurve]:
    """Read the direct shear tests of a text file or spreadsheet.

    Parameters
    ----------
    path, decimal: as in `read_closure`.
    shear, stress, normal, opening: names of columns, with units if the file gives none ("tau:MPa",
        or "tau:-1MPa" to change the sign). None finds columns with the usual names. If the joint
        closes while it shears, a factor ("dn:1mm") confirms the sign of the opening. Several
        names of openings, "A,B,C,D:mm", are gauges, whose mean is used.
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
    stress_quantity = SHEAR_FORCE if has_forces else SHEAR_STRESS
    _require_area(table, area, SHEAR_STRESS, SHEAR_FORCE, "--area", stress)
    quantities = {"shear": (SHEAR, shear), "stress": (stress_quantity, stress)}
    if normal_stress is None:
        quantities["normal"] = (NORMAL_FORCE if has_forces else NORMAL, normal)
    columns = {name: table.column(*quantity) for name, quantity in quantities.items()}
    gauges = list[Column]()
    if opening is not None or table.find_columns(OPENING):
        quantities["opening"] = (OPENING, opening)
        gauges = table.gauges(OPENING, opening)
        columns["opening"] = gauges[0]
    complete = table.complete_rows([*columns.values(), *gauges[1:]], outliers)
    readings = dict(zip(columns, complete.values, strict=False))
    notes = complete.notes
    kind = "force" if has_forces else "stress"
    descriptions = {
        "shear": "shear displacement",
        "stress": f"shear {kind}",
        "normal": f"normal {kind}",
        "opening": "opening",
    }
    described = {descriptions[name]: column for name, column in columns.items()}
    described |= {f"opening {k}": gauge for k, gauge in enumerate(gauges[1:], 2)}
    source = _describe_columns(described)
    if len(gauges) > 1:
        readings["opening"], note = _mean_of_gauges(gauges, complete.values[-len(gauges) :])
        notes.append(note)
    elif not gauges and (lengths := table.unused_lengths(columns.values())):
        notes.append(
            f"no opening is read; columns of lengths that are not used: {', '.join(lengths)}. If "
            "one measures the opening, name it: --opening-column"
        )
    if outliers != "keep":
        _require_one_test(readings, complete.lines, table)
    zeroed = _subtract_initial_readings(readings, columns, table)
    notes += zeroed.notes
    x, y, up = zeroed.shear, zeroed.stress, zeroed.opening
    sigma = readings.get("normal", np.full(x.shape, normal_stress))
    if area is not None:
        contact_area = area * (1 - np.abs(x) / (side or np.inf))
        y = y / contact_area
        sigma = sigma / (contact_area if normal_stress is None else 1.0)
    _require_signs(x, y, sigma, up, columns, quantities, table)
    tail = _unloading_rows(x, y)
    if tail:
        notes.append(
            f"{tail} rows at the end are unloading, from {abs(y[-tail - 1]):.4g} to "
            f"{abs(y[-1]):.4g} Pa without further displacement: they are left out"
        )
        x, y, sigma = x[:-tail], y[:-tail], sigma[:-tail]
        up = None if up is None else up[:-tail]
    mean = float(np.mean(sigma))
    _require_plausible_test(x, np.abs(y), sigma, f"{table.name}: ", up)
    label = f"{Path(table.name).name}, {mean / 1e6:.3g} MPa"
    is_constant = np.ptp(sigma) <= MAX_CONSTANT_STRESS_CHANGE * mean
    return ShearCurve(
        x,
        y,
        mean if is_constant else sigma,
        opening=up,
        name=label,
        notes=tuple(notes),
        source=source,
        initial_stress=float(y[0]) if zeroed.is_loaded else 0.0,
    )


def _mean_of_gauges(gauges: list[Column], values: list[Array]) -> tuple[Array, str]:
    """The mean (n,) of gauges of one displacement, and a note with their largest difference."""
    changes = np.array([column - column[0] for column in values])
    difference = float(np.max(np.ptp(changes, axis=0)))
    titles = ", ".join(gauge.title for gauge in gauges)
    note = (
        f"the opening is the mean of {len(gauges)} gauges, {titles}; they differ by up to "
        f"{1e3 * difference:.3g} mm"
    )
    return np.mean(values, axis=0), note


def _require_one_test(readings: dict[str, Array], lines: list[int], table: FileTable) -> None:
    """Raise ValueError for a second test in the rows of a first one, naming its line.

    Friction opposes slip: a joint that moves back by a large part of the displacement has a shear
    stress in the direction of this motion. Without it the specimen, or the gauge, was set back.
    """
    x = readings["shear"]
    y = readings["stress"]
    sense = np.sign(np.sum(np.diff(x) * (y[1:] + y[:-1]))) or 1.0  # of a column with the wrong sign
    steps = np.diff(x)
    driving = sense * y[1:] * np.sign(steps) / np.max(np.abs(y))
    is_large = np.abs(steps) > MIN_RESTART * np.ptp(x)
    is_back = np.abs(x[1:] - x[0]) < np.abs(x[:-1] - x[0])
    restarts = np.flatnonzero(is_large & is_back & (driving < MAX_RESTART_STRESS))
    if restarts.size:
        row = int(restarts[0]) + 1
        raise ValueError(
            f"{table.name}: line {lines[row]}: the shear displacement returns from "
            f"{1e3 * x[row - 1]:.4g} to {1e3 * x[row]:.4g} mm in one row, without a shear stress "
            "in this direction, as if another test began: repeat the line of names above it to "
            "read two tests, remove the rows that do not belong to this test, or, if it is one "
            "test, write --outliers keep"
        )


def _unloading_rows(x: Array, y: Array) -> int:
    """Number of rows at the end in which the shear stress falls without further displacement.

    Parameters
    ----------
    x: shear displacement in m, (n,).
    y: shear stress, (n,).
    """
    sense = np.sign(x[-1] - x[0])
    distance = sense * (x - x[-1])
    # the rows about the last displacement, and what the joint carried there
    before = np.flatnonzero(np.abs(distance) > MAX_TAIL_DISPLACEMENT * np.ptp(x))
    start = int(before[-1]) + 1 if before.size else 0
    carried = float(np.max(np.abs(y[max(start - 1, 0) :])))
    if not abs(y[-1]) < MAX_TAIL_STRESS * carried:
        return 0
    loaded = np.flatnonzero(np.abs(y) >= (1 - MAX_LOADED_DROP) * carried)
    last = int(loaded[-1])
    advance = float(np.max(distance[last:])) - float(distance[last])
    is_tail = last >= start - 1 and advance < 0.1 * MAX_TAIL_DISPLACEMENT * np.ptp(x)
    return x.size - 1 - last if is_tail else 0


class _Zeroed(NamedTuple):
    """Readings of a shear test from the start of shear, or from an initial load."""

    shear: Array
    stress: Array
    opening: Array | None
    notes: list[str]
    is_loaded: bool


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
    is_loaded = abs(y[0]) > MAX_TARE * largest and abs(x[0]) <= MAX_ZERO_READING * float(np.ptp(x))
    if is_loaded:
        middle = y[np.argmax(np.abs(x - x[0]))]
        if y[0] * middle < 0:
            raise ValueError(
                f"{table.name}: column {columns['stress'].title!r} begins at {initial_percent:.2g} "
                "% of its largest value, against the shear: subtract it from the column if it is a "
                "tare, or begin the record where the shear stress is zero"
            )
        notes.append(
            f"the record begins at a shear stress of {initial_percent:.2g} % of the largest: the "
            "joint is loaded to it first, and displacements count from there"
        )
        up = None if up is None else up - up[0]
        return _Zeroed(x - x[0], y, up, notes, True)
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
    return _Zeroed(x, y, up, notes, False)


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


def _require_plausible_test(
    x: Array, tau: Array, sigma: Array, where: str, up: Array | None = None
) -> None:
    """Raise ValueError for magnitudes that a test on rock cannot have: a wrong unit.

    Parameters
    ----------
    x: shear displacement in m, (n,).
    tau: absolute shear stress in Pa, (n,).
    sigma: normal stress in Pa, (n,).
    where: beginning of the message.
    up: opening in m, (n,), or None.
    """
    if not np.min(sigma) > 0:
        raise ValueError(
            f"{where}normal stress = {np.min(sigma):g} Pa in a row must be > 0; are columns "
            "exchanged? Leave rows without a normal stress out"
        )
    magnitudes = {
        "shear displacement": float(np.ptp(x)),
        "shear stress": float(tau.max()),
        "normal stress": float(np.mean(sigma)),
        "peak shear stress over normal stress": float(np.max(tau / sigma)),
    }
    if up is not None:
        magnitudes["opening over shear displacement"] = float(np.ptp(up) / np.ptp(x))
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
