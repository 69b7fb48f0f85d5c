"""How often the 95 % intervals and bands of fits of shear tests contain the true values.

    python docs/measure/coverage.py [--draws 10] [--case "white noise"] [--results FILE]

Direct shear tests of a known law, with opening, and with the noise of each case; free are mu, a and
mating_length. Columns: draws whose interval of a parameter contains the true value; draws whose
confidence band contains the true peak shear stress, and the true opening at the end, of tests at
two other normal stresses; draws whose report warns that the law has another shape than the data.

    three points        start, peak and end of two tests, 2 % of independent noise
    white noise         15 points of two tests, 2 % of independent noise
    autocorrelated      30 points of two tests, 2 % of noise with an autocorrelation of 0.9
    specimens           14 points of three tests, 1 % of independent noise; the logarithms of mu and
                        a of each specimen have a standard deviation of 6 %
    degradation         15 points of two tests, 1 % of independent noise; the true law has asperity
                        degradation (slope_wear), the fitted law has none

The law that makes the tests has cells and steps so fine that finer ones change it by 0.1 %; the
fits choose their own.

`--results` names a file to which each draw is appended. A later command with the same file and the
same code repeats none of the draws in it, so that a command that was stopped can be continued.
"""

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from common import print_table, run_command

import jointlaw as jl
from jointlaw.support.progress import track

TRUE_PARAMETERS = {"mu": 0.55, "a": 3.0, "mating_length": 4e-3}
START = {"mu": 0.6, "a": 2.6, "mating_length": 3e-3}
RESOLUTION = jl.Resolution(16, 12, 40)
STEPS = 160
END = 8e-3  # m of shear displacement
PREDICTED_STRESSES = (2.5e6, 6e6)  # Pa


@dataclass(frozen=True)
class Case:
    """Shear tests of one kind.

    points: of each test; 3 are start, peak and end.
    stresses: normal stresses of the tests in Pa.
    noise: standard deviation, of the largest shear stress and opening.
    autocorrelation: of neighbouring deviates.
    spread: standard deviation of ln(mu) and ln(a) between specimens.
    changes: of the true law.
    draws: number of draws, without the option --draws.
    """

    points: int
    stresses: tuple[float, ...] = (1e6, 3e6)
    noise: float = 0.02
    autocorrelation: float = 0.0
    spread: float = 0.0
    changes: dict[str, float] = field(default_factory=dict)
    draws: int = 40


CASES = {
    "three points": Case(3),
    "white noise": Case(15),
    "autocorrelated": Case(30, autocorrelation=0.9),
    "specimens": Case(14, (1e6, 2e6, 4e6), noise=0.01, spread=0.06),
    "degradation": Case(15, noise=0.01, changes={"slope_wear": 4e3}, draws=20),
}


def make_law(mu, a, mating_length, **changes):
    """A law of these parameters with a plane."""
    return jl.JointLaw(
        orientation=jl.Orientation(a),
        asperity=jl.Asperity(K=9.637e8, lam=1.167, eta=0.5, mu=mu),
        heights=jl.GammaHeights(3.7, 1e-5, 0.0, "individual"),
        asperity_density=3e5,
        mating_length=mating_length,
        plane=0.0,
        **changes,
    )


def exact_test(law, shear, normal):
    """Shear stress (Pa) and opening (m) of a law at these displacements (m)."""
    curve = jl.ShearCurve(shear, np.ones(shear.size), normal)
    return curve.predict(jl.JointLaw(**law_fields(law), resolution=RESOLUTION), STEPS)


def law_fields(law):
    """The arguments of a law, without its resolution."""
    names = ("orientation", "asperity", "heights", "asperity_density", "mating_length",
             "slope_wear", "plane")  # fmt: skip
    return {name: getattr(law, name) for name in names}


def displacements(case, law, normal):
    """Displacements (m) of the measured points: dense about the peak, or start, peak and end."""
    if case.points > 3:
        half = case.points // 2
        rise = np.linspace(0.0, 0.25 * END, half)
        return np.concatenate([rise, np.linspace(0.25 * END, END, case.points - half + 1)[1:]])
    grid = np.linspace(0.0, END, 161)
    stress, _ = exact_test(law, grid, normal)
    return np.array([0.0, grid[np.argmax(stress)], END])


def autocorrelated_noise(rng, n, rho):
    """Normal deviates (n,) of unit variance with the correlation rho^|i - j|."""
    deviates = rng.standard_normal(n)
    for k in range(1, n):
        deviates[k] = rho * deviates[k - 1] + np.sqrt(1 - rho**2) * deviates[k]
    return deviates


def draw_tests(case, law, paths, rng):
    """One draw of the tests of a case."""
    curves = []
    for normal, shear in paths.items():
        specimen = law
        if case.spread:
            mu, a = (
                TRUE_PARAMETERS[name] * np.exp(case.spread * rng.standard_normal())
                for name in ("mu", "a")
            )
            length = TRUE_PARAMETERS["mating_length"]
            specimen = make_law(mu, a, length, **case.changes)
        columns = []
        for exact in exact_test(specimen, shear, normal):
            noise = autocorrelated_noise(rng, exact.size, case.autocorrelation)
            column = exact + case.noise * np.abs(exact).max() * noise
            column[0] = 0.0
            columns.append(column)
        stress, opening = columns
        curves.append(jl.ShearCurve(shear, stress, normal, opening=opening))
    return curves


def coverage(draws=0, case="", results=""):
    """Print the table of all cases, or of one; draws = 0 takes the number of each case."""
    finished = read_draws(results)
    rows = []
    for name in [case] if case else CASES:
        number = draws or CASES[name].draws
        hits = np.sum(cover(name, number, finished, results), axis=0)
        rows.append([name, *(f"{count}/{number}" for count in hits)])
    head = ["case", *(f"`{name}`" for name in TRUE_PARAMETERS)]
    for stress in PREDICTED_STRESSES:
        head += [f"peak at {stress / 1e6:g} MPa", f"opening at {stress / 1e6:g} MPa"]
    print_table([*head, "report warns"], rows)


def read_draws(results):
    """The results of finished draws by case and seed; empty without a file."""
    if not results or not Path(results).exists():
        return {}
    draws = map(json.loads, Path(results).read_text(encoding="utf-8").splitlines())
    return {(name, seed): hits for name, seed, hits in draws}


def cover(name, draws, finished, results):
    """What the intervals and bands of each draw of a case contain, (draws, columns)."""
    case = CASES[name]
    law = make_law(**TRUE_PARAMETERS, **case.changes)
    paths = {normal: displacements(case, law, normal) for normal in case.stresses}
    new_shear = np.linspace(0.0, END, 21)
    targets = {stress: exact_test(law, new_shear, stress) for stress in PREDICTED_STRESSES}
    rows = []
    for seed in track(range(draws), name, draws):
        hits = finished.get((name, seed))
        if hits is None:
            curves = draw_tests(case, law, paths, np.random.default_rng((7, seed)))
            hits = find_hits(curves, new_shear, targets)
            if results:
                with Path(results).open("a", encoding="utf-8") as file:
                    file.write(json.dumps([name, seed, hits]) + "\n")
        rows.append(hits)
    return rows


def find_hits(curves, new_shear, targets):
    """Whether each interval and band of a fit contains the true value, and whether it warns."""
    fit = jl.fit_curves(curves, law=make_law(**START), free=tuple(TRUE_PARAMETERS))
    hits = []
    for parameter, value in TRUE_PARAMETERS.items():
        low, high = fit.interval(parameter)
        hits.append(low <= value <= high)
    for normal, (stress, opening) in targets.items():
        curve = jl.ShearCurve(new_shear, np.ones(new_shear.size), normal)
        (points,) = (test.points for test in fit.predict_shear(curve))
        stress_band, opening_band = fit.shear_band(curve)[:, :, points]
        peak = int(np.argmax(stress))
        hits.append(stress_band[0, peak] <= stress[peak] <= stress_band[1, peak])
        hits.append(opening_band[0, -1] <= opening[-1] <= opening_band[1, -1])
    return [bool(hit) for hit in [*hits, any(fit.shape_differs)]]


if __name__ == "__main__":
    run_command(__doc__, coverage)
