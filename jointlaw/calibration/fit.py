"""A fit: the problem it solved, the law it found, what it knows and what it does not."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from ..law import JointLaw
from ..parameters.orientation import largest_c
from ..support.checks import Array
from .measured import ClosureCurve, Settings, ShearCurve, build, log_stress
from .noise import Noise
from .priors import quantity, scale_of
from .solve import Rows, Solution, solve

PRIOR_SHARE = 0.05  # of the variance: up to here the data, not the priors, decide
# Standard error of ln(stress) per doubling of the stress beyond the data, from curves of other
# laws: power laws of exponent 1.5 to 6 and Gaussian heights, lower half fitted, upper predicted
MODEL_ERROR = 0.03
# The same per unit of `Fit.wander`, from hyperbolas and logarithms (benchmarks/held_out.py)
WANDER_ERROR = 6.0
WANDERS = 1.5  # of the expected scatter: from this `Fit.wander` on the law is not the rock
WIDEST = math.log(2) / 1.96  # standard error of a logarithm: a factor of 2 either way


@dataclass(frozen=True, eq=False)
class Problem:
    """Curves, free parameters, the values of all others, and priors (centre, sd) by name."""

    curves: tuple[ClosureCurve | ShearCurve, ...]
    free: tuple[str, ...]
    values: tuple[tuple[str, float], ...]
    priors: tuple[tuple[str, tuple[float, float]], ...]
    settings: Settings

    def unpack(self, x: Array) -> dict[str, float]:
        """All parameters at a place on the scale of the fit."""
        values = dict(self.values)
        values |= {n: scale_of(n).back(float(v)) for n, v in zip(self.free, x, strict=True)}
        if "c" in self.free:
            bound = largest_c(values["b"])
            values["c"] = min(max(values["c"], -bound), bound)
        return values

    def place(self, values: Mapping[str, float]) -> Array:
        """Where these values lie on the scale of the fit."""
        inside = []
        for name in self.free:
            scale = scale_of(name)
            inside.append(scale.to(min(max(values[name], scale.low), scale.high)))
        return np.clip(inside, *self.bounds())

    def scaled(self, values: Mapping[str, float]) -> Array:
        """The same with the stiffness brought to the level of the closure curves."""
        x = self.place(values)
        for name in ("asperity_density", "K"):
            closures = [c for c in self.curves if isinstance(c, ClosureCurve)]
            if name in self.free and closures:
                v = self.unpack(x)
                u = v["seating"] + closures[0].closure
                off = np.log(closures[0].stress) - log_stress(v, u, self.settings)
                x[self.free.index(name)] += float(np.mean(off))
                break
        return x

    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper ends of the scale of the fit."""
        scales = [scale_of(name) for name in self.free]
        low = np.array([s.to(s.low) for s in scales])
        high = np.array([s.to(s.high) for s in scales])
        if "b" in self.free and "c" not in self.free:
            high[self.free.index("b")] = 2 - 6 * abs(dict(self.values)["c"])  # Eq. 18
        return low, high

    def data(self, x: Array) -> Array:
        """Residuals of all curves, one after the other."""
        values, parts, seat = self.unpack(x), [], 0
        for curve in self.curves:
            if isinstance(curve, ClosureCurve):
                seat += 1
                seating = values["seating" if seat == 1 else f"seating_{seat}"]
                parts.append(curve.residuals(values, seating, self.settings))
            else:
                parts.append(curve.residuals(values, self.settings))
        return np.concatenate(parts)

    def prior(self, x: Array) -> Array:
        """Residuals of the priors."""
        values = self.unpack(x)
        rows = [
            (scale_of(name).to(quantity(name, values)) - centre) / sd
            for name, (centre, sd) in self.priors
        ]
        return np.array(rows)

    @property
    def rows(self) -> Rows:
        """The data as `solve` takes them."""
        steepness = tuple(curve.steepness for curve in self.curves)
        return Rows(self.data, steepness, tuple(curve.expected for curve in self.curves))

    def solve(self, starts: list[Array]) -> Fit:
        """The best fit from these starts."""
        return Fit(self, solve(self.rows, self.prior, starts, *self.bounds()))


@dataclass(frozen=True, eq=False)
class Fit:
    """Outcome of `fit_closure`, `fit_shear` and `fit_curves`.

    `free` names the fitted parameters in the order of `covariance`; `parameters` holds all values
    in SI units.
    """

    problem: Problem
    solution: Solution

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the fitted parameters, the seating closures last."""
        return self.problem.free

    @property
    def parameters(self) -> Mapping[str, float]:
        """Every parameter in SI units, fitted or held, and the seating closures (m); read-only."""
        return MappingProxyType(self._values)

    @cached_property
    def _values(self) -> dict[str, float]:
        return self.problem.unpack(self.solution.x)  # a proxy of it could not be pickled

    @cached_property
    def law(self) -> JointLaw:
        """The law of these parameters."""
        settings = self.problem.settings
        return build(self.parameters, settings, settings.plane)

    @property
    def noise(self) -> tuple[Noise, ...]:
        """Noise of every curve: `share` of the stress and `absolute` of the closure (m)."""
        return self.solution.noise

    @property
    def bends_otherwise(self) -> tuple[bool, ...]:
        """Whether each closure curve shows that the rock does not close as the law does."""
        pairs = zip(self.wander, self._closures(), strict=True)
        return tuple(wander > WANDERS * curve.expected.share for wander, curve in pairs)

    @cached_property
    def wander(self) -> tuple[float, ...]:
        """Misfit that neighbouring points of each closure curve share, as a part of the stress.

        The root of the mean product of neighbouring residuals, 0 where that is negative: scatter
        averages out of it, a curve that bends otherwise than the law does not.
        """
        found = []
        for number, curve in enumerate(self._closures(), 1):
            r = curve.residuals(self.parameters, self._seating(number), self.problem.settings)
            found.append(math.sqrt(max(float(np.mean(r[1:] * r[:-1])), 0.0)))
        return tuple(found)

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) of the fitted parameters in SI units, in the order of `free`."""
        slope = [scale_of(name).slope(self.parameters[name]) for name in self.free]
        result: Array = self.solution.covariance * np.outer(slope, slope)
        return result

    @property
    def standard_error(self) -> dict[str, float]:
        """Standard error of every fitted parameter in SI units."""
        return dict(zip(self.free, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @property
    def prior_share(self) -> dict[str, float]:
        """Share of the variance of every fitted parameter that the priors contribute."""
        return dict(zip(self.free, self.solution.prior_share.tolist(), strict=True))

    def interval(self, name: str, level: float = 0.95) -> tuple[float, float]:
        """Interval of a fitted parameter (SI units) that holds it with this probability."""
        at, scale = self._index(name), scale_of(name)
        reach = self._quantile(level) * math.sqrt(self.solution.covariance[at, at])
        x = float(self.solution.x[at])
        return scale.back(x - reach), scale.back(x + reach)

    @cached_property
    def identifiable(self) -> tuple[str, ...]:
        """Fitted parameters that the data fix: to a factor of 2, the priors all but silent."""
        return tuple(name for name in self.free if name not in self.not_identifiable)

    @cached_property
    def not_identifiable(self) -> dict[str, str]:
        """Parameters that these data do not fix, each with the reason."""
        from .identify import reasons

        return reasons(self)

    def predict(self, closure: ArrayLike, curve: int = 1) -> Any:
        """Normal stress (Pa) at closures (m) counted as in the closure curve number `curve`."""
        return self.law.normal_stress(np.asarray(closure, float) + self._seating(curve))

    def band(
        self, closure: ArrayLike, level: float = 0.95, curve: int = 1, measured: bool = True
    ) -> tuple[Array, Array]:
        """Band (low, high) in Pa around `predict`.

        closure: in m, as in `predict`; level: probability; measured: whether the band is for a
        point yet to be measured, noise included, or for the curve itself. Beyond the largest
        fitted stress it widens per doubling by `MODEL_ERROR`, for the law is not the rock, and
        by `WANDER_ERROR` times `wander`, where the points say so themselves.
        """
        self._seating(curve)  # there is such a curve
        u = np.atleast_1d(np.asarray(closure, float))
        name = "seating" if curve == 1 else f"seating_{curve}"

        def model(x: Array) -> Array:
            v = self.problem.unpack(x)
            return log_stress(v, v[name] + u, self.problem.settings)

        centre, slope = model(self.solution.x), self._slope(model)
        variance = np.einsum("ip,pq,iq->i", slope, self.solution.covariance, slope)
        if measured:
            data = self._closures()[curve - 1]
            noise = self.noise[self.problem.curves.index(data)]
            step = 1e-4 * float(np.ptp(data.closure))
            v = self.parameters
            above = log_stress(v, v[name] + u + step, self.problem.settings)
            variance = variance + noise.sigma((above - centre) / step) ** 2
        beyond = np.maximum(centre - np.log(self._closures()[curve - 1].stress.max()), 0.0)
        wander = self.wander[curve - 1]
        model_error = math.hypot(MODEL_ERROR, WANDER_ERROR * wander)
        variance = variance + wander**2 + (model_error * beyond / math.log(2)) ** 2
        reach = self._quantile(level) * np.sqrt(variance)
        return np.exp(centre - reach), np.exp(centre + reach)

    def profile(self, name: str, points: int = 21, priors: bool = False) -> Any:
        """Profile likelihood of a fitted parameter: see `identify.Profile`."""
        from .identify import profile

        return profile(self, name, points, priors)

    def report(self) -> str:
        """The fit in words and a table (Markdown)."""
        from .report import report

        return report(self)

    def plot(self, path: str | Path | None = None) -> Any:
        """Draw data, fit and bands (needs matplotlib: extra `plot`)."""
        from .plot import plot_fit

        return plot_fit(self, path)

    def to_toml(self, path: str | Path | None = None, title: str = "Fitted joint") -> str:
        """The law as a preset in TOML with what is known of its parameters; written to `path`."""
        from .report import preset

        return preset(self, title, None if path is None else Path(path))

    # ------------------------------------------------------------------ inner

    def without_priors(self) -> Problem:
        """The same problem with the data alone."""
        return replace(self.problem, priors=())

    def _index(self, name: str) -> int:
        if name not in self.free:
            raise ValueError(f"{name!r} was not fitted; fitted are {', '.join(self.free)}")
        return self.free.index(name)

    def _quantile(self, level: float) -> float:
        if not 0 < level < 1:
            raise ValueError(f"level = {level!r} is out of bounds: it must lie between 0 and 1")
        freedom = self.solution.freedom
        if math.isinf(freedom):
            return float(special.ndtri(0.5 + level / 2))
        return float(special.stdtrit(freedom, 0.5 + level / 2))

    def _closures(self) -> list[ClosureCurve]:
        return [c for c in self.problem.curves if isinstance(c, ClosureCurve)]

    def _seating(self, curve: int) -> float:
        if not 1 <= curve <= len(self._closures()):
            raise ValueError(
                f"curve = {curve!r} is out of bounds: this fit has {len(self._closures())} closure "
                "curves, counted from 1"
            )
        return self.parameters["seating" if curve == 1 else f"seating_{curve}"]

    def _slope(self, model: Any) -> Array:
        """Derivative (n, p) of a function of the place, by central differences."""
        columns = []
        low, high = self.problem.bounds()
        for k in range(len(self.free)):
            up, down = self.solution.x.copy(), self.solution.x.copy()
            up[k], down[k] = min(up[k] + 1e-4, high[k]), max(down[k] - 1e-4, low[k])
            columns.append((model(up) - model(down)) / (up[k] - down[k]))
        return np.stack(columns, -1)
