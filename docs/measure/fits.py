"""How well fits recover parameters and predict stresses that they did not see.

    python docs/measure/fits.py intervals [--draws 40]
    python docs/measure/fits.py extrapolation [--draws 20] [--prior full_contact_stress=2e7,2e10]
    python docs/measure/fits.py empirical-laws
    python docs/measure/fits.py closure-predictions
    python docs/measure/fits.py sandstone

Empirical closure laws, of three parameters each, where u0 is the closure before the test began
(hyperbola: Bandis, Lumsden & Barton 1983):

    power law        stress = s (closure + u0)^n
    Barton-Bandis    stress = k (closure + u0)/(1 - (closure + u0)/V)

They are fitted to the stress itself, the usual way and the one that serves them best beyond the
data: fitted to its logarithm, as the joint law is, the hyperbola diverges even earlier.
"""

from dataclasses import replace
from functools import cache, partial

import numpy as np
from common import print_table, run_command
from scipy.optimize import least_squares

import jointlaw as jl
from jointlaw.calibration import datasets
from jointlaw.calibration.envelopes import (
    ENVELOPES,
    envelope_strength,
    normal_at_peak_and_last,
    peak_and_last,
)
from jointlaw.calibration.meaning import respond, spacing
from jointlaw.calibration.measured import first_loading
from jointlaw.support.progress import track

# intervals: the law that makes the synthetic tests
TRUE_ALPHA = 3.0
TRUE_PARAMETERS = {"asperity_density": 1e6, "beta": 2e-5, "mu": 0.5, "a": 3.0, "b": 0.3, "c": 0.15}
CONVERGED_RESOLUTION = jl.Resolution(20, 14, 48)
CONVERGED_STEPS = 200
NOISE = 0.01  # of the stress (closure), or of the largest shear stress and opening
CLOSURE_TEST_STRESSES = np.geomspace(0.25e6, 10e6, 30)  # Pa
SHEAR_TEST_STRESS = 5e6  # Pa, normal
SHEAR_TEST_SLIPS = np.linspace(0.0, 1e-4, 16)  # m

# extrapolation
LABORATORY_STRESSES = 1e6 * np.array([0.25, 0.5, 0.75, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10])  # Pa
LARGEST_FITTED_STRESS = 5e6  # Pa
STRESS_NOISE = 0.01  # of the stress
CLOSURE_NOISE = 0.005  # of the largest closure

# empirical laws
LARGEST_GRIMSEL_STRESS = 5.3e6  # Pa, of the fitted points
# m/Pa: the slope of first unloading is 1.75e-12 (specimen 1) and 3.22e-12 (2), an upper bound
ROCK_AND_MACHINE_COMPLIANCE = 2e-12
GRIMSEL_CHOICES = [
    (top, alpha) for top in (3.2e6, 4.2e6, 5.3e6) for alpha in ((0, 20), (1, 10), (0, 100))
]

# sandstone: joints of profile JA, dry (0 days) and soaked (Mendeley Data, doi
# 10.17632/g5pf6k9n2w, as parsed by ybfo/RockJointNet). Days in water: normal stress (MPa): peak
# (MPa), its displacement (mm), last shear stress (MPa), its displacement (mm)
SANDSTONE = {
    0: {
        1.0: (1.27995, 1.93732, 0.8615, 9.97151),
        2.0: (2.3101, 2.36467, 1.77513, 10.0),
        3.0: (3.41788, 1.9943, 2.57545, 10.0),
        4.0: (4.46802, 2.42165, 3.48313, 10.02849),
        5.0: (5.71879, 2.64957, 4.33097, 10.02849),
    },
    30: {
        1.0: (1.34898, 1.80036, 1.10121, 10.02452),
        2.0: (2.29358, 2.06711, 1.72, 10.02017),
        3.0: (3.17967, 3.26464, 2.57746, 10.01513),
        4.0: (4.01691, 2.35556, 3.24172, 9.95055),
        5.0: (5.18605, 2.529, 4.23256, 10.00462),
    },
    180: {
        1.0: (1.1597, 1.69231, 0.89354, 10.0),
        2.0: (2.22738, 1.46154, 1.7, 10.02564),
        3.0: (3.1749, 2.12821, 2.37643, 10.05128),
        4.0: (3.74525, 1.84615, 3.1749, 8.82051),
        5.0: (4.93916, 2.97436, 4.17771, 10.02564),
    },
    360: {
        1.0: (1.21339, 1.1509, 0.8159, 10.02558),
        2.0: (1.86982, 1.91816, 1.34762, 10.02558),
        3.0: (2.82427, 2.30179, 2.38, 10.05115),
        4.0: (3.68201, 2.37852, 3.16, 10.0),
        5.0: (4.55658, 2.711, 3.54394, 10.02558),
    },
}
FITTED_STRESSES = (1.0, 3.0, 5.0)  # MPa


def intervals(draws=40):
    """How often the 95 % intervals of a fit contain the true value: synthetic tests with noise.

    Tests: closure alone, shear alone, shear with opening, shear along two directions, and closure
    with shear. Columns: draws in which the interval of a parameter contains the value that made the
    curve, and draws in which the report calls the parameter identifiable. The fit is not given the
    noise level (1 % of the stress, or of the largest shear stress and opening) but estimates it.
    The law that makes the tests has cells and steps so fine that finer ones change it by 0.1 %; the
    fits start with cells as coarse as in a simulation.
    """
    rows = []
    for name, fit_synthetic_test in SYNTHETIC_TESTS.items():
        seeds = track(range(draws), name, draws)
        fits = [fit_synthetic_test(np.random.default_rng((0, seed))) for seed in seeds]
        for parameter in filter(TRUE_PARAMETERS.__contains__, fits[0].free):
            true_value = TRUE_PARAMETERS[parameter]
            ends = [fit.interval(parameter) for fit in fits]
            covered = sum(low <= true_value <= high for low, high in ends)
            identifiable = sum(parameter in fit.identifiable for fit in fits)
            rows.append([name, f"`{parameter}`", f"{covered}/{draws}", identifiable])
    head = ["curves", "parameter", "interval contains the true value", "called identifiable"]
    print_table(head, rows)


def synthetic_law(**changes):
    """The law of the true parameters, with changes."""
    values = TRUE_PARAMETERS | changes
    return jl.JointLaw(
        orientation=jl.Orientation(values["a"], values["b"], values["c"]),
        asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=values["mu"]),
        heights=jl.GammaHeights(TRUE_ALPHA, values["beta"], 0.0, "individual"),
        asperity_density=values["asperity_density"],
    )


def synthetic_closure_curve(rng):
    """A closure test of the true law, from 0.25 MPa, with noise."""
    closure = synthetic_law().closure(CLOSURE_TEST_STRESSES)
    noise = 1 + NOISE * rng.standard_normal(closure.size)
    return jl.ClosureCurve(CLOSURE_TEST_STRESSES * noise, closure - closure[0])


@cache
def exact_shear_test(azimuth):
    """Shear stress (Pa) and opening (m) of the true law at SHEAR_TEST_SLIPS."""
    slips = SHEAR_TEST_SLIPS
    test = jl.ShearCurve(slips, np.ones(slips.size), SHEAR_TEST_STRESS, azimuth)
    law = replace(synthetic_law(), plane=azimuth, resolution=CONVERGED_RESOLUTION)
    return test.predict(law, CONVERGED_STEPS)


def synthetic_shear_curve(rng, azimuth, with_opening):
    """A shear test of the true law, with noise."""
    shear_stress, opening = (
        exact + NOISE * exact.max() * rng.standard_normal(exact.size)
        for exact in exact_shear_test(azimuth)
    )
    return jl.ShearCurve(SHEAR_TEST_SLIPS, shear_stress, SHEAR_TEST_STRESS, azimuth,
                         opening=opening if with_opening else None)  # fmt: skip


def fit_closure(rng):
    """Fit a closure test alone, alpha known from a scan."""
    curve = synthetic_closure_curve(rng)
    return jl.fit_curves([curve], fixed={"alpha": TRUE_ALPHA}, free=("asperity_density", "beta"))


def fit_shear(rng, *azimuths, with_opening=True, **start):
    """Fit shear tests in these directions; start: values of more free parameters than mu and a."""
    curves = [synthetic_shear_curve(rng, azimuth, with_opening) for azimuth in azimuths]
    law = synthetic_law(mu=0.6, a=2.6, **start)
    return jl.fit_curves(curves, law=law, free=("mu", "a", *start))


def fit_closure_and_shear(rng):
    """Fit both tests of one joint, alpha known from a scan, with opening."""
    return jl.fit_curves(
        [synthetic_closure_curve(rng), synthetic_shear_curve(rng, 0.0, with_opening=True)],
        law=synthetic_law(mu=0.6, a=2.6, beta=1.5e-5, asperity_density=1.5e6),
        free=("asperity_density", "beta", "mu", "a"),
    )


SYNTHETIC_TESTS = {
    "closure": fit_closure,
    "shear": lambda rng: fit_shear(rng, 0.0, with_opening=False),
    "shear with opening": lambda rng: fit_shear(rng, 0.0),
    "two shears": lambda rng: fit_shear(rng, 0.0, np.pi / 2, c=0.0),
    "closure and shear": fit_closure_and_shear,
}


def extrapolation(draws=20, prior=""):
    """Errors of predicted stresses, and confidence bands, on curves made by several closure laws.

    Closure tests of 13 points up to 10 MPa, as many laboratories take them, with noise of 1 % of
    the stress and 0.5 % of the closure, fitted up to 5 MPa. Columns for each kind of rock: median
    and largest over the draws of the absolute error of the joint law at 10 MPa, medians of the
    power law and of Barton-Bandis, draws whose 95 % band of the joint law contains the stress
    there, and draws whose report says that the curve has another shape than the law.
    `--prior NAME=LOW,HIGH` sets a prior of the fit.
    """
    name, _, bounds = prior.partition("=")
    priors = {name: tuple(map(float, bounds.split(",")))} if name else {}
    rows = []
    for rock in CLOSURE_LAWS:
        seeds = track(range(draws), rock, draws)
        results = [extrapolate(rock, priors, seed) for seed in seeds]
        errors, covered, warned = (np.array(column) for column in zip(*results, strict=True))
        joint_law, power_law, barton_bandis = np.median(errors, axis=0)
        columns = joint_law, errors[:, 0].max(), power_law, barton_bandis
        rows.append([rock, *(f"{error:.1f} %" for error in columns),
                     f"{covered.sum()}/{draws}", warned.sum()])  # fmt: skip
    print_table(["curve made by", "jointlaw, median", "largest", "power law, median",
                 "Barton-Bandis, median", "inside the band", "report warns"], rows)  # fmt: skip


def extrapolate(rock, priors, seed):
    """Fit one synthetic closure test up to LARGEST_FITTED_STRESS and predict its last stress.

    Returns errors (%) of the joint law and the empirical laws, whether the band of the joint law
    contains the last stress, and whether the report says that the curve has another shape.
    """
    rng = np.random.default_rng(seed)
    closure = CLOSURE_LAWS[rock](rng)
    closure -= closure[0]
    stress = LABORATORY_STRESSES
    noisy_stress = stress * (1 + STRESS_NOISE * rng.standard_normal(stress.size))
    noisy_closure = closure + CLOSURE_NOISE * closure[-1] * rng.standard_normal(stress.size)
    is_fitted = stress <= LARGEST_FITTED_STRESS
    points = noisy_stress[is_fitted], noisy_closure[is_fitted]
    fit = jl.fit_curves([jl.ClosureCurve(*points)], priors=priors)
    laws = fit.predict, *(fit_empirical_law(name, *points) for name in EMPIRICAL_LAWS)
    # compared with the curve, not with one draw of the noise
    errors = [100 * abs(law(closure[-1]) / stress[-1] - 1) for law in laws]
    low, high = fit.band(closure[-1:])
    return errors, low[0] <= stress[-1] <= high[0], fit.shape_differs[0]


def joint_law_closure(rng):
    """Closures (13,) of the joint law: alpha of 1 to 8, density over a decade and a half."""
    law = jl.JointLaw(
        orientation=jl.Orientation(3.0),
        asperity=jl.Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6),
        heights=jl.GammaHeights(rng.uniform(1, 8), 1e-5, 0.0, "individual"),
        asperity_density=10 ** rng.uniform(5.0, 6.5),
    )
    return law.closure(LABORATORY_STRESSES)


def power_law_closure(rng):
    """Closures (13,) of a power law: exponent of 1.5 to 6, closure of 0.1 mm at 10 MPa."""
    return 1e-4 * (LABORATORY_STRESSES / 10e6) ** (1 / rng.uniform(1.5, 6.0))


def hyperbolic_closure(rng):
    """Closures (13,) of Barton-Bandis: 0.1 mm at most, half of it at 0.3 to 3 MPa."""
    half_closure_stress = 10 ** rng.uniform(5.5, 6.5)
    return 1e-4 * LABORATORY_STRESSES / (LABORATORY_STRESSES + half_closure_stress)


def logarithmic_closure(rng):
    """Closures (13,) that grow with the logarithm of the stress, as of unmated joints."""
    return rng.uniform(1e-5, 5e-5) * np.log(LABORATORY_STRESSES / 0.1e6)


def closure_with_rock(joint_closure, rng):
    """Closures (13,) of a joint and linear rock, which is 10 to 40 % of the closure at 10 MPa."""
    closure = joint_closure(rng)
    rock_fraction = rng.uniform(0.1, 0.4)
    rock_closure = closure[-1] * LABORATORY_STRESSES / LABORATORY_STRESSES[-1]
    return (1 - rock_fraction) * closure + rock_fraction * rock_closure


CLOSURE_LAWS = {
    "joint law": joint_law_closure,
    "power law": power_law_closure,
    "joint law and rock": partial(closure_with_rock, joint_law_closure),
    "power law and rock": partial(closure_with_rock, power_law_closure),
    "hyperbola": hyperbolic_closure,
    "semi-logarithm": logarithmic_closure,
}


def empirical_laws():
    """Errors of the joint law and of two empirical laws on the Grimsel fracture, above the fit.

    All are fitted to the loading up to 5.3 MPa. The range of the joint law is over nine choices:
    three priors of alpha, and data up to three stresses. Then the same after correction for the
    compliance of rock and machine.
    """
    stress, measured_closure = first_loading(*datasets.load("grimsel_vd1_closure"))
    fracture_closure = measured_closure - ROCK_AND_MACHINE_COMPLIANCE * stress
    is_fitted = stress <= LARGEST_GRIMSEL_STRESS
    rows = []
    for prefix, closure in (("", measured_closure), ("fracture alone: ", fracture_closure)):
        points = stress[is_fitted], closure[is_fitted]
        laws = {"jointlaw": jl.fit_curves([jl.ClosureCurve(*points)]).predict}
        laws |= {name: fit_empirical_law(name, *points) for name in EMPIRICAL_LAWS}
        for name, law in laws.items():
            error = 100 * (law(closure[~is_fitted]) / stress[~is_fitted] - 1)
            rms = np.sqrt(np.mean(error**2))
            rows.append([prefix + name, f"{error[-1]:+.1f} %", f"{rms:.1f} %"])
        errors = []
        for largest_stress, alpha in GRIMSEL_CHOICES:
            is_used = stress <= largest_stress
            curve = jl.ClosureCurve(stress[is_used], closure[is_used])
            fit = jl.fit_curves([curve], priors={"alpha": alpha})
            errors.append(100 * (fit.predict(closure[-1]) / stress[-1] - 1))
        error_range = f"{min(errors):+.1f} to {max(errors):+.1f} %"
        rows.append([f"{prefix}jointlaw, nine choices", error_range, ""])
    print_table(["law", "error at 10.3 MPa", "rms from 6 to 10.3 MPa"], rows)


def closure_predictions():
    """Errors at 10.3 MPa of laws fitted to the loading of two fractures up to several stresses.

    After correction for the compliance of rock and machine. Columns: largest fitted stress, points
    beyond it whose stress is in the confidence band of the joint law, and errors of the predicted
    stress at 10.3 MPa.
    """
    rows = []
    for specimen in ("grimsel_vd1_closure", "grimsel_vd2_closure"):
        stress, closure = first_loading(*datasets.load(specimen))
        closure = closure - ROCK_AND_MACHINE_COMPLIANCE * stress
        for largest_stress in (3.2e6, 4.2e6, 5.3e6, 7.3e6):
            is_fitted = stress <= largest_stress
            points = stress[is_fitted], closure[is_fitted]
            fit = jl.fit_curves([jl.ClosureCurve(*points)])
            low, high = fit.band(closure[~is_fitted])
            covered = np.sum((low <= stress[~is_fitted]) & (stress[~is_fitted] <= high))
            laws = fit.predict, *(fit_empirical_law(name, *points) for name in EMPIRICAL_LAWS)
            errors = [100 * (law(closure[-1]) / stress[-1] - 1) for law in laws]
            rows.append([specimen, f"{largest_stress / 1e6:g}",
                         f"{covered} of {np.sum(~is_fitted)}",
                         *(f"{error:+.1f} %" for error in errors)])  # fmt: skip
    print_table(["test", "fitted up to (MPa)", "points in the band", "jointlaw", *EMPIRICAL_LAWS],
                rows)  # fmt: skip


def power_law(q, x):
    """Stress over the last stress; q: logarithms (3,) of s, u0, n; x: closure over the last."""
    return np.exp(q[0]) * (np.exp(q[1]) + x) ** np.exp(q[2])


def barton_bandis(q, x):
    """As `power_law`, by the hyperbola, whose largest closure lies beyond the last point."""
    offset = np.exp(q[1])
    y = x + offset
    largest = (1 + offset) * (1 + np.exp(q[2]))
    return np.where(y < largest, np.exp(q[0]) * y / np.maximum(1 - y / largest, 1e-9), np.inf)


EMPIRICAL_LAWS = {"power law": power_law, "Barton-Bandis": barton_bandis}


def fit_empirical_law(name, stress, closure):
    """Fit an empirical law to points (n,) by least squares; returns stress (Pa) of closure (m)."""
    law = EMPIRICAL_LAWS[name]
    first_closure = closure[0]
    span = closure[-1] - first_closure
    x = (closure - first_closure) / span
    relative_stress = stress / stress[-1]
    starts = [
        (-n * np.log1p(u0), np.log(u0), np.log(n))
        for u0 in (0.02, 0.2, 2.0)
        for n in (0.05, 0.5, 1.5, 4.0)
    ]
    bounds = ([-60, -12, -12], [60, 8, 8])

    def residuals(q):
        return law(q, x) - relative_stress

    fits = [
        least_squares(residuals, start, bounds=bounds, x_scale="jac", xtol=1e-12)
        for start in starts
    ]
    best = min(fits, key=lambda fit: fit.cost).x
    return lambda closure: stress[-1] * law(best, (closure - first_closure) / span)


def sandstone():
    """Held-out peaks and last stresses of sandstone joints: the law and empirical envelopes.

    Direct shear to 10 mm of joints of one profile, four sets of five tests, each with start, peak
    and last stress; no closure test and no opening. In each set the tests at 1, 3 and 5 MPa are
    fitted and the tests at 2 and 4 MPa predicted; then each test is predicted from the other four.
    Prints the root mean square errors, and of each fit its law, normal stiffness at 1 MPa, spacing
    of asperities, and errors.
    """
    ways = {"2 and 4 MPa from 1, 3 and 5 MPa": [], "each test from the other four": []}
    details = []
    for days, tests in SANDSTONE.items():
        curves = {stress: sandstone_test(days, stress, *test) for stress, test in tests.items()}
        three = FITTED_STRESSES
        folds = [(three, tuple(stress for stress in tests if stress not in three))]
        folds += [
            (tuple(other for other in tests if other != stress), (stress,)) for stress in tests
        ]
        for fold, (fitted, predicted) in enumerate(track(folds, f"{days} days", len(folds))):
            errors, detail = predict_sandstone(
                [curves[stress] for stress in fitted], [curves[stress] for stress in predicted]
            )
            ways[[*ways][min(fold, 1)]] += errors
            details.append([f"{days}", ", ".join(f"{stress:g}" for stress in predicted), *detail])
    rows = []
    for way, errors in ways.items():
        rms = 100 * np.sqrt(np.mean(np.square(errors), axis=0))
        rows.append([way, len(errors), *(f"{peak:.1f}, {last:.1f} %" for peak, last in rms)])
    names = ["joint law", "without degradation", *ENVELOPES]
    print_table(["predicted", "tests", *names], rows)
    print()
    print_table(["days in water", "predicted (MPa)", "degradation stress (MPa)",
                 "normal stiffness at 1 MPa (GPa/m)", "spacing (mm)", "errors of the law (%)",
                 "errors of Coulomb's line (%)"], details)  # fmt: skip


def sandstone_test(days, stress, peak, peak_displacement, last, last_displacement):
    """A shear curve of start, peak and last stress."""
    shear = 1e-3 * np.array([0.0, peak_displacement, last_displacement])
    name = f"{days} days, {stress:g} MPa"
    return jl.ShearCurve(shear, 1e6 * np.array([0.0, peak, last]), 1e6 * stress, name=name)


def predict_sandstone(fitted, predicted):
    """Errors of predicted peaks and last stresses, (methods, 2) of each test, and the fitted law.

    The methods are the law, the law without degradation, and the envelopes.
    """
    fits = [jl.fit_curves(fitted), jl.fit_curves(fitted, free=("mu", "a", "mating_length"))]
    tests = [fit.predict_shear(*predicted) for fit in fits]
    errors = []
    for k, curve in enumerate(predicted):
        normal = normal_at_peak_and_last(curve)
        strengths = [peak_and_last(one[k].stress) for one in tests]
        strengths += [envelope_strength(name, fitted, normal) for name in ENVELOPES]
        errors.append(np.array(strengths) / peak_and_last(curve.shear_stress) - 1)
    law = fits[0].law
    stiffness = respond(law, 1e6).normal_stiffness
    texts = [", ".join(f"{100 * x:+.1f}" for one in errors for x in one[row]) for row in (0, 2)]
    figures = (law.degradation_stress / 1e6, stiffness / 1e9, 1e3 * spacing(law))
    return errors, [*(f"{figure:.3g}" for figure in figures), *texts]


if __name__ == "__main__":
    run_command(__doc__, intervals, extrapolation, empirical_laws, closure_predictions, sandstone)
