"""Two empirical closure laws, fitted to the same points, to judge the joint law by.

    power law        stress = s (closure + u0)^n                       three parameters
    Barton-Bandis    stress = k (closure + u0)/(1 - (closure + u0)/V)  three parameters

(Bandis, Lumsden & Barton 1983 for the hyperbola.) u0 is the closure before the test began. Both
are fitted to the stress itself, the usual way and the one that serves them best beyond the data:
fitted to its logarithm, as the joint law is, the hyperbola runs away even earlier.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import least_squares

from ..support.checks import Array, number
from .fit import fit_closure
from .measured import ClosureCurve


@dataclass(frozen=True)
class Baseline:
    """A fitted empirical law: its name, parameters in SI units, and stress (Pa) by closure (m)."""

    name: str
    parameters: dict[str, float]

    def predict(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) at closures (m); infinite beyond the largest closure of the law."""
        p, u = self.parameters, np.asarray(closure, float)
        y = np.maximum(u + p["offset"], 0.0)
        if self.name == "power law":
            return (p["scale"] * y ** p["exponent"])[()]
        with np.errstate(divide="ignore", invalid="ignore"):
            stress = p["stiffness"] * y / (1 - y / p["largest_closure"])
        return np.where(y < p["largest_closure"], stress, np.inf)[()]


def fit_power_law(stress: ArrayLike, closure: ArrayLike) -> Baseline:
    """stress (Pa) = scale (closure + offset)^exponent through points (n,), n >= 4."""

    def model(q: Array, x: Array) -> Any:
        return np.exp(q[0] + np.exp(q[2]) * np.log(np.exp(q[1]) + x))

    starts = [(-n * np.log1p(o), np.log(o), np.log(n)) for o in (0.1, 0.5, 2.0) for n in (1.5, 4.0)]
    q, curve = _fitted(stress, closure, model, starts, [-60, -12, -4], [60, 8, 6])
    span, first = float(np.ptp(curve.closure)), float(curve.closure[0])
    n, scale = float(np.exp(q[2])), float(np.exp(q[0]) * curve.stress[-1])
    offset = float(np.exp(q[1])) * span - first
    return Baseline("power law", {"scale": scale / span**n, "exponent": n, "offset": offset})


def fit_barton_bandis(stress: ArrayLike, closure: ArrayLike) -> Baseline:
    """The hyperbola of Barton and Bandis with a seating closure through points (n,), n >= 4."""

    def model(q: Array, x: Array) -> Any:
        offset = np.exp(q[1])
        largest = (1 + offset) * (1 + np.exp(q[2]))  # beyond the last point
        y = x + offset
        return np.exp(q[0]) * y / (1 - y / largest)

    starts = [(-2.0, np.log(o), np.log(v)) for o in (0.02, 0.2) for v in (0.05, 0.5, 5.0)]
    q, curve = _fitted(stress, closure, model, starts, [-60, -12, -12], [60, 8, 12])
    span, first, offset = float(np.ptp(curve.closure)), float(curve.closure[0]), float(np.exp(q[1]))
    return Baseline(
        "Barton-Bandis",
        {
            "stiffness": float(np.exp(q[0]) * curve.stress[-1]) / span,
            "largest_closure": span * (1 + offset) * (1 + float(np.exp(q[2]))),
            "offset": offset * span - first,
        },
    )


@dataclass(frozen=True)
class Comparison:
    """Held-out errors: stress predicted over stress measured, less one, at equal closure.

    `errors` maps the name of each law to the errors (m,) at the points above `limit` (Pa), which
    the fits did not see; `closure` (m) and `stress` (Pa) are those points, `band` the 95 % band of
    the joint law there.
    """

    limit: float
    closure: Array
    stress: Array
    errors: dict[str, Array]
    band: tuple[Array, Array]

    def table(self) -> str:
        """One line per law: error at the largest stress, and rms over the points held out."""
        rows = ["| law | error at the largest stress | rms |", "|---|---|---|"]
        for name, error in self.errors.items():
            rms = 100 * float(np.sqrt(np.mean(error**2)))
            rows.append(f"| {name} | {100 * error[-1]:+.1f} % | {rms:.1f} % |")
        return "\n".join(rows)


def compare(
    stress: ArrayLike, closure: ArrayLike, limit: float | None = None, **options: Any
) -> Comparison:
    """Fit the joint law and both empirical laws up to a stress; judge them by what lies above.

    stress, closure: a first loading, Pa and m, (n,); limit: fit up to this stress (Pa), half of the
    largest by default; options: those of `fit_closure`. Raises ValueError when the limit leaves
    fewer than four points to fit or none to predict.
    """
    s, u = np.asarray(stress, float), np.asarray(closure, float)
    limit = 0.5 * float(s.max()) if limit is None else number("limit", limit)
    seen = s <= limit
    if seen.sum() < 4 or seen.all():
        raise ValueError(
            f"limit = {limit:g} Pa leaves {int(seen.sum())} of {s.size} points to fit: "
            "at least 4 are needed, and one above to predict"
        )
    fit = fit_closure(s[seen], u[seen], **options)
    laws: dict[str, Any] = {
        "jointlaw": fit,
        "power law": fit_power_law(s[seen], u[seen]),
        "Barton-Bandis": fit_barton_bandis(s[seen], u[seen]),
    }
    errors = {n: np.asarray(law.predict(u[~seen])) / s[~seen] - 1 for n, law in laws.items()}
    return Comparison(limit, u[~seen], s[~seen], errors, fit.band(u[~seen]))


def _fitted(
    stress: ArrayLike, closure: ArrayLike, model: Any, starts: Any, low: Any, high: Any
) -> tuple[Array, ClosureCurve]:
    """Best parameters of a model over closures from 0 to 1, stress as a share of the last one."""
    curve = ClosureCurve(np.asarray(stress), np.asarray(closure))
    x = (curve.closure - float(curve.closure[0])) / float(np.ptp(curve.closure))
    target = curve.stress / curve.stress[-1]
    fits = [
        least_squares(
            lambda q: model(q, x) - target, start, bounds=(low, high), x_scale="jac", xtol=1e-12
        )
        for start in starts
    ]
    best: Array = min(fits, key=lambda fit: float(fit.cost)).x
    return best, curve
