"""Does `law.at_tolerance(t)` keep its word? Random laws, on random paths that it has never seen.

    python benchmarks/tolerance.py [--laws 100] [--seed 1] [--json tolerance.json]

Laws: a from 1 to 10 (evenly in log a), b and c over their bounds, mu 0.05 to 1, eta 0 to 0.7,
heights of either formation or none, in a plane or in space. Paths: six per law, five to eight legs
between random corners, closures up to the law's closure range R and openings to -0.3 R, shear up to
R; one corner is closed to between half the normal stress at R and all of it. The truth is 1.25
times the reference resolution in each direction.

`met` is the share of laws that keep the tolerance on all six paths, `paths` the share of paths that
do, `worst` the largest error over the tolerance, `seconds` the longest call of `at_tolerance` (the
first of a law makes its reference). a < 1.4 is reported apart.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

import jointlaw as jl
from jointlaw._progress import track
from jointlaw.accuracy.suite import errors, reference_resolution, scaled, tractions

TOLERANCES = (0.05, 0.025, 0.01, 0.003, 0.001)
PATHS, STEPS = 6, 160
SMALL_A = 1.4


def random_law(
    rng: np.random.Generator, smallest: float = 1.0, largest: float = 10.0
) -> jl.JointLaw:
    """Any law within the bounds above; with "population" formation only where that is convex."""
    a = float(np.exp(rng.uniform(0.0, np.log(10.0))))
    b = rng.uniform(-1.0, 2.0)
    c = rng.uniform(-1.0, 1.0) * (1 / 3 - b / 6)
    eta = rng.uniform(0.0, 0.7) * (rng.random() > 0.1)  # and some linear ones
    asperity = jl.Asperity(K=2e8 * 1e-6 ** (0.5 - eta), lam=rng.uniform(0.8, 1.5), eta=eta,
                           mu=rng.uniform(0.05, 1.0))  # fmt: skip
    formation = (None, "population", "individual")[rng.integers(3)]
    heights = None
    if formation is not None:
        heights = jl.GammaHeights(
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
    """Increments (STEPS, PATHS, dim) in m."""
    at, R = [], law.closure_range
    stress = float(law.normal_stress(R))
    for _ in range(PATHS):
        legs = int(rng.integers(5, 9))
        closure = np.concatenate([[0.0, rng.uniform(0.4, 1.0)], rng.uniform(-0.3, 1.0, legs - 1)])
        closure[int(rng.integers(1, legs + 1))] = law.closure(stress * rng.uniform(0.5, 1.0)) / R
        shear = np.sqrt(rng.random(legs + 1)) * (np.arange(legs + 1) > 0)
        turn = rng.uniform(0.0, 2 * math.pi, legs + 1)
        corners = np.stack([closure, shear * np.cos(turn), shear * np.sin(turn)], axis=1)
        when = np.arange(1, STEPS + 1) / STEPS * legs
        at.append(np.stack([np.interp(when, np.arange(legs + 1), x) for x in corners.T], axis=1))
    place = R * np.stack(at, axis=1)[:, :, : law.tables.dim]
    return np.diff(place, axis=0, prepend=0.0)


def misses(law: jl.JointLaw, rng: np.random.Generator) -> list[dict[str, Any]]:
    """Per tolerance: largest error of each random path over the tolerance, and the sliders."""
    d = random_paths(law, rng)
    best = reference_resolution(law)
    truth = tractions(replace(law, resolution=scaled(best, 1.25)), d)
    found = []
    for tolerance in TOLERANCES:
        start = time.perf_counter()
        try:
            made = law.at_tolerance(tolerance)
        except ValueError as error:
            found.append({"refused": str(error)})
            continue
        took = time.perf_counter() - start
        ratio = errors(tractions(made, d), truth)[0] / tolerance
        r = made.resolution
        found.append({"ratio": ratio.tolist(), "sliders": r.sliders, "seconds": took,
                      "resolution": [r.u, r.phi, r.depth]})  # fmt: skip
    return found


def report(draws: list[tuple[jl.JointLaw, list[dict[str, Any]]]], title: str) -> dict[str, Any]:
    """Print and return how often the tolerances were kept."""
    print(f"\n{title}: {len(draws)} laws")
    if not draws:
        return {}
    print(" tolerance     met   paths  worst  sliders  refused  seconds")
    result = {}
    for k, tolerance in enumerate(TOLERANCES):
        kept = [found[k] for _, found in draws if "ratio" in found[k]]
        ratio = np.array([one["ratio"] for one in kept]).reshape(len(kept), -1)
        if not len(kept):
            continue
        result[str(tolerance)] = row = {
            "met": float(np.mean(ratio.max(axis=1) <= 1.0)),
            "paths": float(np.mean(ratio <= 1.0)),
            "worst": float(ratio.max()),
            "median sliders": float(np.median([one["sliders"] for one in kept])),
            "refused": len(draws) - len(kept),
            "seconds": max(one["seconds"] for one in kept),
        }
        shares = f"{tolerance:10.1%} {row['met']:7.1%} {row['paths']:7.1%} {row['worst']:6.2f}"
        print(f"{shares} {row['median sliders']:8.0f} {row['refused']:8d} {row['seconds']:8.1f}")
    return result


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--laws", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--json", help="file to write the numbers to")
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    draws = []
    for _ in track(range(options.laws), "random laws", options.laws):
        law = random_law(rng)
        draws.append((law, misses(law, rng)))
    steep = [one for one in draws if one[0].orientation.a < SMALL_A]
    usual = [one for one in draws if one[0].orientation.a >= SMALL_A]
    result = {"a >= 1.4": report(usual, "a >= 1.4"), "a < 1.4": report(steep, "a < 1.4")}
    if options.json:
        rows = [{"law": law.to_toml(), "found": found} for law, found in draws]
        with open(options.json, "w") as stream:
            json.dump({"summary": result, "rows": rows}, stream, indent=1)


if __name__ == "__main__":
    main()
