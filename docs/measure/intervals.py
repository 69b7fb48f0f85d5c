"""How often the 95 % intervals of a fit hold the truth: synthetic tests with noise, fitted again.

    python docs/measure/intervals.py --draws 40

For closure alone, shear alone, shear with opening, shear along two directions, and closure with
shear: in how many draws the interval of each parameter held the value that made the curve, and in
how many the report called the parameter identifiable. 1 % noise on the stress (closure), or on the
largest shear stress and opening; the noise is not told to the fit, which estimates it. The tests
are made by a law in cells and steps so fine that finer ones change it by 0.1 %; the fits begin
with cells as coarse as those of a simulation.
"""

from dataclasses import replace
from functools import cache

import numpy as np
from tables import asked, table

import jointlaw as jl
from jointlaw import ClosureCurve, ShearCurve
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


def shear_curve(rng: np.random.Generator, azimuth: float, opening: bool) -> ShearCurve:
    """A shear test of the truth."""
    tau, up = (x + NOISE * x.max() * rng.standard_normal(x.size) for x in exact(azimuth))
    return ShearCurve(SHEAR, tau, NORMAL, azimuth, opening=up if opening else None)


def closure(rng: np.random.Generator):
    """Closure alone, alpha known from a scan."""
    curve = closure_curve(rng)
    return jl.fit_curves([curve], fixed={"alpha": ALPHA}, free=("asperity_density", "beta"))


def shear(rng: np.random.Generator, *azimuths: float, opening: bool = True, **start: float):
    """Shear in some directions, with the opening of the joint; start: of more free parameters."""
    curves = [shear_curve(rng, azimuth, opening) for azimuth in azimuths]
    return jl.fit_curves(curves, law=law(mu=0.6, a=2.6, **start), free=("mu", "a", *start))


def closure_and_shear(rng: np.random.Generator):
    """Both tests of one joint, alpha known from a scan, with opening."""
    return jl.fit_curves(
        [closure_curve(rng), shear_curve(rng, 0.0, opening=True)],
        law=law(mu=0.6, a=2.6, beta=1.5e-5, asperity_density=1.5e6),
        free=("asperity_density", "beta", "mu", "a"),
    )


CASES = {
    "closure": closure,
    "shear": lambda rng: shear(rng, 0.0, opening=False),
    "shear with opening": lambda rng: shear(rng, 0.0),
    "two shears": lambda rng: shear(rng, 0.0, np.pi / 2, c=0.0),
    "closure and shear": closure_and_shear,
}


if __name__ == "__main__":
    draws, rows = asked(__doc__, draws=40).draws, []
    for case, fitted in CASES.items():
        found = track(range(draws), case, draws)
        fits = [fitted(np.random.default_rng((0, k))) for k in found]
        for name in filter(TRUTH.__contains__, fits[0].free):
            ends = [fit.interval(name) for fit in fits]
            held = sum(low <= TRUTH[name] <= high for low, high in ends)
            known = sum(name in fit.identifiable for fit in fits)
            rows.append([case, f"`{name}`", f"{held}/{draws}", known])
    print(table(HEAD, rows))
