"""From tests to a law: fits of closure and shear curves, alone, together, or many at once."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..law import JointLaw
from ..support.progress import track
from .estimate import Estimate
from .identify import Profile, profile, reasons
from .measured import ClosureCurve, ShearCurve
from .plot import Points, plot_fit
from .priors import Ranges, Values
from .problem import pose, starting_points
from .report import preset, report
from .solve import solve


@dataclass(frozen=True, eq=False)
class Fit(Estimate):
    """Outcome of `fit_closure`, `fit_shear` and `fit_curves`.

    `free` names the fitted parameters in the order of `covariance`; `parameters` holds all values
    in SI units.
    """

    @cached_property
    def identifiable(self) -> tuple[str, ...]:
        """Fitted parameters that the data fix: to a factor of 2, the priors all but silent."""
        return tuple(name for name in self.free if name not in self.not_identifiable)

    @cached_property
    def not_identifiable(self) -> dict[str, str]:
        """Parameters that these data do not fix, each with the reason."""
        return reasons(self)

    def profile(self, name: str, points: int = 21, priors: bool = False) -> Profile:
        """Profile likelihood of a fitted parameter: see `identify.Profile`."""
        return profile(self, name, points, priors)

    def report(self) -> str:
        """The fit in words and a table (Markdown)."""
        return report(self, self.not_identifiable)

    def plot(self, path: str | Path | None = None, held_out: Points | None = None) -> Any:
        """Draw data, fit and bands (needs matplotlib: extra `plot`).

        held_out: stress (Pa) and closure (m) of points of the first closure curve that were not
        fitted.
        """
        return plot_fit(self, path, held_out)

    def to_toml(self, path: str | Path | None = None, title: str = "Fitted joint") -> str:
        """The law as a preset in TOML with what is known of its parameters; written to `path`."""
        return preset(self, self.not_identifiable, title, path)


def fit_closure(
    stress: ArrayLike,
    closure: ArrayLike,
    *,
    free: Sequence[str] = ("asperity_density", "alpha", "beta"),
    fixed: Values | None = None,
    law: JointLaw | None = None,
    formation: str | None = None,
    priors: Ranges | None = None,
    seating: float | None = None,
    noise: float | None = None,
    closure_noise: float = 0.0,
    cycle: bool = False,
    compliance: float | tuple[ArrayLike, ArrayLike] = 0.0,
) -> Fit:
    """Fit the law to one closure test.

    Parameters
    ----------
    stress: normal stress in Pa, (n,), n >= 4.
    closure: closure in m, (n,), from wherever the test began.
    free: names of the parameters to fit; see `fit_curves`. `overlap` is held at 0 by default: the
        law's closure then counts from the first touch of the highest asperity, and the seating
        closure, which is fitted, already says how far the test began beyond it.
    fixed: values of parameters that are known otherwise, such as alpha from a scan.
    law: values of all parameters that are not free; None takes rock asperities, see
        `forward.DEFAULTS`.
    formation: "individual" (default, and the one that predicts best) or "population".
    priors: 95 % ranges (low, high) in physical units instead of the defaults, or None to drop one.
    seating, noise, closure_noise, cycle, compliance: as in `ClosureCurve`; cycles need
        "yield_interference" among `free` or `fixed`, or a law that has one.

    Returns a `Fit`. Raises ValueError for curves or names that do not fit.

    Source: Misra 1999, Eq. 11, 12, 33, 37; docs/theory-incremental.md, "Heights, direction and
    Hertz become one curve", for the "individual" reading.
    """
    curve = ClosureCurve(
        np.asarray(stress), np.asarray(closure), seating, noise, closure_noise, cycle, compliance
    )
    return fit_curves([curve], free=free, fixed=fixed, law=law, formation=formation, priors=priors)


def fit_shear(
    shear: ArrayLike,
    shear_stress: ArrayLike,
    normal: float,
    *,
    law: JointLaw,
    azimuth: float = 0.0,
    free: Sequence[str] = ("mu", "a"),
    fixed: Values | None = None,
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
    fixed: Values | None = None,
    law: JointLaw | None = None,
    formation: str | None = None,
    priors: Ranges | None = None,
) -> Fit:
    """Fit one law to several measured curves at once.

    Parameters
    ----------
    curves: `ClosureCurve` and `ShearCurve`, at least one.
    free: parameters to fit, of alpha, beta (m), overlap (m), asperity_density (1/m2),
        K (Pa m^(1-eta)), lam, eta, mu, a, b, c, yield_interference (m), mu_residual,
        wear_slip (m), critical_slip (m). Positive ones are fitted as logarithms. Every
        closure curve that does not begin at zero stress adds its seating closure (m).
    fixed: values of parameters that are known otherwise, in SI units.
    law: values of all parameters that are not free, `critical_slip` among them; None takes
        `forward.DEFAULTS`. A law of one plane or of closure alone stays one.
    formation: "individual" or "population"; None takes that of `law`, or "individual".
    priors: 95 % ranges (low, high) in physical units instead of the defaults of `priors.PRIORS`,
        or None to drop one. Besides the parameters: "overlap_share", "full_contact_stress".

    Returns a `Fit`. Raises ValueError naming the parameter when something does not fit.
    """
    problem = pose(curves, free, fixed, law, formation, priors)
    return Fit(problem, solve(problem, starting_points(problem, near=law is not None)))


def fit_many(
    curves: Sequence[tuple[ArrayLike, ArrayLike]],
    executor: Executor | None = None,
    workers: int | None = None,
    **options: Any,
) -> list[Fit]:
    """Fit many closure curves; the results stand in the order of the curves.

    Parameters
    ----------
    curves: pairs (stress in Pa, closure in m), each as `fit_closure` takes them.
    executor: any `concurrent.futures.Executor`, left open; None makes a process pool of `workers`
        (as many as there are cores by default). For more than one machine:
        `dask.distributed.Client(address).get_executor()`, extra `sweep`.
    options: keywords of `fit_closure`.

    Raises what `fit_closure` raises for the first curve that cannot be fitted. A fit does not
    depend on where it runs: every executor gives the same numbers.
    """
    if executor is None:
        with ProcessPoolExecutor(workers) as pool:
            return fit_many(curves, pool, **options)
    job = partial(fit_closure, **options)
    futures = [executor.submit(job, *curve) for curve in curves]
    return [future.result() for future in track(futures, "fits", len(futures))]
