"""From tests to a law: fits of closure and shear curves, alone or together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.heights import FORMATIONS, GammaHeights
from ..parameters.orientation import largest_c
from ..support.checks import Array, number, one_of
from .fit import Fit, Problem
from .measured import ClosureCurve, Settings, ShearCurve, Values
from .priors import SCALES, chosen

# Rock of shear modulus 20 GPa and Poisson's ratio 0.25 with asperities of 1 mm radius (Eq. 34),
# friction 0.6 (Byerlee 1978), mean inclination 19 degrees as for the paper's rough granite.
_ROCK = Asperity.hertz_mindlin(G=20e9, nu=0.25, R=1e-3, mu=0.6)
DEFAULTS = {
    "alpha": 3.7, "beta": 1e-5, "overlap": 0.0, "asperity_density": 1e6, "K": _ROCK.K,
    "lam": _ROCK.lam, "eta": _ROCK.eta, "mu": _ROCK.mu, "a": 3.0, "b": 0.0, "c": 0.0,
}  # fmt: skip

Ranges = Mapping[str, tuple[float, float] | None]


def fit_closure(
    stress: ArrayLike,
    closure: ArrayLike,
    *,
    free: Sequence[str] = ("asperity_density", "alpha", "beta"),
    fixed: Mapping[str, float] | None = None,
    law: JointLaw | None = None,
    formation: str | None = None,
    priors: Ranges | None = None,
    seating: float | None = None,
    noise: float | None = None,
    closure_noise: float = 0.0,
) -> Fit:
    """Fit the law to one first loading in closure.

    Parameters
    ----------
    stress: normal stress in Pa, (n,), n >= 4.
    closure: closure in m, (n,), from wherever the test began.
    free: names of the parameters to fit; see `fit_curves`. `overlap` is held at 0 by default: the
        law's closure then counts from the first touch of the highest asperity, and the seating
        closure, which is fitted, already says how far the test began beyond it.
    fixed: values of parameters that are known otherwise, such as alpha from a scan.
    law: values of all parameters that are not free; None takes rock asperities, see `DEFAULTS`.
    formation: "individual" (default, and the one that predicts best) or "population".
    priors: 95 % ranges (low, high) in physical units instead of the defaults, or None to drop one.
    seating, noise, closure_noise: as in `ClosureCurve`.

    Returns a `Fit`. Raises ValueError for curves or names that do not fit.

    Source: Misra 1999, Eq. 11, 12, 33, 37; law.md section 5 for the "individual" reading.
    """
    curve = ClosureCurve(np.asarray(stress), np.asarray(closure), seating, noise, closure_noise)
    return fit_curves([curve], free=free, fixed=fixed, law=law, formation=formation, priors=priors)


def fit_shear(
    shear: ArrayLike,
    shear_stress: ArrayLike,
    normal: float,
    *,
    law: JointLaw,
    azimuth: float = 0.0,
    free: Sequence[str] = ("mu", "a"),
    fixed: Mapping[str, float] | None = None,
    priors: Ranges | None = None,
    noise: float | None = None,
) -> Fit:
    """Fit friction and inclination to one direct shear test at constant normal stress.

    Parameters
    ----------
    shear: shear displacement in m, (n,), from zero; it may turn round.
    shear_stress: in Pa, (n,).
    normal: normal stress in Pa.
    law: the law whose other parameters are kept, such as that of `fit_closure`.
    azimuth: direction of shear in rad.
    free, fixed, priors: as in `fit_curves`; noise: as in `ShearCurve`.

    Returns a `Fit`. Raises ValueError for curves or names that do not fit.
    """
    curve = ShearCurve(np.asarray(shear), np.asarray(shear_stress), normal, azimuth, noise)
    return fit_curves([curve], free=free, fixed=fixed, law=law, priors=priors)


def fit_curves(
    curves: Sequence[ClosureCurve | ShearCurve],
    *,
    free: Sequence[str] = ("asperity_density", "alpha", "beta", "mu", "a"),
    fixed: Mapping[str, float] | None = None,
    law: JointLaw | None = None,
    formation: str | None = None,
    priors: Ranges | None = None,
) -> Fit:
    """Fit one law to several measured curves at once.

    Parameters
    ----------
    curves: `ClosureCurve` and `ShearCurve`, at least one.
    free: parameters to fit, of alpha, beta (m), overlap (m), asperity_density (1/m2),
        K (Pa m^(1-eta)), lam, eta, mu, a, b, c. Positive ones are fitted as logarithms. Every
        closure curve that does not begin at zero stress adds its seating closure (m).
    fixed: values of parameters that are known otherwise, in SI units.
    law: values of all parameters that are not free, `critical_slip` among them; None takes
        `DEFAULTS`. A law of one plane or of closure alone stays one.
    formation: "individual" or "population"; None takes that of `law`, or "individual".
    priors: 95 % ranges (low, high) in physical units instead of the defaults of `priors.PRIORS`,
        or None to drop one. Besides the parameters: "overlap_share", "full_contact_stress".

    Returns a `Fit`. Raises ValueError naming the parameter when something does not fit.
    """
    if not curves:
        raise ValueError("curves is empty: give at least one ClosureCurve or ShearCurve")
    values, settings = _base(law, formation)
    if settings.closure_only and any(isinstance(curve, ShearCurve) for curve in curves):
        raise ValueError("law: closure_only = True cannot shear; set it False to fit a ShearCurve")
    for name, value in (fixed or {}).items():
        _known("fixed", name)
        scale = SCALES[name]
        values[name] = number(f"fixed[{name!r}]", value)
        low = 0.0 if name == "overlap" else scale.low
        if not low <= values[name] <= scale.high:
            raise ValueError(
                f"fixed[{name!r}] = {value:g} {scale.unit} is out of bounds: "
                f"{low:g} to {scale.high:g}"
            )
    names = [name for name in free if name not in (fixed or {})]
    for name in names:
        _known("free", name)
    if not settings.has_heights and {"alpha", "beta", "overlap"} & set(names):
        raise ValueError("free: this law has no heights to fit; give it GammaHeights or law=None")
    seatings = [
        "seating" if i == 0 else f"seating_{i + 1}"
        for i, curve in enumerate(c for c in curves if isinstance(c, ClosureCurve))
    ]
    _orientation_fits(values, names)
    closures = [c for c in curves if isinstance(c, ClosureCurve)]
    for name, curve in zip(seatings, closures, strict=True):
        values[name] = curve.seating if curve.seating is not None else float(np.ptp(curve.closure))
    names += [n for n, c in zip(seatings, closures, strict=True) if c.seating is None]
    if not names:
        raise ValueError("free is empty: name at least one parameter to fit")
    problem = Problem(
        tuple(curves),
        tuple(names),
        tuple(values.items()),
        tuple(chosen(tuple(names), priors).items()),
        settings,
    )
    return problem.solve(_starts(problem, law is not None))


def _base(law: JointLaw | None, formation: str | None) -> tuple[dict[str, float], Settings]:
    """Values of all parameters before the fit."""
    values = dict(DEFAULTS)
    settings = Settings()
    if law is not None:
        o, p, h = law.orientation, law.asperity, law.heights
        values |= {"a": o.a, "b": o.b, "c": o.c, "K": p.K, "lam": p.lam, "eta": p.eta}
        values |= {"mu": p.mu, "asperity_density": law.asperity_density}
        if isinstance(h, GammaHeights):
            values |= {"alpha": h.alpha, "beta": h.beta, "overlap": h.overlap}
            settings = replace(settings, formation=h.formation)
        elif h is not None:
            raise ValueError(f"law: heights = {h!r} cannot be fitted; give it GammaHeights")
        settings = replace(
            settings,
            resolution=law.resolution,
            has_heights=h is not None,
            closure_range=law.closure_range,
            critical_slip=law.critical_slip,
            plane=law.plane,
            closure_only=law.closure_only,
        )
    if formation is not None:
        settings = replace(settings, formation=one_of("formation", formation, FORMATIONS))
    return values, settings


def _starts(problem: Problem, near: bool) -> list[Array]:
    """Points to start from: the values at hand, and for closure narrow to broad heights."""
    closures = [c for c in problem.curves if isinstance(c, ClosureCurve)]
    free = set(problem.free)
    if not closures:
        return [problem.place(dict(problem.values))]
    if not free & {"alpha", "beta"} or (near and len(closures) < len(problem.curves)):
        return [problem.scaled(dict(problem.values))]
    span = float(np.ptp(closures[0].closure))
    starts = []
    for shape in (2.0, 5.0, 10.0) if "alpha" in free else (dict(problem.values)["alpha"] + 1,):
        values = dict(problem.values)
        guess: dict[str, Any] = {"alpha": shape - 1, "beta": 1.5 * span / shape}
        guess["overlap"] = 0.1 * shape * guess["beta"]
        guess |= {name: span / 2 for name in problem.free if name.startswith("seating")}
        values |= {name: value for name, value in guess.items() if name in free}
        starts.append(problem.scaled(values))
    return starts


def _orientation_fits(values: Values, names: list[str]) -> None:
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


def _known(where: str, name: str) -> None:
    if name not in DEFAULTS:
        raise ValueError(f"{where}: {name!r} is unknown; choose from {', '.join(DEFAULTS)}")
