"""`jointlaw scan`: a scanned surface to orientation and heights, with report and picture."""

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
    what = "read heights, directions and number of asperities off a scanned surface"
    example = "jointlaw scan scan.csv --spacing 20um --height-unit um --out out"
    parser = add_command(commands, "scan", what, example, _run)
    parser.description = f"{what}. Give the composite surface of both sides, or a profile."
    parser.add_argument("file", help="CSV, NPY, or a format of SurfaceTopography (extra scan)")
    length = in_unit("m", positive=True)
    parser.add_argument(
        "--spacing", type=length, help="of the points, such as 20um; needed for CSV and NPY"
    )
    parser.add_argument("--height-unit", help="of CSV and NPY, such as um")
    parser.add_argument(
        "--sampling-length", type=length, help="edge of a facet (default 4 spacings)"
    )
    add_out(parser)


def _run(options: argparse.Namespace) -> None:
    unit = options.height_unit
    factor = None if unit is None else quantity("--height-unit", f"1{unit}", "m")
    z, spacing = read_scan(options.file, options.spacing, factor)
    fit = from_surface(z, spacing, options.sampling_length)
    require_rock(fit.parameters, f"{Path(options.file).name}: the fitted ")
    text = fit.report()
    print(text)
    summary = {
        "parameters_SI": fit.parameters,
        "standard_error_SI": fit.standard_error,
        "sampling_length_m": fit.sampling_length,
        "summits": int(fit.asperities.depth.size),
        "facets": len(fit.asperities.slope),
        "identifiable": list(fit.identifiable),
        "not_identifiable": fit.not_identifiable,
        "warnings": fit.warnings,
    }
    toml = _toml(fit, Path(options.file).name)
    files: Written = {"scan.png": fit.plot, "surface.toml": toml, "report.md": text}
    write_results(options.out, files, summary, options.format)


def _toml(fit: SurfaceFit, name: str) -> str:
    """The part of a law file that a scan knows; stiffness and friction are left to add."""
    p = fit.parameters
    density = "" if fit.is_profile else f"asperity_density = {p['asperity_density']!r}  # 1/m2\n"
    clean = name.replace("\\", "/").replace('"', "'")
    return (
        f"# From {clean}, sampling length {fit.sampling_length:.4g} m. To make it a law, add\n"
        "# asperity_density if it is missing, and [asperity] with K, lam, eta and mu.\n"
        f"version = {VERSION}\n"
        f"{density}\n[orientation]\na = {max(p['a'], 1.0)!r}\nb = {p['b']!r}\nc = {p['c']!r}\n\n"
        f"[heights]\nalpha = {p['alpha']!r}\nbeta = {p['beta']!r}  # m\n"
        f'overlap = {p["overlap"]!r}  # m\nformation = "individual"\n'
    )
