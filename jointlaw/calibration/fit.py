"""From tests to a law: fits of closure and shear curves, alone or together, and their report."""

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import compress, count
from pathlib import Path
from typing import Any

import numpy as np

from ..laws.joint_law import JammingWarning, JointLaw
from ..support.checks import Array
from ..support.markdown import table
from ..support.progress import track
from ..support.pyplot import escape_math, pyplot, style, written
from .comparison import Comparison, compare, describe_quality
from .estimates import CURVE_QUANTITIES, Estimates
from .forward import DEFAULT_STIFFNESS, DEFAULT_STIFFNESS_STRESS, log_stress
from .meaning import describe
from .measured import ClosureCurve, ShearCurve
from .priors import TRANSFORMS, Ranges, Values
from .problem import Problem, build_problem, solve, staged_starts, starting_points

MAX_DISCRETISATION_ERROR = 0.005  # of the largest stress or opening, with half the step
MAX_REFINEMENTS = 8  # doublings of the number of steps

_PARAMETER_COLUMNS = (
    "parameter | value | 95 % interval | unit | prior share of variance | identifiable, given the "
    "fixed parameters"
)
_NOISE_COLUMNS = "curve | points | noise level | autocorrelated misfit"
_PEAK_COLUMNS = (
    "shear curve | largest stress (MPa), at (mm): measured | law | last (MPa) | law | "
    "opening at the end (mm) | law"
)
SHAPE_DIFFERS = (
    "The residuals of neighbouring points are autocorrelated. Use the law with this error between "
    "the points, and not beyond them. A shear curve that falls after its peak needs a "
    "mating_length, cycles that lose dilation need slope_wear: free them too. Closure of mated "
    "joints may be closer to a hyperbola."
)
TOO_NARROW = (
    "The data have another shape than the law (see below): the intervals assume that they have the "
    "same, and are too narrow."
)
OVER_PARAMETERISED = (
    "The fit is over-parameterised. Fix {}: give known values (--set {}=VALUE), or leave them out "
    "of --free. The data then determine the others."
)
FIXED = "Fixed parameters, whose errors are not in the intervals: {}."
NO_OPENING = (
    "**No opening was measured.** {}Less friction and more dilation give the same shear stress. "
    "Give the normal displacement of the tests, or fix mu (from a tilt test of saw-cut faces) or "
    "a (from a scan)."
)
OPENING_RANGE = (
    "At the lowest normal stress the 95 % interval of the opening is {:.3g} to {:.3g} mm, and of "
    "the largest dilation angle {:.1f} to {:.1f} degrees. "
)


class Fit(Estimates):
    """Result of `fit_curves`: `Estimates`, with a report and a figure."""

    def report(self, specimen_size: float | None = None) -> str:
        """The fit in words and tables (Markdown).

        specimen_size: edge of the specimen in m, which the spacing of asperities is compared with;
            None takes 100 mm.
        """
        lines = ["# Fit of the joint law", "", describe_quality(self.comparisons())]
        if any(self.shape_differs):
            names = "; ".join(compress(self.series_names, self.shape_differs))
            lines += ["", f"**{names} has another shape than the law.** {SHAPE_DIFFERS}"]
        lines += ["", "## Parameters", "", *self._parameter_table()]
        if any(self.shape_differs):
            lines += ["", f"**{TOO_NARROW}**"]
        lines += ["", FIXED.format(self._fixed_parameters())]
        reasons = self.not_identifiable
        if reasons:
            lines += ["", "Not identifiable from these data:", ""]
            lines += [f"- {name}: {reason}" for name, reason in reasons.items()]
        if len(self.parameters_to_fix) > self.has_trade_off:  # mu, or a, is mentioned below
            names = ", ".join(self.parameters_to_fix)
            advice = OVER_PARAMETERISED.format(names, self.parameters_to_fix[0])
            lines += ["", f"**{advice}**"]
        if len(self.free) > 1:
            lines += ["", *self._correlation_table()]
        lines += ["", "## What this law means", ""]
        has_closure = self.problem.closure is not None
        assumed = (DEFAULT_STIFFNESS, DEFAULT_STIFFNESS_STRESS)
        lines += describe(
            self.law,
            self._tested_stresses(),
            specimen_size,
            has_closure,
            assumed if self.problem.assumes_stiffness else None,
        )
        lines += ["", "## Tests"]
        notes = [f"- {curve.name}: {note}" for curve in self.problem.curves for note in curve.notes]
        if notes:
            lines += ["", "Before the fit:", "", *notes]
        if self.problem.shears:
            lines += self._peak_table()
        lines += ["", *self._noise_table()]
        return "\n".join(lines) + "\n"

    def comparisons(
        self,
        predicted: Sequence[ShearCurve] = (),
        held_out: tuple[Array, Array] | None = None,
    ) -> list[Comparison]:
        """The measured quantities of all tests beside the law and its band, see `Comparison`.

        predicted, held_out: as in `plot`.
        """
        return compare(self, predicted, held_out)

    def _tested_stresses(self) -> list[float]:
        """The mean normal stresses of the shear tests, or the range of the closure test, in Pa."""
        stresses = {float(f"{np.mean(curve.normal):.3g}") for curve in self.problem.shears}
        closure = self.problem.closure
        if closure is not None:
            stresses |= {float(f"{x:.3g}") for x in (closure.stress.min(), closure.stress.max())}
        return sorted(stresses)

    def _correlation_table(self) -> list[str]:
        """Correlation of the free parameters."""
        rows = []
        for name, row in zip(self.free, self.correlation, strict=True):
            rows.append(" | ".join([name, *(f"{value:+.2f}" for value in row)]))
        return table(f"correlation | {' | '.join(self.free)}", rows)

    def _parameter_table(self) -> list[str]:
        """Value and 95 % interval of each free parameter."""
        values = self.parameters
        reasons = self.not_identifiable
        rows = (
            f"{name} | {values[name]:.4g} | {self._interval_text(name)} | {TRANSFORMS[name].unit} "
            f"| {100 * prior_share:.0f} % | {'no' if name in reasons else 'yes'}"
            for name, prior_share in zip(self.free, self.solution.prior_share, strict=True)
        )
        return table(_PARAMETER_COLUMNS, rows)

    def _fixed_parameters(self) -> str:
        """Names and values of the fixed parameters that act."""
        values = self.parameters
        excluded = {*self.free}
        if np.isinf(values["slope_wear"]) and np.isinf(values["degradation_stress"]):
            excluded.add("slope_residual")
        fixed = [name for name in values if name not in excluded and np.isfinite(values[name])]
        return ", ".join(f"{name} = {values[name]:.4g}" for name in fixed)

    def _noise_table(self) -> list[str]:
        """Noise levels and autocorrelated misfit of each series."""
        rows = []
        columns = (self.series_names, self._curve_series, self.autocorrelated_misfit)
        for name, series, misfit in zip(*columns, strict=True):
            sigma = series.sigma(self.solution.noise.mean.levels)
            level = float(np.median(sigma))
            rows.append(f"{name} | {sigma.size} | {100 * level:.2g} % | {100 * misfit:.2g} %")
        return [*table(_NOISE_COLUMNS, rows), "", self._noise_sentence()]

    def _noise_sentence(self) -> str:
        """Autocorrelation of the residuals and spread between specimens."""
        noise = self.solution.noise
        parts = [f"{rho:.2g} ({test} tests)" for test, rho in noise.mean.autocorrelation.items()]
        sentence = f"Autocorrelation of neighbouring residuals: {', '.join(parts)}. " * bool(parts)
        if len(self.problem.curves) < 2:
            return sentence + "The intervals are those of this specimen."
        if not noise.has_specimens:
            return sentence + "All tests are on one specimen; the intervals are those of it."
        return sentence + (
            "Spread between specimens, as standard deviation of each parameter: "
            f"{100 * noise.mean.spread:.2g} %; it is part of the intervals."
        )

    def _peak_table(self) -> list[str]:
        """Peak, last stress and opening of each shear curve, measured and of the law."""
        rows = list[str]()
        shears = self.problem.shears
        for curve, test in zip(shears, self.predict_shear(*shears), strict=True):
            cells = [curve.name]
            both = ((curve.shear, curve.shear_stress), (test.shear, test.stress))
            for shear, stress in both:
                peak = np.argmax(np.abs(stress))
                cells.append(f"{stress[peak] / 1e6:.4g}, {1e3 * shear[peak]:.3g}")
            cells += [f"{stress[-1] / 1e6:.4g}" for _, stress in both]
            for opening in (curve.opening, test.opening):
                cells.append("" if opening is None else f"{1e3 * opening[-1]:.3g}")
            rows.append(" | ".join(cells))
        percent = 100 * self.discretisation_error
        lines = [
            "",
            *table(_PEAK_COLUMNS, rows),
            "",
            f"Half the step, with finer cells, changes these figures by {percent:.2g} %.",
        ]
        if self.has_trade_off:
            (min_opening, min_dilation), (max_opening, max_dilation) = self.opening_interval
            angles = np.degrees(np.arctan([min_dilation, max_dilation]))
            sentence = OPENING_RANGE.format(1e3 * min_opening, 1e3 * max_opening, *angles)
            lines += ["", NO_OPENING.format("" if np.isnan(angles).any() else sentence)]
        return lines

    @style()
    def plot(
        self,
        path: str | Path | None = None,
        held_out: tuple[Array, Array] | None = None,
        predicted: Sequence[ShearCurve] = (),
    ) -> Any:
        """Plot points, law and its 95 % band: closure, shear stress, opening (extra `plot`).

        Parameters
        ----------
        path: file to save the figure to, or None.
        held_out: stress (Pa) and closure (m) of points of the closure test that were not fitted,
            drawn as open circles.
        predicted: shear tests that were not fitted, likewise.

        Returns the figure.
        """
        comparisons = self.comparisons(predicted, held_out)
        closure = self.problem.closure
        shears = [*self.problem.shears, *predicted]
        panels = (closure is not None) + 2 * bool(shears)
        figure, axes = pyplot().subplots(
            2,
            panels,
            figsize=(4.6 * panels + 1, 5.6),
            squeeze=False,
            sharex="col",
            height_ratios=(3, 1),
        )
        if closure is not None:
            self._plot_closure(axes[0, 0], closure, held_out)
            parts = [one for one in comparisons if one.quantity == "normal stress"]
            _plot_residuals(axes[1, 0], parts, 1e6, ["C0"] * len(parts))
            axes[1, 0].set_xlabel("closure since the start of the test (µm)")
        if shears:
            self._plot_shear(axes[0, -2:], shears)
            names = [curve.name for curve in shears]
            for axis, quantity in zip(axes[1, -2:], ("shear stress", "opening"), strict=True):
                parts = [one for one in comparisons if one.quantity == quantity]
                colors = [f"C{names.index(one.test) % 10}" for one in parts]
                _plot_residuals(axis, parts, 1e3, colors)
                axis.set_xlabel("shear displacement (mm)")
            entries = axes[0, -2].get_legend_handles_labels()
            figure.legend(*entries, loc="outside lower center", ncols=panels)
        return written(figure, path)

    def _plot_shear(self, axes: Any, shears: Sequence[ShearCurve]) -> None:
        """Plot shear stress and opening of tests, the law and its bands on two axes."""
        for k, (curve, test) in enumerate(zip(shears, self.predict_shear(*shears), strict=True)):
            color = f"C{k % 10}"
            is_fitted = k < len(self.problem.shears)
            markers = {
                "color": color,
                "ls": "none",
                "marker": "o",
                "mfc": None if is_fitted else "w",
            }
            shear = 1e3 * test.shear
            columns = ((curve.shear_stress, test.stress, 1e-6), (curve.opening, test.opening, 1e3))
            bands = self.shear_band(curve)
            for axis, column, (low, high) in zip(axes, columns, bands, strict=True):
                measured, law, scale = column
                axis.fill_between(shear, scale * low, scale * high, color=color, alpha=0.2, lw=0)
                axis.plot(shear, scale * law, color=color)
                if measured is not None:
                    axis.plot(1e3 * curve.shear, scale * measured, **markers)
            label = escape_math(curve.name) + ("" if is_fitted else ", predicted")
            axes[0].plot([], [], label=label, **markers)
        axes[0].set_ylabel("shear stress (MPa)")
        axes[1].set_ylabel("opening (mm)")

    def _plot_closure(
        self, axis: Any, curve: ClosureCurve, held_out: tuple[Array, Array] | None
    ) -> None:
        """Plot the closure test, the law and its band."""
        largest = curve.closure.max() if held_out is None else held_out[1].max()
        u = np.linspace(curve.closure.min(), largest, 100)
        low, high = self.band(u)
        label = "95 % confidence band of the law"
        axis.fill_between(1e6 * u, low / 1e6, high / 1e6, color="C1", alpha=0.25, label=label)
        if held_out is not None:
            stress, closure = held_out
            label = "measured, not fitted"
            axis.plot(1e6 * closure, stress / 1e6, "oC0", mfc="w", ms=4, label=label)
        if curve.cycle:
            u = curve.closure
        values = self.parameters
        law = np.exp(log_stress(values, values["preload_closure"] + u, self.problem.settings))
        axis.plot(1e6 * u, law / 1e6, color="C1", label="law")
        axis.plot(1e6 * curve.closure, curve.stress / 1e6, "oC0", ms=4, label="measured")
        axis.set_ylabel("normal stress (MPa)")
        axis.legend()


def _plot_residuals(
    axis: Any, comparisons: Sequence[Comparison], scale: float, colors: Sequence[str]
) -> None:
    """Plot the residuals of one quantity, law minus measured, as a percentage.

    scale: units of the axis of displacements per m.
    """
    axis.set_ylabel("residual (%)")
    if not comparisons:
        axis.set_yticks([])
        axis.text(0.5, 0.5, "not measured", transform=axis.transAxes, ha="center", va="center")
        return
    axis.axhline(0.0, color="0.5", lw=0.8)
    for one, color in zip(comparisons, colors, strict=True):
        fill = None if one.is_fitted else "w"
        axis.plot(scale * one.displacement, 100 * one.residual, "o", color=color, mfc=fill, ms=3)
    largest = max(float(np.nanmax(np.abs(one.residual))) for one in comparisons)
    axis.set_ylim(-120 * largest, 120 * largest)


def fit_curves(
    curves: Sequence[ClosureCurve | ShearCurve],
    *,
    free: Sequence[str] | None = None,
    fixed: Values | None = None,
    law: JointLaw | None = None,
    priors: Ranges | None = None,
    one_specimen: bool = False,
) -> Fit:
    """Fit one law to one measured curve or to several together.

    Parameters
    ----------
    curves: at least one, `ShearCurve` and at most one `ClosureCurve`.
    free: parameters to fit, of alpha, beta (m), overlap (m), asperity_density (1/m2),
        K (Pa m^(1-eta)), lam, eta, mu, a, b, c, yield_interference (m), mating_length
        (m), slope_wear (J/m2), slope_residual; of a law with a bond cohesion (Pa), tension (Pa).
        Positive ones are fitted as logarithms. A closure curve that does not begin at zero stress
        adds its closure at preload, preload_closure (m). None fits with a closure curve
        asperity_density, alpha and beta, over cycles yield_interference too; with shear curves mu,
        a and mating_length, with three normal stresses or more degradation_stress too.
    fixed: known values of other parameters, such as alpha from a scan, in SI units.
    law: values of all fixed parameters, `mating_length` among them; None takes rock
        asperities, `forward.default_law`, of "individual" formation, and without a closure curve
        heights of `forward.DEFAULT_BETA` and the density with `forward.DEFAULT_STIFFNESS`.
        Without degradation in the law, a free degradation_stress leaves the share
        `forward.DEFAULT_SLOPE_RESIDUAL` of the slopes. A law with a plane keeps it.
        Heights of another kind than GammaHeights, or none, are kept. Its bond keeps stiffnesses
        and, where cohesion or tension change, the ratio of each given energy to the elastic energy
        at the peak.
    priors: 95 % ranges (low, high) in physical units that replace the defaults of `priors.PRIORS`;
        None drops one. Besides the parameters: "full_contact_stress".
    one_specimen: True if all tests are on one specimen (multi-stage tests). By default every test
        is on its own specimen, and the spread between specimens is part of the intervals.

    Returns a `Fit`. Raises ValueError naming the parameter for an invalid argument.

    Source: Misra 1999, Eq. 11, 12, 33, 37; docs/theory-incremental.md, "Heights, direction and
    Hertz become one curve", for the "individual" reading.

    >>> curve = jl.ClosureCurve(record.F1[1:100:9], record.closure[1:100:9])
    >>> fit = jl.fit_curves([curve])
    >>> curve = jl.ShearCurve(sheared.shear, sheared.shear_stress, normal=5e6)
    >>> fit = jl.fit_curves([curve], free=["mu"], law=law)
    """
    with warnings.catch_warnings():  # of laws that are only tried; the fitted law warns for itself
        warnings.simplefilter("ignore", JammingWarning)
        problem = build_problem(curves, free, fixed, law, priors, one_specimen)
        return _fit(problem, has_law=law is not None)


def _fit(problem: Problem, has_law: bool) -> Fit:
    """Solve a problem, with finer steps until they no longer change its curves."""
    problem = replace(problem, progress=iter(track(count(), "fit, laws tried")))
    starts = staged_starts(problem, starting_points(problem, has_law=has_law))
    solution = solve(problem, starts)
    for _ in range(MAX_REFINEMENTS):
        steps = 2 * problem.settings.steps
        refined = replace(problem, settings=replace(problem.settings, steps=steps))
        change = refined.data(solution.x) - problem.data(solution.x)
        curve_changes = [
            part
            for part, series in zip(problem.split(change), problem.series, strict=True)
            if series.quantity in CURVE_QUANTITIES
        ]
        discretisation_error = float(np.max(np.abs(np.concatenate(curve_changes))))
        if discretisation_error < MAX_DISCRETISATION_ERROR:
            break
        problem = refined
        solution = solve(problem, [], previous=solution)
    # the error decreases at least linearly with the step, so the remaining error is at most twice
    # the change
    shift = 2 * solution.gain @ change
    return Fit(replace(problem, progress=None), solution, discretisation_error, shift)
