"""`jointlaw fit`: measured closure and shear tests to one law, with report and picture."""

import argparse
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import presets
from ..calibration import datasets
from ..calibration.fit import fit_curves
from ..calibration.measured import ClosureCurve, ShearCurve, first_loading
from ..parameters.rock import require_rock
from ..support.checks import Array
from ..support.text_numbers import DECIMAL
from .command import Written, add_command, add_out, in_unit, several, write_results

MOST = 60  # points of a shear test that are fitted: a logger writes thousands, each costs a step
NEEDS = {  # what an option is about, where no such test is given
    "data": (
        "a closure test: name its file before --shear",
        ("stress_column", "closure_column", "cycle", "noise", "compliance", "up_to"),
    ),
    "shear": (
        "direct shear tests: name their files after --shear",
        ("shear_column", "shear_stress_column", "normal_column", "normal_stress"),
    ),
}


def add(commands: Any) -> None:
    """Add `fit` to the subparsers of the command line."""
    what = "fit the law to measured closure and shear curves; write preset, report and plot"
    example = "jointlaw fit grimsel_vd1_closure --up-to 5.3MPa --out out"
    parser = add_command(commands, "fit", what, example, _run)
    add = parser.add_argument
    add("data", nargs="*", metavar="CSV", help="file of stress and closure, or shipped data set")
    add("--stress-column", help="name and unit of that column, such as sigmaZ:MPa")
    add("--closure-column", help="name and unit of that column, such as Disp:mm")
    add(
        "--shear",
        nargs="+",
        metavar="CSV",
        default=[],
        help="direct shear tests, one a file, at a constant normal stress that is in a column of "
        "the file or after --normal-stress. One law is fitted to all of them and to the closure "
        "test, if one is given before; this takes half a minute to some minutes",
    )
    add("--shear-column", help="name and unit of that column, such as us:mm")
    add("--shear-stress-column", help="name and unit of that column: tau:MPa")
    add("--normal-column", help="name and unit of that column: sn:MPa")
    add(
        "--normal-stress",
        metavar="STRESSES",
        type=several("Pa", positive=True),
        help="of the shear tests in their order: 1MPa,3MPa",
    )
    add(
        "--decimal",
        choices=tuple(DECIMAL),
        help="the decimal mark of files whose numbers do not show it, as 1,201 and 1.201 do not",
    )
    add("--up-to", type=in_unit("Pa"), help="fit up to this stress, predict the rest: 5.3MPa")
    add("--cycle", action="store_true", help="fit unloading too, and with it yield_interference")
    add(
        "--compliance",
        metavar="LENGTH/STRESS",
        type=_compliance,
        default=0.0,
        help="of rock and machine, such as 4.2um/10MPa: it is subtracted first",
    )
    add("--noise", type=float, help="known error of the closure test's stress, such as 0.01")
    add(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="hold a parameter at a value in SI units, such as alpha=3.8; repeatable",
    )
    add(
        "--free",
        metavar="NAMES",
        help="parameters to fit, with commas between; default asperity_density, of closure tests "
        "alpha and beta, with --cycle yield_interference, of shear tests mu, a and mating_length",
    )
    add("--law", metavar="PRESET_OR_FILE", help="the values of parameters that are not fitted")
    add_out(parser)


def _compliance(text: str) -> float:
    """Type of an option such as 4.2um/10MPa: closure per stress in m/Pa."""
    length, _, load = text.partition("/")
    return in_unit("m")(length) / in_unit("Pa", positive=True)(load)


def _run(options: argparse.Namespace) -> None:
    if len(options.data) > 1 or not (options.data or options.shear):
        raise ValueError(
            f"{len(options.data)} closure files: give one, or none and shear tests after --shear"
        )
    for tests, (about, names) in NEEDS.items():
        for name in names:
            if getattr(options, name) and not getattr(options, tests):
                raise ValueError(f"--{name.replace('_', '-')} is about {about}, or leave it out")
    keywords = _keywords(options)
    curves: list[ClosureCurve | ShearCurve] = []
    held: tuple[Array, Array] | None = None
    if options.data:
        curve, held = _closure_curve(options)
        curves.append(curve)
    fit = fit_curves([*curves, *_shear_curves(options)], **keywords)
    name = ", ".join(Path(item).name for item in [*options.data, *options.shear])
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
    print(text)
    files: Written = {
        "fit.png": partial(fit.plot, held_out=held),
        "law.toml": fit.law.to_toml,
        "report.md": text,
    }
    write_results(options.out, files, summary, options.format)


def _closure_curve(
    options: argparse.Namespace,
) -> tuple[ClosureCurve, tuple[Array, Array] | None]:
    """The closure curve to fit; with it stress (Pa) and closure (m) of points held out, or None."""
    item, compliance = options.data[0], options.compliance
    if item in datasets.names() and not Path(item).exists():
        stress, closure = datasets.load(item)
    else:
        columns = options.stress_column, options.closure_column
        stress, closure = datasets.read_closure(item, *columns, options.decimal)
    if not options.cycle:
        stress, closure = first_loading(stress, closure)
    if options.up_to and options.cycle:
        raise ValueError("--cycle fits all points: leave --up-to out")
    seen = stress <= (options.up_to or np.inf)
    curve = ClosureCurve(stress[seen], closure[seen], options.noise, options.cycle, compliance)
    held = stress[~seen], closure[~seen] - compliance * stress[~seen]
    return curve, None if seen.all() else held


def _shear_curves(options: argparse.Namespace) -> list[ShearCurve]:
    """The shear curves of all files, thinned to `MOST` points each."""
    normals = options.normal_stress or [None] * len(options.shear)
    if len(normals) != len(options.shear):
        raise ValueError(
            f"--normal-stress gives {len(normals)} stresses for {len(options.shear)} shear tests: "
            "give one for each"
        )
    columns = options.shear_column, options.shear_stress_column, options.normal_column
    curves = []
    for path, normal in zip(options.shear, normals, strict=True):
        test = datasets.read_shear(path, *columns, normal, options.decimal)
        n = test.shear.size
        kept = np.unique(np.linspace(0, n - 1, min(n, MOST)).round().astype(int))
        curves.append(ShearCurve(test.shear[kept], test.shear_stress[kept], test.normal))
    return curves


def _keywords(options: argparse.Namespace) -> dict[str, Any]:
    """What `fit_curves` takes besides the curves."""
    free, law = ["asperity_density"], None
    free += ["alpha", "beta"] if options.data else []
    free += ["yield_interference"] if options.cycle else []
    free += ["mu", "a", "mating_length"] if options.shear else []
    if options.free:
        free = [name.strip() for name in options.free.split(",")]
    pairs = (item.partition("=") for item in options.set)
    try:
        fixed = {name.strip(): float(value) for name, _, value in pairs}
    except ValueError:
        raise ValueError(
            f"--set {options.set}: write a name and a number each, such as alpha=3.8"
        ) from None
    if options.law:
        law = presets.load_any(options.law)
        require_rock({"mu": law.asperity.mu}, f"{options.law}: asperity.")
    return {"fixed": fixed, "free": free, "law": law}
