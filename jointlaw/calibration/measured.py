"""Measured curves, each with the noise it is expected to carry and what the law says of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..laboratory.experiments import direct_shear
from ..law import JointLaw
from ..support.checks import Array, above, at_least, number
from .forward import Settings, build_for_shear, log_stress
from .priors import Values

STRESS_NOISE = 0.01  # of the stress: a load cell with the friction of its loading frame
CLOSURE_NOISE = 0.005  # of the largest closure: linearity and repeatability of a transducer
SHEAR_NOISE = 0.02  # of the largest shear stress
FACTOR = 4.0  # 95 % range of a level about the expected one, either way
_SD = np.log(FACTOR) / 1.96
_GRID = np.linspace(-3.2, 3.2, 33)
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
    seating: closure (m) of the law at the closure zero of the test, or None to fit it. A test that
        begins at a non-zero stress is always fitted; one whose first row is (0, 0) begins at 0.
    noise: standard error of the stress as a share of it, taken as known. None expects 1 % of the
        stress and 0.5 % of the largest closure and estimates both from the scatter.
    closure_noise: standard error of the closure in m that goes with a given `noise`.
    cycle: True for points of whole cycles, loading, unloading and reloading in their order. Only
        a law with a yield_interference has a loop to fit to them.
    compliance: of rock and machine, whose strain the test measured too: closure per stress (m/Pa),
        or a pair of arrays (stress in Pa, closure in m) measured without a joint. It is
        subtracted from `closure` first; 0 where the closure is that of the joint alone.

    Raises ValueError for arrays that do not fit, fewer than four points, a branch that unloads
    without `cycle`, cycles that never unload, or a compliance larger than the curve.
    """

    stress: Array
    closure: Array
    seating: float | None = None
    noise: float | None = None
    closure_noise: float = 0.0
    cycle: bool = False
    compliance: float | tuple[ArrayLike, ArrayLike] = 0.0
    expected: Noise = field(init=False, repr=False)
    steepness: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        stress, closure = _pair("stress", self.stress, "closure", self.closure)
        if (stress < 0).any():
            raise ValueError(f"stress = {stress.min():g} Pa is out of bounds: it must be >= 0")
        closure = subtract_compliance(stress, closure, self.compliance)
        _, top, last = cycles(stress)[0]
        unloads = stress[top : last + 1].min() < (1 - _TURN) * stress[top]
        if self.cycle and not unloads:
            raise ValueError(
                f"cycle = True, but stress never falls below 80 % of its largest, {stress[top]:g} "
                "Pa: give the unloading too, or cycle=False for a first loading"
            )
        if unloads and not self.cycle:
            raise ValueError(
                f"stress falls from {stress[top]:g} Pa after point {top}: fit the first loading "
                "only, jointlaw.first_loading(stress, closure) cuts it out, or give cycle=True "
                "(jointlaw fit: --cycle)"
            )
        if self.seating is None and stress[0] == 0.0:
            set_(self, "seating", 0.0 - float(closure[0]))  # not -0.0
        elif self.seating is not None:
            set_(self, "seating", number("seating", self.seating))
        keep = stress > 0  # a point at zero stress only says where the closure is zero
        stress, closure = stress[keep], closure[keep]
        if stress.size < 4 or not np.ptp(closure) > 0:
            raise ValueError(
                f"stress has {stress.size} points above zero over a closure of "
                f"{np.ptp(closure) if closure.size else 0:g} m: at least 4 are needed"
            )
        if self.seating is not None and closure.min() + self.seating <= 0:
            raise ValueError(
                f"seating = {self.seating:g} m: the law would be open at closure = "
                f"{closure.min():g} m where a stress was measured; give a larger seating or None"
            )
        set_(self, "stress", stress)
        set_(self, "closure", closure)
        steep = np.zeros(stress.size)
        turns = sorted({0, stress.size - 1}.union(*cycles(stress) if self.cycle else ()))
        for start, end in reversed(list(pairwise(turns))):
            branch = slice(start, end + 1)
            steep[branch] = _steepness(closure[branch], stress[branch])
        share = stress / np.max(stress) if self.cycle else 1.0  # as `residuals` are
        set_(self, "steepness", share * steep)
        if self.noise is None:
            if self.closure_noise != 0:
                raise ValueError(
                    f"closure_noise = {self.closure_noise!r} goes with a known noise; give noise "
                    "too, or leave both out to have them estimated"
                )
            expected = Noise(STRESS_NOISE, CLOSURE_NOISE * float(np.ptp(closure)))
        else:
            share = above("noise", self.noise, 0.0)
            expected = Noise(share, at_least("closure_noise", self.closure_noise, 0.0), True)
        set_(self, "expected", expected)

    def residuals(self, values: Values, seating: float, settings: Settings) -> Array:
        """ln(model/measured), (n,); over cycles (model - measured)/largest measured.

        Unloading ends at zero stress, where a ratio says nothing.
        """
        model = log_stress(values, seating + self.closure, settings)
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

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        shear, stress = _pair("shear", self.shear, "shear_stress", self.shear_stress)
        if shear.size < 3 or not np.ptp(shear) > 0:
            raise ValueError(f"shear has {shear.size} points: at least 3 that move are needed")
        if not stress.any():
            raise ValueError("shear_stress is zero throughout: there is no strength to fit")
        set_(self, "shear", shear)
        set_(self, "shear_stress", stress)
        set_(self, "normal", above("normal", self.normal, 0.0))
        set_(self, "azimuth", number("azimuth", self.azimuth))
        known = self.noise is not None
        share = above("noise", self.noise, 0.0) if known else SHEAR_NOISE
        set_(self, "expected", Noise(share, 0.0, known))

    @property
    def steepness(self) -> Array:
        """Zeros (n,): the displacement is taken as exact."""
        return np.zeros(self.shear.size)

    def predict(self, law: JointLaw, substeps: int = 1) -> Array:
        """Shear stress (Pa) of a law along the path of this test, (n,)."""
        path = self.shear if self.shear[0] else self.shear[1:]
        record = direct_shear(
            law.joint(), path.tolist(), self.normal, azimuth=self.azimuth, steps=substeps
        )
        stress = record.shear_stress[::substeps]
        return stress[1:] if self.shear[0] else stress

    def residuals(self, values: Values, settings: Settings) -> Array:
        """(model - measured)/largest measured, (n,)."""
        model = self.predict(build_for_shear(values, settings, self.azimuth))
        return np.asarray((model - self.shear_stress) / np.max(np.abs(self.shear_stress)))


def first_loading(stress: ArrayLike, closure: ArrayLike) -> tuple[Array, Array, Array, Array]:
    """Cut the first loading cycle at its largest stress.

    Returns stress (Pa) and closure (m) of the loading branch, the peak included, then those of the
    unloading branch, the peak included again.
    """
    s, u = _pair("stress", stress, "closure", closure)
    _, top, last = cycles(s)[0]
    return s[: top + 1], u[: top + 1], s[top : last + 1], u[top : last + 1]


def cycles(stress: Array) -> list[tuple[int, int, int]]:
    """Rows of every cycle of a test: its first, the one of its largest stress, its last.

    The stress (Pa, (n,)) turns where it falls by a fifth of a peak, and where it rises again by as
    much; the last row of a cycle is the first of the next one.
    """
    least = _FOOT * float(np.max(stress))
    lows, tops = [0], [0]
    for row, now in enumerate(stress):
        peak, low = stress[tops[-1]], stress[lows[-1]]
        if len(lows) == len(tops):  # loading
            if now > peak:
                tops[-1] = row
            elif now < peak - max(_TURN * peak, least):
                lows.append(row)
        elif now < low:
            lows[-1] = row
        elif now > low + max(_TURN * peak, least):
            tops.append(row)
    return list(zip(lows, tops, [*lows[1 : len(tops)], len(stress) - 1], strict=False))


def subtract_compliance(
    stress: Array, closure: Array, compliance: float | tuple[ArrayLike, ArrayLike]
) -> Array:
    """The closure (m) of the joint alone, without that of rock and machine, as in `ClosureCurve`.

    Raises ValueError for a compliance larger than the curve, or measured up to a lower stress.
    """
    if isinstance(compliance, tuple):
        load, rock = _pair("compliance stress", compliance[0], "compliance closure", compliance[1])
        if not (np.diff(load) > 0).all() or stress.max() > load.max():
            raise ValueError(
                f"compliance is measured up to {load.max():g} Pa: it must ascend and reach the "
                f"largest stress, {stress.max():g} Pa"
            )
        strain = np.interp(stress, load, rock)
    else:
        strain = at_least("compliance", compliance, 0.0) * stress
    top, first = int(np.argmax(stress)), int(np.argmin(stress[: np.argmax(stress) + 1]))
    taken, total = strain[top] - strain[first], closure[top] - closure[first]
    if np.any(strain) and taken >= total:
        raise ValueError(
            f"compliance gives {taken:g} m between {stress[first]:g} and {stress[top]:g} Pa, the "
            f"whole closure is {total:g} m: nothing is left for the joint; check its unit, m/Pa"
        )
    return closure - strain


def _pair(name: str, x: Any, other: str, y: Any) -> tuple[Array, Array]:
    try:
        first, second = np.asarray(x, float), np.asarray(y, float)
    except (TypeError, ValueError):
        raise ValueError(f"{name} and {other} must be arrays of numbers") from None
    if first.ndim != 1 or first.shape != second.shape or first.size == 0:
        raise ValueError(
            f"{name} has shape {first.shape}, {other} {second.shape}: "
            "give two arrays of one dimension and the same length"
        )
    for label, array in ((name, first), (other, second)):
        if not np.isfinite(array).all():
            at = int(np.argmin(np.isfinite(array)))
            raise ValueError(f"{label}[{at}] = {array[at]} is not finite; leave such points out")
    return first, second


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
