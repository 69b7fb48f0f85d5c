"""Measured curves, each with the noise it is expected to carry and what the law says of it."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..laws.joint_law import JointLaw
from ..parameters.resolution import Resolution
from ..support.checks import Array, at_least, finite, more_than, number
from .forward import STEPS, Settings, build, log_stress
from .noise import Noise, Series
from .priors import Values
from .shearing import Sheared, shear_all

STRESS_NOISE = 0.01  # of the stress: a load cell with the friction of its loading frame
CLOSURE_NOISE = 0.005  # of the largest closure: linearity and repeatability of a transducer
SHEAR_NOISE = 0.02  # of the largest shear stress
OPENING_NOISE = 0.03  # of the largest opening: a gauge beside a joint that tilts a little
CELLS = Resolution(10, 10, 24)  # with `STEPS`: shear stress within 0.2 % of finer ones
MOST_FINER = 4  # times STEPS: from there on the steps alone grow
FINEST = 0.002  # of the whole way: the first step of shear, and the first after a turn
_TURN = 0.2  # of the stress at a peak: what falls or rises less is scatter
_FOOT = 0.02  # of the largest stress: likewise, where the stress is small
_SLACK = 0.002  # of the largest stress: what is less is none
_COLUMNS = ("shear", "shear_stress", "normal", "opening")
_BACK = 0.02  # of the largest shear displacement: what goes back less is scatter


@dataclass(frozen=True, eq=False)
class ClosureCurve:
    """A closure test: normal stress against closure, in first loading or over whole cycles.

    Parameters
    ----------
    stress: normal stress in Pa, (n,), >= 0.
    closure: closure in m, (n,), measured from wherever the test began; unloading left out (see
        `first_loading`) unless `cycle`.
    noise: standard error of the stress as a share of it, taken as known, the closure as exact.
        None expects 1 % of the stress and 0.5 % of the largest closure and estimates both from the
        scatter.
    cycle: True for points of whole cycles, loading, unloading and reloading in their order. Only
        a law with a yield_interference has a loop to fit to them.
    compliance: of rock and machine, whose strain the test measured too: closure per stress (m/Pa).
        It is subtracted from `closure` first; 0 where the closure is that of the joint alone.
    name, notes: of the test in reports, and what was done to its record before.

    `seating`, the closure (m) of the law where that of the test is zero, is known of a test whose
    first row has zero stress; it is None of any other, and fitted. Several such rows are slack:
    they are left out, and no one knows where touch began.

    Raises ValueError for arrays that do not fit, fewer than four points, a branch that unloads
    without `cycle`, cycles that never unload, or a compliance larger than the curve.

    >>> curve = jl.ClosureCurve(stress=record.F1[:100], closure=record.closure[:100])
    """

    stress: Array
    closure: Array
    noise: float | None = None
    cycle: bool = False
    compliance: float = 0.0
    name: str = "closure"
    notes: tuple[str, ...] = ()
    seating: float | None = field(init=False)
    series: tuple[Series, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        stress, closure = _equally_long(stress=self.stress, closure=self.closure)
        if (stress < 0).any():
            raise ValueError(f"stress = {stress.min():g} Pa is out of bounds: it must be >= 0")
        slack = int(np.argmax(stress > _SLACK * stress.max()))
        if slack > 1:
            told = f"{slack} rows before any load are slack of {np.ptp(closure[:slack]):.3g} m"
            set_(self, "notes", (*self.notes, f"{told}: they are not fitted"))
            stress, closure = stress[slack:], closure[slack:]
        turns = turning_points(stress)
        top = turns[1]
        strain = at_least("compliance", self.compliance, 0.0) * stress
        if strain[top] - strain[0] > 0 and strain[top] - strain[0] >= closure[top] - closure[0]:
            raise ValueError(
                f"compliance = {self.compliance:g} m/Pa gives {strain[top] - strain[0]:g} m up to "
                f"{stress[top]:g} Pa, the whole closure is {closure[top] - closure[0]:g} m: "
                "nothing is left for the joint; check its unit, m/Pa"
            )
        closure = closure - strain
        if self.cycle != (len(turns) > 2):
            raise ValueError(
                f"cycle = {self.cycle}, but stress {'never falls' if self.cycle else 'falls'} by a "
                f"fifth from {stress[top]:g} Pa after point {top}: give cycle=True with loading "
                "and unloading, or the first loading alone (calibration.measured.first_loading)"
            )
        # not -0.0
        set_(self, "seating", 0.0 - float(closure[0]) if stress[0] == 0.0 else None)
        keep = stress > 0  # a point at zero stress only says where the closure is zero
        stress, closure = stress[keep], closure[keep]
        if stress.size < 4 or not np.ptp(closure) > 0:
            raise ValueError(
                f"stress has {stress.size} points above zero over a closure of "
                f"{np.ptp(closure) if closure.size else 0:g} m: at least 4 are needed"
            )
        set_(self, "stress", stress)
        set_(self, "closure", closure)
        steep = np.zeros(stress.size)
        ends = [0, *turning_points(stress)[1:-1], stress.size - 1]
        for start, end in reversed(list(pairwise(ends))):
            branch = slice(start, end + 1)
            steep[branch] = _steepness(closure[branch], stress[branch])
        share = stress / np.max(stress) if self.cycle else 1.0  # as `residuals` are
        usual = Noise(STRESS_NOISE, CLOSURE_NOISE * float(np.ptp(closure)))
        expected = _expected("noise", self.noise, usual)
        set_(self, "series", (Series("stress", expected, share * steep, steep.size),))

    def residuals(self, values: Values, settings: Settings) -> Array:
        """ln(model/measured), (n,); over cycles (model - measured)/largest measured.

        values: parameters. settings: what else the fit holds. Unloading ends at zero stress, where
        a ratio says nothing. Raises nothing.
        """
        model = log_stress(values, values["seating"] + self.closure, settings)
        if not self.cycle:
            return model - np.log(self.stress)
        return (np.exp(model) - self.stress) / np.max(self.stress)


@dataclass(frozen=True, eq=False)
class ShearCurve:
    """Direct shear at given normal stresses: shear stress, and opening, against displacement.

    Parameters
    ----------
    shear: shear displacement in m, (n,), from zero; it may turn round.
    shear_stress: in Pa, (n,), not all zero.
    normal: normal stress in Pa, > 0, (n,); one number is that of all points.
    azimuth: direction of shear in rad, from axis 2 of the law.
    noise: standard error as a share of the largest shear stress, taken as known; None expects 2 %
        and estimates the level from the scatter.
    opening: normal displacement in m, (n,), from where shear began, opening positive; None where
        it was not measured. Then shear stress alone cannot tell friction from dilation.
    opening_noise: as `noise`, of the largest opening; None expects 3 %.
    name, notes: of the test in reports, and what was done to its record before.

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
    series: tuple[Series, ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        given = {name: x for name in _COLUMNS if (x := getattr(self, name)) is not None}
        if np.ndim(self.normal) == 0:
            given["normal"] = np.full(np.shape(self.shear), self.normal)
        for name, values in zip(given, _equally_long(**given), strict=True):
            set_(self, name, values)
        if self.shear.size < 3 or not np.ptp(self.shear) > 0:
            raise ValueError(f"shear has {self.shear.size} points: at least 3 that move are needed")
        if not self.shear_stress.any():
            raise ValueError("shear_stress is zero throughout: there is no strength to fit")
        more_than("normal", np.min(self.normal), 0.0)
        number("azimuth", self.azimuth)
        # the displacement is taken as exact; the last residual of the stress is that of the peak
        n, expected = self.shear.size, _expected("noise", self.noise, Noise(SHEAR_NOISE))
        series = [Series("stress", expected, np.zeros(n + 1), n)]
        if self.opening is not None:
            if not self.opening.any():
                raise ValueError("opening is zero throughout: leave it out if it was not measured")
            expected = _expected("opening_noise", self.opening_noise, Noise(OPENING_NOISE))
            series.append(Series("opening", expected, np.zeros(n), n))
        set_(self, "series", tuple(series))

    @cached_property
    def turns(self) -> list[int]:
        """Points where shear turns: the first, those where it does, the last."""
        way = np.abs(self.shear) > _BACK * np.max(np.abs(self.shear))
        sense = np.sign(self.shear[int(np.argmax(way))])
        return [*turning_points(sense * self.shear, 0.0, _BACK)[:-1], self.shear.size - 1]

    def path(self, steps: int) -> tuple[Array, Array, NDArray[np.intp]]:
        """Displacement (m) and normal stress (Pa) to take a joint through, (rows,), and the rows of
        the points (n,).

        Every step ends at a point or within the interval between two. The steps grow with the
        distance from where shear began or turned: `steps` of them, the shortest `FINEST` of the
        whole way, take the joint that far. Scatter of the displacement is no way: a point behind
        those before it is taken where they are. Raises nothing.
        """
        whole = float(np.sum(np.abs(np.diff(self.shear[self.turns], prepend=0.0))))
        grid = whole * np.geomspace(FINEST, 1.0, steps)
        ways, stresses, rows, start, first = [np.zeros(1)], [self.normal[:1]], list[int](), 0.0, 0
        for end in self.turns[1:]:
            leg = slice(first, end + 1)
            sense = np.sign(self.shear[end] - start)
            points = np.maximum.accumulate(np.maximum(sense * (self.shear[leg] - start), 0.0))
            way = np.unique(np.concatenate([grid[grid < points[-1]], points]))
            rows += (sum(map(len, ways)) + np.searchsorted(way, points)).tolist()
            ways.append(start + sense * way)
            stresses.append(np.interp(way, [0.0, *points], [stresses[-1][-1], *self.normal[leg]]))
            start, first = float(ways[-1][-1]), end + 1
        return np.concatenate(ways), np.concatenate(stresses), np.array(rows)

    def predict(self, law: JointLaw, steps: int = STEPS) -> tuple[Array, Array]:
        """Shear stress (Pa) and opening (m) of a law of its plane at the points, (n,) each.

        law: with a plane. steps: as in `path`. Raises ValueError where the law cannot follow.
        """
        (test,) = shear_all(law, [self.path(steps)])
        return test.stress[test.points], test.opening[test.points]

    def residuals(self, test: Sheared) -> list[Array]:
        """(model - measured)/largest measured, of shear stress (n + 1,) and opening (n,).

        test: what a law gives. Raises nothing.
        Last of the stress stands how far the law rises above its stress at the largest measured
        one before the next points on both sides: few points say by it that the peak lies there.
        """
        measured, stress, rows = self.shear_stress, test.stress, test.points
        top = int(np.argmax(np.abs(measured)))
        near = stress[rows[max(top - 1, 0)] : rows[min(top + 1, rows.size - 1)] + 1]
        rise = np.max(np.sign(measured[top]) * (near - stress[rows[top]]))
        found = [np.append(stress[rows] - measured, rise) / np.max(np.abs(measured))]
        if self.opening is not None:
            found.append((test.opening[rows] - self.opening) / np.max(np.abs(self.opening)))
        return found

    def thinned(self, most: int) -> Self:
        """This test with `most` points or a few more: evenly spaced, the peak, turns and ends.

        Raises nothing.
        """
        n, top = self.shear.size, int(np.argmax(np.abs(self.shear_stress)))
        if n <= most:
            return self
        even = np.linspace(0, n - 1, most).round().astype(int)
        kept = np.unique([*even, top, *self.turns])
        told = f"{kept.size} of {n} rows are fitted: evenly spaced ones, the peak, turns and ends"
        columns = {name: x[kept] for name in _COLUMNS if (x := getattr(self, name)) is not None}
        return replace(self, **columns, notes=(*self.notes, told))


def _expected(name: str, known: float | None, usual: Noise) -> Noise:
    """The noise that is known, or the usual one to begin with."""
    return usual if known is None else Noise(more_than(name, known, 0.0), 0.0, True)


def first_loading(stress: ArrayLike, closure: ArrayLike) -> tuple[Array, Array]:
    """Stress (Pa) and closure (m) of the rows, (n,) each, in which a test loads for the first time.

    Unloading is left out, and reloading up to the largest stress before.
    """
    s, u = _equally_long(stress=stress, closure=closure)
    turns, first = turning_points(s), np.zeros(s.size, bool)
    for low, peak in zip(turns[::2], turns[1::2], strict=False):
        first[low : peak + 1] = s[low : peak + 1] > np.max(s[:low], initial=-np.inf)
    return s[first], u[first]


def turning_points(values: Array, share: float = _TURN, foot: float = _FOOT) -> list[int]:
    """Rows where values (n,) that rise first turn: the first, peaks and lows in turn, the last
    extreme.

    They turn where they fall by this share of a peak and by `foot` of the largest, and where they
    rise again by as much.
    """
    turns, extreme, sense = [0], 0, 1
    least = foot * float(np.max(np.abs(values)))
    for row, now in enumerate(values):
        peak = max(values[extreme], values[turns[-1]])
        if sense * (now - values[extreme]) > 0:
            extreme = row
        elif sense * (values[extreme] - now) > max(share * peak, least):
            turns.append(extreme)
            extreme, sense = row, -sense
    return [*turns, extreme]


def _equally_long(**given: ArrayLike) -> list[Array]:
    """Arrays (n,) of finite numbers."""
    arrays = [finite(name, x, "m, Pa; leave such points out") for name, x in given.items()]
    if arrays[0].ndim != 1 or arrays[0].size == 0 or len({x.shape for x in arrays}) > 1:
        raise ValueError(
            f"{' and '.join(given)} have shapes {', '.join(str(x.shape) for x in arrays)}: give "
            "arrays of one dimension and the same length"
        )
    return arrays


def _steepness(closure: Array, stress: Array) -> Array:
    """d ln(stress)/d closure (1/m) of measured points, smoothed by a power law through them.

    Differences of neighbouring points would carry the noise into the weights.
    """
    span = float(np.ptp(closure))
    if not span > 0:
        return np.zeros(closure.size)
    x = (closure - closure.min()) / span
    shifts = np.geomspace(0.02, 5.0, 25)
    fits = [np.polyfit(np.log(x + s), np.log(stress), 1, full=True) for s in shifts]
    at = int(np.argmin([float(f[1][0]) if f[1].size else np.inf for f in fits]))
    return np.abs(float(fits[at][0][0]) / ((x + shifts[at]) * span))


def sheared(curves: Sequence[ShearCurve], values: Values, settings: Settings) -> list[Sheared]:
    """Each test by the law of these values; cells as fine as steps.

    A parameter would take up the error of few cells, degrees of friction, and its interval would
    not show it.
    """
    found: dict[int, Sheared] = {}
    finer = min(settings.steps / STEPS, MOST_FINER) ** 0.6
    for azimuth in {curve.azimuth for curve in curves}:
        mine = [k for k, curve in enumerate(curves) if curve.azimuth == azimuth]
        law = build(values, settings, azimuth)
        r = law.resolution
        pairs = ((r.u, CELLS.u), (r.phi, CELLS.phi), (r.depth, CELLS.depth))
        cells = Resolution(*(round(finer * max(pair)) for pair in pairs))
        paths = [curves[k].path(settings.steps) for k in mine]
        found |= zip(mine, shear_all(replace(law, resolution=cells), paths), strict=True)
    return [found[k] for k in range(len(curves))]
