"""`jointlaw scan`: a scanned surface to orientation and heights, with a report."""

import argparse
from pathlib import Path
from typing import Any

from ..parameters.rock import require_rock
from ..parameters.toml import VERSION
from ..surface.fit import SurfaceFit, from_surface
from ..surface.scan_files import read_scan
from .command import Written, add_command, add_out, in_unit, quantity, write_results


def add(commands: Any) -> None:
    """Add `scan` to the subparsers of the command line."""
    what = "read heights, directions and number of asperities off a composite surface"
    example = "jointlaw scan scan.csv --spacing 20um --height-unit um --out out"
    parser = add_command(commands, "scan", what, example, _run)
    parser.add_argument("file", help="a matrix of heights, CSV or NPY")
    length = in_unit("m", positive=True)
    parser.add_argument("--spacing", type=length, required=True, help="of the points: 20um")
    parser.add_argument("--height-unit", help="of the heights, such as um")
    parser.add_argument("--sampling-length", type=length, help="edge of a facet: 4 spacings")
    add_out(parser, pictures=False)


def _run(options: argparse.Namespace) -> None:
    if options.height_unit is None:
        raise ValueError(
            f"{options.file}: gives no unit of its heights; name it, such as --height-unit um"
        )
    z = read_scan(options.file, quantity("--height-unit", f"1{options.height_unit}", "m"))
    fit = from_surface(z, options.spacing, options.sampling_length)
    require_rock(fit.parameters, f"{Path(options.file).name}: the fitted ")
    print(fit.report())
    summary = {
        "parameters_SI": fit.parameters,
        "standard_error_SI": fit.standard_error,
        "sampling_length_m": fit.asperities.size,
        "identifiable": list(fit.identifiable),
        "not_identifiable": fit.not_identifiable,
    }
    files: Written = {
        "surface.toml": _toml(fit, Path(options.file).name),
        "report.md": fit.report(),
    }
    write_results(options.out, files, summary, "")


def _toml(fit: SurfaceFit, name: str) -> str:
    """The part of a law file that a scan knows; stiffness and friction are left to add."""
    p = fit.parameters
    return (
        f"# From {name!a}, sampling length {fit.asperities.size:.4g} m. To make it a law, add\n"
        "# [asperity] with K, lam, eta and mu.\n"
        f"version = {VERSION}\n"
        f"asperity_density = {p['asperity_density']!r}  # 1/m2\n"
        f"\n[orientation]\na = {p['a']!r}\nb = {p['b']!r}\nc = {p['c']!r}\n\n"
        f"[heights]\nalpha = {p['alpha']!r}\nbeta = {p['beta']!r}  # m\n"
        f'overlap = {p["overlap"]!r}  # m\nformation = "individual"\n'
    )
