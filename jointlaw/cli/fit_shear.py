"""`jointlaw fit --shear`: direct shear files, alone or with a closure test, to one law."""

import argparse
import math
from typing import Any

import numpy as np

from ..calibration import datasets
from ..calibration.fit import Fit, fit_curves
from ..calibration.measured import ClosureCurve, ShearCurve
from ..parameters.rock import require_rock
from ..support.checks import Array
from .command import quantity

MOST = 60  # points of a curve that are fitted: a logger writes thousands, and each costs a step


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that name shear files and what is in them."""
    parser.add_argument(
        "--shear",
        nargs="+",
        metavar="CSV",
        default=[],
        help="direct shear tests at constant normal stress: shear displacement and shear stress; "
        "the normal stress is that of a title 'tau at 3 MPa [MPa]', of a column, or of "
        "--normal-stress. One law is fitted to all of them and to the closure test, if one is "
        "given before",
    )
    parser.add_argument("--shear-column", help="name and unit of that column, such as us:mm")
    parser.add_argument("--shear-stress-column", help="name and unit of that column: tau:MPa")
    parser.add_argument("--normal-column", help="name and unit of that column: sn:MPa")
    parser.add_argument(
        "--normal-stress", metavar="STRESSES", help="of the shear tests in their order: 1MPa,3MPa"
    )


def fit_with_shear(
    options: argparse.Namespace,
    test: datasets.ClosureData | None,
    compliance: float | tuple[Array, Array],
    keywords: dict[str, Any],
) -> tuple[Fit, str]:
    """One law for all shear tests and a first loading or cycle; with it, in words, what was read.

    test: stress (Pa) and closure (m), or None; compliance: of rock and machine, as in
    `ClosureCurve`; keywords: as for `fit_closure`.
    """
    if options.up_to:
        raise ValueError("--up-to holds back a part of one closure test: leave it out with --shear")
    curves, about = _curves(options)
    noise, cycle = keywords.pop("noise", None), keywords.pop("cycle", False)
    if test is not None:
        curves.insert(0, ClosureCurve(*test, noise=noise, cycle=cycle, compliance=compliance))
    return fit_curves(curves, **keywords), about


def _curves(options: argparse.Namespace) -> tuple[list[ClosureCurve | ShearCurve], str]:
    """The shear curves of all files, and what was read in words."""
    known = options.normal_stress is not None
    named = (options.shear_column, options.shear_stress_column, options.normal_column, known)
    tests = [test for path in options.shear for test in datasets.read_shear(path, *named)]
    normals = [test.normal for test in tests]
    if known:
        given = options.normal_stress.split(",")
        if len(given) != len(tests):
            raise ValueError(
                f"--normal-stress gives {len(given)} stresses for {len(tests)} shear tests, "
                f"{'; '.join(test.name for test in tests)}: give one for each"
            )
        normals = [quantity("--normal-stress", text, "Pa", positive=True) for text in given]
    curves: list[ClosureCurve | ShearCurve] = []
    lines = ["", "Shear tests:", ""]
    for test, normal in zip(tests, normals, strict=True):
        if math.isnan(normal):
            raise ValueError(
                f"{test.name}: at which normal stress? No column or title says; give that of all "
                f"{len(tests)} shear tests, for example --normal-stress "
                + ",".join(f"{2 * k + 1}MPa" for k in range(len(tests)))
            )
        peak = float(np.abs(test.shear_stress).max())
        require_rock({"peak shear stress over normal stress": peak / normal}, f"{test.name}: ")
        n = test.shear.size
        kept = np.unique(np.linspace(0, n - 1, min(n, MOST)).round().astype(int))
        curves.append(ShearCurve(test.shear[kept], test.shear_stress[kept], normal))
        lines.append(f"- {test.name}: {normal / 1e6:.4g} MPa, {kept.size} of {n} points fitted")
    return curves, "\n".join(lines)
