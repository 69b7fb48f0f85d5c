"""The inverse problem of a fit: free and fixed parameters, priors, initial values, least squares.

A fit minimises

    sum (r / sigma)^2 + sum ((x - centre) / sd)^2

over the free parameters x (mostly logarithms): r are the residuals of the data with standard errors
sigma, the second sum are the priors. Three difficulties determine how this module works.

**The noise is unknown.** Level, autocorrelation and spread between specimens follow from the
residuals of the fit, and the fit depends on them. The minimum above, with the expected sigma, is
therefore only the beginning: `solve` then takes Gauss-Newton steps to the mean of the posterior
that is averaged over the noise models (`noise`), until neither parameters nor noise change.

**The misfit has several minima.** A mating length far from the true one makes the misfit flat,
since the peak is then outside the measured range; and closure curves of narrow and of broad heights
are similar. Hence a fit starts from several points (`starting_points`), and a fit of closure and
shear curves is prepared in stages (`staged_starts`): first the closure curve determines the
parameters of closure, then the shear curves the others, then all curves all parameters.

**Data do not determine all parameters.** The covariance C = (D + L)^-1 has the information D of the
data and L of the priors. Since C = C D C + C L C, the prior share of the variance of a parameter is
the ratio of the diagonals of C L C and C. D includes that each parameter is within its bounds, as a
normal distribution whose standard deviation is the distance of the bounds: a parameter that
nothing else determines then has a wide but finite interval, and C exists.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..laws.joint_law import JointLaw
from ..parameters.bond import Bond
from ..parameters.declared import parameters_of
from ..parameters.orientation import largest_c
from ..support.checks import Array, number, one_of
from .forward import (
    DEFAULT_BETA,
    DEFAULT_SLOPE_RESIDUAL,
    DEFAULT_STIFFNESS,
    DEFAULT_STIFFNESS_STRESS,
    Settings,
    build_law,
    density_for_stiffness,
    log_stress,
    parameters_of_law,
)
from .measured import ClosureCurve, ShearCurve, simulate_curves
from .noise import (
    LinearTest,
    NoiseEstimate,
    Posterior,
    Prior,
    Series,
    estimate_posterior,
    misfit,
    parameter_gain,
    prior_estimate,
    specimen_residuals,
)
from .priors import TRANSFORMS, Ranges, Values, normal_priors, quantity

Curves = Sequence[ClosureCurve | ShearCurve]
QUANTILE = 1.959964  # half-width of a 95 % interval in standard errors
MAX_STEPS = 12  # to the mean of the posterior
MAX_HALVINGS = 6  # of a step that increases the misfit
STEP_TOLERANCE = 0.1  # of the standard error of a parameter: it widens an interval by 0.5 %
FULL_STEPS = 4  # later steps are reduced, because they oscillate about the mean
STEP_REDUCTION = 0.6
LEVEL_TOLERANCE = 0.05  # of the logarithm of a noise level
CLOSURE_PARAMETERS = (
    "alpha",
    "beta",
    "overlap",
    "asperity_density",
    "K",
    "yield_interference",
    "preload_closure",
)
# initial mating lengths over the largest shear displacement
INITIAL_MATING_LENGTHS = (0.5, 0.15, 0.05, 0.015)
MIN_STRESS_DIFFERENCE = 0.05  # of normal stresses of tests that are different
START_TOLERANCE = 1e-5  # relative change of parameters and misfit, with the expected noise
COARSE_TOLERANCE = 1e-3  # likewise, for initial values
REJECTED_RESIDUAL = 1e6  # of a law that cannot follow a test
BOUND_MARGIN = 1e-9  # of the distance of the bounds: a fit stays away from them by this much
DIFFERENCE_STEP = 1e-4  # of central differences, of a transformed parameter
Function = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Problem:
    """Curves, free parameters, values of all parameters, and priors.

    closure: the closure curve, or None.
    shears: the shear curves.
    free: names of the free parameters.
    values: values of all parameters by name; of the free ones, initial values.
    priors: centre and standard deviation of each prior by name, after the transform.
    settings: fixed properties of the law.
    one_specimen: whether all tests are on one specimen.
    progress: a progress bar that advances with each law tried, or None.
    assumes_stiffness: whether the density of asperities follows from the default stiffness, because
        no closure was measured.

    A vector x (p,) has the free parameters after their transforms, mostly logarithms.
    """

    closure: ClosureCurve | None
    shears: tuple[ShearCurve, ...]
    free: tuple[str, ...]
    values: Values
    priors: Mapping[str, tuple[float, float]]
    settings: Settings
    one_specimen: bool = False
    progress: Iterator[object] | None = None
    assumes_stiffness: bool = False

    @property
    def curves(self) -> Curves:
        """The closure curve, if there is one, and the shear curves."""
        return [curve for curve in (self.closure, *self.shears) if curve is not None]

    @property
    def series(self) -> tuple[Series, ...]:
        """The measured quantities of all curves."""
        return tuple(series for curve in self.curves for series in curve.series)

    @property
    def has_specimens(self) -> bool:
        """Whether the tests are on several specimens."""
        return len(self.curves) > 1 and not self.one_specimen

    @property
    def varies(self) -> Array:
        """Whether each free parameter is a logarithm that differs between specimens, (p,)."""
        return np.array([TRANSFORMS[n].log and n != "preload_closure" for n in self.free])

    def unpack(self, x: Array) -> dict[str, float]:
        """All parameters in SI units from the vector of the free ones."""
        free_values = {
            name: TRANSFORMS[name].back(float(transformed))
            for name, transformed in zip(self.free, x, strict=True)
        }
        values = {**self.values, **free_values}
        if "c" in self.free:
            bound = largest_c(values["b"])
            values["c"] = min(max(values["c"], -bound), bound)
        return values

    def pack(self, values: Values) -> Array:
        """The vector of these values, or the nearest within bounds."""
        transformed = []
        for name in self.free:
            transform = TRANSFORMS[name]
            transformed.append(transform.to(min(max(values[name], transform.low), transform.high)))
        return np.clip(transformed, *self.bounds())

    def pack_scaled(self, values: Values) -> Array:
        """The vector of these values, with a stiffness that fits the closure curve on average.

        The stiffness is `asperity_density`, else K, whichever is free; without either, or without a
        closure curve, as `pack`.
        """
        x = self.pack(values)
        stiffness = next((name for name in ("asperity_density", "K") if name in self.free), None)
        curve = self.closure
        if stiffness is not None and curve is not None:
            packed = self.unpack(x)
            closure = packed["preload_closure"] + curve.closure
            log_ratio = np.log(curve.stress) - log_stress(packed, closure, self.settings)
            x[self.free.index(stiffness)] += float(np.mean(log_ratio))
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the vector."""
        transforms = [TRANSFORMS[name] for name in self.free]
        low = np.array([transform.to(transform.low) for transform in transforms])
        high = np.array([transform.to(transform.high) for transform in transforms])
        if "b" in self.free and "c" not in self.free:
            high[self.free.index("b")] = 2 - 6 * abs(self.values["c"])  # Eq. 18
        if "c" in self.free and "b" not in self.free:
            bound = largest_c(self.values["b"])
            low[self.free.index("c")] = -bound
            high[self.free.index("c")] = bound
        return low, high

    def data(self, x: Array) -> Array:
        """Residuals of all series, one after the other."""
        if self.progress is not None:
            next(self.progress)
        values = self.unpack(x)
        residuals = list[Array]()
        if self.closure is not None:
            residuals.append(self.closure.residuals(values, self.settings))
        tests = simulate_curves(self.shears, values, self.settings)
        for curve, test in zip(self.shears, tests, strict=True):
            residuals += curve.residuals(test)
        return np.concatenate(residuals)

    def prior(self, x: Array) -> Array:
        """Residuals of the priors over their standard deviations."""
        values = self.unpack(x)
        residuals = [
            (TRANSFORMS[name].to(quantity(name, values)) - centre) / sd
            for name, (centre, sd) in self.priors.items()
        ]
        return np.array(residuals)

    def residuals(self, x: Array, sigma: Array) -> Array:
        """Residuals of the data over their standard errors, then residuals of the priors."""
        return np.concatenate([self.data(x) / sigma, self.prior(x)])

    def split(self, residuals: Array) -> list[Array]:
        """An array with one number per residual of the data, divided by series."""
        sizes = [series.sigma().size for series in self.series]
        return np.split(residuals, np.cumsum(sizes)[:-1])

    @property
    def expected_sigma(self) -> Array:
        """Expected standard errors of all residuals."""
        return np.concatenate([series.sigma() for series in self.series])

    def by_test(self, residuals: Array, J: Array) -> list[LinearTest]:
        """Residuals (n,) and their derivative (n, p), divided by test and series."""
        pieces = iter(zip(self.split(residuals), self.split(J), strict=True))
        tests = []
        for curve in self.curves:
            own = [next(pieces) for _ in curve.series]
            tests.append(LinearTest(curve.series, [r for r, _ in own], [D for _, D in own]))
        return tests


def build_problem(
    curves: Curves,
    free: Sequence[str] | None,
    fixed: Values | None,
    law: JointLaw | None,
    priors: Ranges | None,
    one_specimen: bool = False,
) -> Problem:
    """The problem of the arguments of `fit_curves`; raises ValueError as `fit_curves`."""
    closures = [curve for curve in curves if isinstance(curve, ClosureCurve)]
    shears = tuple(curve for curve in curves if isinstance(curve, ShearCurve))
    if not curves or len(closures) > 1:
        raise ValueError(
            f"curves holds {len(closures)} closure curves of {len(curves)}: give one at most, and "
            "ShearCurves"
        )
    values, settings = parameters_of_law(law)
    fixed = fixed or {}
    free = _default_free(closures, shears) if free is None else free
    given = {*fixed, *free}
    takes_default_heights = law is None and not closures and "beta" not in given
    if takes_default_heights:
        values["beta"] = DEFAULT_BETA
    degrades = np.isfinite([values["slope_wear"], values["degradation_stress"]]).any()
    if "degradation_stress" in free and not degrades and "slope_residual" not in given:
        values["slope_residual"] = DEFAULT_SLOPE_RESIDUAL
    free_names = [name for name in free if name not in fixed]
    for name in (*fixed, *free_names):
        if name in parameters_of(Bond) and settings.law.bond is None:
            raise ValueError(
                f"{name} is a parameter of a bond: give a law with a bond, whose other parameters "
                "are kept"
            )
        one_of("free or fixed", name, tuple(values))
    values |= {name: number(f"fixed[{name!r}]", value) for name, value in fixed.items()}
    initial_law = build_law(values, settings)  # raises ValueError for values that no law has
    assumes_stiffness = law is None and not closures and not given & {"asperity_density", "K"}
    if assumes_stiffness:
        values["asperity_density"] = density_for_stiffness(
            initial_law, DEFAULT_STIFFNESS, DEFAULT_STIFFNESS_STRESS
        )
    values |= {
        name: _finite_initial_value(name, closures, shears, build_law(values, settings))
        for name in free_names
        if math.isinf(values[name])
    }
    for curve in closures:
        if curve.preload_closure is None:
            values["preload_closure"] = float(np.ptp(curve.closure))
            free_names.append("preload_closure")
        else:
            values["preload_closure"] = curve.preload_closure
    if not free_names:
        raise ValueError("free is empty: name at least one parameter to fit")
    # the prior of the full contact stress is stated for the standard deviation of gamma heights
    dropped = {} if "alpha" in values else {"full_contact_stress": None}
    chosen = normal_priors(tuple(free_names), {**dropped, **(priors or {})})
    closure = next(iter(closures), None)
    return Problem(
        closure,
        shears,
        tuple(free_names),
        values,
        chosen,
        settings,
        one_specimen,
        assumes_stiffness=assumes_stiffness,
    )


def _default_free(closures: Sequence[ClosureCurve], shears: Sequence[ShearCurve]) -> list[str]:
    """The free parameters of a fit to these tests if none are named.

    Shear tests alone do not determine the density of asperities: it would bend the strength
    envelope by joints that are much too soft. The degradation stress bends it, where tests at three
    normal stresses or more show how.
    """
    names = ["asperity_density", "alpha", "beta"] if closures else []
    names += ["yield_interference"] if any(curve.cycle for curve in closures) else []
    names += ["mu", "a", "mating_length"] if shears else []
    stresses = sorted(float(np.mean(curve.normal)) for curve in shears)
    steps = np.diff(stresses) > MIN_STRESS_DIFFERENCE * np.array(stresses[1:])
    return names + ["degradation_stress"] * bool(np.sum(steps) >= 2)


# -------------------------------------------------------------------------- initial values


def _finite_initial_value(
    name: str, closures: Sequence[ClosureCurve], shears: Sequence[ShearCurve], law: JointLaw
) -> float:
    """Initial value of a parameter with an infinite default: half the range of the tests.

    For a degradation stress this is the largest normal stress.

    For a yield interference without a closure test this is half the closure of the law at the
    largest normal stress: beyond the closure no asperity would yield, and the misfit would not
    depend on it.
    """
    if name == "degradation_stress":
        stresses = [curve.stress for curve in closures] + [curve.normal for curve in shears]
        return max(float(np.max(stress)) for stress in stresses)
    if not shears or (closures and name == "yield_interference"):
        return 0.5 * max(float(np.ptp(curve.closure)) for curve in closures)
    if name == "yield_interference":
        return 0.5 * float(law.closure(max(float(np.max(curve.normal)) for curve in shears)))
    if name == "slope_wear":
        return 0.5 * max(
            float(np.max(np.abs(curve.shear_stress)) * np.sum(np.abs(np.diff(curve.shear))))
            for curve in shears
        )
    return 0.5 * max(float(np.ptp(curve.shear)) for curve in shears)


def starting_points(problem: Problem, has_law: bool) -> list[Array]:
    """Vectors to start a fit from.

    One, the initial values, without a closure curve, with heights that are fixed, or with shear
    tests and a law. Else several, with narrow to broad heights that suit the closure curve. Each
    has the stiffness that fits the closure curve on average.
    """
    free = set(problem.free)
    values = problem.values
    curve = problem.closure
    if curve is None or not free & {"alpha", "beta"} or (has_law and problem.shears):
        return [problem.pack_scaled(values)]
    span = float(np.ptp(curve.closure))
    shapes = (2.0, 5.0, 10.0) if "alpha" in free else (values["alpha"] + 1,)
    starts = list[Array]()
    for shape in shapes:
        guess = {
            "alpha": shape - 1,
            "beta": 1.5 * span / shape,
            "overlap": 0.15 * span,
            "preload_closure": span / 2,
        }
        starts.append(problem.pack_scaled({**values, **guess}))
    return starts


def staged_starts(problem: Problem, starts: list[Array]) -> list[Array]:
    """One start near the best fit, for fits with shear curves.

    The closure curve determines the parameters of closure, then the shear curves the others. Starts
    for closure curves alone are returned unchanged, as is a single start with a fixed mating
    length.
    """
    shears = problem.shears
    closure = problem.closure
    fits_mating_length = "mating_length" in problem.free
    if not shears or (len(starts) == 1 and not fits_mating_length):
        return starts
    candidates = [problem.unpack(x) for x in starts]
    remaining = problem.free
    closure_names = tuple(name for name in remaining if name in CLOSURE_PARAMETERS)
    if closure is not None and closure_names:
        remaining = tuple(name for name in remaining if name not in closure_names)
        closure_problem = replace(problem, shears=(), free=closure_names)
        candidates = [_best_values(closure_problem, candidates)]
    if fits_mating_length:
        span = max(float(np.ptp(curve.shear)) for curve in shears)
        candidates = [
            values | {"mating_length": ratio * span}
            for values in candidates
            for ratio in INITIAL_MATING_LENGTHS
        ]
    if remaining:
        shear_problem = replace(problem, closure=None, free=remaining, values=candidates[0])
        candidates = [_best_values(shear_problem, candidates)]
    return [problem.pack_scaled(candidates[0])]


def _best_values(problem: Problem, candidates: Sequence[dict[str, float]]) -> dict[str, float]:
    """The values of least misfit from several initial values, with the expected noise."""
    starts = [problem.pack(values) for values in candidates]
    return problem.unpack(minimise(problem, starts, COARSE_TOLERANCE))


# ------------------------------------------------------------------------- the solution


class Solution(NamedTuple):
    """Outcome of `solve`, for p parameters after their transforms.

    x: (p,), the mean of the posterior.
    information: (p, p) of the data, and of the bounds of the parameters.
    covariance: (p, p).
    noise: noise levels, autocorrelation and spread between specimens.
    prior_share: (p,) share of the priors in the variance of each parameter.
    gain: (p, n) derivative of the parameters by the residuals.
    specimen_residuals: (n,) residuals of the data without the differences between specimens.
    """

    x: Array
    information: Array
    covariance: Array
    noise: NoiseEstimate
    prior_share: Array
    gain: Array
    specimen_residuals: Array


def solve(problem: Problem, starts: Sequence[Array], previous: Solution | None = None) -> Solution:
    """The mean and covariance of the posterior of the parameters.

    Parameters
    ----------
    problem: the problem.
    starts: initial vectors, of which the best is used.
    previous: the solution of a similar problem to begin with, instead of `starts`.
    """
    if previous is None:
        x = minimise(problem, starts, START_TOLERANCE)
        noise = prior_estimate(problem.series, problem.has_specimens)
    else:
        x = previous.x
        noise = previous.noise
    low, high = problem.bounds()
    margin = BOUND_MARGIN * (high - low)
    for iteration in range(MAX_STEPS):
        x = np.clip(x, low + margin, high - margin)
        tests, prior, prior_precision = _linearise(problem, x)
        posterior = estimate_posterior(tests, prior, problem.varies, noise)
        level_change = _level_change(noise, posterior.noise)
        noise = posterior.noise
        step = _step_within(x, posterior, low + margin, high - margin)
        if iteration >= FULL_STEPS:
            step = STEP_REDUCTION * step
        step = _decreasing_step(problem, x, step, tests, posterior)
        x = x + step
        is_small = np.abs(step) < STEP_TOLERANCE * np.sqrt(np.diag(posterior.covariance))
        if is_small.all() and level_change < LEVEL_TOLERANCE:
            break
    C = posterior.covariance
    P = posterior.prior_weight
    return Solution(
        x=x,
        information=_positive(np.linalg.inv(C) - prior_precision, (high - low) ** -2),
        covariance=C,
        noise=noise,
        prior_share=np.diag(P @ prior_precision @ P) / np.diag(C),
        gain=parameter_gain(tests, prior, posterior.mode, problem.varies),
        specimen_residuals=specimen_residuals(tests, posterior.mode, problem.varies),
    )


def _positive(information: Array, least: Array) -> Array:
    """An information matrix (p, p) whose eigenvalues are at least those of the bounds, `least`."""
    values, vectors = np.linalg.eigh(information)
    return np.asarray((vectors * np.maximum(values, least.min())) @ vectors.T)


def _linearise(problem: Problem, x: Array) -> tuple[list[LinearTest], Prior, Array]:
    """The tests and the prior near x, and the information of the priors without the bounds."""
    low, high = problem.bounds()
    J = central_differences(problem.data, x, low, high)
    tests = problem.by_test(problem.data(x), J)
    J_prior = central_differences(problem.prior, x, low, high)
    prior_precision = J_prior.T @ J_prior
    information = prior_precision + np.diag((high - low) ** -2)
    return tests, Prior(information, J_prior.T @ problem.prior(x)), prior_precision


def _level_change(before: NoiseEstimate, after: NoiseEstimate) -> float:
    """Largest change of the logarithm of a noise level."""
    changes = [
        abs(math.log(after.mean.levels[key] / level)) for key, level in before.mean.levels.items()
    ]
    return max(changes, default=0.0)


def _step_within(x: Array, posterior: Posterior, low: Array, high: Array) -> Array:
    """The step to the mean of the posterior, given that parameters stay within their bounds.

    Parameters that would leave them stop there; the step of the others follows from the covariance.
    """
    step = posterior.step
    C = posterior.covariance
    stopped = np.zeros(x.size, bool)
    while True:
        leaves = ~stopped & ((x + step < low) | (x + step > high))
        if not leaves.any():
            return step
        stopped |= leaves
        target = np.clip(x + posterior.step, low, high) - x
        excess = (target - posterior.step)[stopped]
        C_stopped = C[np.ix_(stopped, stopped)]
        step = posterior.step + C[:, stopped] @ np.linalg.solve(C_stopped, excess)
        step[stopped] = target[stopped]


def _decreasing_step(
    problem: Problem, x: Array, step: Array, tests: Sequence[LinearTest], posterior: Posterior
) -> Array:
    """The step, halved until it increases the misfit by at most one unit; zero if none does.

    The misfit is that of the most probable noise model. Steps to parameters whose joints cannot
    follow a test are halved too.
    """

    def objective(at: Array, residuals_at: Sequence[LinearTest]) -> float:
        prior = problem.prior(at)
        return misfit(residuals_at, posterior.mode, problem.varies) + float(prior @ prior)

    J = np.concatenate([D for test in tests for D in test.derivatives])
    before = objective(x, tests)
    for _ in range(MAX_HALVINGS):
        try:
            moved = problem.by_test(problem.data(x + step), J)
        except ValueError:  # no joint of these parameters can follow a test
            step = step / 2
            continue
        # the mean of the posterior is not the minimum: an increase of one unit is admissible
        if objective(x + step, moved) <= before + 1.0:
            return step
        step = step / 2
    return np.zeros_like(step)


def minimise(problem: Problem, starts: Sequence[Array], tolerance: float) -> Array:
    """The vector (p,) with the least sum of squares from several starts, with the expected noise.

    Parameters
    ----------
    problem: the problem.
    starts: initial vectors.
    tolerance: relative change of the vector and of the sum at the end.

    Raises ValueError if the law of a start cannot follow a test. Other laws that cannot are steps
    that the search rejects.
    """
    sigma = problem.expected_sigma
    low, high = problem.bounds()
    margin = BOUND_MARGIN * (high - low)
    inside = [np.clip(x, low + margin, high - margin) for x in starts]
    n_residuals = problem.residuals(inside[0], sigma).size

    def residuals(x: Array) -> Array:
        try:
            return problem.residuals(x, sigma)
        except ValueError:
            return np.full(n_residuals, REJECTED_RESIDUAL)

    fits = [
        least_squares(
            residuals,
            x,
            bounds=(low, high),
            method="dogbox",
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
        )
        for x in inside
    ]
    return np.asarray(min(fits, key=lambda fit: float(fit.cost)).x)


def central_differences(f: Function, x: Array, low: Array, high: Array) -> Array:
    """Derivative (n, p) of a function by central differences, one-sided at the bounds."""
    columns = []
    for step in DIFFERENCE_STEP * np.eye(x.size):
        up = np.minimum(x + step, high)
        down = np.maximum(x - step, low)
        columns.append((f(up) - f(down)) / np.sum(up - down))
    return np.stack(columns, -1)
