"""From tests to a law: fits of closure and shear curves, alone or together, and their result."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..laws.joint_law import JointLaw
from ..support.checks import Array
from ..support.pyplot import pyplot, style, written
from .forward import build, build_for_shear, log_stress
from .measured import ClosureCurve, ShearCurve
from .priors import TRANSFORMS, Ranges, Values
from .problem import Problem, Solution, derivative, pose, solve, staged, starting_points

MISFITS = 1.5  # of the expected scatter: from this systematic misfit on the law is not the rock
PRIOR_SHARE = 0.05  # of the variance: up to here the data, not the priors, decide
WIDEST = math.log(2) / 1.96  # standard error of a logarithm: a factor of 2 either way
OPEN = 1e6  # upper over lower end of the interval of what nothing fixes
HALVED = 0.005  # of the largest measured stress: what halving the steps of shear may change
HALVINGS = 8  # at most
SOFTENING = 3  # points of one test on the fall of the bond, to know its cohesion by
AT_BOUND = 1e-6  # of the distance of the bounds

OTHER = (
    "Neighbouring points deviate to the same side. Use the law with this error between the points, "
    "and not beyond them. A shear curve that falls after its peak needs a mating_length, cycles "
    "that lose dilation need slope_wear: let them be free too. Closure of mated joints may follow "
    "a hyperbola better."
)
TOO_MANY = (
    "These data do not fix so many parameters. Hold {}: give what you know (--set {}=VALUE), or "
    "leave it out of --free. Then the data fix the others."
)


@dataclass(frozen=True, eq=False)
class Fit:
    """Outcome of `fit_closure` and `fit_curves`, in SI units.

    `free` names the fitted parameters in the order of `covariance`, the seating closure last;
    `parameters` holds all values; `noise` and `systematic_misfit` have an entry for each curve.
    """

    problem: Problem
    solution: Solution
    halved: float = 0.0  # change of the shear stress, of its largest, when steps are halved

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the fitted parameters, the seating closure last."""
        return self.problem.free

    @property
    def parameters(self) -> dict[str, float]:
        """Every parameter, fitted or held, and the seating closure (m)."""
        return self.problem.unpack(self.solution.x)

    @cached_property
    def law(self) -> JointLaw:
        """The law of these parameters."""
        return build(self.parameters, self.problem.settings, self.problem.settings.plane)

    def interval(self, name: str) -> tuple[float, float]:
        """The 95 % interval of a fitted parameter, within its bounds."""
        if name not in self.free:
            raise ValueError(f"{name!r} was not fitted; fitted are {', '.join(self.free)}")
        at, transform = self.free.index(name), TRANSFORMS[name]
        reach = self.solution.quantile * math.sqrt(self.solution.covariance[at, at])
        x, (low, high) = self.solution.x[at], self.problem.bounds()
        ends = max(x - reach, low[at]), min(x + reach, high[at])
        return transform.back(float(ends[0])), transform.back(float(ends[1]))

    @cached_property
    def at_bound(self) -> tuple[str, ...]:
        """Fitted parameters that the fit left at a bound: the data ask for what no law has."""
        low, high = self.problem.bounds()
        gap = np.minimum(self.solution.x - low, high - self.solution.x) / (high - low)
        if "mating_length" in self.free:  # of which the closure range is a bound too
            short = self.law.mating_length > (1 + AT_BOUND) * self.parameters["mating_length"]
            gap[self.free.index("mating_length")] *= not short
        return tuple(name for name, g in zip(self.free, gap, strict=True) if g < AT_BOUND)

    @cached_property
    def too_many(self) -> tuple[str, ...]:
        """Fitted parameters to hold, the vaguest first, so that the data alone fix the others."""
        kept, held = [k for k, name in enumerate(self.free) if name != "seating"], list[str]()
        while kept:
            C = np.linalg.inv(self.solution.information[np.ix_(kept, kept)])
            vague = np.sqrt(np.diag(C)) / self._widest[kept]
            if vague.max() <= 1:
                break
            held.append(self.free[kept.pop(int(np.argmax(vague)))])
        return tuple(held)

    @cached_property
    def not_identifiable(self) -> dict[str, str]:
        """Fitted parameters that these data do not fix, each with the reason."""
        found: dict[str, str] = {}
        errors = np.sqrt(np.diag(self.solution.covariance)) / self._widest
        for name, share, error in zip(self.free, self.solution.prior_share, errors, strict=True):
            if name in self.at_bound:
                found[name] = f"the fit ended at a bound, {self.parameters[name]:.3g}"
            elif name == "cohesion" and self._softening < SOFTENING:
                found[name] = (
                    f"at most {self._softening} points of a test lie where the bond softens: a "
                    "bond that breaks between two points shows no cohesion"
                )
            elif share > PRIOR_SHARE:
                found[name] = f"the priors supply {100 * share:.0f} % of its variance"
            elif error > 1:
                found[name] = f"the data leave it {self._spread(name)}"
        return found

    @property
    def _softening(self) -> int:
        """Points between begin and end of damage in pure shear, of the curve that has most."""
        assert self.law.bond is not None
        (_, begin), (_, end) = self.law.bond.limits
        shears = [np.abs(c.shear) for c in self.problem.curves if isinstance(c, ShearCurve)]
        inside = [int(np.sum((way * begin > 1) & (way * end < 1))) for way in shears]
        return max(inside, default=0)

    @property
    def _widest(self) -> Array:
        """Standard errors (p,) up to which a parameter is known."""
        return np.array([WIDEST if TRANSFORMS[name].log else 0.5 for name in self.free])

    def _spread(self, name: str) -> str:
        """The 95 % interval of a fitted parameter in words."""
        if name in self.at_bound:
            return "at a bound"
        low, high = self.interval(name)
        return "open" if TRANSFORMS[name].log and high > OPEN * low else f"{low:.3g} to {high:.3g}"

    @property
    def identifiable(self) -> tuple[str, ...]:
        """Fitted parameters that the data fix: to a factor of 2, the priors all but silent."""
        return tuple(name for name in self.free if name not in self.not_identifiable)

    @cached_property
    def systematic_misfit(self) -> tuple[float, ...]:
        """Misfit that neighbouring points of each curve share, as residuals are.

        The root of the mean product of neighbouring residuals, 0 where that is negative: scatter
        averages out of it, the misfit of a curve of another shape does not.
        """
        curves = self.problem.split(self.problem.data(self.solution.x))
        return tuple(math.sqrt(max(float(np.mean(r[1:] * r[:-1])), 0.0)) for r in curves)

    @property
    def shape_differs(self) -> tuple[bool, ...]:
        """Whether each curve shows that the rock deforms along another curve than the law."""
        pairs = zip(self.systematic_misfit, self.problem.curves, strict=True)
        return tuple(misfit > MISFITS * curve.expected.share for misfit, curve in pairs)

    def predict(self, closure: ArrayLike) -> Any:
        """Normal stress (Pa) at closures (m) counted as in the closure test."""
        seating = self.parameters["seating"]
        return self.law.normal_stress(np.asarray(closure, float) + seating)

    def band(self, closure: ArrayLike) -> tuple[Array, Array]:
        """95 % band (low, high) in Pa of the curve `predict`.

        By the covariance of the parameters alone: the noise of a further point is not in it, nor
        that rock is not this law, which counts most beyond the largest fitted stress.
        """
        settings, u = self.problem.settings, np.atleast_1d(np.asarray(closure, float))

        def model(x: Array) -> Array:
            values = self.problem.unpack(x)
            return log_stress(values, values["seating"] + u, settings)

        slope = derivative(model, self.solution.x, *self.problem.bounds())
        variance = np.einsum("ip,pq,iq->i", slope, self.solution.covariance, slope)
        centre, reach = model(self.solution.x), self.solution.quantile * np.sqrt(variance)
        return np.exp(centre - reach), np.exp(centre + reach)

    def report(self) -> str:
        """The fit in words and tables (Markdown)."""
        values, left = self.parameters, self.not_identifiable
        lines = [
            "# Fit of the joint law",
            "",
            "| parameter | value | 95 % interval | unit | from the priors | fixed by the data |",
            "|---|---|---|---|---|---|",
        ]
        for name, share in zip(self.free, self.solution.prior_share, strict=True):
            lines.append(
                f"| {name} | {values[name]:.4g} | {self._spread(name)} | "
                f"{TRANSFORMS[name].unit} | {100 * share:.0f} % | "
                f"{'no' if name in left else 'yes'} |"
            )
        unworn = {"slope_residual"} if np.isinf(values["slope_wear"]) else set()
        held = [n for n in values if n not in {*self.free, *unworn} and np.isfinite(values[n])]
        lines += ["", "Held: " + ", ".join(f"{n} = {values[n]:.4g}" for n in held) + "."]
        lines += ["", "Not fixed by these data:", ""] if left else []
        lines += [f"- {name}: {reason}" for name, reason in left.items()]
        if self.too_many:
            lines += ["", f"**{TOO_MANY.format(', '.join(self.too_many), self.too_many[0])}**"]
        lines += [
            "",
            "| curve | points | scatter of the stress | of the closure (um) | systematic misfit |",
            "|---|---|---|---|---|",
        ]
        rows = zip(self.problem.curves, self.solution.noise, self.systematic_misfit, strict=True)
        for k, (curve, noise, misfit) in enumerate(rows, 1):
            points = (curve.stress if isinstance(curve, ClosureCurve) else curve.shear).size
            lines.append(
                f"| {k} | {points} | {100 * noise.share:.2g} % | "
                f"{1e6 * noise.absolute:.2g} | {100 * misfit:.2g} % |"
            )
        lines += self._peaks()
        differ = [str(k) for k, differs in enumerate(self.shape_differs, 1) if differs]
        if differ:
            lines += ["", f"**Curve {', '.join(differ)} has another shape than the law.** {OTHER}"]
        return "\n".join(lines) + "\n"

    def _peaks(self) -> list[str]:
        """The largest and the last stress of each shear curve, measured and of the law."""
        head = "| shear curve | largest stress (MPa), at (mm): measured | law | last (MPa) | law |"
        lines, settings = ["", head, "|---|---|---|---|---|"], self.problem.settings
        for k, curve in enumerate(self.problem.curves, 1):
            if isinstance(curve, ShearCurve):
                law = build_for_shear(self.parameters, settings, curve.azimuth)
                own = curve.sheared(law, settings.steps)[:2]
                cells = [
                    f"{stress[(top := np.argmax(np.abs(stress)))] / 1e6:.4g}, {1e3 * way[top]:.3g}"
                    for way, stress in ((curve.shear, curve.shear_stress), own)
                ]
                ends = [f"{stress[-1] / 1e6:.4g}" for stress in (curve.shear_stress, own[1])]
                lines.append(f"| {k} | {' | '.join([*cells, *ends])} |")
        halved = f"Half the step of shear changes these stresses by {100 * self.halved:.2g} %."
        return [*lines, "", halved] if len(lines) > 3 else []

    @style()
    def plot(
        self, path: str | Path | None = None, held_out: tuple[Array, Array] | None = None
    ) -> Any:
        """Draw the points and the law, a closure curve with its band (extra `plot`).

        held_out: stress (Pa) and closure (m) of points of the closure test that were not fitted;
        they are drawn as open circles.
        """
        curves, values, settings = self.problem.curves, self.parameters, self.problem.settings
        figure, axes = pyplot().subplots(
            1, len(curves), figsize=(5 * len(curves) + 1, 4.4), layout="constrained", squeeze=False
        )
        for axis, curve in zip(axes.flat, curves, strict=True):
            if isinstance(curve, ClosureCurve):
                x, measured, what = curve.closure, curve.stress, "closure since the test began"
                u = np.linspace(x.min(), x.max() if held_out is None else held_out[1].max(), 100)
                low, high = self.band(u)
                axis.fill_between(
                    1e6 * u,
                    low / 1e6,
                    high / 1e6,
                    color="C1",
                    alpha=0.25,
                    label="95 % band of the law",
                )
                if held_out is not None:
                    held = 1e6 * held_out[1], held_out[0] / 1e6
                    axis.plot(*held, "oC0", mfc="w", ms=4, label="measured, not fitted")
                u = x if curve.cycle else u
                law = np.exp(log_stress(values, values["seating"] + u, settings))
            else:
                x, measured = curve.shear, curve.shear_stress
                what = f"shear at {curve.normal / 1e6:.3g} MPa"
                found = build_for_shear(values, settings, curve.azimuth)
                u, law, _ = curve.sheared(found, settings.steps)
            axis.plot(1e6 * u, law / 1e6, color="C1", label="law")
            axis.plot(1e6 * x, measured / 1e6, "oC0", ms=4, label="measured")
            axis.set(xlabel=f"{what} (µm)", ylabel="stress (MPa)")
            axis.legend()
        return written(figure, path)


def fit_closure(
    stress: ArrayLike,
    closure: ArrayLike,
    *,
    free: Sequence[str] = ("asperity_density", "alpha", "beta"),
    fixed: Values | None = None,
    law: JointLaw | None = None,
    priors: Ranges | None = None,
    noise: float | None = None,
    cycle: bool = False,
    compliance: float = 0.0,
) -> Fit:
    """Fit the law to one closure test.

    Parameters
    ----------
    stress: normal stress in Pa, (n,), n >= 4.
    closure: closure in m, (n,), from wherever the test began.
    free: names of the parameters to fit; see `fit_curves`. `overlap` is held at 0 by default: the
        law's closure then counts from the first touch of the highest asperity, and the seating
        closure, which is fitted, already says how far the test began beyond it.
    fixed, law, priors: as in `fit_curves`.
    noise, cycle, compliance: as in `ClosureCurve`; cycles need "yield_interference" among
        `free` or `fixed`, or a law that has one.

    Returns a `Fit`. Raises ValueError for curves or names that do not fit.

    Source: Misra 1999, Eq. 11, 12, 33, 37; docs/theory-incremental.md, "Heights, direction and
    Hertz become one curve", for the "individual" reading.
    """
    curve = ClosureCurve(np.asarray(stress), np.asarray(closure), noise, cycle, compliance)
    return fit_curves([curve], free=free, fixed=fixed, law=law, priors=priors)


def fit_curves(
    curves: Sequence[ClosureCurve | ShearCurve],
    *,
    free: Sequence[str] = ("asperity_density", "alpha", "beta", "mu", "a"),
    fixed: Values | None = None,
    law: JointLaw | None = None,
    priors: Ranges | None = None,
) -> Fit:
    """Fit one law to several measured curves at once.

    Parameters
    ----------
    curves: at least one, `ShearCurve` and at most one `ClosureCurve`.
    free: parameters to fit, of alpha, beta (m), overlap (m), asperity_density (1/m2),
        K (Pa m^(1-eta)), lam, eta, mu, a, b, c, yield_interference (m), mating_length
        (m), slope_wear (J/m2), slope_residual; of a law with a bond cohesion (Pa), tension (Pa).
        Positive ones are fitted as logarithms. A closure curve that does not begin at zero stress
        adds its seating closure (m).
    fixed: values of parameters that are known otherwise, such as alpha from a scan, in SI units.
    law: values of all parameters that are not free, `mating_length` among them; None takes rock
        asperities, `forward.DEFAULT`, of "individual" formation. A law of one plane stays one; its
        heights must be GammaHeights. Its bond keeps stiffnesses and, where cohesion or tension
        change, the ratio of each given energy to the elastic energy at the peak.
    priors: 95 % ranges (low, high) in physical units instead of the defaults of `priors.PRIORS`,
        or None to drop one. Besides the parameters: "full_contact_stress".

    Returns a `Fit`. Raises ValueError naming the parameter when something does not fit.
    """
    problem = pose(curves, free, fixed, law, priors)
    starts = staged(problem, starting_points(problem, near=law is not None))
    for _ in range(HALVINGS):
        solution, settings = solve(problem, starts), problem.settings
        finer = replace(problem, settings=replace(settings, steps=2 * settings.steps))
        halved = float(np.max(np.abs(finer.data(solution.x) - problem.data(solution.x))))
        if halved < HALVED:
            break
        problem, starts = finer, [solution.x]
    return Fit(problem, solution, halved)
