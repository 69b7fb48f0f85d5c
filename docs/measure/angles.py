"""Friction and dilation angle under slip far beyond the closure: how far a resolution misses them.

    python docs/measure/angles.py [--laws 30] [--seed 18]
    python docs/measure/angles.py --sum

Laws: all presets and random ones as in docs/measure/tolerance.py, but with a from 1.5 to 9, every
third with c at its bound, none that jams (atan(mu) + 90 deg/a < 90 deg). Motion in one plane, at
2 MPa and at half the normal stress of the closure range R, to three mating lengths (without one to
30 R) and back. Misses count from 0.2 mating lengths (2 R) on, and on the way back from its first
fifth (and 2 R) on.

With --sum: how far the friction angle lies from that of the asperities plus the dilation angle, in
degrees, at the peak and from one mating length on; the largest of all presets, at "fine".
"""

import math
from dataclasses import replace

import numpy as np
from tables import asked, table
from tolerance import random_law

import jointlaw as jl
from jointlaw.accuracy.slip import LEG, slip
from jointlaw.support.progress import track

RATIOS = (1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, math.inf)  # mating length over closure range
BEST = jl.Resolution(24, 14, 12)  # finer ones change the friction angle by less than 0.1 degrees
TRIED = ("fast", "balanced", "fine")


def draw(count: int, seed: int) -> list[jl.JointLaw]:
    """All presets and that many random laws."""
    laws = [replace(jl.presets.load(name), plane=0.0) for name in jl.presets.names()]
    rng, all_of_them = np.random.default_rng(seed), len(laws) + count
    while len(laws) < all_of_them:
        law = random_law(rng)
        a = float(np.exp(rng.uniform(np.log(1.5), np.log(9.0))))
        b, c = law.orientation.b, law.orientation.c
        if len(laws) % 3 == 0:
            c = math.copysign(1 / 3 - b / 6, c)
        if math.degrees(math.atan(law.asperity.mu)) + 90 / a < 90:
            laws.append(replace(law, orientation=jl.Orientation(a, b, c), plane=0.0))
    return laws


def misses(law: jl.JointLaw) -> np.ndarray:
    """Degrees (tried, ratios, 4): friction there and back, median of friction there, dilation."""
    R = law.closure_range
    stress = float(law.normal_stress(R)) / 2
    ways = np.array([(1.0, 0.0, 1.0), (2e6 / stress, 0.0, 1.0)])
    found = np.empty((len(TRIED), len(RATIOS), 4))
    for j, ratio in enumerate(RATIOS):
        own = replace(law, mating_length=ratio * R)
        truth = slip(replace(own, resolution=BEST), R, stress, ways)
        there = truth.counts & (np.arange(2 * LEG) < LEG)[:, None]
        back = truth.counts & ~there
        for i, name in enumerate(TRIED):
            mine = slip(replace(own, resolution=name), R, stress, ways)
            friction = np.abs(mine.friction - truth.friction)
            dilation = np.abs(mine.dilation - truth.dilation)[there]
            found[i, j] = (friction[there].max(), friction[back].max(),
                           np.median(friction[there]), dilation.max())  # fmt: skip
    return found


def missed(found: np.ndarray) -> str:
    """Markdown of misses (laws, tried, ratios, 4)."""
    kinds = "friction, before reversal", "friction, after reversal", "friction, median", "dilation"
    rows = []
    for i, name in enumerate(TRIED):
        for k, kind in enumerate(kinds):
            some = found[:, i, :, k]
            row = np.median(some, axis=0) if k == 2 else some.max(axis=0)
            rows.append([name, kind, *(f"{x:.2f}" for x in row)])
    names = [f"{ratio:g}" if math.isfinite(ratio) else "none" for ratio in RATIOS]
    return table(["resolution", "error of", *names], rows)


def sums() -> str:
    """Markdown: rows by normal stress, columns by mating length over closure range."""
    ratios, rows = RATIOS[:5], []
    for stress in (1e5, 1e6, 5e6, 20e6):
        apart = np.array([[excess(name, ratio, stress) for ratio in ratios]
                          for name in jl.presets.names()]).max(axis=0)  # fmt: skip
        for k, place in enumerate(("at the peak", "later")):
            rows.append([f"{stress / 1e6:g} MPa, {place}", *(f"{x:.1f}" for x in apart[:, k])])
    return table(["normal stress", *(f"{ratio:g}" for ratio in ratios)], rows)


def excess(name: str, ratio: float, stress: float) -> tuple[float, float]:
    """Degrees between friction and that of asperities and dilation: at the peak, and later."""
    law = replace(jl.presets.load(name), plane=0.0)
    law = replace(law, mating_length=ratio * law.closure_range, resolution="fine")
    places = np.geomspace(1e-3, 3.0, 300) * law.mating_length
    test = jl.direct_shear(law.joint(), places, normal=stress, steps=1)
    dilation = np.degrees(np.arctan(-np.gradient(test.closure, test.shear_2)))
    apart = np.abs(test.friction_angle - math.degrees(math.atan(law.asperity.mu)) - dilation)
    later = test.shear_2 >= law.mating_length
    return apart[test.friction_angle.argmax()], apart[later][:-1].max()


if __name__ == "__main__":
    options = asked(__doc__, laws=30, seed=18, sum=False)
    if options.sum:
        print(sums())
    else:
        laws = draw(options.laws, options.seed)
        print(missed(np.array([misses(law) for law in track(laws, "laws", len(laws))])))
