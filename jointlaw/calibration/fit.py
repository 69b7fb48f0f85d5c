"""From tests to a law: fits of closure and shear curves, alone, together, or many at once."""

from __future__ import annotations

import math
import signal
from collections.abc import Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..law import JointLaw
from ..support.files import replace_file
from ..support.progress import track
from ..support.pyplot import pyplot, written
from . import shear_report
from .estimate import Estimate
from .forward import log_stress
from .measured import ClosureCurve, ShearCurve
from .priors import Ranges, Values, transform_of
from .problem import pose, solve, starting_points
from .starts import staged

Points = tuple[ArrayLike, ArrayLike]  # stress (Pa) and closure (m)


@dataclass(frozen=True, eq=False)
class Fit(Estimate):
    """Outcome of `fit_closure`, `fit_shear` and `fit_curves`.

    `free` names the fitted parameters in the order of `covariance`; `parameters` holds all values
    in SI units.
    """

    def report(self) -> str:
        """The fit in words and a table (Markdown)."""
        lines = [
            "# Fit of the joint law",
            "",
            "| parameter | value | 95 % interval | unit | from the priors | fixed by the data |",
            "|---|---|---|---|---|---|",
        ]
        for name, share in self.prior_share.items():
            low, high = self.interval(name)
            lines.append(
                f"| {name} | {self.parameters[name]:.4g} | {low:.3g} to {high:.3g} | "
                f"{transform_of(name).unit} | {100 * share:.0f} % | "
                f"{'no' if name in self.not_identifiable else 'yes'} |"
            )
        finite = [name for name, value in self.parameters.items() if np.isfinite(value)]
        worn = "wear_slip" in finite
        held = [n for n in finite if n not in self.free and (worn or n != "mu_residual")]
        lines += ["", "Held: " + ", ".join(f"{n} = {self.parameters[n]:.4g}" for n in held) + "."]
        lines += ["", "Not identifiable from these data:", ""]
        grouped: dict[str, list[str]] = {}
        for name, reason in self.not_identifiable.items():
            grouped.setdefault(reason, []).append(name)
        lines += [f"- {', '.join(names)}: {reason}" for reason, names in grouped.items()]
        for number, noise in enumerate(self.noise, 1):
            text = f"Curve {number}: scatter {100 * noise.share:.2g} % of the stress"
            if noise.absolute:
                text += f" and {1e6 * noise.absolute:.2g} um of closure"
            lines += ["", text + (" (given)." if noise.known else " (estimated).")]
        for number, (seating, curve) in enumerate(self.problem.closures, 1):
            lines += ["", *_curve(self, self.parameters[seating], curve, number)]
        lines += shear_report.describe(self)
        return "\n".join(lines) + "\n"

    def plot(self, path: str | Path | None = None, held_out: Points | None = None) -> Any:
        """Draw data, fit and bands (needs matplotlib: extra `plot`).

        held_out: stress (Pa) and closure (m) of points of the first closure curve that were not
        fitted.
        """
        curves = self.problem.curves
        across = math.ceil(math.sqrt(len(curves)))
        down = math.ceil(len(curves) / across)
        figure, axes = pyplot().subplots(
            down, across, figsize=(5.2 * across + 0.8, 4.2 * down + 0.2),
            layout="constrained", squeeze=False,
        )  # fmt: skip
        closures = 0
        for axis in axes.flat[len(curves) :]:
            axis.remove()
        for axis, curve in zip(axes.flat, curves, strict=False):
            if isinstance(curve, ClosureCurve):
                closures += 1
                _draw_closure(axis, self, curve, closures, held_out if closures == 1 else None)
            else:
                shear_report.draw(axis, self, curve)
        return written(figure, path)

    def to_toml(self, path: str | Path | None = None, title: str = "Fitted joint") -> str:
        """The law as a preset in TOML with what is known of its parameters; written to `path`."""
        closures = len(self.problem.closures)
        others = len(self.problem.curves) - closures
        source = f"fitted by jointlaw to {closures} closure and {others} shear curves"
        clean = title.replace("\\", "/").replace('"', "'")
        left = ", ".join(self.not_identifiable)
        text = self.law.to_toml() + (
            f'\n[about]\ntitle = "{clean}"\nsource = "{source}"\n'
            f'assumptions = "not identifiable from these data: {left}"\n'
        )
        if path is not None:
            replace_file(Path(path), text.encode())
        return text


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
    formation: "individual" or "population"; None takes that of `law`, or "individual", which
        predicts best.
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
    starts = staged(problem, starting_points(problem, near=law is not None))
    return Fit(problem, solve(problem, starts))


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
        quiet = signal.SIGINT, signal.SIG_DFL  # Ctrl-C ends a worker without a traceback
        with ProcessPoolExecutor(workers, initializer=signal.signal, initargs=quiet) as pool:
            return fit_many(curves, pool, **options)
    job = partial(fit_closure, **options)
    futures = [executor.submit(job, *curve) for curve in curves]
    return [future.result() for future in track(futures, "fits", len(futures))]


def _curve(fit: Fit, seating: float, curve: ClosureCurve, number: int) -> list[str]:
    """What a closure curve does fix: stress and stiffness along it."""
    at = np.array([0.5, 1.0]) * curve.closure[np.argmax(curve.stress)]
    low, high = fit.band(at, curve=number, measured=False)
    lines = [
        f"Closure curve {number} (seating closure {1e6 * seating:.3g} um):",
        "",
        "| closure (um) | stress (MPa) | 95 % band (MPa) | normal stiffness (GPa/m) |",
        "|---|---|---|---|",
    ]
    for u, lo, hi in zip(at, low, high, strict=True):
        stress = float(fit.predict(u, number))
        step = 1e-4 * float(at[-1])
        rise = float(fit.predict(u + step, number)) - float(fit.predict(u - step, number))
        lines.append(
            f"| {1e6 * u:.4g} | {stress / 1e6:.4g} | {lo / 1e6:.4g} to {hi / 1e6:.4g} | "
            f"{rise / (2 * step) / 1e9:.4g} |"
        )
    if fit.bends_otherwise[number - 1]:
        of = "the largest stress" if curve.cycle else "the stress"
        lines += [
            "",
            "**This curve does not bend as the law does**: neighbouring points deviate to the same "
            f"side, by {100 * fit.wander[number - 1]:.2g} % of {of}. Between the points use it "
            "with this error; beyond them use neither the curve nor its band. A hyperbola (mated "
            "joints) or a logarithm (unmated ones) may follow the loading of this rock better.",
        ]
    if curve.compliance != 0.0:
        return [*lines, "", "The compliance of rock and machine that was given is subtracted."]
    missing = "if the closure was measured across rock too, the law includes its strain."
    return [*lines, "", f"No compliance of rock and machine was given: {missing}"]


def _draw_closure(
    axis: Any, fit: Fit, curve: ClosureCurve, number: int, held_out: Points | None
) -> None:
    top = float(curve.closure.max())
    points = {"marker": "o", "ls": "none", "color": "C0", "zorder": 3}
    if held_out is not None:
        stress, closure = (np.asarray(x, float) for x in held_out)
        top = float(closure[-1])
        label = "measured, not fitted"
        axis.plot(1e6 * closure, stress / 1e6, mfc="none", ms=5, label=label, **points)
    u = np.linspace(float(curve.closure[0]), 1.03 * top, 120)
    low, high = fit.band(u, curve=number)
    axis.fill_between(1e6 * u, low / 1e6, high / 1e6, color="C1", alpha=0.25, label="95 % band")
    axis.plot(1e6 * u, fit.predict(u, number) / 1e6, color="C1", label="law")
    if curve.cycle:
        rows = np.arange(curve.closure.size)
        path = np.interp(np.linspace(0, rows[-1], 400), rows, curve.closure)
        seated = path + fit.parameters[fit.closure_curve(number)[0]]
        stress = np.exp(log_stress(fit.parameters, seated, fit.problem.settings))
        axis.plot(1e6 * path, stress / 1e6, "--", color="C1", label="law, cycle")
    axis.plot(1e6 * curve.closure, curve.stress / 1e6, ms=4, label="measured", **points)
    axis.set(
        xlabel="closure since the test began (µm)", ylabel="normal stress (MPa)", title="Closure"
    )
    axis.legend(loc="upper left")
