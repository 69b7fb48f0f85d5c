"""The hydraulic aperture of a joint from a flow test during a cycle of closure.

The map `Aperture` is fitted to the loading branch, against the closure of a law that was fitted to
the same cycle; the unloading branch is predicted. Empirical forms of the normal stress are fitted
to the same points for comparison. All fits are least squares of ln(e).
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..joints.normal_control import NormalCondition, closing_increments
from ..laws.joint_law import JointLaw
from ..parameters.aperture import Aperture
from ..support.checks import Array, more_than
from ..support.markdown import table
from ..support.pyplot import pyplot, style, written
from .datasets import CLOSURE, STRESS
from .tables import Quantity, read_tables

WATER_VISCOSITY = 1.002e-3  # Pa s, at 20 degrees Celsius
MIN_POINTS = 3  # of the loading branch that are fitted
_MIN_APERTURE = 1e-100  # m: bound of the trial values of a fit, whose logarithm is taken
HYDRAULIC_APERTURE = Quantity(
    "hydraulic aperture (or the pressure at the inlet)",
    "m",
    ("hydraulic_aperture", "aperture", "e", "e_h", "eh"),
    "--flow-column",
)
PRESSURE = Quantity(
    "pressure at the inlet (or the hydraulic aperture)",
    "Pa",
    ("pressure", "inlet_pressure", "p_in", "pin", "p"),
    "--flow-column",
)


@dataclass(frozen=True)
class FlowConditions:
    """Flow of a constant rate between parallel walls, from which apertures follow (cubic law).

    rate: volume flow in m3/s. outlet_pressure: in Pa, as the inlet pressure is counted.
    shape: 12 viscosity rate shape/(pressure difference) is e^3: length/width of a rectangle,
        ln(outer/inner radius)/(2 pi) for radial flow. viscosity: in Pa s.
    description: of the geometry, for the report.
    """

    rate: float
    outlet_pressure: float
    shape: float
    description: str
    viscosity: float = WATER_VISCOSITY

    @classmethod
    def radial(cls, radii: Sequence[float], **options: Any) -> "FlowConditions":
        """Flow between two radii (m). Raises ValueError unless the outer one is larger."""
        inner = more_than("inner radius", radii[0], 0.0)
        outer = more_than("outer radius", radii[1], inner)
        shape = math.log(outer / inner) / (2 * math.pi)
        description = f"radial flow from a radius of {1e3 * inner:g} mm to {1e3 * outer:g} mm"
        return cls(shape=shape, description=description, **options)

    @classmethod
    def linear(cls, length: float, width: float, **options: Any) -> "FlowConditions":
        """Flow along a rectangle (m)."""
        shape = more_than("length", length, 0.0) / more_than("width", width, 0.0)
        description = f"flow along {1e3 * length:g} mm, {1e3 * width:g} mm wide"
        return cls(shape=shape, description=description, **options)

    def hydraulic_aperture(self, pressure: Array) -> Array:
        """Hydraulic apertures (m) at inlet pressures (Pa), which exceed the outlet pressure."""
        cube = 12 * self.viscosity * self.rate * self.shape / (pressure - self.outlet_pressure)
        return np.asarray(np.cbrt(cube))


@dataclass(frozen=True, eq=False)
class FlowTest:
    """Hydraulic aperture during one cycle of closure, in the order measured.

    stress: normal stress (n,) in Pa, rising once and falling once. hydraulic: aperture (n,) in m.
    closure: measured closure (n,) in m, None if the file has none.
    name: of the file. notes: on conditions and rows.
    """

    stress: Array
    hydraulic: Array
    closure: Array | None
    name: str
    notes: tuple[str, ...] = ()

    @cached_property
    def is_loading(self) -> NDArray[np.bool_]:
        """Which rows (n,) are loading: up to the largest stress."""
        return np.arange(self.stress.size) <= int(np.argmax(self.stress))


def read_flow(
    path: str | Path,
    conditions: FlowConditions | None = None,
    column: str | None = None,
    decimal: str | None = None,
    outliers: str | None = None,
) -> FlowTest:
    """Read a flow test: normal stress with hydraulic aperture, or with inlet pressure.

    Parameters
    ----------
    path: text file or workbook; a column of measured closure is optional.
    conditions: of a file with pressures.
    column: name and unit of the column of apertures or pressures, "p_in:kPa"; None finds it.
    decimal, outliers: as in `datasets.read_closure`.

    Raises ValueError naming file, column or line, and the option that helps.
    """
    quantities = [(STRESS, None), (HYDRAULIC_APERTURE, column), (PRESSURE, column)]
    flow_table, *others = read_tables(Path(path), quantities, decimal)
    if others:
        raise ValueError(f"{path}: holds {1 + len(others)} tests; give a file with one flow test")
    has_pressure = conditions is not None
    if column is None:
        has_pressure = bool(flow_table.find_columns(PRESSURE)) and not flow_table.find_columns(
            HYDRAULIC_APERTURE
        )
    if has_pressure and conditions is None:
        raise ValueError(
            f"{path}: pressures give no aperture without --flow-rate, --outlet-pressure and the "
            "geometry, --flow-radii or --flow-length with --flow-width; or give a column of "
            "hydraulic apertures"
        )
    columns = [
        flow_table.column(STRESS),
        flow_table.column(PRESSURE if has_pressure else HYDRAULIC_APERTURE, column),
    ]
    has_closure = bool(flow_table.find_columns(CLOSURE))
    if has_closure:
        columns.append(flow_table.column(CLOSURE))
    (stress, values, *closure), _, notes = flow_table.complete_rows(columns, outliers)
    if has_pressure:
        assert conditions is not None
        _require_larger(path, "pressure", values, conditions.outlet_pressure, "outlet pressure")
        values = conditions.hydraulic_aperture(values)
        notes.append(
            f"apertures by the cubic law from pressures: {conditions.description}, "
            f"{6e7 * conditions.rate:.4g} ml/min, viscosity {1e3 * conditions.viscosity:.4g} "
            f"mPa s, outlet pressure {conditions.outlet_pressure / 1e3:.4g} kPa; the outlet "
            "pressure changes their ratios, rate, geometry and viscosity do not"
        )
    _require_larger(path, "hydraulic aperture", values, 0.0, "zero")
    _require_larger(path, "stress", stress, 0.0, "zero")
    return FlowTest(stress, values, closure[0] if closure else None, str(path), tuple(notes))


def _require_larger(path: str | Path, name: str, values: Array, bound: float, what: str) -> None:
    """Refuse values that are not larger than a bound. Raises ValueError."""
    smallest = float(values.min())
    if not smallest > bound:
        raise ValueError(
            f"{path}: {name} = {smallest:.6g} must be larger than the {what}, {bound:.6g} (SI "
            "units); check columns and units"
        )


def closure_along(law: JointLaw, stress: Array) -> Array:
    """Closures (n,) in m of a new joint that is loaded to these normal stresses (Pa) in turn.

    The joint has neither shear nor dilation and keeps its history from one stress to the next, so
    that unloading differs from loading.
    """
    batch = replace(law, plane=None, closure_only=True).joints(1)
    scale = float(np.max(stress))
    closures = np.empty(stress.size)
    for k, target in enumerate(stress.tolist()):
        step = np.zeros((1, 1))
        step[:, 0] = closing_increments(batch, step, NormalCondition(target, scale))
        batch.update(step, tangent=False)
        closures[k] = batch.delta[0, 0]
    return closures


def fit_aperture(closure: Array, hydraulic: Array) -> Aperture:
    """Fit the map to apertures (m) at closures (m), by least squares of ln(e).

    `at` is the first closure. Raises ValueError for fewer than three points, or apertures that do
    not fall while the joint closes.
    """
    if closure.size < MIN_POINTS:
        raise ValueError(
            f"{closure.size} loading points with flow: give {MIN_POINTS} or more; raise "
            "--flow-up-to, or leave it out"
        )
    at = float(closure[0])
    slope, start = np.polyfit(closure - at, np.log(hydraulic), 1)
    if not slope < 0:
        raise ValueError(
            "the hydraulic aperture does not fall while the joint closes: check the order of the "
            "rows and the columns of the flow test"
        )

    def residuals(x: Array) -> Array:
        e = Aperture(math.exp(x[0]), at, math.exp(x[1]))(closure).hydraulic
        # far from the solution an aperture may underflow
        return np.asarray(np.log(np.maximum(e, _MIN_APERTURE) / hydraulic))

    solution = least_squares(residuals, [start, -math.log(-slope)], xtol=1e-12, ftol=1e-12)
    return Aperture(math.exp(solution.x[0]), at, math.exp(solution.x[1]))


class StressForm(NamedTuple):
    """An empirical form e(stress) with two positive parameters.

    formula: in words of the report. aperture: e in m at stresses in Pa. guess: parameters from
    the stresses and apertures of the fitted points.
    """

    formula: str
    aperture: Callable[[Array, Array], Array]
    guess: Callable[[Array, Array], Sequence[float]]


def _semi_logarithm_guess(stress: Array, e: Array) -> Sequence[float]:
    slope, start = np.polyfit(np.log(stress), e, 1)
    return start, -slope


FORMS = {
    "Bandis": StressForm(
        "e0/(1 + 9 stress/s)",
        lambda p, stress: p[0] / (1 + 9 * stress / p[1]),
        lambda stress, e: (e[0], float(stress[-1])),
    ),
    "semi-logarithm": StressForm(
        "a - b ln(stress)",
        lambda p, stress: np.maximum(p[0] - p[1] * np.log(stress), 1e-9 * p[0]),
        _semi_logarithm_guess,
    ),
    "power law": StressForm(
        "a stress^-n",
        lambda p, stress: p[0] * (stress / 1e6) ** -p[1],
        lambda stress, e: (e[-1], 0.3),
    ),
}


def fit_form(form: StressForm, stress: Array, hydraulic: Array) -> Array:
    """Parameters (2,) of a form by least squares of ln(e) at stresses (Pa) and apertures (m).

    The logarithms of both parameters vary, from the guess of the form, so that they stay positive.
    """
    guess = np.abs(np.asarray(form.guess(stress, hydraulic), float))

    def residuals(x: Array) -> Array:
        return np.asarray(np.log(form.aperture(guess * np.exp(x), stress) / hydraulic))

    solution = least_squares(residuals, np.zeros(2), xtol=1e-12, ftol=1e-12)
    return np.asarray(guess * np.exp(solution.x))


class FormErrors(NamedTuple):
    """Relative errors of a form: at the largest stress, and rms on unloading (NaN without it)."""

    at_largest_stress: float
    unloading_rms: float


@dataclass(frozen=True, eq=False)
class FlowFit:
    """The hydraulic aperture fitted to a flow test, and empirical forms beside it.

    test: the flow test. closure: closures (n,) in m of the law at its rows.
    is_fitted: which rows (n,) are fitted. aperture: the fitted map.
    curves: apertures (n,) in m at all rows, by the name of the form; the map comes first.
    """

    test: FlowTest
    closure: Array
    is_fitted: NDArray[np.bool_]
    aperture: Aperture
    curves: dict[str, Array]

    @cached_property
    def errors(self) -> dict[str, FormErrors]:
        """Errors of each form by its name.

        Its relative error at the largest stress, and the rms of its relative errors on the
        unloading branch, NaN without one.
        """
        top = int(np.argmax(self.test.stress))
        unloading = ~self.test.is_loading
        errors = {}
        for name, e in self.curves.items():
            relative = e / self.test.hydraulic - 1
            rms = math.sqrt(np.mean(relative[unloading] ** 2)) if unloading.any() else math.nan
            errors[name] = FormErrors(float(relative[top]), rms)
        return errors

    def summary(self) -> dict[str, Any]:
        """Parameters and errors for `summary.json`."""
        return {
            "aperture_SI": {
                "hydraulic": self.aperture.hydraulic,
                "at": self.aperture.at,
                "length": self.aperture.length,
            },
            "aperture_errors": {name: errors._asdict() for name, errors in self.errors.items()},
        }

    def report(self) -> str:
        """The fit in sentences and a table (Markdown)."""
        test = self.test
        loading = int(test.is_loading.sum())
        largest = test.stress.max() / 1e6
        limit = test.stress[self.is_fitted].max() / 1e6
        a = self.aperture
        rows = []
        for name, errors in self.errors.items():
            unloading = errors.unloading_rms
            cell = "-" if math.isnan(unloading) else f"{100 * unloading:.0f}"
            rows.append(f"{name} | {100 * errors.at_largest_stress:+.0f} | {cell}")
        lines = [
            "",
            "## Hydraulic aperture",
            "",
            f"{test.stress.size} points of {Path(test.name).name}, {loading} of them loading. "
            f"Fitted by least squares of ln(e): {int(self.is_fitted.sum())} loading points up to "
            f"{limit:.4g} MPa.",
            "",
            f"e = {1e6 * a.hydraulic:.4g} um at a closure of {1e6 * a.at:.4g} um of the law, "
            f"length {1e6 * a.length:.4g} um. The heights of the law do not give these numbers: "
            "they are valid for this specimen only.",
            "",
            *table(
                f"form | error at {largest:.4g} MPa (%) | rms error on unloading (%)",
                rows,
            ),
            "",
            *(f"- {note}" for note in test.notes),
        ]
        return "\n".join(lines).rstrip("\n") + "\n"

    @style()
    def plot(self, path: str | Path | None = None) -> Any:
        """Draw aperture against normal stress and against closure (extra `plot`).

        Filled points are fitted, open points and the unloading branch are predicted.
        """
        figure, axes = pyplot().subplots(1, 2, figsize=(9.2, 4.4), sharey=True)
        stress_axis, closure_axis = axes
        self._draw_branches(stress_axis, 1e-6 * self.test.stress)
        self._draw_branches(closure_axis, 1e6 * self.closure)
        loading = self.test.is_loading
        for name, linestyle in zip(FORMS, ("--", ":", "-."), strict=True):
            stress_axis.plot(
                1e-6 * self.test.stress[loading],
                1e6 * self.curves[name][loading],
                color="0.4",
                ls=linestyle,
                label=name,
            )
        stress_axis.set(xlabel="normal stress (MPa)", ylabel="hydraulic aperture (µm)")
        stress_axis.set_ylim(bottom=0.0)
        closure_axis.set(xlabel="closure of the law (µm)")
        closure_axis.plot([], [], "ok", label="measured, fitted")
        closure_axis.plot([], [], "ok", mfc="w", label="measured, predicted")
        stress_axis.legend()
        closure_axis.legend()
        return written(figure, path)

    def _draw_branches(self, axis: Any, x: Array) -> None:
        """Measured points and the map on loading and unloading, against x (n,)."""
        fitted_curve = next(iter(self.curves.values()))
        measured = 1e6 * self.test.hydraulic
        for branch, color, label in (
            (self.test.is_loading, "C0", "map, loading"),
            (~self.test.is_loading, "C3", "map, unloading"),
        ):
            if branch.any():
                predicted = branch & ~self.is_fitted
                axis.plot(x[branch], 1e6 * fitted_curve[branch], color=color, label=label)
                axis.plot(x[predicted], measured[predicted], "o", color=color, mfc="w")
        axis.plot(x[self.is_fitted], measured[self.is_fitted], "oC0")


def fit_flow(
    test: FlowTest, law: JointLaw, up_to: float | None = None, compliance: float = 0.0
) -> FlowFit:
    """Fit the hydraulic aperture, and the empirical forms, to a flow test.

    Parameters
    ----------
    test: the flow test.
    law: fitted to the same cycle of closure.
    up_to: largest stress (Pa) of fitted points; None takes the whole loading branch.
    compliance: of rock and machine (m/Pa), subtracted from the measured closure of the test.

    Raises ValueError for fewer than three points to fit, or apertures that rise with closure.
    """
    closure = closure_along(law, test.stress)
    is_fitted = test.is_loading & (test.stress <= (up_to or np.inf))
    aperture = fit_aperture(closure[is_fitted], test.hydraulic[is_fitted])
    curves = {"map of the law's closure": aperture(closure).hydraulic}
    if test.closure is not None:
        measured = test.closure - compliance * test.stress
        measured_map = fit_aperture(measured[is_fitted], test.hydraulic[is_fitted])
        curves["map of the measured closure"] = measured_map(measured).hydraulic
    for name, form in FORMS.items():
        parameters = fit_form(form, test.stress[is_fitted], test.hydraulic[is_fitted])
        curves[name] = form.aperture(parameters, test.stress)
    return FlowFit(test, closure, is_fitted, aperture, curves)
