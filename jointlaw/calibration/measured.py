"""Measured curves: their data, expected noise, and residuals of a law."""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from ..laws.joint_law import JointLaw
from ..parameters.resolution import Resolution
from ..support.checks import Array, at_least, finite, more_than, number
from .forward import INITIAL_STEPS, Settings, build_law, log_stress
from .noise import Series
from .priors import Values
from .shearing import ShearPath, SimulatedTest, simulate_shear

STRESS_NOISE = 0.01  # of the stress: a load cell with the friction of its loading frame
LOAD_CELL_NOISE = 0.005  # of the largest stress: load cells are graded by their full scale
CLOSURE_NOISE = 0.005  # of the largest closure: linearity and repeatability of a transducer
SHEAR_NOISE = 0.02  # of the largest shear stress
OPENING_NOISE = 0.03  # of the largest opening: a gauge beside a joint that tilts slightly
# resolution of shear tests with `INITIAL_STEPS`: shear stress within 0.2 % of a finer one
INITIAL_CELLS = Resolution(10, 10, 24)
MAX_REFINEMENT = 4  # of the cells; beyond, only the steps are refined
CELLS_PER_STEPS = 0.6  # exponent: the cells are refined with this power of the steps
SHORTEST_STEP = 0.002  # of the whole shear displacement: at the start and after a reversal
MIN_STRESS_DROP = 0.2  # of the stress at a peak: a smaller drop is scatter, not a reversal
MIN_STRESS_DROP_OF_LARGEST = 0.02  # likewise, of the largest stress
MAX_SLACK_STRESS = 0.002  # of the largest stress: rows with less are slack
MIN_SHEAR_REVERSAL = 0.02  # of the largest shear displacement: a smaller reversal is scatter
MIN_PEAK_DROP = 0.04  # of the peak stress, twice the noise: a curve that falls less has no peak
PEAK_DISPLACEMENT_NOISE = 0.3  # of its logarithm: peaks are flat, and specimens differ
MIN_PEAK_RATIO = 1e-3  # of displacements of the peak, of a model and measured
MAX_ARC_BLOCKS = 100  # blocks of rows that are averaged to measure the length of a curve
MIN_CLOSURE_POINTS = 4
MIN_SHEAR_POINTS = 3
_COLUMNS = ("shear", "shear_stress", "normal", "opening")


@dataclass(frozen=True, eq=False)
class ClosureCurve:
    """A closure test: normal stress against closure, in first loading or over whole load cycles.

    Parameters
    ----------
    stress: normal stress in Pa, (n,), >= 0.
    closure: closure in m, (n,), from any origin. Unloading is left out (see `first_loading`) unless
        `cycle`.
    noise: known standard error of the stress relative to it; the closure is then taken as exact.
        None expects 1 % of the stress with 0.5 % of the largest stress, and 0.5 % of the largest
        closure, and estimates the levels of both from the residuals.
    cycle: True for whole cycles of loading, unloading and reloading in their order. Only a law with
        a yield_interference has a hysteresis loop to fit to them.
    compliance: of rock and machine, whose deformation the test measured too: closure per stress in
        m/Pa. It is subtracted from `closure`; 0 if the joint alone was measured.
    name, notes: name of the test in reports, and changes made to its record.
    source: where the numbers are from, for reports.

    `preload_closure` is the closure (m) of the law at the origin of the measured closure. It is
    known if the first row has zero stress; otherwise it is None, and fitted. Several rows of zero
    stress at the beginning are slack: they are left out, and first contact is unknown.

    Raises ValueError for arrays of different lengths, fewer than four points, unloading without
    `cycle`, cycles without unloading, or a compliance that exceeds the curve.

    >>> curve = jl.ClosureCurve(stress=record.F1[:100], closure=record.closure[:100])
    """

    stress: Array
    closure: Array
    noise: float | None = None
    cycle: bool = False
    compliance: float = 0.0
    name: str = "closure"
    notes: tuple[str, ...] = ()
    source: str = ""
    preload_closure: float | None = field(init=False)
    series: tuple[Series, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        stress, closure = _same_length(stress=self.stress, closure=self.closure)
        if (stress < 0).any():
            raise ValueError(f"stress = {stress.min():g} Pa is out of bounds: it must be >= 0")
        stress, closure = self._without_slack(stress, closure)
        reversals = reversal_rows(stress)
        peak = reversals[1]
        closure = self._without_compliance(stress, closure, peak)
        if self.cycle != (len(reversals) > 2):
            raise ValueError(
                f"cycle = {self.cycle}, but stress {'never falls' if self.cycle else 'falls'} by a "
                f"fifth from {stress[peak]:g} Pa after point {peak}: give cycle=True with loading "
                "and unloading, or the first loading alone (calibration.measured.first_loading)"
            )
        # 0.0 - x, not -x, which may be -0.0
        preload_closure = 0.0 - float(closure[0]) if stress[0] == 0.0 else None
        is_loaded = stress > 0  # a point at zero stress only determines the origin of the closure
        stress = stress[is_loaded]
        closure = closure[is_loaded]
        if stress.size < MIN_CLOSURE_POINTS or not np.ptp(closure) > 0:
            raise ValueError(
                f"stress has {stress.size} points above zero over a closure of "
                f"{np.ptp(closure) if closure.size else 0:g} m: at least {MIN_CLOSURE_POINTS} are "
                "needed"
            )
        self._set("preload_closure", preload_closure)
        self._set("stress", stress)
        self._set("closure", closure)
        self._set("series", (self._make_series(stress, closure),))

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    def _without_slack(self, stress: Array, closure: Array) -> tuple[Array, Array]:
        """Stress and closure from the first loaded row on, without the slack rows before it.

        A note on them is added to `notes`. One row before the first loaded row is no slack.
        """
        slack = int(np.argmax(stress > MAX_SLACK_STRESS * stress.max()))
        if slack <= 1:
            return stress, closure
        note = f"{slack} rows before any load are slack of {np.ptp(closure[:slack]):.3g} m"
        self._set("notes", (*self.notes, f"{note}: they are not fitted"))
        return stress[slack:], closure[slack:]

    def _without_compliance(self, stress: Array, closure: Array, peak: int) -> Array:
        """The closure (n,) of the joint alone. Raises ValueError if none is left.

        peak: row of the first peak of the stress.
        """
        deformation = at_least("compliance", self.compliance, 0.0) * stress
        subtracted = deformation[peak] - deformation[0]
        if subtracted > 0 and subtracted >= closure[peak] - closure[0]:
            raise ValueError(
                f"compliance = {self.compliance:g} m/Pa gives {subtracted:g} m up to "
                f"{stress[peak]:g} Pa, the whole closure is {closure[peak] - closure[0]:g} m: "
                "nothing is left for the joint; check its unit, m/Pa"
            )
        return closure - deformation

    def _make_series(self, stress: Array, closure: Array) -> Series:
        """The measured stress and its expected standard error, from stress and closure."""
        if self.noise is not None:
            sigma = np.full(stress.size, more_than("noise", self.noise, 0.0))
            return Series("closure", "stress", {"normal stress": sigma}, is_known=True)
        slope = np.zeros(stress.size)
        ends = [0, *reversal_rows(stress)[1:-1], stress.size - 1]
        for start, end in reversed(list(pairwise(ends))):
            branch = slice(start, end + 1)
            slope[branch] = _log_slope(closure[branch], stress[branch])
        # of the scaled stress, as in `residuals`
        scaled_slope = (stress / np.max(stress) if self.cycle else 1.0) * slope
        closure_error = CLOSURE_NOISE * float(np.ptp(closure))
        errors = {
            "normal stress": np.full(stress.size, STRESS_NOISE),
            "closure": closure_error * scaled_slope,
        }
        if not self.cycle:
            errors["load cell"] = LOAD_CELL_NOISE * np.max(stress) / stress
        return Series("closure", "stress", errors)

    def up_to(self, n: int) -> Self:
        """The first n points of this test, with the same origin of the closure. Raises nothing."""
        shorter = copy(self)
        object.__setattr__(shorter, "stress", self.stress[:n])
        object.__setattr__(shorter, "closure", self.closure[:n])
        object.__setattr__(
            shorter, "series", (shorter._make_series(self.stress[:n], self.closure[:n]),)
        )
        return shorter

    def residuals(self, values: Values, settings: Settings) -> Array:
        """ln(model/measured), (n,); over cycles (model - measured)/largest measured stress.

        Unloading ends at zero stress, where a logarithm is not defined. Raises nothing.

        Parameters
        ----------
        values: values of all parameters by name.
        settings: fixed properties of the law.
        """
        model = log_stress(values, values["preload_closure"] + self.closure, settings)
        if not self.cycle:
            return model - np.log(self.stress)
        return (np.exp(model) - self.stress) / np.max(self.stress)


@dataclass(frozen=True, eq=False)
class ShearCurve:
    """A direct shear test: shear stress, and opening, against shear displacement.

    Parameters
    ----------
    shear: shear displacement in m, (n,), from zero; it may reverse.
    shear_stress: in Pa, (n,), not all zero.
    normal: normal stress in Pa, > 0; (n,), or one number for all points.
    azimuth: direction of shear in rad, from axis 2 of the law.
    noise: known standard error relative to the largest shear stress; None expects 2 % and estimates
        it from the residuals.
    opening: normal displacement in m, (n,), from the start of shear, opening positive; None if it
        was not measured. Shear stress alone cannot separate friction from dilation.
    opening_noise: as `noise`, relative to the largest opening; None expects 3 %.
    name, notes: name of the test in reports, and changes made to its record.
    source: where the numbers are from, for reports.
    initial_stress: shear stress in Pa at which the record begins, under the first normal stress, as
        of a joint under load before an injection. The law is sheared up to this stress first;
        displacement and opening count from there. It must be the first of `shear_stress`, at zero
        displacement.

    >>> curve = jl.ShearCurve(sheared.shear, sheared.shear_stress, normal=5e6)
    """

    shear: Array
    shear_stress: Array
    normal: Any
    azimuth: float = 0.0
    noise: float | None = None
    opening: Array | None = None
    opening_noise: float | None = None
    name: str = "shear"
    notes: tuple[str, ...] = ()
    source: str = ""
    initial_stress: float = 0.0
    series: tuple[Series, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        columns = self._columns()
        if np.ndim(self.normal) == 0:
            columns["normal"] = np.full(np.shape(self.shear), self.normal)
        for name, values in zip(columns, _same_length(**columns), strict=True):
            object.__setattr__(self, name, values)
        if self.shear.size < MIN_SHEAR_POINTS or not np.ptp(self.shear) > 0:
            raise ValueError(
                f"shear has {self.shear.size} points: at least {MIN_SHEAR_POINTS} that move are "
                "needed"
            )
        if not self.shear_stress.any():
            raise ValueError("shear_stress is zero throughout: there is no strength to fit")
        more_than("normal", np.min(self.normal), 0.0)
        number("azimuth", self.azimuth)
        number("initial_stress", self.initial_stress)
        if self.initial_stress and (
            self.shear[0] != 0.0 or self.shear_stress[0] != self.initial_stress
        ):
            raise ValueError(
                f"initial_stress = {self.initial_stress:g} Pa, but the record begins at "
                f"{self.shear_stress[0]:g} Pa and {self.shear[0]:g} m: it must be the first shear "
                "stress, at zero displacement"
            )
        if self.opening is not None and not self.opening.any():
            raise ValueError("opening is zero throughout: leave it out if it was not measured")
        object.__setattr__(self, "series", self._make_series())

    def _make_series(self) -> tuple[Series, ...]:
        """The measured quantities. The displacement is taken as exact."""
        n = self.shear.size - self._first_row
        stress = _shear_series("stress", "noise", self.noise, SHEAR_NOISE, n)
        series = [stress]
        if self.peak is not None:
            errors = {"peak displacement": np.array([self.peak.displacement_error])}
            series.append(Series("shear", "peak displacement", errors, is_known=True))
        if self.opening is not None:
            series.append(
                _shear_series("opening", "opening_noise", self.opening_noise, OPENING_NOISE, n)
            )
        return tuple(series)

    @property
    def _first_row(self) -> int:
        """First row with residuals. A row at zero displacement is zero by construction."""
        return int(self.shear[0] == 0.0)

    def _columns(self) -> dict[str, Any]:
        """The measured columns by name."""
        return {name: x for name in _COLUMNS if (x := getattr(self, name)) is not None}

    @cached_property
    def reversals(self) -> list[int]:
        """Rows of the first point, of each shear reversal, and of the last point, ascending.

        Displacements that return by less than a small share of the largest one are no reversal.
        """
        is_sheared = np.abs(self.shear) > MIN_SHEAR_REVERSAL * np.max(np.abs(self.shear))
        first_sense = np.sign(self.shear[int(np.argmax(is_sheared))])
        rows = reversal_rows(first_sense * self.shear, 0.0, MIN_SHEAR_REVERSAL)
        return [*rows[:-1], self.shear.size - 1]

    @cached_property
    def peak(self) -> "Peak | None":
        """The peak of the shear stress, within one stroke from reversal to reversal.

        None if the stress falls by less than 4 % of the peak within the rest of this stroke. `Peak`
        holds the row of the peak, first and last row of the stroke, the displacement (m) from the
        start of the stroke, and its relative error: the usual error of a peak displacement,
        combined with half the width of the top of the curve.
        """
        stress = np.abs(self.shear_stress)
        row = int(np.argmax(stress))
        ends = [end for end in self.reversals[1:] if end >= row]
        begins = [begin for begin in self.reversals[:-1] if begin < row]
        if not ends or not begins:
            return None
        begin = begins[-1]
        end = ends[0]
        is_high = stress > (1 - MIN_PEAK_DROP) * stress[row]
        after = np.flatnonzero(~is_high[row : end + 1])
        if after.size == 0:
            return None
        before = np.flatnonzero(~is_high[begin : row + 1])
        first_high = begin + before[-1] + 1 if before.size else begin
        last_high = row + after[0] - 1
        distance = np.abs(self.shear - self.shear[begin])
        if not distance[row] > 0:
            return None
        # the largest of many rows of a flat peak may be any of them
        width = np.log(distance[last_high] / max(distance[first_high], distance[row] / 100))
        error = float(np.hypot(PEAK_DISPLACEMENT_NOISE, 0.5 * width))
        return Peak(row, begin, end, float(distance[row]), error)

    def path(self, steps: int) -> ShearPath:
        """The path to take a joint through: the measured points, and rows between them.

        Every step ends at a point or between two points. The steps grow geometrically with the
        distance from the start of shear or the last reversal: `steps` of them, the shortest
        `SHORTEST_STEP` of the whole displacement, cover the whole displacement. Scatter of the
        displacement is no reversal: a point behind the points before it has their displacement.
        Raises nothing.
        """
        whole = float(np.sum(np.abs(np.diff(self.shear[self.reversals], prepend=0.0))))
        grid = whole * np.geomspace(SHORTEST_STEP, 1.0, steps)
        displacements = [np.zeros(1)]
        stresses = [self.normal[:1]]
        rows = list[int]()
        start = 0.0
        first = 0
        for end in self.reversals[1:]:
            leg = slice(first, end + 1)
            sense = np.sign(self.shear[end] - start)
            distance = np.maximum(sense * (self.shear[leg] - start), 0.0)
            points = np.maximum.accumulate(distance)
            stops = np.unique(np.concatenate([grid[grid < points[-1]], points]))
            rows += (sum(map(len, displacements)) + np.searchsorted(stops, points)).tolist()
            displacements.append(start + sense * stops)
            normal = [stresses[-1][-1], *self.normal[leg]]
            stresses.append(np.interp(stops, [0.0, *points], normal))
            start = float(displacements[-1][-1])
            first = end + 1
        return ShearPath(
            np.concatenate(displacements),
            np.concatenate(stresses),
            np.array(rows),
            self.initial_stress,
        )

    def predict(self, law: JointLaw, steps: int = INITIAL_STEPS) -> tuple[Array, Array]:
        """Shear stress (Pa) and opening (m) of a law at the measured points, (n,) each.

        Parameters
        ----------
        law: a law with a plane.
        steps: as in `path`.

        Raises ValueError if the law cannot follow the test.
        """
        (test,) = simulate_shear(law, [self.path(steps)])
        return test.stress[test.points], test.opening[test.points]

    def residuals(self, test: SimulatedTest) -> list[Array]:
        """(model - measured)/largest measured of shear stress and opening, for each row.

        A first row at zero displacement has no residual. The peak of the shear stress is compared
        with the largest stress of the model between the same reversals, at whatever displacement,
        because the stress about a peak depends little on the displacement, and the displacement of
        a peak varies between specimens. The logarithm of the displacement over the measured one is
        a residual of its own, (1,), between those of stress and opening. Raises nothing.

        test: the test by the law.
        """
        measured_rows = slice(self._first_row, None)
        largest = np.max(np.abs(self.shear_stress))
        stress = test.stress
        rows = test.points
        difference = stress[rows] - self.shear_stress
        log_ratios = []
        if self.peak is not None:
            peak = self.peak
            leg = slice(rows[peak.begin], rows[peak.end] + 1)
            distance = np.abs(test.shear[leg] - test.shear[rows[peak.begin]])
            sense = np.sign(self.shear_stress[peak.row])
            displacement, maximum = _interpolated_maximum(distance, sense * stress[leg])
            difference[peak.row] = sense * maximum - self.shear_stress[peak.row]
            log_ratios.append(np.log(max(displacement / peak.displacement, MIN_PEAK_RATIO)))
        residuals = [difference[measured_rows] / largest]
        if self.peak is not None:
            residuals.append(np.array(log_ratios))
        if self.opening is not None:
            difference = (test.opening[rows] - self.opening)[measured_rows]
            residuals.append(difference / np.max(np.abs(self.opening)))
        return residuals

    def _arc_length(self) -> Array:
        """Length (n,) along the curve, each column divided by its range.

        Scatter of neighbouring rows is no length: it is averaged over blocks of rows.
        """
        columns = [self.shear, self.shear_stress]
        if self.opening is not None:
            columns.append(self.opening)
        n = self.shear.size
        edges = np.linspace(0, n, min(n, MAX_ARC_BLOCKS) + 1).round().astype(int)
        # blocks between reversals only, so that these are not averaged away
        edges = np.unique([*edges, *self.reversals[1:-1]])
        middles = (edges[:-1] + edges[1:] - 1) / 2
        squares = np.zeros(middles.size - 1)
        for column in columns:
            means = np.add.reduceat(column, edges[:-1]) / np.diff(edges)
            squares += (np.diff(means) / max(float(np.ptp(column)), 1e-300)) ** 2
        length = np.concatenate([[0.0], np.cumsum(np.sqrt(squares))])
        # extended to the first and the last row at the slope of the neighbouring block
        rows = np.arange(n)
        inner = np.interp(rows, middles, length)
        first = (length[1] - length[0]) / (middles[1] - middles[0])
        last = (length[-1] - length[-2]) / (middles[-1] - middles[-2])
        inner += first * np.minimum(rows - middles[0], 0.0)
        inner += last * np.maximum(rows - middles[-1], 0.0)
        return np.asarray(inner - inner[0])

    def resampled(self, max_points: int) -> Self:
        """This test with at most `max_points` points, and the peak, the reversals and end points.

        The points are evenly spaced along the curve of shear stress against displacement (and of
        opening), each divided by its range: a steep rise before the peak has as many points as the
        displacement after it. Raises nothing.
        """
        n = self.shear.size
        if n <= max_points:
            return self
        length = self._arc_length()
        stops = np.linspace(0.0, length[-1], max_points)
        along = np.searchsorted(length, stops).clip(0, n - 1)
        peak = int(np.argmax(np.abs(self.shear_stress)))
        rows = np.unique([*along, peak, *self.reversals])
        note = (
            f"{rows.size} of {n} rows are fitted: rows that are evenly spaced along the curve, the "
            "peak, reversals and end points"
        )
        columns = {name: x[rows] for name, x in self._columns().items()}
        return replace(self, **columns, notes=(*self.notes, note))


class Peak(NamedTuple):
    """The peak of the shear stress of a measured test.

    row: of the peak.
    begin, end: rows of the reversals before and after it.
    displacement: in m, from the reversal before it.
    displacement_error: standard error of its logarithm.
    """

    row: int
    begin: int
    end: int
    displacement: float
    displacement_error: float


def _interpolated_maximum(x: Array, y: Array) -> tuple[float, float]:
    """Position and value of the maximum of points (n,), by a parabola through the highest and its
    two neighbours. The highest point itself at an end, or where x does not increase there.
    """
    top = int(np.argmax(y))
    if top == 0 or top == y.size - 1:
        return float(x[top]), float(y[top])
    left, right = np.diff(x[top - 1 : top + 2])
    if not (left > 0 and right > 0):
        return float(x[top]), float(y[top])
    rise, fall = np.diff(y[top - 1 : top + 2])
    curvature = (fall / right - rise / left) / (left + right)
    slope = rise / left + curvature * left
    shift = -slope / (2 * curvature) if curvature < 0 else 0.0
    return float(x[top] + shift), float(y[top] + 0.5 * slope * shift)


def _shear_series(quantity: str, name: str, known: float | None, default: float, n: int) -> Series:
    """A quantity of a shear test with n residuals of the known noise, or of the default.

    name: of the argument with the known noise.
    """
    sigma = default if known is None else more_than(name, known, 0.0)
    source = {"stress": "shear stress", "opening": "opening"}[quantity]
    errors = {source: np.full(n, sigma)}
    return Series("shear", quantity, errors, is_known=known is not None)


def first_loading(stress: ArrayLike, closure: ArrayLike) -> tuple[Array, Array]:
    """The rows of a closure test in which a stress is reached for the first time.

    Unloading is left out, and reloading up to the largest stress before.

    Parameters
    ----------
    stress: normal stress in Pa, (n,).
    closure: in m, (n,).

    Returns stress (Pa) and closure (m) of these rows.
    """
    s, u = _same_length(stress=stress, closure=closure)
    reversals = reversal_rows(s)
    is_first = np.zeros(s.size, bool)
    for low, peak in zip(reversals[::2], reversals[1::2], strict=False):
        branch = slice(low, peak + 1)
        is_first[branch] = s[branch] > np.max(s[:low], initial=-np.inf)
    return s[is_first], u[is_first]


def reversal_rows(
    values: Array,
    min_drop: float = MIN_STRESS_DROP,
    min_drop_of_largest: float = MIN_STRESS_DROP_OF_LARGEST,
) -> list[int]:
    """Rows at which values (n,) that first increase reverse.

    These are the first row, maxima and minima in turn, and the last extreme. Values reverse where
    they fall from a maximum, and where they rise again, by both thresholds.

    Parameters
    ----------
    values: (n,).
    min_drop: smallest drop relative to the maximum.
    min_drop_of_largest: smallest drop relative to the largest absolute value.
    """
    rows = [0]
    extreme = 0
    sense = 1
    threshold = min_drop_of_largest * float(np.max(np.abs(values)))
    for row, value in enumerate(values):
        maximum = max(values[extreme], values[rows[-1]])
        if sense * (value - values[extreme]) > 0:
            extreme = row
        elif sense * (values[extreme] - value) > max(min_drop * maximum, threshold):
            rows.append(extreme)
            extreme = row
            sense = -sense
    return [*rows, extreme]


def _same_length(**columns: ArrayLike) -> list[Array]:
    """Arrays (n,) of finite numbers. Raises ValueError for other shapes."""
    arrays = [finite(name, x, "m, Pa; leave such points out") for name, x in columns.items()]
    if arrays[0].ndim != 1 or arrays[0].size == 0 or len({x.shape for x in arrays}) > 1:
        raise ValueError(
            f"{' and '.join(columns)} have shapes {', '.join(str(x.shape) for x in arrays)}: give "
            "arrays of one dimension and the same length"
        )
    return arrays


def _log_slope(closure: Array, stress: Array) -> Array:
    """d ln(stress)/d closure (1/m) at measured points, of a power law fitted to them.

    Differences of neighbouring points would transfer the noise to the weights of the points.
    """
    span = float(np.ptp(closure))
    if not span > 0:
        return np.zeros(closure.size)
    x = (closure - closure.min()) / span
    shifts = np.geomspace(0.02, 5.0, 25)
    fits = [np.polyfit(np.log(x + shift), np.log(stress), 1, full=True) for shift in shifts]
    misfits = [float(fit[1][0]) if fit[1].size else np.inf for fit in fits]
    best = int(np.argmin(misfits))
    exponent = float(fits[best][0][0])
    return np.abs(exponent / ((x + shifts[best]) * span))


def simulate_curves(
    curves: Sequence[ShearCurve], values: Values, settings: Settings
) -> list[SimulatedTest]:
    """Simulate each test with the law of these values, with cells refined with the steps.

    Otherwise the parameters would compensate the error of coarse cells, degrees of friction angle,
    which their intervals do not include.
    """
    tests: dict[int, SimulatedTest] = {}
    refinement = min(settings.steps / INITIAL_STEPS, MAX_REFINEMENT) ** CELLS_PER_STEPS
    for azimuth in {curve.azimuth for curve in curves}:
        members = [k for k, curve in enumerate(curves) if curve.azimuth == azimuth]
        law = build_law(values, settings, azimuth)
        resolution = law.resolution
        pairs = (
            (resolution.u, INITIAL_CELLS.u),
            (resolution.phi, INITIAL_CELLS.phi),
            (resolution.depth, INITIAL_CELLS.depth),
        )
        refined = Resolution(*(round(refinement * max(pair)) for pair in pairs))
        paths = [curves[k].path(settings.steps) for k in members]
        simulated = simulate_shear(replace(law, resolution=refined), paths)
        tests |= zip(members, simulated, strict=True)
    return [tests[k] for k in range(len(curves))]
