"""Measured points of tests beside a fitted law and its band: for counts, tables and pictures."""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..support.checks import Array
from .estimates import Estimates
from .forward import log_stress
from .measured import ClosureCurve, ShearCurve
from .problem import QUANTILE

# heads of the table of points
CSV_TITLES = (
    "test",
    "use",
    "quantity",
    "unit",
    "displacement_mm",
    "normal_stress_MPa",
    "measured",
    "law",
    "low",
    "high",
    "residual_percent",
)
UNITS = {"normal stress": ("MPa", 1e-6), "shear stress": ("MPa", 1e-6), "opening": ("mm", 1e3)}


@dataclass(frozen=True, eq=False)
class Comparison:
    """One measured quantity of a test beside the law.

    test: name of the test. quantity: "normal stress", "shear stress" or "opening".
    is_fitted: whether the law was fitted to it.
    displacement: shear displacement, or closure, in m, (n,).
    normal: normal stress in Pa, (n,).
    measured, law: in SI units, (n,).
    band: low and high of the 95 % confidence band of the law, (2, n).
    specimen_band: likewise of one specimen, wider by the spread between specimens.
    residual: of the fit relative to `scale`, (n,); NaN for a row that cannot have one. The
        residual of a peak is the largest stress of the law, at any displacement, minus the measured
        peak.
    scale: what a residual of 1 is, in SI units, (n,).
    sigma: noise level of the residuals, (n,).
    """

    test: str
    quantity: str
    is_fitted: bool
    displacement: Array
    normal: Array
    measured: Array
    law: Array
    band: Array
    specimen_band: Array
    residual: Array
    scale: Array
    sigma: Array

    @property
    def is_within(self) -> NDArray[np.bool_]:
        """Which rows (n,) are within the 95 % band of the law, its specimens and their noise.

        Rows without a residual are not.
        """
        low, high = self.specimen_band
        half_width = np.hypot((high - low) / 2, QUANTILE * self.sigma * self.scale)
        with np.errstate(invalid="ignore"):
            return np.abs(self.residual * self.scale) <= half_width

    @property
    def has_residual(self) -> NDArray[np.bool_]:
        """Which rows (n,) have a residual."""
        return np.isfinite(self.residual)


def compare(
    fit: Estimates,
    predicted: Sequence[ShearCurve] = (),
    held_out: tuple[Array, Array] | None = None,
) -> list[Comparison]:
    """All measured quantities of the fitted tests and of predicted ones beside the law.

    Parameters
    ----------
    fit: the fit.
    predicted: shear tests that were not fitted.
    held_out: stress (Pa) and closure (m) of points of the closure test that were not fitted.
    """
    comparisons = list[Comparison]()
    closure = fit.problem.closure
    if closure is not None:
        comparisons.append(_compare_closure(fit, closure, True))
        if held_out is not None:
            comparisons.append(_compare_held_out(fit, closure, *held_out))
    fitted = fit.problem.shears
    for curve in (*fitted, *predicted):
        comparisons += _compare_shear(fit, curve, curve in fitted)
    return comparisons


def _compare_closure(fit: Estimates, curve: ClosureCurve, is_fitted: bool) -> Comparison:
    """The closure test beside the law."""
    values = fit.parameters
    settings = fit.problem.settings
    law = np.exp(log_stress(values, values["preload_closure"] + curve.closure, settings))
    largest = np.full(curve.stress.size, np.max(curve.stress))
    return Comparison(
        curve.name,
        "normal stress",
        is_fitted,
        curve.closure,
        curve.stress,
        curve.stress,
        law,
        fit.band(curve.closure),
        fit.band(curve.closure, of_specimen=True),
        curve.residuals(values, settings),
        largest if curve.cycle else curve.stress,
        curve.series[0].sigma(fit.solution.noise.mean.levels),
    )


def _compare_held_out(
    fit: Estimates, curve: ClosureCurve, stress: Array, closure: Array
) -> Comparison:
    """Points of the closure test that were not fitted, beside the law."""
    law = np.asarray(fit.predict(closure))
    level = float(np.median(curve.series[0].sigma(fit.solution.noise.mean.levels)))
    return Comparison(
        curve.name,
        "normal stress",
        False,
        closure,
        stress,
        stress,
        law,
        fit.band(closure),
        fit.band(closure, of_specimen=True),
        np.log(law / stress),
        stress,
        np.full(stress.size, level),
    )


def _compare_shear(fit: Estimates, curve: ShearCurve, is_fitted: bool) -> list[Comparison]:
    """Shear stress and opening of a test beside the law."""
    (test,) = fit.predict_shear(curve)
    rows = test.points
    bands = fit.shear_band(curve)[:, :, rows]
    specimen_bands = fit.shear_band(curve, of_specimen=True)[:, :, rows]
    levels = fit.solution.noise.mean.levels
    residuals = {
        series.quantity: one
        for series, one in zip(curve.series, curve.residuals(test), strict=True)
    }
    columns = {
        "shear stress": ("stress", curve.shear_stress, test.stress[rows]),
        "opening": ("opening", curve.opening, test.opening[rows]),
    }
    comparisons = []
    for k, (quantity, (name, measured, law)) in enumerate(columns.items()):
        if measured is None:
            continue
        series = next(one for one in curve.series if one.quantity == name)
        comparisons.append(
            Comparison(
                curve.name,
                quantity,
                is_fitted,
                curve.shear,
                curve.normal,
                measured,
                law,
                bands[k],
                specimen_bands[k],
                _padded(residuals[name], measured.size),
                np.full(measured.size, np.max(np.abs(measured))),
                _padded(series.sigma(levels), measured.size),
            )
        )
    return comparisons


def _padded(values: Array, size: int) -> Array:
    """Values of the last rows, after NaN for the rows before."""
    return np.concatenate([np.full(size - values.size, np.nan), values])


def describe_quality(comparisons: Sequence[Comparison]) -> str:
    """The quality of a fit in one sentence."""
    fitted = [one for one in comparisons if one.is_fitted]
    misses = []
    for quantity in UNITS:
        own = [one for one in fitted if one.quantity == quantity]
        if not own:
            continue
        residuals = np.concatenate([one.residual[one.has_residual] for one in own])
        rms = 100 * float(np.sqrt(np.mean(residuals**2)))
        relative = "measured" if quantity == "normal stress" else "largest"
        misses.append(f"{rms:.2g} % of the {relative} {quantity}")
        if quantity == "shear stress":
            rows = [int(np.argmax(np.abs(one.measured))) for one in own]
            pairs = zip(own, rows, strict=True)
            peaks = np.array([one.residual[row] for one, row in pairs if one.has_residual[row]])
            if peaks.size:
                largest = 100 * float(peaks[np.argmax(np.abs(peaks))])
                rms = 100 * float(np.sqrt(np.mean(peaks**2)))
                misses[-1] += f" (the peaks {rms:.2g} %, at most {largest:+.2g} %)"
    within, points = count_within(fitted)
    return (
        f"The law misses the fitted points by {', '.join(misses)}, root mean square; {within} of "
        f"{points} points are within the 95 % band of law, specimens and noise."
    )


def count_within(comparisons: Sequence[Comparison]) -> tuple[int, int]:
    """Number of points within the 95 % band, see `Comparison.is_within`, and of all points."""
    within = sum(int(np.sum(one.is_within)) for one in comparisons)
    return within, sum(int(np.sum(one.has_residual)) for one in comparisons)


def to_csv(comparisons: Sequence[Comparison]) -> str:
    """All points as CSV, stresses in MPa and lengths in mm, with the band of the law."""
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(CSV_TITLES)
    for one in comparisons:
        unit, factor = UNITS[one.quantity]
        for k in range(one.measured.size):
            numbers = (one.measured[k], one.law[k], one.band[0, k], one.band[1, k])
            residual = one.residual[k]
            writer.writerow(
                [
                    one.test,
                    "fitted" if one.is_fitted else "predicted",
                    one.quantity,
                    unit,
                    f"{1e3 * one.displacement[k]:.6g}",
                    f"{1e-6 * one.normal[k]:.6g}",
                    *(f"{factor * number:.6g}" for number in numbers),
                    f"{100 * residual:.4g}" if np.isfinite(residual) else "",
                ]
            )
    return buffer.getvalue()
