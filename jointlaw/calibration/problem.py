"""The inverse problem, what is free and held, priors, starts; and its solution by least squares.

Minimised is sum (r/sigma)^2 + sum ((x - centre)/sd)^2 over the free parameters x (mostly
logarithms), r being the residuals of the data. The noise sigma of every curve is estimated in turn
with the parameters, see `measured.Noise`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import special
from scipy.optimize import least_squares

from ..law import JointLaw
from ..parameters.heights import FORMATIONS
from ..parameters.orientation import largest_c
from ..support.checks import Array, number, one_of
from .forward import DEFAULTS, Settings, log_stress, parameters
from .measured import ClosureCurve, Noise, ShearCurve, estimate_noise
from .priors import TRANSFORMS, Ranges, Values, normal_priors, quantity, transform_of

Curves = Sequence[ClosureCurve | ShearCurve]
ROUNDS = 12  # at most, of fitting and estimating the noise in turn
NOISE_WEIGHT = 4.0  # degrees of freedom that the expectation of the noise is worth
Function = Callable[[Array], Array]


@dataclass(frozen=True, eq=False)
class Problem:
    """Curves, free parameters, the values of all others, and priors (centre, sd) by name.

    A vector x (p,) holds the free parameters after their transforms, mostly logarithms.
    """

    curves: tuple[ClosureCurve | ShearCurve, ...]
    free: tuple[str, ...]
    values: Values
    priors: Mapping[str, tuple[float, float]]
    settings: Settings

    @property
    def closures(self) -> list[tuple[str, ClosureCurve]]:
        """The closure curves, each with the name of its seating closure."""
        return name_seatings(self.curves)

    def unpack(self, x: Array) -> dict[str, float]:
        """All parameters in SI units from the vector of the free ones."""
        values = dict(self.values)
        values |= {n: transform_of(n).back(float(v)) for n, v in zip(self.free, x, strict=True)}
        if "c" in self.free:
            bound = largest_c(values["b"])
            values["c"] = min(max(values["c"], -bound), bound)
        return values

    def pack(self, values: Values) -> Array:
        """The vector of these values, or the nearest within bounds."""
        inside = []
        for name in self.free:
            transform = transform_of(name)
            inside.append(transform.to(min(max(values[name], transform.low), transform.high)))
        return np.clip(inside, *self.bounds())

    def pack_scaled(self, values: Values) -> Array:
        """The same with the stiffness brought to the level of the first closure curve."""
        x = self.pack(values)
        stiff = next((n for n in ("asperity_density", "K") if n in self.free), None)
        if stiff is not None and self.closures:
            v, (seating, curve) = self.unpack(x), self.closures[0]
            off = np.log(curve.stress) - log_stress(v, v[seating] + curve.closure, self.settings)
            x[self.free.index(stiff)] += float(np.mean(off))
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of the vector."""
        transforms = [transform_of(name) for name in self.free]
        low = np.array([t.to(t.low) for t in transforms])
        high = np.array([t.to(t.high) for t in transforms])
        if "b" in self.free and "c" not in self.free:
            high[self.free.index("b")] = 2 - 6 * abs(self.values["c"])  # Eq. 18
        return low, high

    def data(self, x: Array) -> Array:
        """Residuals of all curves, one after the other."""
        values, seatings = self.unpack(x), (name for name, _ in self.closures)
        return np.concatenate([
            curve.residuals(values, values[next(seatings)], self.settings)
            if isinstance(curve, ClosureCurve)
            else curve.residuals(values, self.settings)
            for curve in self.curves
        ])  # fmt: skip

    def prior(self, x: Array) -> Array:
        """Residuals of the priors."""
        values = self.unpack(x)
        return np.array([
            (transform_of(name).to(quantity(name, values)) - centre) / sd
            for name, (centre, sd) in self.priors.items()
        ])  # fmt: skip

    def residuals(self, x: Array, sigma: Array) -> Array:
        """Residuals of the data over their standard errors, then those of the priors."""
        return np.concatenate([self.data(x) / sigma, self.prior(x)])

    def sigma(self, noise: Sequence[Noise]) -> Array:
        """Standard errors of all residuals at these noises of the curves."""
        pairs = zip(noise, self.curves, strict=True)
        return np.concatenate([n.sigma(curve.steepness) for n, curve in pairs])


def pose(
    curves: Curves,
    free: Sequence[str],
    fixed: Values | None,
    law: JointLaw | None,
    formation: str | None,
    priors: Ranges | None,
) -> Problem:
    """The problem that the arguments of `fit_curves` pose; raises as that does."""
    if not curves:
        raise ValueError("curves is empty: give at least one ClosureCurve or ShearCurve")
    values, settings = (dict(DEFAULTS), Settings()) if law is None else parameters(law)
    if formation is not None:
        settings = replace(settings, formation=one_of("formation", formation, FORMATIONS))
    if settings.closure_only and any(isinstance(curve, ShearCurve) for curve in curves):
        raise ValueError("law: closure_only = True cannot shear; set it False to fit a ShearCurve")
    fixed = fixed or {}
    names = [name for name in free if name not in fixed]
    for where, given in (("fixed", fixed), ("free", names)):
        for name in given:
            if name not in DEFAULTS:
                raise ValueError(f"{where}: {name!r} is unknown; choose from {', '.join(DEFAULTS)}")
    values |= {name: _within_bounds(name, value) for name, value in fixed.items()}
    if not settings.has_heights and {"alpha", "beta", "overlap"} & set(names):
        raise ValueError("free: this law has no heights to fit; give it GammaHeights or law=None")
    _require_eq_18(values, names)
    for name in names:  # a length that is infinite by default starts within the curves
        if math.isinf(values[name]):
            closure = name == "yield_interference"
            values[name] = 0.5 * max(
                float(np.ptp(one.closure if isinstance(one, ClosureCurve) else one.shear))
                for one in curves
                if isinstance(one, ClosureCurve) is closure or len(curves) == 1
            )
    for name, curve in name_seatings(curves):
        values[name] = float(np.ptp(curve.closure)) if curve.seating is None else curve.seating
        if curve.seating is None:
            names.append(name)
    if not names:
        raise ValueError("free is empty: name at least one parameter to fit")
    chosen = normal_priors(tuple(names), priors)
    return Problem(tuple(curves), tuple(names), values, chosen, settings)


def starting_points(problem: Problem, near: bool) -> list[Array]:
    """Vectors to start from: the values at hand, and for closure narrow to broad heights.

    near: whether the values at hand are those of a law and not the defaults.
    """
    if not problem.closures:
        return [problem.pack(problem.values)]
    free = set(problem.free)
    if not free & {"alpha", "beta"} or (near and len(problem.closures) < len(problem.curves)):
        return [problem.pack_scaled(problem.values)]
    span = float(np.ptp(problem.closures[0][1].closure))
    starts = []
    for shape in (2.0, 5.0, 10.0) if "alpha" in free else (problem.values["alpha"] + 1,):
        guess: dict[str, Any] = {"alpha": shape - 1, "beta": 1.5 * span / shape}
        guess["overlap"] = 0.1 * shape * guess["beta"]
        guess |= {name: span / 2 for name in free if name.startswith("seating")}
        chosen = {name: value for name, value in guess.items() if name in free}
        starts.append(problem.pack_scaled({**problem.values, **chosen}))
    return starts


def name_seatings(curves: Curves) -> list[tuple[str, ClosureCurve]]:
    """The closure curves among these, each with the name of its seating closure."""
    closures = [curve for curve in curves if isinstance(curve, ClosureCurve)]
    return [("seating" if i == 1 else f"seating_{i}", c) for i, c in enumerate(closures, 1)]


def _within_bounds(name: str, value: Any) -> float:
    result, transform = number(f"fixed[{name!r}]", value), TRANSFORMS[name]
    low = 0.0 if name == "overlap" else transform.low
    if not low <= result <= transform.high:
        raise ValueError(
            f"fixed[{name!r}] = {result:g} {transform.unit} is out of bounds: "
            f"{low:g} to {transform.high:g}"
        )
    return result


def _require_eq_18(values: Values, names: Sequence[str]) -> None:
    """Refuse a held c that breaks Eq. 18 with the b that is held, or with every b to be fitted."""
    if "c" in names:
        return
    free, c = "b" in names, values["c"]
    bound = largest_c(-1.0 if free else values["b"])
    if abs(c) > bound + 1e-12 or (free and abs(c) >= bound):
        what = "b > -1, which is fitted" if free else f"b = {values['b']:g}"
        raise ValueError(
            f"c = {c:g} is out of bounds: |c| {'<' if free else '<='} 1/3 - b/6 = {bound:.9g} "
            f"(Eq. 18) for {what}; hold a smaller c or another b"
        )


# ------------------------------------------------------------------------- the solution


class Solution(NamedTuple):
    """Outcome of `solve`, p parameters after their transforms."""

    x: Array
    covariance: Array  # (p, p)
    noise: tuple[Noise, ...]  # per curve
    freedom: float  # degrees of freedom that the noise was estimated with
    prior_share: Array  # (p,) share of each variance that the priors contribute

    def quantile(self, level: float) -> float:
        """Standard errors either way that hold a parameter with this probability."""
        if not 0 < level < 1:
            raise ValueError(f"level = {level!r} is out of bounds: it must lie between 0 and 1")
        if math.isinf(self.freedom):
            return float(special.ndtri(0.5 + level / 2))
        return float(special.stdtrit(self.freedom, 0.5 + level / 2))


def solve(problem: Problem, starts: Sequence[Array]) -> Solution:
    """Best of several starts, then parameters and noise in turn until both stand.

    With C = (D + L)^-1 the covariance, D the information of the data and L that of the priors,
    C = C D C + C L C: the share of the priors in the variance of a parameter is the ratio of the
    diagonals of C L C and C.
    """
    expected = tuple(curve.expected for curve in problem.curves)
    steepness = [curve.steepness for curve in problem.curves]
    cuts = np.cumsum([s.size for s in steepness])[:-1]
    low, high = problem.bounds()
    noise, sigma = expected, problem.sigma(expected)
    fits = [minimise(partial(problem.residuals, sigma=sigma), x, low, high) for x in starts]
    best = min(fits, key=lambda fit: float(fit.cost))
    for _ in range(ROUNDS):
        r = problem.data(best.x)
        weighted = derivative(problem.data, best.x, low, high) / sigma[:, None]
        Jp = derivative(problem.prior, best.x, low, high)
        precision = Jp.T @ Jp
        C = np.linalg.pinv(weighted.T @ weighted + precision, hermitian=True)
        leverage = np.einsum("ip,pq,iq->i", weighted, C, weighted)
        if all(n.known for n in noise):
            break
        pieces = zip(expected, np.split(r, cuts), np.split(leverage, cuts), steepness, strict=True)
        previous, noise = noise, tuple(estimate_noise(*piece) for piece in pieces)
        if noise == previous:
            break
        sigma = problem.sigma(noise)
        best = minimise(partial(problem.residuals, sigma=sigma), best.x, low, high)
    known = all(n.known for n in noise)
    freedom = np.inf if known else NOISE_WEIGHT + r.size - float(np.sum(leverage))
    share = np.diag(C @ precision @ C) / np.diag(C)
    return Solution(best.x, np.asarray(C, np.float64), noise, freedom, share)


def minimise(residuals: Function, start: Array, low: Array, high: Array) -> Any:
    """One least squares problem, from one start; the result of `least_squares`."""
    margin = 1e-9 * (high - low)
    inside = np.clip(start, low + margin, high - margin)
    return least_squares(
        residuals, inside, bounds=(low, high), method="dogbox", x_scale="jac", xtol=1e-9
    )


def derivative(f: Function, x: Array, low: Array, high: Array) -> Array:
    """Derivative (n, p) of a function within bounds, by central differences."""
    columns = []
    for k in range(x.size):
        up, down = x.copy(), x.copy()
        up[k], down[k] = min(x[k] + 1e-4, high[k]), max(x[k] - 1e-4, low[k])
        columns.append((f(up) - f(down)) / (up[k] - down[k]))
    return np.stack(columns, -1)
