"""How often the 95 % intervals of a fit hold the truth: synthetic tests with noise, fitted again.

    python docs/measure/intervals.py --draws 40

For closure alone, shear alone, shear with opening, shear along two directions, and closure with
shear: in how many draws the interval of each parameter held the value that made the curve, and in
how many the report called the parameter identifiable. 1 % noise on the stress (closure), or on the
largest shear stress and opening; the noise is not told to the fit, which estimates it. The tests
are made by a law in cells and steps so fine that finer ones change it by 0.1 %; the fits begin
with cells as coarse as those of a simulation.
"""

import argparse
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import cache, partial

import numpy as np
from tables import table

import jointlaw as jl
from jointlaw import ClosureCurve, ShearCurve
from jointlaw.calibration.fit import Fit
from jointlaw.support.progress import track

HEAD = ["curves", "parameter", "interval contains the true value", "called identifiable"]
NOISE = 0.01
ALPHA, NU, G, R = 3.0, 0.25, 20e9, 1e-3
TRUTH = {"asperity_density": 1e6, "beta": 2e-5, "mu": 0.5, "a": 3.0, "b": 0.3, "c": 0.15}
STRESS = np.geomspace(0.25e6, 10e6, 30)  # Pa
SHEAR = np.linspace(0.0, 1e-4, 16)  # m
NORMAL = 5e6  # Pa
CONVERGED, STEPS = jl.Resolution(20, 14, 48), 200


def law(**change: float) -> jl.JointLaw:
    """The law of these parameters."""
    v = TRUTH | change
    return jl.JointLaw(
        orientation=jl.Orientation(v["a"], v["b"], v["c"]),
        asperity=jl.Asperity.hertz_mindlin(G, NU, R, v["mu"]),
        heights=jl.GammaHeights(ALPHA, v["beta"], 0.0, "individual"),
        asperity_density=v["asperity_density"],
    )


def closure_curve(rng: np.random.Generator) -> ClosureCurve:
    """A closure test of the truth, from 0.25 MPa."""
    y = law().closure(STRESS)
    return ClosureCurve(STRESS * (1 + NOISE * rng.standard_normal(y.size)), y - y[0])


@cache
def exact(azimuth: float) -> tuple[np.ndarray, np.ndarray]:
    """Shear stress and opening of the truth at constant normal stress."""
    clean = ShearCurve(SHEAR, np.ones(SHEAR.size), NORMAL, azimuth)
    return clean.predict(replace(law(), plane=azimuth, resolution=CONVERGED), STEPS)


def shear_curve(
    rng: np.random.Generator, azimuth: float = 0.0, opening: bool = False
) -> ShearCurve:
    """A shear test of the truth."""
    tau, up = (x + NOISE * x.max() * rng.standard_normal(x.size) for x in exact(azimuth))
    return ShearCurve(SHEAR, tau, NORMAL, azimuth, opening=up if opening else None)


def closure(rng: np.random.Generator) -> Fit:
    """Closure alone, alpha known from a scan."""
    curve = closure_curve(rng)
    return jl.fit_curves([curve], fixed={"alpha": ALPHA}, free=("asperity_density", "beta"))


def shear(rng: np.random.Generator, opening: bool = False) -> Fit:
    """One direction of shear, also with the opening of the joint."""
    curve = shear_curve(rng, opening=opening)
    return jl.fit_curves([curve], law=law(mu=0.6, a=2.6), free=("mu", "a"))


def two_shears(rng: np.random.Generator) -> Fit:
    """Shear along the rough direction and across it, with opening."""
    curves = [shear_curve(rng, azimuth, opening=True) for azimuth in (0.0, np.pi / 2)]
    return jl.fit_curves(curves, law=law(mu=0.6, a=2.6, c=0.0), free=("mu", "a", "c"))


def closure_and_shear(rng: np.random.Generator) -> Fit:
    """Both tests of one joint, alpha known from a scan, with opening."""
    return jl.fit_curves(
        [closure_curve(rng), shear_curve(rng, opening=True)],
        law=law(mu=0.6, a=2.6, beta=1.5e-5, asperity_density=1.5e6),
        free=("asperity_density", "beta", "mu", "a"),
    )


CASES: dict[str, Callable[[np.random.Generator], Fit]] = {
    "closure": closure,
    "shear": shear,
    "shear with opening": partial(shear, opening=True),
    "two shears": two_shears,
    "closure and shear": closure_and_shear,
}


def draw(case: str, seed: tuple[int, int]) -> dict[str, tuple[bool, bool]]:
    """For each parameter: does the interval hold the truth, and is it called identifiable?"""
    fit = CASES[case](np.random.default_rng(seed))
    out = {}
    for name in fit.free:
        if name in TRUTH:
            low, high = fit.interval(name)
            out[name] = low <= TRUTH[name] <= high, name in fit.identifiable
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--draws", type=int, default=40, help="draws per case (40)")
    parser.add_argument("--workers", type=int, default=None, help="processes (all cores)")
    args = parser.parse_args()
    rows = []
    with ProcessPoolExecutor(args.workers) as pool:
        for case in CASES:
            found = pool.map(partial(draw, case), [(0, k) for k in range(args.draws)])
            draws = list(track(found, case, args.draws))
            for name in draws[0]:
                held = sum(d[name][0] for d in draws)
                known = sum(d[name][1] for d in draws)
                rows.append([case, f"`{name}`", f"{held}/{len(draws)}", known])
    print(table(HEAD, rows))


if __name__ == "__main__":
    main()
