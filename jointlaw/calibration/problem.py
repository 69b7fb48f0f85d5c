"""The inverse problem of a fit: free and fixed parameters, priors, initial values, least squares.

A fit minimises

    sum (r / sigma)^2 + sum ((x - centre) / sd)^2

over the free parameters x (mostly logarithms): r are the residuals of the data with standard errors
sigma, the second sum are the priors. Three difficulties determine how this module works.

**The noise is unknown.** The standard errors sigma follow from the residuals of the fit, and the
fit depends on them. Both are estimated in turn until they are constant (`solve`). A restricted
likelihood is used, because the parameters follow part of the noise (`noise.estimate_noise`).

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
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy import special
from scipy.optimize import least_squares

from ..laws.joint_law import JointLaw
from ..parameters.bond import Bond
from ..parameters.declared import parameters_of
from ..parameters.orientation import largest_c
from ..support.checks import Array, number, one_of
from .forward import Settings, build_law, log_stress, parameters_of_law
from .measured import ClosureCurve, ShearCurve, simulate_curves
from .noise import Noise, Series, estimate_noise
from .priors import TRANSFORMS, Ranges, Values, normal_priors, quantity

Curves = Sequence[ClosureCurve | ShearCurve]
MAX_NOISE_ITERATIONS = 12
NOISE_PRIOR_FREEDOM = 4.0  # degrees of freedom of the prior of the noise levels
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
FINAL_TOLERANCE = 1e-8  # change of the parameters and of the misfit at the end of a search
COARSE_TOLERANCE = 1e-3  # likewise, for initial values
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
    progress: a progress bar that advances with each law tried, or None.

    A vector x (p,) has the free parameters after their transforms, mostly logarithms.
    """

    closure: ClosureCurve | None
    shears: tuple[ShearCurve, ...]
    free: tuple[str, ...]
    values: Values
    priors: Mapping[str, tuple[float, float]]
    settings: Settings
    progress: Iterator[object] | None = None

    @property
    def curves(self) -> Curves:
        """The closure curve, if there is one, and the shear curves."""
        return [curve for curve in (self.closure, *self.shears) if curve is not None]

    @property
    def series(self) -> tuple[Series, ...]:
        """The measured quantities of all curves."""
        return tuple(series for curve in self.curves for series in curve.series)

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
        """The vector of these values, with a stiffness that fits the closure curve on average."""
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
        sizes = [series.log_slope.size for series in self.series]
        return np.split(residuals, np.cumsum(sizes)[:-1])

    def sigma(self, noise: Sequence[Noise]) -> Array:
        """Standard errors of all residuals with these noise levels of the series."""
        errors = [
            np.hypot(level.relative, level.absolute * series.log_slope)
            for level, series in zip(noise, self.series, strict=True)
        ]
        return np.concatenate(errors)


def build_problem(
    curves: Curves,
    free: Sequence[str] | None,
    fixed: Values | None,
    law: JointLaw | None,
    priors: Ranges | None,
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
    free_names = [name for name in free if name not in fixed]
    for name in (*fixed, *free_names):
        if name in parameters_of(Bond) and settings.law.bond is None:
            raise ValueError(
                f"{name} is a parameter of a bond: give a law with a bond, whose other parameters "
                "are kept"
            )
        one_of("free or fixed", name, tuple(values))
    values |= {name: number(f"fixed[{name!r}]", value) for name, value in fixed.items()}
    build_law(values, settings)  # raises ValueError for values that no law has
    values |= {
        name: _finite_initial_value(name, closures, shears)
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
    return Problem(closure, shears, tuple(free_names), values, chosen, settings)


def _default_free(closures: Sequence[ClosureCurve], shears: Sequence[ShearCurve]) -> list[str]:
    """The free parameters of a fit to these tests if none are named."""
    names = ["asperity_density"]
    names += ["alpha", "beta"] if closures else []
    names += ["yield_interference"] if any(curve.cycle for curve in closures) else []
    return names + (["mu", "a", "mating_length"] if shears else [])


# -------------------------------------------------------------------------- initial values


def _finite_initial_value(
    name: str, closures: Sequence[ClosureCurve], shears: Sequence[ShearCurve]
) -> float:
    """Initial value of a parameter with an infinite default: half the range of the tests."""
    if not shears or (closures and name == "yield_interference"):
        return 0.5 * max(float(np.ptp(curve.closure)) for curve in closures)
    if name == "slope_wear":
        return 0.5 * max(
            float(np.max(np.abs(curve.shear_stress)) * np.sum(np.abs(np.diff(curve.shear))))
            for curve in shears
        )
    return 0.5 * max(float(np.ptp(curve.shear)) for curve in shears)


def starting_points(problem: Problem, has_law: bool) -> list[Array]:
    """Vectors to start from: the initial values, and for closure narrow to broad heights.

    has_law: whether the initial values come from a law instead of the defaults.
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
    sigma = problem.sigma([series.expected for series in problem.series])
    starts = [problem.pack(values) for values in candidates]
    return problem.unpack(minimise(problem, sigma, starts, COARSE_TOLERANCE))


# ------------------------------------------------------------------------- the solution


class Solution(NamedTuple):
    """Outcome of `solve`, for p parameters after their transforms.

    x: (p,).
    information: (p, p) of the data, and of the bounds of the parameters.
    covariance: (p, p).
    noise: noise levels of each series.
    freedom: degrees of freedom from which the noise was estimated; infinite if it is known.
    prior_share: (p,) share of the priors in the variance of each parameter.
    gain: (p, n) derivative of the parameters by the residuals.
    """

    x: Array
    information: Array
    covariance: Array
    noise: tuple[Noise, ...]
    freedom: float
    prior_share: Array
    gain: Array

    @property
    def quantile(self) -> float:
        """Half-width of a 95 % interval in standard errors."""
        if math.isinf(self.freedom):
            return float(special.ndtri(0.975))
        return float(special.stdtrit(self.freedom, 0.975))


def solve(problem: Problem, starts: Sequence[Array]) -> Solution:
    """The best of several starts, then parameters and noise levels in turn until convergence."""
    low, high = problem.bounds()
    noise = tuple(series.expected for series in problem.series)
    sigma = problem.sigma(noise)
    x = minimise(problem, sigma, starts)
    for _ in range(MAX_NOISE_ITERATIONS):
        r = problem.data(x)
        J = central_differences(problem.data, x, low, high) / sigma[:, None]
        J_prior = central_differences(problem.prior, x, low, high)
        precision = J_prior.T @ J_prior
        information = J.T @ J + np.diag((high - low) ** -2)
        C = np.linalg.inv(information + precision)
        leverage = np.einsum("ip,pq,iq->i", J, C, J)
        previous = noise
        pieces = zip(problem.series, problem.split(r), problem.split(leverage), strict=True)
        noise = tuple(estimate_noise(*piece) for piece in pieces)
        if noise == previous:
            break
        sigma = problem.sigma(noise)
        x = minimise(problem, sigma, [x])
    is_noise_known = all(level.is_known for level in noise)
    residual_freedom = NOISE_PRIOR_FREEDOM + r.size - float(np.sum(leverage))
    return Solution(
        x=x,
        information=information,
        covariance=np.asarray(C, np.float64),
        noise=noise,
        freedom=np.inf if is_noise_known else residual_freedom,
        prior_share=np.diag(C @ precision @ C) / np.diag(C),
        gain=C @ (J / sigma[:, None]).T,
    )


def minimise(
    problem: Problem, sigma: Array, starts: Sequence[Array], tolerance: float = FINAL_TOLERANCE
) -> Array:
    """The vector (p,) with the least sum of squares from several starts.

    Parameters
    ----------
    problem: the problem.
    sigma: standard errors of the residuals.
    starts: initial vectors.
    tolerance: relative change of the vector and of the sum at the end.
    """
    low, high = problem.bounds()
    margin = 1e-9 * (high - low)
    fits = [
        least_squares(
            partial(problem.residuals, sigma=sigma),
            np.clip(x, low + margin, high - margin),
            bounds=(low, high),
            method="dogbox",
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
        )
        for x in starts
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
