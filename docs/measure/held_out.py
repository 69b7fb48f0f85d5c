"""Stresses that a fit did not see: error and band of the joint law on curves made by other laws.

    python docs/measure/held_out.py --draws 40
    python docs/measure/held_out.py --few --prior full_contact_stress=2e7,2e10

Closure tests of 16 points from 0.3 to 10 MPa with 1 % noise, fitted up to 5 MPa; with --few of 13
points, as many laboratories take them, and 0.5 % of noise in closure too. For each kind of
rock: median and largest over the draws of the absolute error at 10 MPa of the joint law, medians of
the power law and of Barton-Bandis, the draws whose 95 % band of the joint law covers the stress
there, and those whose report says that the curve has another shape than the law.
"""

import argparse
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial

import numpy as np
from baselines import LAWS, fitted
from tables import table

import jointlaw as jl
from jointlaw.support.progress import track

STRESS = np.geomspace(0.3e6, 10e6, 16)  # Pa
FEW = 1e6 * np.array([0.25, 0.5, 0.75, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10])  # Pa
CLOSURE_NOISE = 0.005  # of the largest closure, with these
LIMIT = 5e6  # Pa
HEAD = ["curve made by", "jointlaw, median", "largest", "power law, median",
        "Barton-Bandis, median", "inside the band", "report warns"]  # fmt: skip
Rng = np.random.Generator
Rock = Callable[[Rng, np.ndarray], np.ndarray]


def power_law(rng: Rng, stress: np.ndarray) -> np.ndarray:
    """Exponent of 1.5 to 6, closure of 0.1 mm at 10 MPa."""
    return 1e-4 * (stress / 10e6) ** (1 / rng.uniform(1.5, 6.0))


def hyperbola(rng: Rng, stress: np.ndarray) -> np.ndarray:
    """Barton-Bandis of 0.1 mm, half closed at 0.3 to 3 MPa."""
    half = 10 ** rng.uniform(5.5, 6.5)
    return 1e-4 * stress / (stress + half)


def semi_logarithm(rng: Rng, stress: np.ndarray) -> np.ndarray:
    """Closure that rises with the logarithm of the stress (unmated joints)."""
    return rng.uniform(1e-5, 5e-5) * np.log(stress / 0.1e6)


def asperities(rng: Rng, stress: np.ndarray) -> np.ndarray:
    """The joint law itself, alpha of 1 to 8, density over a decade and a half."""
    law = jl.JointLaw(
        orientation=jl.Orientation(3.0),
        asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6),
        heights=jl.GammaHeights(rng.uniform(1, 8), 1e-5, 0.0, "individual"),
        asperity_density=10 ** rng.uniform(5.0, 6.5),
    )
    return np.asarray(law.closure(stress))


def with_rock(joint: Rock, rng: Rng, stress: np.ndarray) -> np.ndarray:
    """The joint and linear rock beside it, of 10 to 40 % of the closure at 10 MPa."""
    closure, share = joint(rng, stress), rng.uniform(0.1, 0.4)
    return (1 - share) * closure + share * closure[-1] * stress / stress[-1]


ROCKS: dict[str, Rock] = {
    "joint law": asperities,
    "power law": power_law,
    "joint law and rock": partial(with_rock, asperities),
    "power law and rock": partial(with_rock, power_law),
    "hyperbola": hyperbola,
    "semi-logarithm": semi_logarithm,
}


def draw(
    rock: str, few: bool, priors: dict[str, tuple[float, float]], seed: int
) -> tuple[list[float], bool, bool]:
    """Errors at the largest stress, whether the band covers it, and whether the fit warns."""
    rng, stress = np.random.default_rng(seed), FEW if few else STRESS
    closure = ROCKS[rock](rng, stress)
    closure -= closure[0]
    noisy = stress * (1 + 0.01 * rng.standard_normal(stress.size))
    measured = closure + few * CLOSURE_NOISE * closure[-1] * rng.standard_normal(stress.size)
    seen = noisy[stress <= LIMIT], measured[stress <= LIMIT]
    fit = jl.fit_curves([jl.ClosureCurve(*seen)], priors=priors)
    laws = (fit.predict, *(fitted(name, *seen) for name in LAWS))
    # judged by the curve, not by one draw of the noise
    errors = [float(law(closure[-1])) / stress[-1] - 1 for law in laws]
    low, high = fit.band(closure[-1:])
    return errors, bool(low[0] <= stress[-1] <= high[0]), fit.shape_differs[0]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=40, help="draws per kind of rock (40)")
    parser.add_argument("--workers", type=int, default=None, help="processes (all cores)")
    parser.add_argument("--prior", action="append", default=[], help="NAME=LOW,HIGH; repeatable")
    parser.add_argument("--few", action="store_true", help="13 points, noise of closure too")
    args = parser.parse_args()
    given = (text.partition("=") for text in args.prior)
    priors = {name: tuple(map(float, ends.split(","))) for name, _, ends in given}
    rows = []
    with ProcessPoolExecutor(args.workers) as pool:
        for rock in ROCKS:
            draws = pool.map(partial(draw, rock, args.few, priors), range(args.draws))
            found = list(track(draws, rock, args.draws))
            errors = 100 * np.abs([row[0] for row in found])
            own, *others = np.median(errors, axis=0)
            columns = [own, np.max(errors[:, 0]), *others]
            covered, warned = (sum(row[k] for row in found) for k in (1, 2))
            cells = [f"{error:.1f} %" for error in columns]
            rows.append([rock, *cells, f"{covered}/{len(found)}", warned])
    print(table(HEAD, rows))


if __name__ == "__main__":
    main()
