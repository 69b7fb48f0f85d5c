"""The standard paths on which accuracy is measured, and errors along them.

With R the law's closure range and S the normal stress there, the paths are

    closure            close to R, open, close again to R/2
    shear 0, 45, 90    at the normal stress S/2, along these azimuths to a shear of R
    reversal           at S/2 along 30 degrees, to 0.6 R, back to -0.6 R, and to zero
    constant closure   R, shear along 20 degrees to R: the largest load of all
    re-contact         closed and sheared, opened under shear until it separates, closed again
    walk               a smooth random walk in closure and both shears
    weave              closed five times while the shear crosses itself (in space)
    far                R/2, shear along 20 degrees to three mating lengths, 3 R at most, and back
    slip               as far at the stresses S/2 and S/20, held by every resolution itself; errors
                       count where friction is mobilised (`Slip.counts`)

Excursions are random: four to ten legs between corners with closures from -0.3 R to R (one of them
at a stress of S/2 to S) and shears up to R, every second one rounded. One of eight slips as `far`
does, at the closure of S/20 to S/2, and one of sixteen as `slip` does, along other ways. They are
drawn once and for all, so that they too are the same for every resolution. A law without critical
slip takes 30 R for three of them. At a given closure a longer slip would end at many times the
stress S; at a given stress a law that jams, atan(mu) + 90 deg/a above 88 degrees, has no end, and
leaves `slip` out.

Along 0, 45 and 90 degrees the rings of azimuths look alike; the other directions lie between, where
a ring of few azimuths errs most. A law with a plane takes the paths along azimuth 0 and the others
projected on its plane; one of closure only the closures of those that shut more than once. Those at
constant stress are found once, at half the reference resolution, and are paths of displacement from
then on, so that every resolution is asked the same.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator

from ..joints.normal_control import NormalCondition, closing_increments
from ..parameters.resolution import Resolution
from ..support.checks import Array
from ..support.progress import track
from .slip import HELD, JointLaw, Slip, distance, random_ways, slip, standard_ways

STEPS = 120  # of each path
FAR = 3.0  # R: the longest slip at a given closure
_JAMS = 88.0  # degrees: the steepest friction angle of a law that slips at a given stress


def reference_resolution(law: JointLaw) -> Resolution:
    """The resolution whose tractions count as exact: steep facets (small a) need the most of it."""
    if law.heights is None and law.asperity.eta == 0.0:  # one spring, whose slip has a sharp onset
        return Resolution(64, 48, 1)
    return Resolution(math.ceil(6 + 32 / law.orientation.a), 16, 36)


def steepest(law: JointLaw) -> float:
    """Limit of the friction angle under long slip at small stress: atan(mu) + 90 deg/a."""
    return math.degrees(math.atan(law.asperity.mu)) + 90.0 / law.orientation.a


def scaled(r: Resolution, share: float) -> Resolution:
    """That many times the nodes in each direction."""
    return replace(
        r,
        u=max(round(share * r.u), 1),
        phi=max(round(share * r.phi), 3),
        depth=max(round(share * r.depth), 1),
    )


class Miss(NamedTuple):
    """How far a resolution is off.

    `largest` (paths,): shares of the path's largest |F|. `friction`, `dilation`: largest misses of
    the angles under slip, in degrees; NaN for a joint that does not shear, or jams.
    """

    largest: Array
    friction: float
    dilation: float


@dataclass(frozen=True)
class Suite:
    """Paths of one law: increments d (steps, paths, dim) in m and reference tractions F in Pa.

    The paths of `slip`, which are no paths of displacement, come last in `names`.
    """

    names: tuple[str, ...]
    d: Array
    F: Array
    slip: Slip | None
    slide: Callable[[JointLaw], Slip]  # along the same ways at the same stress
    uncertainty: Array  # (paths,) of F: its difference from two thirds of the nodes

    def miss(self, law: JointLaw) -> Miss:
        """How far another resolution is off, or closure range."""
        largest = errors(tractions(law, self.d), self.F)
        if self.slip is None:
            return Miss(largest, math.nan, math.nan)
        mine = self.slide(law)
        more = errors(mine.F, self.slip.F, self.slip.counts)
        return Miss(np.append(largest, more), *mine.apart(self.slip))


@lru_cache(maxsize=16)
def standard_suite(law: JointLaw, best: Resolution | None = None, excursions: int = 0) -> Suite:
    """The standard paths of a law, with tractions at `best`, by default the reference resolution.

    `excursions` random paths come after them. Second-order convergence makes the reference's own
    error about 0.8 of its `uncertainty`.
    """
    best = best or reference_resolution(law)
    law = replace(law, resolution=best)
    stress = float(law.normal_stress(law.closure_range)) / 2
    called, goal, held = _paths(law, stress)
    if excursions:
        goal = np.concatenate([goal, _excursions(law, stress, excursions)], axis=1)
        held = np.append(held, np.zeros(excursions, bool))
        called += tuple(f"excursion {i + 1}" for i in range(excursions))
    d = np.diff(goal, axis=0, prepend=0.0)
    d = _hold_stress(replace(law, resolution=scaled(best, 1 / 2)), d, held, stress)
    slid, ways = None, standard_ways(law.tables.dim)
    if not law.closure_only and steepest(law) < _JAMS:
        more = random_ways(np.random.default_rng(18), excursions // 16, law.tables.dim)
        called += tuple(f"slip {way:g} at S/{2 / share:g}" for share, way, _ in ways)
        called += tuple(f"slip {i + 1}" for i in range(len(more)))
        ways = np.concatenate([ways, more])
        slid = slip(law, law.closure_range, stress, ways)
    slide = partial(slip, closure_range=law.closure_range, stress=stress, ways=ways)
    suite = Suite(called, d, tractions(law, d), slid, slide, np.full(len(called), np.nan))
    coarser = replace(law, resolution=scaled(best, 2 / 3))
    return replace(suite, uncertainty=suite.miss(coarser).largest)


def tractions(law: JointLaw, d: Array) -> Array:
    """F (steps, paths, dim) in Pa along increments d of the same shape, from the virgin state."""
    batch, F = law.joints(d.shape[1], ledger=False), np.empty_like(d)
    for k, step in enumerate(track(d, "steps of the paths", len(d))):
        F[k], _ = batch.update(step, tangent=False)
    return F


def errors(F: Array, reference: Array, counts: Any = True) -> Array:
    """Largest |F - reference| (steps, paths, dim) over each path's largest |reference|: (paths,).

    counts: (steps, paths), which steps count; all by default. 0 for a path that nothing resists:
    few asperities may reach so high.
    """
    off, most = (
        np.linalg.norm(f, axis=2).max(axis=0, where=counts, initial=0.0)
        for f in (F - reference, reference)
    )
    return np.divide(off, most, out=np.zeros_like(off), where=most > 0.0)


def _paths(law: JointLaw, stress: float) -> tuple[tuple[str, ...], Array, Array]:
    """Names, places (steps, paths, dim) in m, and which paths hold the normal stress from STEPS/10.

    The closures of those that hold it are first guesses.
    """
    R, seat = law.closure_range, float(law.closure(stress)) / law.closure_range
    s = np.arange(1, STEPS + 1) / STEPS
    shear = _legs(s, [0, 0.1, 1], [0, seat, seat], [0, 0, 1])
    back = _legs(s, [0, 0.1, 0.35, 0.75, 1], [0, *4 * [seat]], [0, 0, 0.6, -0.6, 0])
    fixed = _legs(s, [0, 0.2, 1], [0, 1, 1], [0, 0, 1])
    way = min(distance(law.mating_length, R) / R, FAR)
    far = _legs(s, [0, 0.1, 0.55, 1], [0, 0.5, 0.5, 0.5], [0, 0, way, 0])
    again = _legs(s, [0, 0.15, 0.35, 0.6, 0.7, 1], [0, 0.7, 0.7, -0.6, -0.6, 0.8],
                 [0, 0, 0.4, 0.7, 0.2, 0.5])  # fmt: skip
    turn = 2 * np.pi * s
    walk = np.stack([
        0.45 * (1 - np.cos(3 * turn)) * (0.7 + 0.3 * np.sin(turn)) + 0.1 * np.sin(turn / 4),
        0.5 * np.sin(2 * turn) + 0.3 * np.sin(3.3 * turn + 0.4) - 0.3 * np.sin(0.4),
        0.45 * np.sin(1.7 * turn) + 0.25 * np.sin(4.1 * turn + 1.0) - 0.25 * np.sin(1.0),
    ], axis=-1)  # fmt: skip
    weave = np.stack([
        0.525 - 0.525 * np.cos(5 * turn) + 0.4 * s * (1 - s),
        0.7 * np.sin(1.3 * turn),
        0.7 * (np.sin(2.1 * turn + 0.7) - np.sin(0.7)) / (1 + np.sin(0.7)),
    ], axis=-1)  # fmt: skip
    named = {
        "closure": _along(_legs(s, [0, 0.4, 0.8, 1], [0, 1, 0, 0.5], [0, 0, 0, 0]), 0),
        "shear 0": _along(shear, 0),
        "shear 45": _along(shear, 45),
        "shear 90": _along(shear, 90),
        "reversal": _along(back, 30),
        "constant closure": _along(fixed, 20),
        "re-contact": _along(again, 65),
        "walk": walk,
        "far": _along(far, 20),
        "weave": weave,
    }
    if law.closure_only:
        named = {name: named[name][:, :1] for name in ("closure", "re-contact", "walk", "weave")}
    elif law.plane is not None:
        turned = ("shear 45", "shear 90", "weave")
        named |= {"reversal": back, "constant closure": fixed, "re-contact": again, "far": far}
        named = {name: path[:, :2] for name, path in named.items() if name not in turned}
    held = np.array([name.startswith(("shear", "reversal")) for name in named])
    return tuple(named), R * np.stack(list(named.values()), axis=1), held


def _excursions(law: JointLaw, stress: float, count: int) -> Array:
    """Random places (steps, count, dim) in m."""
    rng, R, s = np.random.default_rng(8), law.closure_range, np.arange(1, STEPS + 1) / STEPS
    goal = []
    for i in range(count):
        if i % 8 == 7:
            goal.append(far_path(law, rng, stress, s))
            continue
        legs = int(rng.integers(4, 11))
        closure = np.append(0.0, rng.uniform(-0.3, 1.0, legs))
        highest = float(law.closure(stress * rng.uniform(1.0, 2.0))) / R
        closure[rng.integers(1, legs + 1)] = highest
        shear = np.append(0.0, np.sqrt(rng.random(legs)))
        turn = rng.uniform(0.0, 2.0 * np.pi, legs + 1)
        corners = np.stack([closure, shear * np.cos(turn), shear * np.sin(turn)], axis=-1)
        at = np.linspace(0.0, 1.0, legs + 1)
        goal.append(PchipInterpolator(at, corners)(s) if i % 2 else _legs(s, at, *corners.T))
    return R * np.stack(goal, axis=1)[:, :, : law.tables.dim]


def far_path(law: JointLaw, rng: np.random.Generator, stress: float, s: Array) -> Array:
    """Random places (steps, 3) in closure ranges: slip at one closure, back, and forth again.

    The closure is that at a normal stress between a tenth of `stress` and all of it.
    """
    R = law.closure_range
    closure = float(law.closure(stress * rng.uniform(0.1, 1.0))) / R
    way = min(distance(law.mating_length, R) / R, FAR) * rng.uniform(0.3, 1.0)
    back, turn = way * rng.uniform(-1.0, 0.5), rng.uniform(0.0, 2.0 * np.pi)
    path = _legs(s, [0.0, 0.1, 0.4, 0.8, 1.0], [0.0, *4 * [closure]], [0.0, 0.0, way, back, way])
    return _along(path, np.degrees(turn))


def _legs(s: Array, at: Any, *columns: Any) -> Array:
    """Places (steps, columns) on straight legs between corners, which are reached at `at`."""
    return np.stack([np.interp(s, at, column) for column in columns], axis=-1)


def _along(path: Array, degrees: float) -> Array:
    """Closure and shear (steps, 2) as places in space, the shear along this azimuth."""
    turn = np.radians(degrees)
    return np.stack([path[:, 0], np.cos(turn) * path[:, 1], np.sin(turn) * path[:, 1]], axis=-1)


def _hold_stress(law: JointLaw, d: Array, held: Array, stress: float) -> Array:
    """Increments whose closures keep the normal stress on the paths `held`."""
    d, which, condition = d.copy(), np.flatnonzero(held), NormalCondition(stress, stress)
    batch = law.joints(len(which), ledger=False)
    for k in range(len(d)):
        step = d[k, which]
        if k >= STEPS // 10:
            step[:, 0] = closing_increments(batch, step, condition, HELD)
        batch.update(step, tangent=False)
        d[k, which] = step
    return d
