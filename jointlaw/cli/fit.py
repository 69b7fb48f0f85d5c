"""`jointlaw fit`: one law for measured closure and shear tests, with report and picture."""

import argparse
import math
from collections.abc import Iterator, Sequence
from functools import partial
from itertools import compress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import presets
from ..calibration import datasets
from ..calibration.aperture import FlowConditions, FlowFit, fit_flow, read_flow
from ..calibration.comparison import count_within, to_csv
from ..calibration.envelopes import (
    ENVELOPES,
    envelope_strength,
    normal_at_peak_and_last,
    peak_and_last,
)
from ..calibration.fit import Fit, fit_curves
from ..calibration.meaning import spacing
from ..calibration.measured import ClosureCurve, ShearCurve, first_loading
from ..parameters.about import About
from ..parameters.rock import require_rock
from ..support.checks import Array
from ..support.markdown import table
from ..support.text_numbers import DECIMAL_MARKS
from .command import (
    JSON,
    OUT,
    PICTURE_FORMAT,
    Command,
    Contents,
    Group,
    law_text,
    new_about,
    option,
    quantities,
    quantity,
    write_results,
)

MAX_SHEAR_POINTS = 60  # per shear test: a logger writes thousands, and each costs a step
SAME_STRESS = 0.02  # relative difference of normal stresses that --fit takes as equal
CLOSURE_OPTIONS = (
    "stress_column",
    "closure_column",
    "closure_area",
    "cycle",
    "noise",
    "compliance",
    "up_to",
)
SHEAR_OPTIONS = (
    "shear_column",
    "shear_stress_column",
    "normal_column",
    "opening_column",
    "area",
    "side",
    "normal_stress",
)


FLOW_OPTIONS = (
    "flow_column",
    "flow_rate",
    "outlet_pressure",
    "flow_radii",
    "flow_length",
    "flow_width",
    "flow_up_to",
)


class HeldOut(NamedTuple):
    """Points of a closure test, to be predicted instead of fitted."""

    stress: Array  # (n,) in Pa
    closure: Array  # (n,) in m, of the joint alone


def _compliance(text: str) -> float:
    """Type of an option such as 4.2um/10MPa: closure per stress in m/Pa."""
    length, _, stress = text.partition("/")
    return quantity("m")(length) / quantity("Pa", positive=True)(stress)


def _run(options: argparse.Namespace) -> None:
    _require_consistent(options)
    parameters = _fit_parameters(options)
    closure_curves, held_out = _read_closure(options)
    fitted, predicted = _split_shear_tests(_read_shear_tests(options), options.fit)
    fit = fit_curves([*closure_curves, *fitted], **parameters)
    comparisons = fit.comparisons(predicted, held_out)
    inputs = [*options.data, *options.shear, options.peaks, options.flow]
    about = new_about(options, filter(None, inputs), _warnings(fit), _origin(fit, options))
    provenance = _provenance(about, [*closure_curves, *fitted, *predicted])
    shear_files = [*options.shear, *([options.peaks] if options.peaks else [])]
    name = ", ".join(Path(file).name for file in [*options.data, *shear_files])
    require_rock(fit.parameters, f"{name}: the fitted ")
    text = fit.report(_specimen_size(options))
    summary: dict[str, Any] = {
        "data": name,
        "parameters_SI": fit.parameters,
        "interval_95_SI": {parameter: fit.interval(parameter) for parameter in fit.free},
        "identifiable": list(fit.identifiable),
        "not_identifiable": fit.not_identifiable,
        "shape_differs": dict(zip(fit.series_names, fit.shape_differs, strict=True)),
        "noise": fit.solution.noise.mean._asdict(),
        "correlation": fit.correlation.tolist(),
        "spacing_of_asperities_m": spacing(fit.law),
        "points_in_band": count_within([one for one in comparisons if one.is_fitted]),
        "provenance": provenance,
        "warnings": about.warnings,
    }
    if held_out is not None:
        error = fit.predict(held_out.closure) / held_out.stress - 1
        summary["error_at_largest_stress"] = float(error[-1])
        text += _report_held_out(held_out, error)
    if predicted:
        text += _report_predictions(fit, fitted, predicted)
    files: Contents = {
        "points.csv": to_csv(comparisons),
        "fit.png": partial(fit.plot, held_out=held_out, predicted=predicted),
        "law.toml": law_text(fit.law, about),
    }
    if options.flow:
        flow_fit = _fit_flow(options, fit)
        text += flow_fit.report()
        summary |= flow_fit.summary()
        with_aperture = f"{law_text(fit.law, about)}\n{flow_fit.aperture.to_toml()}"
        files = {**files, "law.toml": with_aperture, "flow.png": flow_fit.plot}
    text += _report_provenance(provenance)
    files = {**files, "report.md": text}
    write_results(options, files, summary, text)


def _warnings(fit: Fit) -> Iterator[str]:
    """Yield what a user of the fitted law has to know: shape, parameters, missing openings."""
    stresses = [float(np.max(curve.normal)) for curve in fit.problem.shears]
    if fit.problem.closure is not None:
        stresses.append(float(np.max(fit.problem.closure.stress)))
    yield f"fitted to normal stresses up to {max(stresses) / 1e6:.4g} MPa"
    if any(fit.shape_differs):
        names = "; ".join(compress(fit.series_names, fit.shape_differs))
        yield f"{names} has another shape than the law: its intervals are too narrow"
    for name, reason in fit.not_identifiable.items():
        yield f"{name} is not identifiable from the data: {reason}"
    if fit.has_trade_off:
        yield "no opening was measured: less friction and more dilation give the same shear stress"


def _origin(fit: Fit, options: argparse.Namespace) -> dict[str, str]:
    """Origin of each parameter: fitted with its interval, given, or that of the initial law."""
    given = {item.partition("=")[0].strip() for item in options.set}
    initial = f"of the law {options.law}" if options.law else "assumed: default rock"
    origin = {}
    for name in fit.parameters:
        if name in fit.free:
            low, high = fit.interval(name)
            origin[name] = f"fitted, 95 % interval {low:.4g} to {high:.4g}"
        else:
            origin[name] = "given (--set)" if name in given else initial
    return origin


def _specimen_size(options: argparse.Namespace) -> float | None:
    """Edge of the specimen in m, if its side or area is known."""
    area = options.area or options.closure_area
    return options.side or (math.sqrt(area) if area else None)


def _provenance(about: About, curves: Sequence[ClosureCurve | ShearCurve]) -> dict[str, Any]:
    """Command, version, date, hashes of the files, and the columns that were read."""
    columns = {curve.name: curve.source for curve in curves if curve.source}
    return {**about.notes, "sha256": dict(about.sha256), "columns": columns}


def _report_provenance(provenance: dict[str, Any]) -> str:
    """Where a fit comes from (Markdown)."""
    lines = [
        "",
        "## Provenance",
        "",
        f"{provenance['version']}, {provenance['date']}:",
        "",
        f"    {provenance['command']}",
        "",
        *table("file | SHA-256", [f"{a} | `{b}`" for a, b in provenance["sha256"].items()]),
        "",
        *table("test | columns", [f"{a} | {b}" for a, b in provenance["columns"].items()]),
    ]
    return "\n".join(lines) + "\n"


def _require_consistent(options: argparse.Namespace) -> None:
    """Refuse options that contradict each other or have no test. Raises ValueError."""
    shear_files = [*options.shear, *([options.peaks] if options.peaks else [])]
    if len(options.data) > 1 or not (options.data or shear_files):
        raise ValueError(
            f"{len(options.data)} closure files: give one, or none and shear tests after --shear"
        )
    if not options.data:
        _refuse(options, CLOSURE_OPTIONS, "a closure test: name its file before --shear")
    if not options.shear:
        _refuse(options, SHEAR_OPTIONS, "direct shear tests: name their files after --shear")
    if options.up_to and options.cycle:
        raise ValueError("--cycle fits all points: leave --up-to out")
    if options.flow and not (options.data and options.cycle):
        raise ValueError(
            "--flow needs a closure test with --cycle: flow on unloading follows the closure, "
            "which a fit to loading alone does not predict"
        )
    if not options.flow:
        _refuse(options, FLOW_OPTIONS, "a flow test: name its file after --flow")


def _refuse(options: argparse.Namespace, names: Sequence[str], subject: str) -> None:
    """Refuse options whose test is missing. Raises ValueError."""
    for name in names:
        if getattr(options, name):
            raise ValueError(f"--{name.replace('_', '-')} is about {subject}, or leave it out")


def _read_closure(options: argparse.Namespace) -> tuple[list[ClosureCurve], HeldOut | None]:
    """The closure curve to fit, and the points above --up-to, which are held out.

    Without --cycle only first loading is fitted, and a note of the curve says how many rows were
    left out. No curve without a closure file; None instead of `HeldOut` if all points are fitted.
    The closure of held-out points is corrected by the compliance of the rock.
    """
    if not options.data:
        return [], None
    item = options.data[0]
    notes: list[str] = []
    source = "data set of the package"
    if Path(item).exists():
        stress, closure, notes, source = datasets.read_closure(
            item,
            options.stress_column,
            options.closure_column,
            options.decimal,
            options.outliers,
            options.closure_area,
        )
    elif item in datasets.names():
        stress, closure = datasets.load(item)
    else:
        raise ValueError(
            f"closure test {item!r}: neither a file nor a data set ({', '.join(datasets.names())})"
        )
    if not options.cycle:
        rows = stress.size
        stress, closure = first_loading(stress, closure)
        if stress.size < rows:
            notes.append(
                f"{rows - stress.size} of {rows} rows are unloading or reloading: --cycle fits "
                "them too"
            )
    is_fitted = stress <= (options.up_to or np.inf)
    curve = ClosureCurve(
        stress[is_fitted],
        closure[is_fitted],
        options.noise,
        options.cycle,
        options.compliance,
        item,
        tuple(notes),
        source,
    )
    if is_fitted.all():
        return [curve], None
    above = stress[~is_fitted]
    return [curve], HeldOut(above, closure[~is_fitted] - options.compliance * above)


def _read_shear_tests(options: argparse.Namespace) -> list[ShearCurve]:
    """All shear tests of --shear, with at most `MAX_SHEAR_POINTS` each, and of --peaks."""
    normal_stresses = options.normal_stress or [None] * len(options.shear)
    if len(normal_stresses) != len(options.shear):
        raise ValueError(
            f"--normal-stress gives {len(normal_stresses)} stresses for {len(options.shear)} files "
            "of shear tests: give one for each"
        )
    format_options = {
        "shear": options.shear_column,
        "stress": options.shear_stress_column,
        "normal": options.normal_column,
        "opening": options.opening_column,
        "decimal": options.decimal,
        "outliers": options.outliers,
        "area": options.area,
        "side": options.side,
    }
    tests = []
    for path, normal_stress in zip(options.shear, normal_stresses, strict=True):
        for test in datasets.read_shear(path, normal_stress=normal_stress, **format_options):
            tests.append(test.resampled(MAX_SHEAR_POINTS))
    if options.peaks:
        tests += datasets.read_peaks(options.peaks, options.decimal, options.outliers)
    return tests


def _split_shear_tests(
    tests: list[ShearCurve], stresses: list[float] | None
) -> tuple[list[ShearCurve], list[ShearCurve]]:
    """The shear tests at these normal stresses (Pa), to be fitted, and all others, to be predicted.

    None fits all of them.
    """
    if stresses is None:
        return tests, []
    normal = [float(np.mean(test.normal)) for test in tests]
    is_fitted = [
        any(abs(mean - stress) <= SAME_STRESS * stress for stress in stresses) for mean in normal
    ]
    if sum(is_fitted) < 2 or all(is_fitted):
        raise ValueError(
            f"--fit names {sum(is_fitted)} of {len(tests)} shear tests, at "
            f"{', '.join(f'{mean / 1e6:.3g}MPa' for mean in normal)}: name two or more, and leave "
            "one out"
        )
    return list(compress(tests, is_fitted)), list(compress(tests, np.logical_not(is_fitted)))


def _fit_flow(options: argparse.Namespace, fit: Fit) -> FlowFit:
    """The hydraulic aperture fitted to the flow test, with the law fitted to the cycle."""
    test = read_flow(
        options.flow,
        _flow_conditions(options),
        options.flow_column,
        options.decimal,
        options.outliers,
    )
    return fit_flow(test, fit.law, options.flow_up_to, options.compliance)


def _flow_conditions(options: argparse.Namespace) -> FlowConditions | None:
    """Rate, outlet pressure and geometry of a flow test with pressures; None without them.

    Raises ValueError naming what is missing.
    """
    geometry = options.flow_radii or options.flow_length or options.flow_width
    if not (geometry or options.flow_rate or options.outlet_pressure):
        return None
    missing = [
        f"--{name.replace('_', '-')}"
        for name in ("flow_rate", "outlet_pressure")
        if getattr(options, name) is None
    ]
    is_rectangle = options.flow_length and options.flow_width
    if bool(options.flow_radii) == bool(is_rectangle):
        missing.append("the geometry, either --flow-radii or --flow-length with --flow-width")
    if missing:
        raise ValueError(f"apertures from pressures need {', '.join(missing)}")
    conditions = {
        "rate": options.flow_rate,
        "outlet_pressure": options.outlet_pressure,
        "viscosity": options.viscosity,
    }
    if options.flow_radii:
        if len(options.flow_radii) != 2:
            raise ValueError(
                f"--flow-radii gives {len(options.flow_radii)} radii: write two, inner and outer"
            )
        return FlowConditions.radial(options.flow_radii, **conditions)
    return FlowConditions.linear(options.flow_length, options.flow_width, **conditions)


def _report_held_out(held_out: HeldOut, error: Array) -> str:
    """Errors of the predicted stress at points that were not fitted (Markdown)."""
    return (
        f"\nHeld out: {error.size} points above the fitted stress. Error of the predicted stress: "
        f"{100 * error[-1]:+.1f} % at the largest, {held_out.stress[-1] / 1e6:.4g} MPa; "
        f"{100 * np.sqrt(np.mean(error**2)):.1f} % rms over all of them.\n"
    )


def _report_predictions(fit: Fit, fitted: list[ShearCurve], predicted: list[ShearCurve]) -> str:
    """Errors of the predicted shear tests, beside envelopes of the fitted ones (Markdown)."""
    rows = []
    for curve, test in zip(predicted, fit.predict_shear(*predicted), strict=True):
        measured = peak_and_last(curve.shear_stress)
        normal = normal_at_peak_and_last(curve)
        predictions = [peak_and_last(test.stress)]
        predictions += [envelope_strength(form, fitted, normal) for form in ENVELOPES]
        cells = [curve.name, "{:.4g}, {:.4g}".format(*(measured / 1e6))]
        for prediction in predictions:
            cells.append("{:+.1f}, {:+.1f} %".format(*(100 * (prediction / measured - 1))))
        rows.append(" | ".join(cells))
    head = f"test | peak, last (MPa) | law | {' | '.join(ENVELOPES)}"
    introduction = (
        "Errors of the predicted peak and last shear stress, for tests that were not fitted:"
    )
    return "\n".join(["", introduction, "", *table(head, rows), ""])


def _fit_parameters(options: argparse.Namespace) -> dict[str, Any]:
    """Keyword arguments of `fit_curves`: free and fixed parameters, and the initial law."""
    free = [name.strip() for name in options.free.split(",")] if options.free else None
    fixed = {}
    for item in options.set:
        name, _, value = item.partition("=")
        try:
            fixed[name.strip()] = float(value)
        except ValueError:
            raise ValueError(
                f"--set {item}: write a name and a number, such as --set alpha=3.8"
            ) from None
    law = presets.load_any(options.law) if options.law else None
    return {"fixed": fixed, "free": free, "law": law, "one_specimen": options.one_specimen}


_CLOSURE = Group(
    "closure test",
    (
        option("--stress-column", metavar="NAME:UNIT", help="normal stress, such as sigmaZ:MPa"),
        option("--closure-column", metavar="NAME:UNIT", help="closure, such as Disp:mm"),
        option(
            "--closure-area",
            metavar="AREA",
            type=quantity("m2", positive=True),
            help="area of the joint, for a closure test with a force, such as 100cm2",
        ),
        option(
            "--up-to",
            metavar="STRESS",
            type=quantity("Pa", positive=True),
            help="fit points up to this stress and predict the others, such as 5.3MPa",
        ),
        option(
            "--cycle",
            action="store_true",
            help="fit unloading and reloading too, with yield_interference",
        ),
        option(
            "--compliance",
            metavar="LENGTH/STRESS",
            type=_compliance,
            default=0.0,
            help="compliance of intact rock and machine, such as 4.2um/10MPa: their closure is "
            "subtracted first",
        ),
        option(
            "--noise",
            metavar="FRACTION",
            type=float,
            help="relative standard error of the stress, if it is known, such as 0.01",
        ),
    ),
)
_SHEAR = Group(
    "direct shear tests",
    (
        option(
            "--shear",
            nargs="+",
            metavar="FILE",
            default=[],
            help="CSV or XLSX files with one or several tests each",
        ),
        option(
            "--peaks",
            metavar="FILE",
            help="a table with one test in each row: normal_stress, peak_shear_stress, "
            "peak_displacement, residual_shear_stress, residual_displacement, with units",
        ),
        option(
            "--normal-stress",
            metavar="STRESSES",
            type=quantities("Pa", positive=True),
            help="normal stress of each file, if it is not in a column: 1MPa,3MPa",
        ),
        option("--shear-column", metavar="NAME:UNIT", help="shear displacement, such as us:mm"),
        option("--shear-stress-column", metavar="NAME:UNIT", help="shear stress, such as tau:MPa"),
        option("--normal-column", metavar="NAME:UNIT", help="normal stress, such as sn:MPa"),
        option(
            "--opening-column",
            metavar="NAMES:UNIT",
            help="normal displacement, opening positive, such as dn:mm; of several gauges, such as "
            "A,B,C,D:mm, the mean is taken",
        ),
        option(
            "--area",
            metavar="AREA",
            type=quantity("m2", positive=True),
            help="area of the joint, for columns with forces, such as 100cm2",
        ),
        option(
            "--side",
            metavar="LENGTH",
            type=quantity("m", positive=True),
            help="length of the specimen along the shear, such as 10cm: the area shrinks with slip",
        ),
        option(
            "--fit",
            metavar="STRESSES",
            type=quantities("Pa", positive=True),
            help="fit the tests at these normal stresses and predict the others: 1MPa,3MPa,5MPa",
        ),
    ),
)
_FLOW = Group(
    "flow test (hydraulic aperture), with --cycle",
    (
        option(
            "--flow",
            metavar="FILE",
            help="CSV or XLSX file with normal stress and hydraulic aperture, or inlet pressure at "
            "a constant flow rate, over the same cycle",
        ),
        option(
            "--flow-column",
            metavar="NAME:UNIT",
            help="hydraulic aperture or inlet pressure, such as p_in:kPa",
        ),
        option(
            "--flow-up-to",
            metavar="STRESS",
            type=quantity("Pa", positive=True),
            help="fit the aperture up to this stress of loading, predict the others: 5.3MPa",
        ),
        option(
            "--flow-rate",
            metavar="RATE",
            type=quantity("m3/s", positive=True),
            help="of pressures: constant flow rate, such as 5ml/min",
        ),
        option(
            "--outlet-pressure",
            metavar="PRESSURE",
            type=quantity("Pa"),
            help="of pressures: pressure at the outlet, such as 101.3kPa",
        ),
        option(
            "--flow-radii",
            metavar="INNER,OUTER",
            type=quantities("m", positive=True),
            help="of pressures: radii of radial flow, such as 4mm,61mm",
        ),
        option(
            "--flow-length",
            metavar="LENGTH",
            type=quantity("m", positive=True),
            help="of pressures: length along the flow, with --flow-width",
        ),
        option(
            "--flow-width",
            metavar="LENGTH",
            type=quantity("m", positive=True),
            help="of pressures: width across the flow",
        ),
        option(
            "--viscosity",
            metavar="VISCOSITY",
            type=quantity("Pas", positive=True),
            default="1.002mPas",
            help="of pressures: viscosity (default 1.002mPas, water at 20 degrees Celsius)",
        ),
    ),
)
_FILES = Group(
    "files",
    (
        option(
            "--decimal",
            choices=tuple(DECIMAL_MARKS),
            help="decimal mark, if no number of a file shows it (1,201 and 1.201 do not)",
        ),
        option(
            "--outliers",
            choices=("skip", "keep"),
            help="how to treat outliers; without this option they are listed and refused",
        ),
    ),
)
_PARAMETERS = Group(
    "parameters",
    (
        option(
            "--set",
            action="append",
            default=[],
            metavar="NAME=VALUE",
            help="fix a parameter, in SI units, such as alpha=3.8; repeatable",
        ),
        option(
            "--free",
            metavar="NAMES",
            help="parameters to fit, separated by commas (default: for closure tests "
            "asperity_density, alpha and beta, with --cycle yield_interference; for shear tests "
            "mu, a and mating_length, at three normal stresses or more degradation_stress)",
        ),
        option(
            "--one-specimen",
            action="store_true",
            help="all tests are on one specimen, as in a multi-stage test (default: each test is "
            "on its own specimen, and the spread between specimens is part of the intervals)",
        ),
        option(
            "--law",
            metavar="PRESET_OR_FILE",
            help="values of all fixed parameters (default: contacts of an average rock)",
        ),
    ),
)
COMMAND = Command(
    "fit",
    "fit one law to measured closure and shear tests; write law, report and picture",
    "jointlaw fit grimsel_vd1_closure --up-to 5.3MPa --out out",
    _run,
    (
        option(
            "data",
            nargs="*",
            metavar="CLOSURE_TEST",
            help="CSV or XLSX file with stress and closure, or a data set of the package "
            f"({', '.join(datasets.names())})",
        ),
        _CLOSURE,
        _SHEAR,
        _FLOW,
        _FILES,
        _PARAMETERS,
        Group("output", (*OUT, JSON, PICTURE_FORMAT)),
    ),
)
