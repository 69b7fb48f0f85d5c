"""Measured curves, each with the noise it is expected to carry and what the law says of it."""

from dataclasses import dataclass, field
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..laboratory.experiments import direct_shear
from ..laws.joint_law import JointLaw
from ..support.checks import Array, at_least, finite, more_than, number
from .forward import STEPS, Settings, build_for_shear, log_stress
from .priors import Values

STRESS_NOISE = 0.01  # of the stress: a load cell with the friction of its loading frame
CLOSURE_NOISE = 0.005  # of the largest closure: linearity and repeatability of a transducer
SHEAR_NOISE = 0.02  # of the largest shear stress
FACTOR = 4.0  # 95 % range of a level about the expected one, either way
_SD = np.log(FACTOR) / 1.96
_GRID = np.linspace(-3.2, 3.2, 33)
FINEST = 0.002  # of the whole way: the first step of shear, and the first after a turn
_TURN = 0.2  # of the stress at a peak: what falls or rises less is scatter
_FOOT = 0.05  # of the largest stress: likewise, where the stress is small


class Noise(NamedTuple):
    """How noisy a measured curve is: two levels, estimated from the scatter about the fit.

    The variance of a residual is share^2 + (absolute * steepness)^2. `share` is the error of the
    measured stress relative to its scale, `absolute` that of the closure (m), which `steepness`
    (1/m) turns into one of stress; a curve without a steepness has the first alone. Levels that
    are `known` are not estimated.
    """

    share: float
    absolute: float = 0.0
    known: bool = False

    def sigma(self, steepness: Array) -> Array:
        """Standard errors at points of this steepness."""
        return np.hypot(self.share, self.absolute * steepness)


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

    `seating`, the closure (m) of the law where that of the test is zero, is known of a test that
    begins at zero stress; it is None of any other, and fitted.

    Raises ValueError for arrays that do not fit, fewer than four points, a branch that unloads
    without `cycle`, cycles that never unload, or a compliance larger than the curve.
    """

    stress: Array
    closure: Array
    noise: float | None = None
    cycle: bool = False
    compliance: float = 0.0
    seating: float | None = field(init=False)
    expected: Noise = field(init=False, repr=False)
    steepness: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        stress, closure = _pair(stress=self.stress, closure=self.closure)
        if (stress < 0).any():
            raise ValueError(f"stress = {stress.min():g} Pa is out of bounds: it must be >= 0")
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
        set_(self, "steepness", share * steep)
        expected = Noise(STRESS_NOISE, CLOSURE_NOISE * float(np.ptp(closure)))
        if self.noise is not None:
            expected = Noise(more_than("noise", self.noise, 0.0), 0.0, known=True)
        set_(self, "expected", expected)

    def residuals(self, values: Values, settings: Settings) -> Array:
        """ln(model/measured), (n,); over cycles (model - measured)/largest measured.

        Unloading ends at zero stress, where a ratio says nothing.
        """
        model = log_stress(values, values["seating"] + self.closure, settings)
        if not self.cycle:
            return model - np.log(self.stress)
        return (np.exp(model) - self.stress) / np.max(self.stress)


@dataclass(frozen=True, eq=False)
class ShearCurve:
    """Direct shear at constant normal stress: shear stress against shear displacement.

    Parameters
    ----------
    shear: shear displacement in m, (n,), from zero; it may turn round.
    shear_stress: in Pa, (n,), not all zero.
    normal: normal stress in Pa, > 0.
    azimuth: direction of shear in rad, from axis 2 of the law.
    noise: standard error as a share of the largest shear stress, taken as known; None expects 2 %
        and estimates the level from the scatter.
    """

    shear: Array
    shear_stress: Array
    normal: float
    azimuth: float = 0.0
    noise: float | None = None
    expected: Noise = field(init=False, repr=False)
    steepness: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        shear, stress = _pair(shear=self.shear, shear_stress=self.shear_stress)
        if shear.size < 3 or not np.ptp(shear) > 0:
            raise ValueError(f"shear has {shear.size} points: at least 3 that move are needed")
        if not stress.any():
            raise ValueError("shear_stress is zero throughout: there is no strength to fit")
        set_(self, "shear", shear)
        set_(self, "shear_stress", stress)
        set_(self, "normal", more_than("normal", self.normal, 0.0))
        set_(self, "azimuth", number("azimuth", self.azimuth))
        known = self.noise is not None
        share = more_than("noise", self.noise, 0.0) if known else SHEAR_NOISE
        set_(self, "expected", Noise(share, 0.0, known))
        set_(self, "steepness", np.zeros(shear.size + 1))  # the displacement is taken as exact

    def sheared(self, law: JointLaw, steps: int = STEPS) -> tuple[Array, Array, NDArray[np.intp]]:
        """The test by a law: way (m) and shear stress (Pa), (rows,) each, and the points' rows.

        Every step ends at a point or within the interval between two. The steps grow with the
        distance from where shear began or turned: `steps` of them, the shortest `FINEST` of the
        whole way, take the joint that far.
        """
        grid = float(np.sum(np.abs(np.diff(self.shear)))) * np.geomspace(FINEST, 1.0, steps)
        path, rows, start = [0.0], [], 0.0
        turns = np.flatnonzero(np.diff(np.sign(np.diff(self.shear, prepend=0.0)))) + 1
        for leg in np.split(self.shear, turns):
            sense, points = np.sign(leg[-1] - start), np.abs(leg - start)
            way = np.unique(np.concatenate([grid[grid < points[-1]], points]))
            rows += (len(path) + np.searchsorted(way, points)).tolist()
            path += (start + sense * way).tolist()
            start = path[-1]
        record = direct_shear(law.joint(), path[1:], self.normal, azimuth=self.azimuth, steps=1)
        return record.shear, record.shear_stress, np.array(rows)

    def predict(self, law: JointLaw, steps: int = STEPS) -> Array:
        """Shear stress (Pa) of a law at the points of this test, (n,); steps: as in `sheared`."""
        _, stress, rows = self.sheared(law, steps)
        return stress[rows]

    def residuals(self, values: Values, settings: Settings) -> Array:
        """(model - measured)/largest measured, (n + 1,).

        Last stands how far the law rises above its stress at the largest measured one before the
        next points on both sides: few points say by it that the peak lies there.
        """
        law = build_for_shear(values, settings, self.azimuth)
        _, stress, rows = self.sheared(law, settings.steps)
        top = int(np.argmax(np.abs(self.shear_stress)))
        near = stress[rows[max(top - 1, 0)] : rows[min(top + 1, rows.size - 1)] + 1]
        rise = np.max(np.sign(self.shear_stress[top]) * (near - stress[rows[top]]))
        misfit = np.append(stress[rows] - self.shear_stress, rise)
        return np.asarray(misfit / np.max(np.abs(self.shear_stress)))


def first_loading(stress: ArrayLike, closure: ArrayLike) -> tuple[Array, Array]:
    """Stress (Pa) and closure (m) of a test, (n,) each, up to where the stress first turns."""
    s, u = _pair(stress=stress, closure=closure)
    top = turning_points(s)[1]
    return s[: top + 1], u[: top + 1]


def turning_points(stress: Array) -> list[int]:
    """Rows where the stress (Pa, (n,)) turns: the first, peaks and lows in turn, the last extreme.

    It turns where it falls by a fifth of a peak, and where it rises again by as much.
    """
    turns, extreme, sense = [0], 0, 1
    least = _FOOT * float(np.max(stress))
    for row, now in enumerate(stress):
        peak = max(stress[extreme], stress[turns[-1]])
        if sense * (now - stress[extreme]) > 0:
            extreme = row
        elif sense * (stress[extreme] - now) > max(_TURN * peak, least):
            turns.append(extreme)
            extreme, sense = row, -sense
    return [*turns, extreme]


def _pair(**given: ArrayLike) -> list[Array]:
    """Two arrays (n,) of finite numbers."""
    arrays = [finite(name, x, "m, Pa; leave such points out") for name, x in given.items()]
    if arrays[0].ndim != 1 or arrays[0].size == 0 or arrays[0].shape != arrays[1].shape:
        raise ValueError(
            f"{' and '.join(given)} have shapes {arrays[0].shape} and {arrays[1].shape}: give two "
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
    slope: Array = float(fits[at][0][0]) / ((x + shifts[at]) * span)
    return np.abs(slope)


def estimate_noise(expected: Noise, residual: Array, leverage: Array, steepness: Array) -> Noise:
    """Levels that the residuals (n,) of a fit with these leverages (n,) make most likely.

    Both have wide priors from what instruments do, because eight points cannot tell two levels by
    themselves. Restricted likelihood: a point of leverage h has the residual variance
    (1 - h) sigma^2.
    """
    if expected.known:
        return expected
    free = np.clip(1 - leverage, 0.02, 1.0)
    steps = _GRID * _SD
    share = (expected.share * np.exp(steps))[:, None, None]
    absolute = (expected.absolute * np.exp(steps))[None, :, None]
    variance = share**2 + (absolute * steepness) ** 2
    loss = np.sum(free * np.log(variance) + residual**2 / variance, axis=-1)
    loss = loss + _GRID[:, None] ** 2 + _GRID[None, :] ** 2
    i, j = np.unravel_index(int(np.argmin(loss)), loss.shape)
    return Noise(float(share[i, 0, 0]), float(absolute[0, j, 0]))
