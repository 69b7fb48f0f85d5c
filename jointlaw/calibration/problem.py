"""The inverse problem: measured curves, what is free and what is held, priors, where to start."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..law import JointLaw
from ..parameters.heights import FORMATIONS
from ..parameters.orientation import largest_c
from ..support.checks import Array, number, one_of
from .forward import DEFAULTS, Settings, log_stress, parameters
from .measured import ClosureCurve, Noise, ShearCurve
from .priors import TRANSFORMS, Ranges, Values, normal_priors, quantity, transform_of

Curves = Sequence[ClosureCurve | ShearCurve]


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
