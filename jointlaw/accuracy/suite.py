"""The standard paths on which accuracy is measured, and the errors of a resolution on them.

With R the law's closure range and S the normal stress there, the paths are

    closure            close to R, open, close again to R/2
    shear 0, 45, 90    at the normal stress S/2, along these azimuths to a shear of R
    reversal           at S/2 along 30 degrees, to 0.6 R, back to -0.6 R, and to zero
    constant closure   R, shear along 20 degrees to R: the largest load of all
    re-contact         closed and sheared, opened under shear until it separates, closed again
    walk               a smooth random walk in closure and both shears
    weave              closed five times while the shear crosses itself (in 3-D)
    far                R/2, shear along 20 degrees to three mating lengths, 3 R at most, and back
    slip               as far at the stresses S/2 and S/20, each controlled by every resolution;
                       errors count where friction is mobilised (`SlipResults.is_mobilised`)

Excursions are random paths: four to ten legs between corners with closures from -0.3 R to R (one of
them at a stress of S/2 to S) and shears up to R, every second path smooth. Every eighth slips as
`far` does, at the closure of S/20 to S/2; one slip test at random stress and azimuth is added for
every sixteen. The generator has a fixed seed, so that every resolution follows the same paths.

Dilated paths are random paths of joints that are open and pressed by their slopes alone: three to
six legs, sheared to 0.3 to 7 R (three mating lengths at most) as they open, so that few facets,
the steep ones that the shear closes, bear the load. The closures of a path are shifted together
until its largest normal stress is S/2 to S.

A law without mating length slips by 30 R in the slip tests. At a constant closure a longer slip
would end at many times the stress S; at a constant stress a law that jams, atan(mu) + 90 deg/a
above 88 degrees, slips without end, and has no slip tests.

Along 0, 45 and 90 degrees the azimuths of facets are symmetric; other azimuths lie between, where
few azimuths have the largest errors. A law with a plane takes the paths along azimuth 0 and the
others projected on its plane; a law of closure only takes the closures of paths that close more
than once. Paths at constant stress are computed once, at half the reference resolution, and are
paths of displacement from then on, so that every resolution follows the same displacements.
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
from .slip import (
    STRESS_TOLERANCE,
    JointLaw,
    SlipResults,
    max_slip,
    random_slip_tests,
    run_slip_tests,
    standard_slip_tests,
)

STEPS = 120  # of each path
MAX_SLIP_AT_CONSTANT_CLOSURE = 3.0  # R
_JAMMING_ANGLE = 88.0  # degrees: a law with a larger friction angle has no slip tests
_EXCURSION_SEED = 8
_DILATED_SEED = 28
_DILATED_SHEAR = (0.3, 7.0)  # R, of the farthest corner, but for the mating length
_SHIFT_ITERATIONS = 20  # bisections of the shift of closures: to 1e-6 of the first bracket
_SLIP_SEED = 18


def reference_resolution(law: JointLaw) -> Resolution:
    """The resolution of the reference solution: steep facets (small a) need the most nodes."""
    if law.heights is None and law.asperity.eta == 0.0:  # one spring: sharp onset of sliding
        return Resolution(64, 48, 1)
    return Resolution(math.ceil(6 + 32 / law.orientation.a), 16, 36)


def limit_friction_angle(law: JointLaw) -> float:
    """Friction angle under long slip at small stress, atan(mu) + 90 deg/a, in degrees."""
    return math.degrees(math.atan(law.asperity.mu)) + 90.0 / law.orientation.a


def scale_resolution(r: Resolution, factor: float) -> Resolution:
    """A resolution with `factor` times the nodes in each direction."""
    return replace(
        r,
        u=max(round(factor * r.u), 1),
        phi=max(round(factor * r.phi), 3),
        depth=max(round(factor * r.depth), 1),
    )


class SuiteErrors(NamedTuple):
    """Errors of a resolution on a suite.

    traction: (paths,), over the largest |F| of each path.
    friction, dilation: largest errors of the angles under slip, in degrees; NaN for a law without
        slip tests.
    """

    traction: Array
    friction: float
    dilation: float


@dataclass(frozen=True)
class Suite:
    """Paths of one law, with the reference solution.

    names: (paths,). Slip tests come last; they are not paths of displacement.
    d: increments (steps, paths, dim) in m.
    F: reference tractions (steps, paths, dim) in Pa.
    slip: reference results of the slip tests, None without them.
    run_slip: runs the slip tests with another resolution of the law.
    uncertainty: (paths,), of F: its difference from the solution with two thirds of the nodes.
    """

    names: tuple[str, ...]
    d: Array
    F: Array
    slip: SlipResults | None
    run_slip: Callable[[JointLaw], SlipResults]
    uncertainty: Array

    def errors(self, law: JointLaw) -> SuiteErrors:
        """Errors of a law with another resolution or closure range along the paths of this suite.

        The traction errors of the standard paths, and of the slip tests if the suite has any; the
        largest errors of friction and dilation angles in slip tests, NaN without them.
        """
        traction = relative_errors(tractions(law, self.d), self.F)
        if self.slip is None:
            return SuiteErrors(traction, math.nan, math.nan)
        results = self.run_slip(law)
        slip_traction = relative_errors(results.F, self.slip.F, self.slip.is_mobilised)
        angles = results.largest_differences(self.slip)
        return SuiteErrors(np.append(traction, slip_traction), *angles)


@lru_cache(maxsize=16)
def standard_suite(
    law: JointLaw, best: Resolution | None = None, excursions: int = 0, dilated: int = 0
) -> Suite:
    """The standard paths of a law with their reference solution.

    best: resolution of the reference solution; None takes `reference_resolution`.
    excursions: number of random paths, which follow the standard ones.
    dilated: number of dilated paths, which follow the excursions; none for a law of closure only.

    Convergence is of second order, so the error of the reference is about 0.8 of its `uncertainty`.
    """
    best = best or reference_resolution(law)
    law = replace(law, resolution=best)
    stress = float(law.normal_stress(law.closure_range)) / 2
    names, points, at_constant_stress = _standard_paths(law, stress)
    if excursions:
        points = np.concatenate([points, _random_excursions(law, stress, excursions)], axis=1)
        at_constant_stress = np.append(at_constant_stress, np.zeros(excursions, bool))
        names += tuple(f"excursion {i + 1}" for i in range(excursions))
    coarse = replace(law, resolution=scale_resolution(best, 1 / 2))
    if dilated and not law.closure_only:
        points = np.concatenate([points, _dilated_paths(coarse, stress, dilated)], axis=1)
        at_constant_stress = np.append(at_constant_stress, np.zeros(dilated, bool))
        names += tuple(f"dilated {i + 1}" for i in range(dilated))
    d = np.diff(points, axis=0, prepend=0.0)
    d = _control_stress(coarse, d, at_constant_stress, stress)
    slip_results = None
    slip_tests = standard_slip_tests(law.tables.dim)
    if not law.closure_only and limit_friction_angle(law) < _JAMMING_ANGLE:
        rng = np.random.default_rng(_SLIP_SEED)
        random_tests = random_slip_tests(rng, excursions // 16, law.tables.dim)
        names += tuple(
            f"slip {azimuth:g} at S/{2 / fraction:g}" for fraction, azimuth, _ in slip_tests
        )
        names += tuple(f"slip {i + 1}" for i in range(len(random_tests)))
        slip_tests = np.concatenate([slip_tests, random_tests])
        slip_results = run_slip_tests(law, law.closure_range, stress, slip_tests)
    run_slip = partial(
        run_slip_tests, closure_range=law.closure_range, stress=stress, tests=slip_tests
    )
    unknown = np.full(len(names), np.nan)
    suite = Suite(names, d, tractions(law, d), slip_results, run_slip, unknown)
    coarser = replace(law, resolution=scale_resolution(best, 2 / 3))
    return replace(suite, uncertainty=suite.errors(coarser).traction)


def tractions(law: JointLaw, d: Array) -> Array:
    """F (steps, paths, dim) in Pa along increments d of the same shape, from the virgin state."""
    batch = law.joints(d.shape[1], track_dissipation=False)
    F = np.empty_like(d)
    for k, step in enumerate(track(d, "steps of the paths", len(d))):
        F[k], _ = batch.update(step, tangent=False)
    return F


def relative_errors(F: Array, reference: Array, where: Any = True) -> Array:
    """Largest |F - reference| (steps, paths, dim) over each path's largest |reference|: (paths,).

    where: (steps, paths), the steps that count. The error is 0 for a path without resistance, on
    which few asperities are high enough to touch.
    """
    largest_error, largest = (
        np.linalg.norm(f, axis=2).max(axis=0, where=where, initial=0.0)
        for f in (F - reference, reference)
    )
    return np.divide(largest_error, largest, out=np.zeros_like(largest_error), where=largest > 0.0)


def _standard_paths(law: JointLaw, stress: float) -> tuple[tuple[str, ...], Array, Array]:
    """Names, points (steps, paths, dim) in m, and which paths are at constant normal stress.

    Constant stress begins at step STEPS/10; the closures of these paths are first guesses.
    """
    R = law.closure_range
    seat = float(law.closure(stress)) / R
    s = np.arange(1, STEPS + 1) / STEPS
    shear = _legs(s, [0, 0.1, 1], [0, seat, seat], [0, 0, 1])
    reversal = _legs(s, [0, 0.1, 0.35, 0.75, 1], [0, *4 * [seat]], [0, 0, 0.6, -0.6, 0])
    constant_closure = _legs(s, [0, 0.2, 1], [0, 1, 1], [0, 0, 1])
    distance = min(max_slip(law.mating_length, R) / R, MAX_SLIP_AT_CONSTANT_CLOSURE)
    far = _legs(s, [0, 0.1, 0.55, 1], [0, 0.5, 0.5, 0.5], [0, 0, distance, 0])
    recontact = _legs(
        s, [0, 0.15, 0.35, 0.6, 0.7, 1], [0, 0.7, 0.7, -0.6, -0.6, 0.8], [0, 0, 0.4, 0.7, 0.2, 0.5]
    )
    paths = {
        "closure": _in_space(_legs(s, [0, 0.4, 0.8, 1], [0, 1, 0, 0.5], [0, 0, 0, 0]), 0),
        "shear 0": _in_space(shear, 0),
        "shear 45": _in_space(shear, 45),
        "shear 90": _in_space(shear, 90),
        "reversal": _in_space(reversal, 30),
        "constant closure": _in_space(constant_closure, 20),
        "re-contact": _in_space(recontact, 65),
        "walk": _walk(s),
        "far": _in_space(far, 20),
        "weave": _weave(s),
    }
    if law.closure_only:
        names = ("closure", "re-contact", "walk", "weave")
        paths = {name: paths[name][:, :1] for name in names}
    elif law.plane is not None:
        off_plane = ("shear 45", "shear 90", "weave")
        paths |= {
            "reversal": reversal,
            "constant closure": constant_closure,
            "re-contact": recontact,
            "far": far,
        }
        paths = {name: path[:, :2] for name, path in paths.items() if name not in off_plane}
    at_constant_stress = np.array([name.startswith(("shear", "reversal")) for name in paths])
    return tuple(paths), R * np.stack(list(paths.values()), axis=1), at_constant_stress


def _walk(s: Array) -> Array:
    """A smooth random walk (steps, 3) in closure ranges."""
    turn = 2 * np.pi * s
    closure = 0.45 * (1 - np.cos(3 * turn)) * (0.7 + 0.3 * np.sin(turn)) + 0.1 * np.sin(turn / 4)
    shear_2 = 0.5 * np.sin(2 * turn) + 0.3 * np.sin(3.3 * turn + 0.4) - 0.3 * np.sin(0.4)
    shear_3 = 0.45 * np.sin(1.7 * turn) + 0.25 * np.sin(4.1 * turn + 1.0) - 0.25 * np.sin(1.0)
    return np.stack([closure, shear_2, shear_3], axis=-1)


def _weave(s: Array) -> Array:
    """Five closures while the shear crosses itself (steps, 3), in closure ranges."""
    turn = 2 * np.pi * s
    closure = 0.525 - 0.525 * np.cos(5 * turn) + 0.4 * s * (1 - s)
    shear_2 = 0.7 * np.sin(1.3 * turn)
    shear_3 = 0.7 * (np.sin(2.1 * turn + 0.7) - np.sin(0.7)) / (1 + np.sin(0.7))
    return np.stack([closure, shear_2, shear_3], axis=-1)


def _random_excursions(law: JointLaw, stress: float, count: int) -> Array:
    """Points (steps, count, dim) in m of reproducible random paths.

    Every eighth path slips at random (`random_slip_path`). The others visit 4 to 10 random corners,
    one of which is closed by one to two times `stress` (Pa); along straight legs and along smooth
    curves in turn.
    """
    rng = np.random.default_rng(_EXCURSION_SEED)
    R = law.closure_range
    s = np.arange(1, STEPS + 1) / STEPS
    paths = []
    for i in range(count):
        if i % 8 == 7:
            paths.append(random_slip_path(law, rng, stress, s))
            continue
        legs = int(rng.integers(4, 11))
        closure = np.append(0.0, rng.uniform(-0.3, 1.0, legs))
        highest = float(law.closure(stress * rng.uniform(1.0, 2.0))) / R
        closure[rng.integers(1, legs + 1)] = highest
        shear = np.append(0.0, np.sqrt(rng.random(legs)))
        azimuth = rng.uniform(0.0, 2.0 * np.pi, legs + 1)
        corners = np.stack([closure, shear * np.cos(azimuth), shear * np.sin(azimuth)], axis=-1)
        times = np.linspace(0.0, 1.0, legs + 1)
        is_smooth = i % 2
        paths.append(
            PchipInterpolator(times, corners)(s) if is_smooth else _legs(s, times, *corners.T)
        )
    return R * np.stack(paths, axis=1)[:, :, : law.tables.dim]


def _dilated_paths(law: JointLaw, stress: float, count: int) -> Array:
    """Points (steps, count, dim) in m of reproducible random paths of open, sheared joints.

    law: at a coarse resolution, which finds the closures; stress: S/2 in Pa.
    """
    rng = np.random.default_rng(_DILATED_SEED)
    R = law.closure_range
    s = np.arange(1, STEPS + 1) / STEPS
    farthest = max_slip(law.mating_length, R) / R
    paths = []
    for _ in range(count):
        legs = int(rng.integers(3, 7))
        size = min(float(np.exp(rng.uniform(*np.log(_DILATED_SHEAR)))), farthest)
        shear = size * np.append(0.0, np.sqrt(rng.random(legs)))
        azimuth = rng.uniform(0.0, 2.0 * np.pi, legs + 1)
        closure = np.append(0.0, rng.uniform(-0.2, 1.0, legs))
        corners = np.stack([closure, shear * np.cos(azimuth), shear * np.sin(azimuth)], axis=-1)
        paths.append(_legs(s, np.linspace(0.0, 1.0, legs + 1), *corners.T))
    points = R * np.stack(paths, axis=1)[:, :, : law.tables.dim]
    return _shift_to_stress(law, points, stress * rng.uniform(1.0, 2.0, count))


def _shift_to_stress(law: JointLaw, points: Array, stress: Array) -> Array:
    """Shift the closures of paths so that their largest normal stress becomes a given one.

    points: (steps, paths, dim) in m; stress: (paths,) in Pa. The shift of a path grows over its
    first tenth. Returns the new points.
    """
    ramp = np.minimum(np.arange(1, len(points) + 1) / (0.1 * len(points)), 1.0)[:, None]
    distance = np.abs(points).max(axis=(0, 2))
    low = -law.tables.closure_per_displacement * distance  # nothing touches
    high = distance.copy()
    for _ in range(_SHIFT_ITERATIONS):
        middle = 0.5 * (low + high)
        shifted = points.copy()
        shifted[:, :, 0] += ramp * middle
        F = tractions(law, np.diff(shifted, axis=0, prepend=0.0))
        is_high = F[:, :, 0].max(axis=0) > stress
        low = np.where(is_high, low, middle)
        high = np.where(is_high, middle, high)
    points = points.copy()
    points[:, :, 0] += ramp * low
    return points


def random_slip_path(law: JointLaw, rng: np.random.Generator, stress: float, s: Array) -> Array:
    """A random path (steps, 3) in closure ranges: slip at constant closure, reversed twice.

    The closure belongs to a normal stress between a tenth of `stress` (Pa) and `stress`.
    s: (steps,), the fraction of the path at each step.
    """
    R = law.closure_range
    closure = float(law.closure(stress * rng.uniform(0.1, 1.0))) / R
    limit = min(max_slip(law.mating_length, R) / R, MAX_SLIP_AT_CONSTANT_CLOSURE)
    farthest = limit * rng.uniform(0.3, 1.0)
    reversed_to = farthest * rng.uniform(-1.0, 0.5)
    azimuth = rng.uniform(0.0, 2.0 * np.pi)
    slip = [0.0, 0.0, farthest, reversed_to, farthest]
    path = _legs(s, [0.0, 0.1, 0.4, 0.8, 1.0], [0.0, *4 * [closure]], slip)
    return _in_space(path, np.degrees(azimuth))


def _legs(s: Array, times: Any, *columns: Any) -> Array:
    """Points (steps, columns) on straight legs between corners, which are reached at `times`."""
    return np.stack([np.interp(s, times, column) for column in columns], axis=-1)


def _in_space(path: Array, azimuth: float) -> Array:
    """Closure and shear (steps, 2) as points (steps, 3), the shear along an azimuth in degrees."""
    psi = np.radians(azimuth)
    return np.stack([path[:, 0], np.cos(psi) * path[:, 1], np.sin(psi) * path[:, 1]], axis=-1)


def _control_stress(law: JointLaw, d: Array, at_constant_stress: Array, stress: float) -> Array:
    """Copy of the increments d whose closures keep a constant normal stress on selected paths.

    at_constant_stress: which paths, (paths,). From step STEPS/10 on, each closing increment of
    these paths is replaced by the increment that keeps the joint at `stress` (Pa); their shear
    and all other paths stay as they are.
    """
    d = d.copy()
    selected = np.flatnonzero(at_constant_stress)
    condition = NormalCondition(stress, stress)
    batch = law.joints(len(selected), track_dissipation=False)
    for k in range(len(d)):
        step = d[k, selected]
        if k >= STEPS // 10:
            step[:, 0] = closing_increments(batch, step, condition, STRESS_TOLERANCE)
        batch.update(step, tangent=False)
        d[k, selected] = step
    return d
