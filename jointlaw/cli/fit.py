"""`jointlaw fit`: measured closure and shear tests to one law, with report and picture."""

import argparse
from functools import partial
from itertools import compress
from pathlib import Path
from typing import Any

import numpy as np

from .. import presets
from ..calibration import datasets
from ..calibration.envelopes import FORMS, envelope, peak_and_last
from ..calibration.fit import Fit, fit_curves
from ..calibration.measured import ClosureCurve, ShearCurve, first_loading
from ..parameters.rock import require_rock
from ..support.checks import Array, one_of
from ..support.markdown import table
from ..support.text_numbers import DECIMAL_MARKS
from .command import OUT, PICTURES, Command, Written, in_unit, option, several, write_results

MOST = 60  # points of a shear test that are fitted: a logger writes thousands, each costs a step
SAME = 0.02  # of a normal stress: tests that --fit names
NEEDS = {  # what an option is about, where no such test is given
    "data": (
        "a closure test: name its file before --shear",
        ("stress_column", "closure_column", "cycle", "noise", "compliance", "up_to"),
    ),
    "shear": (
        "direct shear tests: name their files after --shear",
        ("shear_column", "shear_stress_column", "normal_column", "opening_column", "area", "side",
         "normal_stress"),
    ),
}  # fmt: skip


def _compliance(text: str) -> float:
    """Type of an option such as 4.2um/10MPa: closure per stress in m/Pa."""
    length, _, load = text.partition("/")
    return in_unit("m")(length) / in_unit("Pa", positive=True)(load)


def _run(options: argparse.Namespace) -> None:
    shears = [*options.shear, *([options.peaks] if options.peaks else [])]
    if len(options.data) > 1 or not (options.data or shears):
        raise ValueError(
            f"{len(options.data)} closure files: give one, or none and shear tests after --shear"
        )
    for tests, (about, names) in NEEDS.items():
        for name in names:
            if getattr(options, name) and not getattr(options, tests):
                raise ValueError(f"--{name.replace('_', '-')} is about {about}, or leave it out")
    keywords = _keywords(options)
    closures, held = _closure_curve(options)
    fitted, predicted = _shear_curves(options)
    fit = fit_curves([*closures, *fitted], **keywords)
    name = ", ".join(Path(item).name for item in [*options.data, *shears])
    require_rock(fit.parameters, f"{name}: the fitted ")
    text = fit.report()
    summary: dict[str, Any] = {
        "data": name,
        "parameters_SI": fit.parameters,
        "interval_95_SI": {one: fit.interval(one) for one in fit.free},
        "identifiable": list(fit.identifiable),
        "not_identifiable": fit.not_identifiable,
    }
    if held is not None:
        error = fit.predict(held[1]) / held[0] - 1
        summary["error_at_largest_stress"] = float(error[-1])
        text += (
            f"\nHeld out: {error.size} points. The predicted stress is off by "
            f"{100 * error[-1]:+.1f} % at the largest, {held[0][-1] / 1e6:.4g} MPa, and by "
            f"{100 * np.sqrt(np.mean(error**2)):.1f} % (rms) over all of them.\n"
        )
    if predicted:
        text += _misses(fit, fitted, predicted)
    print(text)
    files: Written = {
        "fit.png": partial(fit.plot, held_out=held, predicted=predicted),
        "law.toml": fit.law.to_toml,
        "report.md": text,
    }
    write_results(options.out, files, summary, options.format)


def _closure_curve(
    options: argparse.Namespace,
) -> tuple[list[ClosureCurve], tuple[Array, Array] | None]:
    """The closure curve to fit, if there is one; stress (Pa) and closure (m) of points held out."""
    if not options.data:
        return [], None
    item, compliance, notes = options.data[0], options.compliance, list[str]()
    if Path(item).exists():
        stress, closure, notes = datasets.read_closure(
            item, options.stress_column, options.closure_column, options.decimal, options.outliers
        )
    else:
        one_of("the closure test, no file and as data set,", item, tuple(datasets.names()))
        stress, closure = datasets.load(item)
    rows = stress.size
    if not options.cycle:
        stress, closure = first_loading(stress, closure)
        if stress.size < rows:
            told = f"{rows - stress.size} of {rows} rows unload or load again up to where they were"
            notes.append(f"{told}: --cycle fits them")
    if options.up_to and options.cycle:
        raise ValueError("--cycle fits all points: leave --up-to out")
    seen = stress <= (options.up_to or np.inf)
    curve = ClosureCurve(
        stress[seen], closure[seen], options.noise, options.cycle, compliance, item, tuple(notes)
    )
    held = stress[~seen], closure[~seen] - compliance * stress[~seen]
    return [curve], None if seen.all() else held


def _shear_curves(options: argparse.Namespace) -> tuple[list[ShearCurve], list[ShearCurve]]:
    """The shear tests to fit, thinned to `MOST` points each, and those to predict."""
    normals = options.normal_stress or [None] * len(options.shear)
    if len(normals) != len(options.shear):
        raise ValueError(
            f"--normal-stress gives {len(normals)} stresses for {len(options.shear)} files of "
            "shear tests: give one for each"
        )
    how = {
        "shear": options.shear_column,
        "stress": options.shear_stress_column,
        "normal": options.normal_column,
        "opening": options.opening_column,
        "decimal": options.decimal,
        "outliers": options.outliers,
        "area": options.area,
        "side": options.side,
    }
    tests = [
        test.thinned(MOST)
        for path, normal in zip(options.shear, normals, strict=True)
        for test in datasets.read_shear(path, normal_stress=normal, **how)
    ]
    tests += (
        datasets.read_peaks(options.peaks, options.decimal, options.outliers)
        if options.peaks
        else []
    )
    if options.fit is None:
        return tests, []
    given = [float(np.mean(test.normal)) for test in tests]
    fit = [any(abs(at - one) <= SAME * one for one in options.fit) for at in given]
    if sum(fit) < 2 or all(fit):
        raise ValueError(
            f"--fit names {sum(fit)} of {len(tests)} shear tests, at "
            f"{', '.join(f'{at / 1e6:.3g}MPa' for at in given)}: name two or more, and leave one"
        )
    return list(compress(tests, fit)), list(compress(tests, np.logical_not(fit)))


def _misses(fit: Fit, fitted: list[ShearCurve], predicted: list[ShearCurve]) -> str:
    """How far predictions miss, those of envelopes through the same tests beside (Markdown)."""
    rows = []
    for curve, test in zip(predicted, fit.predict_shear(*predicted), strict=True):
        measured, normal = peak_and_last(curve.shear_stress), float(np.mean(curve.normal))
        found = [peak_and_last(test.stress), *(envelope(form, fitted, normal) for form in FORMS)]
        cells = ["{:+.1f}, {:+.1f} %".format(*(100 * (one / measured - 1))) for one in found]
        told = "{:.4g}, {:.4g}".format(*(measured / 1e6))
        rows.append(" | ".join([curve.name, told, *cells]))
    head = f"test | peak, last (MPa) | law | {' | '.join(FORMS)}"
    what = "Tests that were not fitted: errors of the predicted peak and last shear stress."
    return "\n".join(["", what, "", *table(head, rows), ""])


def _keywords(options: argparse.Namespace) -> dict[str, Any]:
    """What `fit_curves` takes besides the curves."""
    free = [name.strip() for name in options.free.split(",")] if options.free else None
    pairs = (item.partition("=") for item in options.set)
    try:
        fixed = {name.strip(): float(value) for name, _, value in pairs}
    except ValueError:
        raise ValueError(
            f"--set {options.set}: write a name and a number each, such as alpha=3.8"
        ) from None
    law = presets.load_any(options.law) if options.law else None
    return {"fixed": fixed, "free": free, "law": law}


COMMAND = Command(
    "fit",
    "fit the law to measured closure and shear curves; write preset, report and plot",
    "jointlaw fit grimsel_vd1_closure --up-to 5.3MPa --out out",
    _run,
    (
        option(
            "data", nargs="*", metavar="CSV", help="file of stress and closure, or shipped data set"
        ),
        option("--stress-column", help="name and unit of that column, such as sigmaZ:MPa"),
        option("--closure-column", help="name and unit of that column, such as Disp:mm"),
        option(
            "--shear",
            nargs="+",
            metavar="CSV",
            default=[],
            help="direct shear tests, several to a file or one, as CSV or XLSX. Their normal "
            "stress is in a column or after --normal-stress. One law is fitted to all of them and "
            "to the closure test, if one is given before",
        ),
        option(
            "--peaks",
            metavar="CSV",
            help="a table with one shear test a row: normal_stress, peak_shear_stress, "
            "peak_displacement, residual_shear_stress, residual_displacement, with units",
        ),
        option("--shear-column", help="name and unit of that column, such as us:mm"),
        option("--shear-stress-column", help="name and unit of that column: tau:MPa"),
        option("--normal-column", help="name and unit of that column: sn:MPa"),
        option("--opening-column", help="name and unit of that column, opening positive: dn:mm"),
        option("--area", type=in_unit("m2", positive=True), help="that forces act on: 100cm2"),
        option(
            "--side",
            type=in_unit("m", positive=True),
            help="of an area that slip makes smaller: 10cm",
        ),
        option(
            "--normal-stress",
            metavar="STRESSES",
            type=several("Pa", positive=True),
            help="of the shear tests in their order: 1MPa,3MPa",
        ),
        option(
            "--decimal",
            choices=tuple(DECIMAL_MARKS),
            help="the decimal mark of files whose numbers do not show it, as 1,201 and 1.201 do "
            "not",
        ),
        option(
            "--outliers",
            choices=("skip", "keep"),
            help="what to do with rows that may be no measurement; they are named first",
        ),
        option(
            "--fit",
            metavar="STRESSES",
            type=several("Pa", positive=True),
            help="fit the shear tests at these normal stresses, predict the others: 1MPa,3MPa,5MPa",
        ),
        option(
            "--up-to",
            type=in_unit("Pa", positive=True),
            help="fit up to this stress, predict the rest: 5.3MPa",
        ),
        option(
            "--cycle", action="store_true", help="fit unloading too, and with it yield_interference"
        ),
        option(
            "--compliance",
            metavar="LENGTH/STRESS",
            type=_compliance,
            default=0.0,
            help="of rock and machine, such as 4.2um/10MPa: it is subtracted first",
        ),
        option(
            "--noise", type=float, help="known error of the closure test's stress, such as 0.01"
        ),
        option(
            "--set",
            action="append",
            default=[],
            metavar="NAME=VALUE",
            help="hold a parameter at a value in SI units, such as alpha=3.8; repeatable",
        ),
        option(
            "--free",
            metavar="NAMES",
            help="parameters to fit, with commas between; default asperity_density, of closure "
            "tests alpha and beta, with --cycle yield_interference, of shear tests mu, a and "
            "mating_length",
        ),
        option(
            "--law", metavar="PRESET_OR_FILE", help="the values of parameters that are not fitted"
        ),
        *OUT,
        PICTURES,
    ),
)
