"""Does `law.at_tolerance(t)` keep its word? Random laws, on random paths that it has never seen.

    python docs/measure/tolerance.py [--laws 100] [--seed 1] [--plane | --small]

Laws: a from 1 to 10 (evenly in log a), b and c over their bounds, mu 0.05 to 1, eta 0 to 0.7,
heights of either formation or none, in a plane or in space, half of them with a mating length of 1
to 1000 R. Paths: 15 per law, six of five to eight legs between random corners, six smooth ones
(sums of four waves), closures up to the law's closure range R and openings to -0.3 R, shear up to
R; somewhere each is closed to between half the normal stress S at R and all of it; and three of
slip at the closure of S/20 to S/2, to three mating lengths but 3 R at most, back and forth again.
Besides, four of slip to three mating lengths, or 30 R, and back at random normal stresses, which
each resolution holds by itself. The truth is twice the reference resolution in each direction.

`met` is the share of laws that keep the tolerance on all of them (one that `at_tolerance`
refuses does not), `paths` the share of paths that do, `worst` the largest error over the tolerance,
`seconds` the longest call of `at_tolerance` in processor time (the first of a law makes its
reference). a < 1.4 is reported apart.

With --small: what paths of small loads ask. The same paths, but within shares of the closure range
of all presets and of that many of the laws, in one plane; the largest error of all paths, in %, of
"balanced", of `at_tolerance(0.01)`, and of it with the `stress` at 0.01 closure ranges and at one.
"""

import math
import time
from dataclasses import replace
from functools import partial

import numpy as np
from tables import asked, table

import jointlaw as jl
from jointlaw.accuracy.slip import random_ways, slip
from jointlaw.accuracy.suite import (
    Suite,
    errors,
    far_path,
    reference_resolution,
    scaled,
    steepest,
    tractions,
)
from jointlaw.support.progress import track

TOLERANCES = (0.05, 0.01, 0.003)
PATHS, STEPS = 6, 160  # of each kind
FARS, SLIPS = 3, 4  # paths that slip at a given closure, and at a given normal stress
SMALL_A = 1.4
HEAD = ["laws", "tolerance", "met", "paths", "worst", "sliders", "refused", "seconds"]
REACHES = (1.0, 0.3, 0.1, 0.03, 0.01)  # closure ranges


def random_law(rng: np.random.Generator) -> jl.JointLaw:
    """Any law within the bounds above; with "population" formation only where that is convex."""
    a = float(np.exp(rng.uniform(0.0, np.log(10.0))))
    b = rng.uniform(-1.0, 2.0)
    c = rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6)
    eta = rng.uniform(0.0, 0.7) * (rng.random() > 0.1)  # and some linear ones
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


def random_paths(law: jl.JointLaw, rng: np.random.Generator) -> np.ndarray:
    """Increments (STEPS, 2 PATHS + FARS, dim) in m."""
    R, s = law.closure_range, np.arange(1, STEPS + 1) / STEPS
    stress = float(law.normal_stress(R))
    far = [far_path(law, rng, stress / 2, s) for _ in range(FARS)]
    straight = [legs(law, rng, stress, s) for _ in range(PATHS)]
    smooth = [waves(law, rng, stress) for _ in range(PATHS)]
    place = np.stack([*straight, *smooth, *far], axis=1)[:, :, : law.dim]
    return np.diff(R * place, axis=0, prepend=0.0)


def legs(law: jl.JointLaw, rng: np.random.Generator, stress: float, s: np.ndarray) -> np.ndarray:
    """Places (STEPS, 3) in units of the closure range, on lines between random corners."""
    count = int(rng.integers(5, 9))
    closure = np.concatenate([[0.0, rng.uniform(0.4, 1.0)], rng.uniform(-0.3, 1.0, count - 1)])
    highest = law.closure(stress * rng.uniform(0.5, 1.0)) / law.closure_range
    closure[rng.integers(1, count + 1)] = highest
    shear = np.sqrt(rng.random(count + 1)) * (np.arange(count + 1) > 0)
    turn = rng.uniform(0.0, 2 * math.pi, count + 1)
    corners = closure, shear * np.cos(turn), shear * np.sin(turn)
    return np.stack([np.interp(s * count, np.arange(count + 1), x) for x in corners], axis=1)


def waves(law: jl.JointLaw, rng: np.random.Generator, stress: float) -> np.ndarray:
    """As `legs`, smooth: each component a sum of four waves of half a period to five."""
    s = np.arange(STEPS + 1) / STEPS

    def wave() -> np.ndarray:
        often, turn = rng.uniform(0.5, 5.0, 4), rng.uniform(0.0, 2 * math.pi, 4)
        made = np.sin(2 * math.pi * np.outer(s, often) + turn) @ rng.normal(size=4)
        return made - made[0]

    up, x, y = wave(), wave(), wave()
    low = rng.uniform(-0.3, 0.3)
    high = float(law.closure(stress * rng.uniform(0.5, 1.0))) / law.closure_range
    closure = low + (high - low) * (up - up.min()) / np.ptp(up)
    far = rng.uniform(0.3, 1.0) / np.hypot(x, y).max()
    # shut within the first tenth of the path
    return np.stack([np.minimum(10 * s, 1.0) * closure, far * x, far * y], axis=1)[1:]


def misses(law: jl.JointLaw, rng: np.random.Generator):
    """Per tolerance: errors of the random paths over it, sliders, seconds; None if refused."""
    d, R = random_paths(law, rng), law.closure_range
    exact = replace(law, resolution=scaled(reference_resolution(law), 2.0))
    stress, ways = float(law.normal_stress(R)) / 2, random_ways(rng, SLIPS, law.dim)
    slid = slip(exact, R, stress, ways) if steepest(law) < 88.0 else None  # else it jams
    suite = Suite((), d, tractions(exact, d), slid, ways, R, stress, np.zeros(0))
    found = []
    for tolerance in TOLERANCES:
        start = time.process_time()
        try:
            made = law.at_tolerance(tolerance)
        except ValueError:
            found.append(None)
            continue
        took = time.process_time() - start
        found.append((suite.miss(made).largest / tolerance, made.tables.sliders, took))
    return found


def rows(count: int, seed: int, plane: bool = False) -> list[list]:
    """How often random laws, all of them in a plane if asked, kept the tolerances; a below and
    above SMALL_A apart."""
    rng, usual, steep = np.random.default_rng(seed), [], []
    for _ in track(range(count), "random laws", count):
        law = random_law(rng)
        if rng.random() < 0.5:
            law = replace(law, mating_length=law.closure_range * 10 ** rng.uniform(0.0, 3.0))
        law = replace(law, plane=0.0) if plane else law
        (usual if law.orientation.a >= SMALL_A else steep).append(misses(law, rng))
    found = []
    for some, name in ((usual, f"a >= {SMALL_A}"), (steep, f"a < {SMALL_A}")):
        for tolerance, column in zip(TOLERANCES, zip(*some, strict=True), strict=False):
            kept = [one for one in column if one is not None]
            if not kept:
                continue
            ratios, sliders, seconds = zip(*kept, strict=True)
            met = sum(ratio.max() <= 1.0 for ratio in ratios) / len(some)
            ratio = np.concatenate(ratios)  # fewer of laws that jam
            found.append([f"{len(some)} with {name}", f"{tolerance:.1%}", f"{met:.1%}",
                          f"{np.mean(ratio <= 1.0):.1%}", f"{ratio.max():.2f}",
                          f"{np.median(sliders):.0f}", len(some) - len(kept),
                          f"{max(seconds):.1f}"])  # fmt: skip
    return found


def small(law: jl.JointLaw) -> dict[str, list[float]]:
    """Sliders, and largest errors in % on paths within each of REACHES, of three resolutions."""
    R = law.closure_range
    stress = law.normal_stress(np.array([REACHES[-1] * R, R])).tolist()
    laws = {
        "`balanced`": replace(law, resolution="balanced"),
        "`at_tolerance(0.01)`": law.at_tolerance(0.01),
        "`at_tolerance(0.01, stress=...)`": law.at_tolerance(0.01, stress),
    }
    found = {name: [made.tables.sliders] for name, made in laws.items()}
    for reach in REACHES:
        near = replace(law, closure_range=reach * R)
        d = random_paths(near, np.random.default_rng(0))
        truth = tractions(replace(near, resolution=scaled(reference_resolution(near), 1.2)), d)
        for name, made in laws.items():
            found[name].append(100.0 * errors(tractions(made, d), truth).max())
    return found


def small_rows(count: int, seed: int) -> list[list]:
    """Median sliders and largest errors of all presets and that many random laws."""
    laws = [jl.presets.load(name) for name in jl.presets.names()]
    laws += [random_law(np.random.default_rng([seed, i])) for i in range(count)]
    found, made = [small(replace(law, plane=0.0)) for law in track(laws, "laws", len(laws))], []
    for name in found[0]:
        sliders, *missed = np.transpose([one[name] for one in found])
        made.append([name, f"{np.median(sliders):.0f}", *(f"{max(one):.2f}" for one in missed)])
    return made


if __name__ == "__main__":
    given = asked(__doc__, laws=100, seed=1, plane=False, small=False)
    if given.small:
        head = ["resolution", "sliders", *(f"{reach:g}" for reach in REACHES)]
        print(table(head, small_rows(given.laws, given.seed)))
    else:
        print(table(HEAD, rows(given.laws, given.seed, given.plane)))
