"""From tests to a law: fits of closure and shear curves, alone or together, and their result."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import compress, count
from pathlib import Path
from typing import Any

import numpy as np

from ..laws.joint_law import JointLaw
from ..support.checks import Array
from ..support.markdown import table
from ..support.progress import track
from ..support.pyplot import escape_math, pyplot, style, written
from .estimates import Estimates
from .forward import log_stress
from .measured import ClosureCurve, ShearCurve
from .priors import TRANSFORMS, Ranges, Values
from .problem import pose, solve, staged, starting_points

HALVED = 0.005  # of the largest stress or opening: what finer steps and cells of shear may change
HALVINGS = 8  # of the steps, at most

_PEAKS = (
    "shear curve | largest stress (MPa), at (mm): measured | law | last (MPa) | law | "
    "opening at the end (mm) | law"
)
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
HELD = "Held; the intervals are those for these values alone: {}."
UNMEASURED = (
    "**No opening was measured.** {}Less friction and more dilation give the same shear stress. "
    "Give the normal displacement of the tests, or hold mu (from a tilt test of saw-cut faces) or "
    "a (from a scan)."
)
OPENS = (
    "At the lowest normal stress the fits that these data allow open by {:.3g} to {:.3g} mm, at a "
    "largest dilation angle of {:.1f} to {:.1f} degrees. "
)


class Fit(Estimates):
    """Outcome of `fit_curves`: `Estimates`, with words and a picture."""

    def report(self) -> str:
        """The fit in words and tables (Markdown)."""
        values, left = self.parameters, self.not_identifiable
        rows = (
            f"{name} | {values[name]:.4g} | {self._spread(name)} | {TRANSFORMS[name].unit} | "
            f"{100 * share:.0f} % | {'no' if name in left else 'yes'}"
            for name, share in zip(self.free, self.solution.prior_share, strict=True)
        )
        lines = [
            "# Fit of the joint law",
            "",
            *table(
                "parameter | value | 95 % interval | unit | from the priors | fixed by the data",
                rows,
            ),
        ]
        unworn = {"slope_residual"} if np.isinf(values["slope_wear"]) else set()
        held = [n for n in values if n not in {*self.free, *unworn} and np.isfinite(values[n])]
        lines += ["", HELD.format(", ".join(f"{n} = {values[n]:.4g}" for n in held))]
        lines += ["", "Not fixed by these data:", ""] if left else []
        lines += [f"- {name}: {reason}" for name, reason in left.items()]
        if len(self.too_many) > self.traded:  # that mu, or a, is to be held is said below
            lines += ["", f"**{TOO_MANY.format(', '.join(self.too_many), self.too_many[0])}**"]
        names = [f"{one.name}, {part.what}" for one in self.problem.curves for part in one.series]
        series = zip(names, self.problem.series, self.solution.noise, strict=True)
        rows = (
            f"{name} | {one.points} | {100 * noise.share:.2g} % | {1e6 * noise.absolute:.2g} | "
            f"{100 * misfit:.2g} %"
            for (name, one, noise), misfit in zip(series, self.systematic_misfit, strict=True)
        )
        lines.append("")
        lines += table("curve | points | scatter | of the closure (um) | systematic misfit", rows)
        notes = [f"- {one.name}: {note}" for one in self.problem.curves for note in one.notes]
        lines += ["", "Before the fit:", "", *notes] if notes else []
        lines += self._peaks() if self.problem.shears else []
        if any(self.shape_differs):
            differ = compress(names, self.shape_differs)
            lines += ["", f"**{'; '.join(differ)} has another shape than the law.** {OTHER}"]
        return "\n".join(lines) + "\n"

    def _peaks(self) -> list[str]:
        """Peak, last stress and opening of each shear curve, measured and of the law."""
        rows, shears = list[str](), self.problem.shears
        for curve, test in zip(shears, self.predict_shear(*shears), strict=True):
            both = ((curve.shear, curve.shear_stress, curve.opening), test[:3])
            tops = [
                f"{stress[(top := np.argmax(np.abs(stress)))] / 1e6:.4g}, {1e3 * way[top]:.3g}"
                for way, stress, _ in both
            ]
            ends = [f"{stress[-1] / 1e6:.4g}" for _, stress, _ in both]
            wide = [f"{1e3 * up[-1]:.3g}" if up is not None else "" for _, _, up in both]
            rows.append(" | ".join([curve.name, *tops, *ends, *wide]))
        lines = [
            "",
            *table(_PEAKS, rows),
            "",
            f"Half the step, with finer cells, changes these figures by {100 * self.halved:.2g} %.",
        ]
        if self.traded:
            (least, flat), (most, steep) = self.openings
            angles = np.degrees(np.arctan([flat, steep]))
            told = OPENS.format(1e3 * least, 1e3 * most, *angles)
            lines += ["", UNMEASURED.format("" if np.isnan(angles).any() else told)]
        return lines

    @style()
    def plot(
        self,
        path: str | Path | None = None,
        held_out: tuple[Array, Array] | None = None,
        predicted: Sequence[ShearCurve] = (),
    ) -> Any:
        """Draw points, law and its 95 % band (extra `plot`): closure, shear stress, opening.

        held_out: stress (Pa) and closure (m) of points of the closure test that were not fitted,
        drawn as open circles; predicted: shear tests that were not fitted, likewise.
        """
        closure, shears = self.problem.closure, [*self.problem.shears, *predicted]
        panels = (closure is not None) + 2 * bool(shears)
        figure, axes = pyplot().subplots(1, panels, figsize=(4.6 * panels + 1, 4.4), squeeze=False)
        if closure is not None:
            self._draw_closure(axes[0, 0], closure, held_out)
        for k, (curve, test) in enumerate(zip(shears, self.predict_shear(*shears), strict=True)):
            fitted, way = k < len(self.problem.shears), 1e3 * test.way
            dots = {"color": f"C{k}", "ls": "none", "marker": "o", "mfc": None if fitted else "w"}
            columns = (curve.shear_stress, 1e-6), (curve.opening, 1e3)
            for axis, (points, scale), law, (low, high) in zip(
                axes[0, -2:], columns, test[1:3], self.shear_band(curve), strict=True
            ):
                axis.fill_between(way, scale * low, scale * high, color=f"C{k}", alpha=0.2, lw=0)
                axis.plot(way, scale * law, color=f"C{k}")
                if points is not None:
                    axis.plot(1e3 * curve.shear, scale * points, **dots)
            label = escape_math(curve.name) + ("" if fitted else ", predicted")
            axes[0, -2].plot([], [], label=label, **dots)
        if shears:
            axes[0, -2].set(xlabel="shear displacement (mm)", ylabel="shear stress (MPa)")
            axes[0, -1].set(xlabel="shear displacement (mm)", ylabel="opening (mm)")
            entries = axes[0, -2].get_legend_handles_labels()
            figure.legend(*entries, loc="outside lower center", ncols=panels)
        return written(figure, path)

    def _draw_closure(
        self, axis: Any, curve: ClosureCurve, held_out: tuple[Array, Array] | None
    ) -> None:
        """The closure test, the law and its band."""
        x = curve.closure
        u = np.linspace(x.min(), x.max() if held_out is None else held_out[1].max(), 100)
        low, high = self.band(u)
        label = "95 % band of the law"
        axis.fill_between(1e6 * u, low / 1e6, high / 1e6, color="C1", alpha=0.25, label=label)
        if held_out is not None:
            held = 1e6 * held_out[1], held_out[0] / 1e6
            axis.plot(*held, "oC0", mfc="w", ms=4, label="measured, not fitted")
        u = x if curve.cycle else u
        values = self.parameters
        law = np.exp(log_stress(values, values["seating"] + u, self.problem.settings))
        axis.plot(1e6 * u, law / 1e6, color="C1", label="law")
        axis.plot(1e6 * x, curve.stress / 1e6, "oC0", ms=4, label="measured")
        axis.set(xlabel="closure since the test began (µm)", ylabel="normal stress (MPa)")
        axis.legend()


def fit_curves(
    curves: Sequence[ClosureCurve | ShearCurve],
    *,
    free: Sequence[str] | None = None,
    fixed: Values | None = None,
    law: JointLaw | None = None,
    priors: Ranges | None = None,
) -> Fit:
    """Fit one law to one measured curve or to several at once.

    Parameters
    ----------
    curves: at least one, `ShearCurve` and at most one `ClosureCurve`.
    free: parameters to fit, of alpha, beta (m), overlap (m), asperity_density (1/m2),
        K (Pa m^(1-eta)), lam, eta, mu, a, b, c, yield_interference (m), mating_length
        (m), slope_wear (J/m2), slope_residual; of a law with a bond cohesion (Pa), tension (Pa).
        Positive ones are fitted as logarithms. A closure curve that does not begin at zero stress
        adds its seating closure (m). None takes asperity_density; with a closure curve alpha and
        beta, over cycles yield_interference too; with shear curves mu, a and mating_length.
    fixed: values of parameters that are known otherwise, such as alpha from a scan, in SI units.
    law: values of all parameters that are not free, `mating_length` among them; None takes rock
        asperities, `forward.DEFAULT`, of "individual" formation. A law of one plane stays one.
        Heights of another kind than GammaHeights, or none, are kept. Its bond keeps stiffnesses
        and, where cohesion or tension change, the ratio of each given energy to the elastic energy
        at the peak.
    priors: 95 % ranges (low, high) in physical units instead of the defaults of `priors.PRIORS`,
        or None to drop one. Besides the parameters: "full_contact_stress".

    Returns a `Fit`. Raises ValueError naming the parameter when something does not fit.

    Source: Misra 1999, Eq. 11, 12, 33, 37; docs/theory-incremental.md, "Heights, direction and
    Hertz become one curve", for the "individual" reading.

    >>> curve = jl.ClosureCurve(record.F1[1:100:9], record.closure[1:100:9])
    >>> fit = jl.fit_curves([curve])
    >>> curve = jl.ShearCurve(sheared.shear, sheared.shear_stress, normal=5e6)
    >>> fit = jl.fit_curves([curve], free=["mu"], law=law)
    """
    problem = pose(curves, free, fixed, law, priors)
    problem = replace(problem, bar=iter(track(count(), "fit, laws tried")))
    starts = staged(problem, starting_points(problem, near=law is not None))
    for _ in range(HALVINGS):
        solution, steps = solve(problem, starts), problem.settings.steps
        finer = replace(problem, settings=replace(problem.settings, steps=2 * steps))
        change = finer.data(solution.x) - problem.data(solution.x)
        halved = float(np.max(np.abs(change)))
        if halved < HALVED:
            break
        problem, starts = finer, [solution.x]
    # what is left of an error that falls with the steps is up to twice the change by half of them
    return Fit(replace(problem, bar=None), solution, halved, 2 * solution.gain @ change)
