"""Errors on random laws: does a resolution do as well on a law and a path that it was not made for?

    python docs/measure/random_laws.py tolerance [--laws 100] [--seed 1] [--plane]
    python docs/measure/random_laws.py small-loads [--laws 100] [--seed 1]
    python docs/measure/random_laws.py angles [--laws 30] [--seed 18]
    python docs/measure/random_laws.py angle-sum

Random laws: a from 1 to 10 (evenly in log a), b and c over their bounds, mu 0.05 to 1, eta 0 to
0.7, heights of either formation or none, in a plane or in space.

Random paths of a law with the closure range R and the normal stress S at R: 15 per law, six of five
to eight straight legs between random corners, six smooth ones (sums of four waves), closures up to
R and openings to -0.3 R, shear up to R; somewhere each is closed to between half of S and S; and
three of slip at the closure of S/20 to S/2, to three mating lengths but 3 R at most, back and forth
again.
"""

import math
import time
from dataclasses import replace
from functools import partial

import numpy as np
from common import print_table, run_command

import jointlaw as jl
from jointlaw.accuracy.slip import STEPS_PER_LEG, random_slip_tests, run_slip_tests
from jointlaw.accuracy.suite import (
    Suite,
    limit_friction_angle,
    random_slip_path,
    reference_resolution,
    relative_errors,
    scale_resolution,
    tractions,
)
from jointlaw.support.progress import track

STRAIGHT_PATHS = 6
SMOOTH_PATHS = 6
LONG_SLIP_PATHS = 3  # at a given closure
CONSTANT_STRESS_PATHS = 4  # slip at a given normal stress
PATH_STEPS = 160

TOLERANCES = (0.05, 0.01, 0.003)
SMALL_A = 1.4  # laws with a smaller a are reported separately
JAMMING_ANGLE = 88.0  # deg, of `limit_friction_angle`: a law with more slips without end
PATH_RANGES = (1.0, 0.3, 0.1, 0.03, 0.01)  # closure ranges

MATING_RATIOS = (1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, math.inf)  # mating length / closure range
FINEST = jl.Resolution(24, 14, 12)  # finer ones change the friction angle by less than 0.1 degrees
NAMED_RESOLUTIONS = ("fast", "balanced", "fine")
ANGLE_SUM_STRESSES = 1e5, 1e6, 5e6, 20e6  # Pa


def random_law(rng):
    """Any law within the bounds above; with "population" formation only where that is convex."""
    a = float(np.exp(rng.uniform(0.0, np.log(10.0))))
    b = rng.uniform(-1.0, 2.0)
    c = rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6)
    eta = rng.uniform(0.0, 0.7) * (rng.random() > 0.1)  # a tenth are linear
    asperity = jl.Asperity(K=2e8 * 1e-6 ** (0.5 - eta), lam=rng.uniform(0.8, 1.5), eta=eta,
                           mu=rng.uniform(0.05, 1.0))  # fmt: skip
    formation = (None, "population", "individual")[rng.integers(3)]
    heights = formation and jl.GammaHeights(
        alpha=rng.uniform(1.5, 8.0), beta=rng.uniform(0.5e-6, 2e-6),
        overlap=rng.uniform(0.5e-6, 4e-6), formation=formation,
    )  # fmt: skip
    plane = None if rng.random() < 0.5 else 0.0
    law = partial(jl.JointLaw, orientation=jl.Orientation(a, b, c), asperity=asperity,
                  asperity_density=1e10, plane=plane)  # fmt: skip
    try:
        return law(heights=heights)
    except ValueError:  # not convex
        return law(heights=replace(heights, formation="individual"))


def random_paths(law, rng):
    """Increments (PATH_STEPS, paths, dim) in m."""
    path_fraction = np.arange(1, PATH_STEPS + 1) / PATH_STEPS
    stress = float(law.normal_stress(law.closure_range))
    long_slip = [
        random_slip_path(law, rng, stress / 2, path_fraction) for _ in range(LONG_SLIP_PATHS)
    ]
    straight = [straight_path(law, rng, stress, path_fraction) for _ in range(STRAIGHT_PATHS)]
    smooth = [smooth_path(law, rng, stress) for _ in range(SMOOTH_PATHS)]
    positions = np.stack([*straight, *smooth, *long_slip], axis=1)[:, :, : law.dim]
    return np.diff(law.closure_range * positions, axis=0, prepend=0.0)


def straight_path(law, rng, stress, path_fraction):
    """Positions (PATH_STEPS, 3) in units of the closure range, on lines between random corners."""
    legs = int(rng.integers(5, 9))
    closure = np.concatenate([[0.0, rng.uniform(0.4, 1.0)], rng.uniform(-0.3, 1.0, legs - 1)])
    largest_closure = law.closure(stress * rng.uniform(0.5, 1.0)) / law.closure_range
    closure[rng.integers(1, legs + 1)] = largest_closure
    shear = np.sqrt(rng.random(legs + 1)) * (np.arange(legs + 1) > 0)
    azimuth = rng.uniform(0.0, 2 * math.pi, legs + 1)
    corners = closure, shear * np.cos(azimuth), shear * np.sin(azimuth)
    interpolated = [np.interp(path_fraction * legs, np.arange(legs + 1), x) for x in corners]
    return np.stack(interpolated, axis=1)


def smooth_path(law, rng, stress):
    """As `straight_path`, but each component is a sum of four waves of half a period to five."""
    path_fraction = np.arange(PATH_STEPS + 1) / PATH_STEPS

    def wave_sum():
        periods = rng.uniform(0.5, 5.0, 4)
        phases = rng.uniform(0.0, 2 * math.pi, 4)
        waves = np.sin(2 * math.pi * np.outer(path_fraction, periods) + phases)
        values = waves @ rng.normal(size=4)
        return values - values[0]

    closure_wave = wave_sum()
    x = wave_sum()
    y = wave_sum()
    smallest = rng.uniform(-0.3, 0.3)
    largest = float(law.closure(stress * rng.uniform(0.5, 1.0))) / law.closure_range
    relative = (closure_wave - closure_wave.min()) / np.ptp(closure_wave)
    closure = smallest + (largest - smallest) * relative
    scale = rng.uniform(0.3, 1.0) / np.hypot(x, y).max()
    # closed within the first tenth of the path
    closing = np.minimum(10 * path_fraction, 1.0)
    return np.stack([closing * closure, scale * x, scale * y], axis=1)[1:]


def tolerance(laws=100, seed=1, plane=False):
    """How often `law.at_tolerance(t)` meets its tolerance on random laws, on paths it does not use.

    Half of the laws have a mating length of 1 to 1000 closure ranges; with --plane all are in one
    plane. Paths: the random ones, and four of slip to three mating lengths, or 30 R, and back at
    random normal stresses, which each resolution keeps by itself. The reference solution has twice
    the reference resolution in each direction.

    `met` is the fraction of laws that keep the tolerance on all paths (a law that `at_tolerance`
    refuses does not), `paths` the fraction of paths that do, `worst` the largest error over the
    tolerance, `seconds` the longest call of `at_tolerance` in processor time (the first call for a
    law computes its reference solution). Laws with a < 1.4 are reported separately.
    """
    rng = np.random.default_rng(seed)
    usual = []
    steep = []
    for _ in track(range(laws), "random laws", laws):
        law = random_law(rng)
        if rng.random() < 0.5:
            law = replace(law, mating_length=law.closure_range * 10 ** rng.uniform(0.0, 3.0))
        if plane:
            law = replace(law, plane=0.0)
        group = usual if law.orientation.a >= SMALL_A else steep
        group.append(tolerance_results(law, rng))
    rows = tolerance_rows(usual, f"a >= {SMALL_A}") + tolerance_rows(steep, f"a < {SMALL_A}")
    head = ["laws", "tolerance", "met", "paths", "worst", "sliders", "refused", "seconds"]
    print_table(head, rows)


def tolerance_results(law, rng):
    """For each tolerance: errors of the paths over it, sliders, seconds; None if refused."""
    increments = random_paths(law, rng)
    reference = replace(law, resolution=scale_resolution(reference_resolution(law), 2.0))
    stress = float(law.normal_stress(law.closure_range)) / 2
    directions = random_slip_tests(rng, CONSTANT_STRESS_PATHS, law.dim)
    slide = partial(slip_at_stress, law.closure_range, stress, directions)
    reference_slip = slide(reference) if limit_friction_angle(law) < JAMMING_ANGLE else None
    suite = Suite((), increments, tractions(reference, increments), reference_slip, slide,
                  uncertainty=np.zeros(0))  # fmt: skip
    results = []
    for tolerance in TOLERANCES:
        start = time.process_time()
        try:
            adapted = law.at_tolerance(tolerance)
        except ValueError:
            results.append(None)
            continue
        seconds = time.process_time() - start
        relative_errors = suite.errors(adapted).traction / tolerance
        results.append((relative_errors, adapted.tables.sliders, seconds))
    return results


def slip_at_stress(closure_range, stress, directions, law):
    """Slip of a law along the directions at a normal stress (Pa)."""
    return run_slip_tests(law, closure_range, stress, directions)


def tolerance_rows(results, group):
    """Rows of the table for a group of laws, one for each tolerance that is not always refused."""
    rows = []
    for tolerance, column in zip(TOLERANCES, zip(*results, strict=True), strict=False):
        accepted = [result for result in column if result is not None]
        if not accepted:
            continue
        errors_by_law, sliders, seconds = zip(*accepted, strict=True)
        met = sum(one.max() <= 1.0 for one in errors_by_law) / len(results)
        path_errors = np.concatenate(errors_by_law)  # laws that jam have fewer
        rows.append([f"{len(results)} with {group}", f"{tolerance:.1%}", f"{met:.1%}",
                     f"{np.mean(path_errors <= 1.0):.1%}", f"{path_errors.max():.2f}",
                     f"{np.median(sliders):.0f}", len(results) - len(accepted),
                     f"{max(seconds):.1f}"])  # fmt: skip
    return rows


def small_loads(laws=100, seed=1):
    """Largest errors (%) on random paths within fractions of the closure range.

    All presets and so many random laws, in one plane; of "balanced", of `at_tolerance(0.01)`, and
    of `at_tolerance` with the `stress` at 0.01 closure ranges and at one.
    """
    cases = [jl.presets.load(name) for name in jl.presets.names()]
    cases += [random_law(np.random.default_rng([seed, i])) for i in range(laws)]
    results = [
        small_load_errors(replace(law, plane=0.0)) for law in track(cases, "laws", len(cases))
    ]
    rows = []
    for name in results[0]:
        sliders, *path_errors = np.transpose([result[name] for result in results])
        cells = [f"{max(column):.2f}" for column in path_errors]
        rows.append([name, f"{np.median(sliders):.0f}", *cells])
    print_table(["resolution", "sliders", *(f"{x:g}" for x in PATH_RANGES)], rows)


def small_load_errors(law):
    """By resolution: sliders, and largest errors (%) on paths within each of PATH_RANGES."""
    ends = np.array([PATH_RANGES[-1], 1.0]) * law.closure_range
    stress = law.normal_stress(ends).tolist()
    variants = {
        "`balanced`": replace(law, resolution="balanced"),
        "`at_tolerance(0.02)`": law.at_tolerance(0.02),
        "`at_tolerance(0.02, stress=...)`": law.at_tolerance(0.02, stress),
    }
    results = {name: [variant.tables.sliders] for name, variant in variants.items()}
    for path_range in PATH_RANGES:
        limited = replace(law, closure_range=path_range * law.closure_range)
        increments = random_paths(limited, np.random.default_rng(0))
        finest = replace(limited, resolution=scale_resolution(reference_resolution(limited), 1.2))
        reference = tractions(finest, increments)
        for name, variant in variants.items():
            largest = relative_errors(tractions(variant, increments), reference).max()
            results[name].append(100.0 * largest)
    return results


def angles(laws=30, seed=18):
    """Errors (deg) of friction and dilation angle under slip far beyond the closure, by resolution.

    Laws: all presets and so many random ones with a from 1.5 to 9, every third with c at its bound,
    without laws that jam (atan(mu) + 90 deg/a >= 90 deg). Motion in one plane, at 2 MPa and at half
    the normal stress of the closure range R, to three mating lengths (without one to 30 R) and
    back. Errors count from 0.2 mating lengths (2 R) on, and on the way back from its first fifth
    (and 2 R) on.
    """
    cases = laws_that_slip(laws, seed)
    results = np.array([angle_errors(law) for law in track(cases, "laws", len(cases))])
    columns = "friction, before reversal", "friction, after reversal", "friction, median"
    rows = []
    for i, name in enumerate(NAMED_RESOLUTIONS):
        for k, column in enumerate((*columns, "dilation")):
            by_law = results[:, i, :, k]
            row = np.median(by_law, axis=0) if column.endswith("median") else by_law.max(axis=0)
            rows.append([name, column, *(f"{error:.2f}" for error in row)])
    ratios = [f"{ratio:g}" if math.isfinite(ratio) else "none" for ratio in MATING_RATIOS]
    print_table(["resolution", "error of", *ratios], rows)


def laws_that_slip(count, seed):
    """All presets and so many random laws that do not jam."""
    laws = [replace(jl.presets.load(name), plane=0.0) for name in jl.presets.names()]
    total = len(laws) + count
    rng = np.random.default_rng(seed)
    while len(laws) < total:
        law = random_law(rng)
        a = float(np.exp(rng.uniform(np.log(1.5), np.log(9.0))))
        b = law.orientation.b
        c = law.orientation.c
        if len(laws) % 3 == 0:
            c = math.copysign(1 / 3 - b / 6, c)
        if math.degrees(math.atan(law.asperity.mu)) + 90 / a < 90:
            laws.append(replace(law, orientation=jl.Orientation(a, b, c), plane=0.0))
    return laws


def angle_errors(law):
    """Degrees (resolutions, ratios, 4): friction forward and back, median forward, dilation."""
    closure_range = law.closure_range
    stress = float(law.normal_stress(closure_range)) / 2
    directions = np.array([(1.0, 0.0, 1.0), (2e6 / stress, 0.0, 1.0)])
    results = np.empty((len(NAMED_RESOLUTIONS), len(MATING_RATIOS), 4))
    for j, ratio in enumerate(MATING_RATIOS):
        variant = replace(law, mating_length=ratio * closure_range)
        finest = replace(variant, resolution=FINEST)
        reference = run_slip_tests(finest, closure_range, stress, directions)
        forward = reference.is_mobilised & (np.arange(2 * STEPS_PER_LEG) < STEPS_PER_LEG)[:, None]
        back = reference.is_mobilised & ~forward
        for i, name in enumerate(NAMED_RESOLUTIONS):
            coarse = replace(variant, resolution=name)
            result = run_slip_tests(coarse, closure_range, stress, directions)
            friction = np.abs(result.friction - reference.friction)
            dilation = np.abs(result.dilation - reference.dilation)[forward]
            results[i, j] = (friction[forward].max(), friction[back].max(),
                             np.median(friction[forward]), dilation.max())  # fmt: skip
    return results


def angle_sum():
    """Difference (deg) between the friction angle and atan(mu) plus the dilation angle.

    At the peak, and from one mating length on; the largest of all presets, at "fine", by normal
    stress and by mating length over closure range.
    """
    ratios = MATING_RATIOS[:5]
    rows = []
    for stress in ANGLE_SUM_STRESSES:
        differences = np.array([[angle_differences(name, ratio, stress) for ratio in ratios]
                                for name in jl.presets.names()]).max(axis=0)  # fmt: skip
        for k, place in enumerate(("at the peak", "later")):
            cells = [f"{x:.1f}" for x in differences[:, k]]
            rows.append([f"{stress / 1e6:g} MPa, {place}", *cells])
    print_table(["normal stress", *(f"{ratio:g}" for ratio in ratios)], rows)


def angle_differences(name, ratio, stress):
    """Degrees between friction angle and atan(mu) plus dilation: at the peak, and later."""
    law = replace(jl.presets.load(name), plane=0.0)
    law = replace(law, mating_length=ratio * law.closure_range, resolution="fine")
    slips = np.geomspace(1e-3, 3.0, 300) * law.mating_length
    test = jl.direct_shear(law.joint(), slips, normal=stress, steps=1)
    dilation = np.degrees(np.arctan(-np.gradient(test.closure, test.shear_2)))
    basic_friction = math.degrees(math.atan(law.asperity.mu))
    difference = np.abs(test.friction_angle - basic_friction - dilation)
    later = test.shear_2 >= law.mating_length
    return difference[test.friction_angle.argmax()], difference[later][:-1].max()


if __name__ == "__main__":
    run_command(__doc__, tolerance, small_loads, angles, angle_sum)
