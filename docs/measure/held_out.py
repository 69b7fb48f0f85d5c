"""Stresses that a fit did not see: error and band of the joint law on curves made by other laws.

    python docs/measure/held_out.py --draws 20
    python docs/measure/held_out.py --prior full_contact_stress=2e7,2e10

Closure tests of 13 points up to 10 MPa, as many laboratories take them, with noise of 1 % of the
stress and 0.5 % of the closure, fitted up to 5 MPa. For each kind of rock: median and largest over
the draws of the absolute error at 10 MPa of the joint law, medians of the power law and of
Barton-Bandis, the draws whose 95 % band of the joint law covers the stress there, and those whose
report says that the curve has another shape than the law.
"""

from functools import partial

import numpy as np
from baselines import LAWS, fitted
from tables import asked, table

import jointlaw as jl
from jointlaw.support.progress import track

STRESS = 1e6 * np.array([0.25, 0.5, 0.75, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10])  # Pa
CLOSURE_NOISE = 0.005  # of the largest closure
LIMIT = 5e6  # Pa
HEAD = ["curve made by", "jointlaw, median", "largest", "power law, median",
        "Barton-Bandis, median", "inside the band", "report warns"]  # fmt: skip


def power_law(rng):
    """Closures (13,) at STRESS: exponent of 1.5 to 6, closure of 0.1 mm at 10 MPa."""
    return 1e-4 * (STRESS / 10e6) ** (1 / rng.uniform(1.5, 6.0))


def hyperbola(rng):
    """Barton-Bandis of 0.1 mm, half closed at 0.3 to 3 MPa."""
    half = 10 ** rng.uniform(5.5, 6.5)
    return 1e-4 * STRESS / (STRESS + half)


def semi_logarithm(rng):
    """Closure that rises with the logarithm of the stress (unmated joints)."""
    return rng.uniform(1e-5, 5e-5) * np.log(STRESS / 0.1e6)


def asperities(rng):
    """The joint law itself, alpha of 1 to 8, density over a decade and a half."""
    law = jl.JointLaw(
        orientation=jl.Orientation(3.0),
        asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6),
        heights=jl.GammaHeights(rng.uniform(1, 8), 1e-5, 0.0, "individual"),
        asperity_density=10 ** rng.uniform(5.0, 6.5),
    )
    return law.closure(STRESS)


def with_rock(joint, rng):
    """The joint and linear rock beside it, of 10 to 40 % of the closure at 10 MPa."""
    closure, share = joint(rng), rng.uniform(0.1, 0.4)
    return (1 - share) * closure + share * closure[-1] * STRESS / STRESS[-1]


ROCKS = {
    "joint law": asperities,
    "power law": power_law,
    "joint law and rock": partial(with_rock, asperities),
    "power law and rock": partial(with_rock, power_law),
    "hyperbola": hyperbola,
    "semi-logarithm": semi_logarithm,
}


def draw(rock, priors, seed):
    """Errors (%) at the largest stress, whether the band covers it, and whether the fit warns."""
    rng = np.random.default_rng(seed)
    closure = ROCKS[rock](rng)
    closure -= closure[0]
    noisy = STRESS * (1 + 0.01 * rng.standard_normal(STRESS.size))
    measured = closure + CLOSURE_NOISE * closure[-1] * rng.standard_normal(STRESS.size)
    seen = noisy[STRESS <= LIMIT], measured[STRESS <= LIMIT]
    fit = jl.fit_curves([jl.ClosureCurve(*seen)], priors=priors)
    laws = (fit.predict, *(fitted(name, *seen) for name in LAWS))
    # judged by the curve, not by one draw of the noise
    errors = [100 * abs(law(closure[-1]) / STRESS[-1] - 1) for law in laws]
    low, high = fit.band(closure[-1:])
    return errors, low[0] <= STRESS[-1] <= high[0], fit.shape_differs[0]


if __name__ == "__main__":
    given, rows = asked(__doc__, draws=20, prior=""), []
    name, _, ends = given.prior.partition("=")
    priors = {name: tuple(map(float, ends.split(",")))} if name else {}
    for rock in ROCKS:
        found = [draw(rock, priors, k) for k in track(range(given.draws), rock, given.draws)]
        errors, covered, warned = (np.array(column) for column in zip(*found, strict=True))
        own, *others = np.median(errors, axis=0)
        cells = [f"{error:.1f} %" for error in (own, errors[:, 0].max(), *others)]
        rows.append([rock, *cells, f"{covered.sum()}/{len(found)}", warned.sum()])
    print(table(HEAD, rows))
