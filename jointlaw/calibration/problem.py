"""The inverse problem, what is free and held, priors; where to start; and its least squares.

Minimised is sum (r/sigma)^2 + sum ((x - centre)/sd)^2 over the free parameters x (mostly
logarithms), r being the residuals of the data. The noise sigma of every curve is estimated in turn
with the parameters, see `measured.Noise`.
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
from .forward import Settings, build, log_stress, parameters
from .measured import ClosureCurve, ShearCurve, sheared
from .noise import Noise, Series, estimate_noise
from .priors import TRANSFORMS, Ranges, Values, normal_priors, quantity

Curves = Sequence[ClosureCurve | ShearCurve]
ROUNDS = 12  # at most, of fitting and estimating the noise in turn
NOISE_WEIGHT = 4.0  # degrees of freedom that the expectation of the noise is worth
OF_CLOSURE = ("alpha", "beta", "overlap", "asperity_density", "K", "yield_interference", "seating")
# Mating lengths to try, as shares of the longest way sheared: far from the measured one the misfit
# is flat, and no descent comes back
LENGTHS = (0.5, 0.15, 0.05, 0.015)
EXACT, NEAR = 1e-8, 1e-3  # change of a parameter and of the misfit at which a search ends
Function = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Problem:
    """Curves, free parameters, the values of all others, and priors (centre, sd) by name.

    A vector x (p,) holds the free parameters after their transforms, mostly logarithms.
    """

    closure: ClosureCurve | None
    shears: tuple[ShearCurve, ...]
    free: tuple[str, ...]
    values: Values
    priors: Mapping[str, tuple[float, float]]
    settings: Settings
    bar: Iterator[object] | None = None  # of progress: a step for each law that is tried

    @property
    def curves(self) -> Curves:
        """The closure curve, if there is one, and the shear curves."""
        return [curve for curve in (self.closure, *self.shears) if curve is not None]

    @property
    def series(self) -> tuple[Series, ...]:
        """What was measured, the curves one after the other."""
        return tuple(one for curve in self.curves for one in curve.series)

    def unpack(self, x: Array) -> dict[str, float]:
        """All parameters in SI units from the vector of the free ones."""
        found = {n: TRANSFORMS[n].back(float(v)) for n, v in zip(self.free, x, strict=True)}
        values = {**self.values, **found}
        if "c" in self.free:
            bound = largest_c(values["b"])
            values["c"] = min(max(values["c"], -bound), bound)
        return values

    def pack(self, values: Values) -> Array:
        """The vector of these values, or the nearest within bounds."""
        pairs = [(TRANSFORMS[name], values[name]) for name in self.free]
        inside = [t.to(min(max(value, t.low), t.high)) for t, value in pairs]
        return np.clip(inside, *self.bounds())

    def pack_scaled(self, values: Values) -> Array:
        """The same with the stiffness brought to the level of the closure curve."""
        x = self.pack(values)
        stiff = next((n for n in ("asperity_density", "K") if n in self.free), None)
        if stiff is not None and (curve := self.closure) is not None:
            v = self.unpack(x)
            off = np.log(curve.stress) - log_stress(v, v["seating"] + curve.closure, self.settings)
            x[self.free.index(stiff)] += float(np.mean(off))
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the vector."""
        transforms = [TRANSFORMS[name] for name in self.free]
        low = np.array([t.to(t.low) for t in transforms])
        high = np.array([t.to(t.high) for t in transforms])
        if "b" in self.free and "c" not in self.free:
            high[self.free.index("b")] = 2 - 6 * abs(self.values["c"])  # Eq. 18
        if "c" in self.free and "b" not in self.free:
            at = self.free.index("c")
            low[at], high[at] = -largest_c(self.values["b"]), largest_c(self.values["b"])
        return low, high

    def data(self, x: Array) -> Array:
        """Residuals of all series, one after the other."""
        if self.bar is not None:
            next(self.bar)
        values, found = self.unpack(x), list[Array]()
        if self.closure is not None:
            found.append(self.closure.residuals(values, self.settings))
        for curve, test in zip(
            self.shears, sheared(self.shears, values, self.settings), strict=True
        ):
            found += curve.residuals(test)
        return np.concatenate(found)

    def prior(self, x: Array) -> Array:
        """Residuals of the priors."""
        values = self.unpack(x)
        return np.array([
            (TRANSFORMS[name].to(quantity(name, values)) - centre) / sd
            for name, (centre, sd) in self.priors.items()
        ])  # fmt: skip

    def residuals(self, x: Array, sigma: Array) -> Array:
        """Residuals of the data over their standard errors, then those of the priors."""
        return np.concatenate([self.data(x) / sigma, self.prior(x)])

    def split(self, residuals: Array) -> list[Array]:
        """Residuals of the data, or what goes with each of them, by series."""
        return np.split(residuals, np.cumsum([one.steepness.size for one in self.series])[:-1])

    def sigma(self, noise: Sequence[Noise]) -> Array:
        """Standard errors of all residuals at these noises of the series."""
        pairs = zip(noise, self.series, strict=True)
        return np.concatenate([np.hypot(n.share, n.absolute * one.steepness) for n, one in pairs])


def pose(
    curves: Curves,
    free: Sequence[str] | None,
    fixed: Values | None,
    law: JointLaw | None,
    priors: Ranges | None,
) -> Problem:
    """The problem that the arguments of `fit_curves` pose; raises as that does."""
    closures = [curve for curve in curves if isinstance(curve, ClosureCurve)]
    shears = tuple(curve for curve in curves if isinstance(curve, ShearCurve))
    if not curves or len(closures) > 1:
        raise ValueError(
            f"curves holds {len(closures)} closure curves of {len(curves)}: give one at most, and "
            "ShearCurves"
        )
    values, settings = parameters(law)
    fixed = fixed or {}
    free = _usual(closures, shears) if free is None else free
    names = [name for name in free if name not in fixed]
    for name in (*fixed, *names):
        if name in parameters_of(Bond) and settings.law.bond is None:
            raise ValueError(f"{name} is that of a bond: give a law with a bond, which is kept")
        one_of("free or fixed", name, tuple(values))
    values |= {name: number(f"fixed[{name!r}]", value) for name, value in fixed.items()}
    build(values, settings)  # raises for values that no law has
    values |= {n: _within(n, closures, shears) for n in names if math.isinf(values[n])}
    for curve in closures:
        values["seating"] = float(np.ptp(curve.closure)) if curve.seating is None else curve.seating
        if curve.seating is None:
            names.append("seating")
    if not names:
        raise ValueError("free is empty: name at least one parameter to fit")
    # its prior is stated for the standard deviation of gamma heights
    off = {} if "alpha" in values else {"full_contact_stress": None}
    chosen = normal_priors(tuple(names), {**off, **(priors or {})})
    return Problem(next(iter(closures), None), shears, tuple(names), values, chosen, settings)


def _usual(closures: Sequence[ClosureCurve], shears: Sequence[ShearCurve]) -> list[str]:
    """The parameters that a fit to such tests finds if it is not told which."""
    names = ["asperity_density"]
    names += ["alpha", "beta"] if closures else []
    names += ["yield_interference"] if any(curve.cycle for curve in closures) else []
    return names + (["mu", "a", "mating_length"] if shears else [])


# -------------------------------------------------------------------------- where to start


def _within(name: str, closures: Sequence[ClosureCurve], shears: Sequence[ShearCurve]) -> float:
    """Where a parameter starts that is infinite by default: at half of what the tests reach."""
    if not shears or (closures and name == "yield_interference"):
        return 0.5 * max(float(np.ptp(one.closure)) for one in closures)
    if name == "slope_wear":
        return 0.5 * max(
            float(np.max(np.abs(one.shear_stress)) * np.sum(np.abs(np.diff(one.shear))))
            for one in shears
        )
    return 0.5 * max(float(np.ptp(one.shear)) for one in shears)


def starting_points(problem: Problem, near: bool) -> list[Array]:
    """Vectors to start from: the values at hand, and for closure narrow to broad heights.

    near: whether the values at hand are those of a law and not the defaults.
    """
    free, curve, values = set(problem.free), problem.closure, problem.values
    if curve is None or not free & {"alpha", "beta"} or (near and problem.shears):
        return [problem.pack_scaled(values)]
    span, starts = float(np.ptp(curve.closure)), list[Array]()
    for shape in (2.0, 5.0, 10.0) if "alpha" in free else (values["alpha"] + 1,):
        guess = {"alpha": shape - 1, "beta": 1.5 * span / shape, "overlap": 0.15 * span}
        starts.append(problem.pack_scaled({**values, **guess, "seating": span / 2}))
    return starts


def staged(problem: Problem, starts: list[Array]) -> list[Array]:
    """One start near the best fit of closure and shear curves, for fits that have shear curves.

    The closure curves place what acts on them, then the shear curves the rest. Kept as they are are
    starts for closure alone, and a single start without a mating length to find.
    """
    shears, closure = problem.shears, problem.closure
    finds_length = "mating_length" in problem.free
    if not shears or (len(starts) == 1 and not finds_length):
        return starts
    values, rest = [problem.unpack(x) for x in starts], problem.free
    mine = tuple(n for n in rest if n in OF_CLOSURE)
    if closure is not None and mine:
        rest = tuple(n for n in rest if n not in mine)
        values = [_best(replace(problem, shears=(), free=mine), values)]
    if finds_length:
        span = max(float(np.ptp(curve.shear)) for curve in shears)
        values = [v | {"mating_length": share * span} for v in values for share in LENGTHS]
    if rest:
        values = [_best(replace(problem, closure=None, free=rest, values=values[0]), values)]
    return [problem.pack_scaled(values[0])]


def _best(problem: Problem, starts: Sequence[dict[str, float]]) -> dict[str, float]:
    """The values of least misfit that are found from these, at the noise that is expected."""
    sigma = problem.sigma([one.expected for one in problem.series])
    return problem.unpack(least(problem, sigma, [problem.pack(v) for v in starts], NEAR))


# ------------------------------------------------------------------------- the solution


class Solution(NamedTuple):
    """Outcome of `solve`, p parameters after their transforms."""

    x: Array
    information: Array  # (p, p) of the data, and that the parameters lie within their bounds
    covariance: Array  # (p, p)
    noise: tuple[Noise, ...]  # per series
    freedom: float  # degrees of freedom that the noise was estimated with
    prior_share: Array  # (p,) share of each variance that the priors contribute
    gain: Array  # (p, n) change of the parameters with the residuals

    @property
    def quantile(self) -> float:
        """Standard errors either way that hold a parameter with a probability of 95 %."""
        known = math.isinf(self.freedom)
        return float(special.ndtri(0.975) if known else special.stdtrit(self.freedom, 0.975))


def solve(problem: Problem, starts: Sequence[Array]) -> Solution:
    """Best of several starts, then parameters and noise in turn until both stand.

    With C = (D + L)^-1 the covariance, D the information of the data and L that of the priors,
    C = C D C + C L C: the share of the priors in the variance of a parameter is the ratio of the
    diagonals of C L C and C. D includes that a parameter lies within its bounds, as a standard
    error of their distance: what nothing else fixes is then wide open, and C exists.
    """
    bounds, noise = problem.bounds(), tuple(one.expected for one in problem.series)
    sigma = problem.sigma(noise)
    x = least(problem, sigma, starts)
    for _ in range(ROUNDS):
        r = problem.data(x)
        weighted = derivative(problem.data, x, *bounds) / sigma[:, None]
        Jp = derivative(problem.prior, x, *bounds)
        precision = Jp.T @ Jp
        information = weighted.T @ weighted + np.diag((bounds[1] - bounds[0]) ** -2)
        C = np.linalg.inv(information + precision)
        leverage = np.einsum("ip,pq,iq->i", weighted, C, weighted)
        pieces = zip(problem.series, problem.split(r), problem.split(leverage), strict=True)
        previous, noise = noise, tuple(estimate_noise(*piece) for piece in pieces)
        if noise == previous:
            break
        sigma = problem.sigma(noise)
        x = least(problem, sigma, [x])
    left = NOISE_WEIGHT + r.size - float(np.sum(leverage))
    freedom = np.inf if all(n.known for n in noise) else left
    share = np.diag(C @ precision @ C) / np.diag(C)
    gain = C @ (weighted / sigma[:, None]).T
    return Solution(x, information, np.asarray(C, np.float64), noise, freedom, share, gain)


def least(
    problem: Problem, sigma: Array, starts: Sequence[Array], tolerance: float = EXACT
) -> Array:
    """The vector (p,) of the least sum of squares that is found from these starts."""
    low, high = problem.bounds()
    margin = 1e-9 * (high - low)
    fits = [
        least_squares(
            partial(problem.residuals, sigma=sigma), np.clip(x, low + margin, high - margin),
            bounds=(low, high), method="dogbox", x_scale="jac",
            xtol=tolerance, ftol=tolerance,
        )
        for x in starts
    ]  # fmt: skip
    return np.asarray(min(fits, key=lambda fit: float(fit.cost)).x)


def derivative(f: Function, x: Array, low: Array, high: Array) -> Array:
    """Derivative (n, p) of a function within bounds, by central differences."""
    steps = 1e-4 * np.eye(x.size)
    pairs = zip(np.minimum(x + steps, high), np.maximum(x - steps, low), strict=True)
    return np.stack([(f(up) - f(down)) / np.sum(up - down) for up, down in pairs], -1)
