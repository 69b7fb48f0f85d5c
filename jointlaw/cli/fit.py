"""`jointlaw fit`: measured closure curves to laws, with report, plot and held-out errors."""

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from .. import presets
from ..calibration import datasets
from ..calibration.baselines import Comparison, compare
from ..calibration.fit import Fit, fit_closure, fit_many
from ..calibration.measured import first_loading, subtract_compliance
from ..calibration.unloading import explain_each, summed_up
from ..parameters.rock import require_rock
from ..support.checks import Array
from ..support.files import require_free
from .command import Written, add_command, add_out, quantity, write_results
from .fit_shear import add_options, fit_with_shear

OF_CLOSURE = "stress_column", "closure_column", "cycle", "noise", "compliance"
OF_SHEAR = "shear_column", "shear_stress_column", "normal_column", "normal_stress"


def add(commands: Any) -> None:
    """Add `fit` to the subparsers of the command line."""
    what = "fit the law to measured closure and shear curves; write preset, report and plot"
    example = "jointlaw fit grimsel_vd1_closure --up-to 5.3MPa --out out"
    parser = add_command(commands, "fit", what, example, _run)
    parser.description = (
        f"{what}. Only the first loading is fitted, or whole cycles with --cycle; every cycle of a "
        "file is compared with what the fitted law loses and keeps. Several closure files are "
        "fitted one by one; shear files together."
    )
    parser.add_argument(
        "data", nargs="*", metavar="CSV", help="files of stress and closure, or a shipped data set"
    )
    parser.add_argument("--stress-column", help="name and unit of that column, such as sigmaZ:MPa")
    parser.add_argument("--closure-column", help="name and unit of that column, such as Disp:mm")
    add_options(parser)
    parser.set_defaults(wait="with shear tests it takes half a minute to some minutes")
    parser.add_argument(
        "--up-to", help="fit up to this stress, predict the rest: 5.3MPa; or half, of the largest"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="hold a parameter at a value in SI units, such as alpha=3.8; repeatable",
    )
    parser.add_argument(
        "--compliance",
        metavar="LENGTH/STRESS",
        help="of rock and machine, such as 4.2um/10MPa, or a file of stress and closure measured "
        "without a joint: it is subtracted first",
    )
    parser.add_argument(
        "--cycle",
        action="store_true",
        help="fit all cycles of a file, unloading too, yield_interference among the parameters",
    )
    parser.add_argument(
        "--free",
        metavar="NAMES",
        help="parameters to fit, with commas between; default asperity_density, of closure tests "
        "alpha and beta, with --cycle yield_interference, of shear tests mu, a and critical_slip",
    )
    parser.add_argument(
        "--law", metavar="PRESET_OR_FILE", help="the values of parameters that are not fitted"
    )
    parser.add_argument(
        "--formation",
        choices=("individual", "population"),
        help="default: that of --law, or individual",
    )
    parser.add_argument("--noise", type=float, help="known error of the stress, such as 0.01")
    parser.add_argument("--workers", type=int, help="processes for several files")
    add_out(parser)


def _run(options: argparse.Namespace) -> None:
    if (options.shear and len(options.data) > 1) or not (options.shear or options.data):
        raise ValueError(
            f"{len(options.data)} closure files: give one or more, or shear tests after --shear "
            "with one closure file or none"
        )
    _require_used(options)
    folders = _folders(options)
    tests = [_read(options, item) for item in options.data]
    keywords = _keywords(options)
    compliance = _compliance(options)
    alone = [
        datasets.ClosureData(stress, subtract_compliance(stress, closure, compliance))
        for stress, closure in tests
    ]
    if options.cycle and options.up_to:
        raise ValueError("--cycle fits all points: leave --up-to out")
    loading = [test if options.cycle else first_loading(*test)[:2] for test in tests]
    if options.shear:
        closed = datasets.ClosureData(*loading[0]) if loading else None
        fit, about = fit_with_shear(options, closed, compliance, keywords)
        names = ", ".join(Path(item).name for item in [*options.data, *options.shear])
        _write(options.out, options.format, names, fit, alone[0] if alone else None, None, about)
        return
    limits = [_limit(options.up_to, stress) for stress, _ in loading]
    seen = [(s[s <= limit], u[s <= limit]) for (s, u), limit in zip(loading, limits, strict=True)]
    if len(seen) > 1:
        fits = fit_many(seen, workers=options.workers, compliance=compliance, **keywords)
    else:
        fits = [fit_closure(*seen[0], compliance=compliance, **keywords)]
    for k, fit in enumerate(fits):
        stress, closure = first_loading(*alone[k])[:2]
        held = (
            compare(stress, closure, limits[k], **keywords) if (stress > limits[k]).any() else None
        )
        name = Path(options.data[k]).name
        _write(folders[k], options.format, name, fit, alone[k], held)


def _require_used(options: argparse.Namespace) -> None:
    """Refuse options about tests that are not given."""
    for tests, place, names in (
        (options.data, "a closure test: name its file before --shear", OF_CLOSURE),
        (options.shear, "direct shear tests: name their files after --shear", OF_SHEAR),
    ):
        for name in names:
            value = getattr(options, name)
            if not tests and value is not None and value is not False:
                raise ValueError(f"--{name.replace('_', '-')} is about {place}, or leave it out")


def _folders(options: argparse.Namespace) -> list[Path]:
    """One folder for the results of each file, named after it when there are several."""
    if len(options.data) == 1:
        return [options.out]
    items: dict[str, str] = {}
    for item in options.data:
        if (other := items.setdefault(Path(item).stem, item)) is not item:
            raise ValueError(
                f"{other} and {item} would both be written to {options.out / Path(item).stem}; "
                "rename one, or fit them one at a time"
            )
    folders = [options.out / stem for stem in items]
    for folder in folders:
        if not options.force:
            require_free(folder)
    return folders


def _write(
    folder: Path,
    picture_format: str,
    name: str,
    fit: Fit,
    test: datasets.ClosureData | None,
    held: Comparison | None,
    about: str = "",
) -> None:
    require_rock(fit.parameters, f"{name}: the fitted ")
    text = f"{fit.report()}{about}\n"
    summary: dict[str, Any] = {
        "data": name,
        "parameters_SI": fit.parameters,
        "standard_error_SI": fit.standard_error,
        "identifiable": list(fit.identifiable),
        "not_identifiable": fit.not_identifiable,
    }
    if held is not None:
        text += _held_out(held)
        summary["error_at_largest_stress"] = {n: float(e[-1]) for n, e in held.errors.items()}
    if test is not None and first_loading(*test)[2].size >= 3:
        try:
            loops = explain_each(fit.law, *test)
            text += f"\n## Unloading\n\n{summed_up(loops)}\n"
            summary |= {"unloading": vars(loops[0]), "cycles": [vars(loop) for loop in loops]}
        except ValueError as error:  # the fit is not lost for it
            text += f"\n## Unloading\n\nNot compared with the law: {error}.\n"
            print(f"unloading is not compared: {error}", file=sys.stderr)
    print(text)
    points = None if held is None else (held.stress, held.closure)
    files: Written = {
        "fit.png": partial(fit.plot, held_out=points),
        "law.toml": partial(fit.to_toml, title=f"Fit to {name}"),
        "report.md": text,
    }
    write_results(folder, files, summary, picture_format)


def _held_out(held: Comparison) -> str:
    low, high = held.band
    inside = (low <= held.stress) & (held.stress <= high)
    return (
        f"\n## Held out: {held.stress.size} points above {held.limit / 1e6:.4g} MPa\n\n"
        f"{held.table()}\n\nThe 95 % band of the law covers {int(inside.sum())} of "
        f"{inside.size} of them, at the largest stress from "
        f"{100 * (low[-1] / held.stress[-1] - 1):+.1f} to "
        f"{100 * (high[-1] / held.stress[-1] - 1):+.1f} % of it.\n"
    )


def _read(options: argparse.Namespace, item: str) -> datasets.ClosureData:
    if item in datasets.names() and not Path(item).exists():
        return datasets.load(item)
    return datasets.read_closure(item, options.stress_column, options.closure_column)


def _compliance(options: argparse.Namespace) -> float | tuple[Array, Array]:
    """That of rock and machine, as `ClosureCurve` takes it."""
    text = options.compliance
    if text is None:
        return 0.0
    if "/" in text and not Path(text).exists():
        length, _, load = text.partition("/")
        pressed = quantity("--compliance", load, "Pa", positive=True)
        return quantity("--compliance", length, "m") / pressed
    rock = datasets.read_closure(text, options.stress_column, options.closure_column)
    return rock.stress, rock.closure


def _limit(text: str | None, stress: Any) -> float:
    if text is None:
        return float("inf")
    return 0.5 * float(np.max(stress)) if text == "half" else quantity("--up-to", text, "Pa")


def _keywords(options: argparse.Namespace) -> dict[str, Any]:
    fixed = {}
    for item in options.set:
        name, _, value = item.partition("=")
        try:
            fixed[name.strip()] = float(value)
        except ValueError:
            raise ValueError(
                f"--set {item!r}: write a name and a number, such as alpha=3.8"
            ) from None
    keywords: dict[str, Any] = {"fixed": fixed, "formation": options.formation}
    keywords["free"] = (
        tuple(name.strip() for name in options.free.split(","))
        if options.free
        else ("asperity_density",)
        + (("alpha", "beta") if options.data else ())
        + (("yield_interference",) if options.cycle else ())
        + (("mu", "a", "critical_slip") if options.shear else ())
    )
    if options.law:
        keywords["law"] = law = presets.load_any(options.law)
        require_rock({"mu": law.asperity.mu}, f"{options.law}: asperity.")
    if options.noise is not None:
        keywords["noise"] = options.noise
    if options.cycle:
        keywords["cycle"] = True
    return keywords
