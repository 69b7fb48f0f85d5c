"""`jointlaw scan`: a scanned surface to orientation and heights, with a report."""

import argparse
import math
from pathlib import Path

from ..laboratory.experiments import direct_shear
from ..parameters.rock import ROCK, require_rock
from ..parameters.toml import VERSION
from ..support.checks import Array
from ..support.markdown import table
from ..support.text_numbers import DECIMAL_MARKS
from ..surface.fit import SAMPLES, SurfaceFit, from_surface
from ..surface.scan_files import read_scan
from .command import DEFAULT_ROCK, OUT, Command, Written, in_unit, option, write_results

STRESS = 1e6  # Pa at which the report tells friction angles
LONGER = 2  # the second sampling length, over the first


def _run(options: argparse.Namespace) -> None:
    z = read_scan(options.file, options.height_unit, options.spacing, options.decimal)
    fit = from_surface(z, options.spacing, options.sampling_length)
    require_rock(fit.parameters, f"{Path(options.file).name}: the fitted ")
    text = fit.report() + _friction(fit, z)
    print(text)
    summary = {
        "parameters_SI": fit.parameters,
        "standard_error_SI": {name: one.standard_error for name, one in fit.estimates.items()},
        "sampling_length_m": fit.asperities.size,
        "not_identifiable": fit.not_identifiable,
    }
    files: Written = {"surface.toml": _toml(fit, Path(options.file).name), "report.md": text}
    write_results(options.out, files, summary, "")


def _friction(fit: SurfaceFit, z: Array) -> str:
    """What the scan means for friction, at its sampling length and at a longer one (Markdown)."""
    rows = []
    for length in (fit.asperities.size, LONGER * fit.asperities.size):
        try:
            one = from_surface(z, fit.spacing, length)
            cells = ["not told: the law does not describe this surface, see Z2"] * 2
            if one.orientation_is_representative:
                joints = (one.law(ROCK, plane=plane).joint() for plane in (0.0, math.pi / 2))
                tests = (direct_shear(j, one.asperities.size, STRESS, steps=100) for j in joints)
                cells = [f"{test.peak_friction_angle:.1f}°" for test in tests]
        except ValueError as error:
            rows.append(f"{1e3 * length:.3g} | {error} | |")
        else:
            rows.append(f"{1e3 * length:.3g} | {one.orientation.a:.3g} | {' | '.join(cells)}")
    what = (
        f"Friction angle of a joint of this surface at {STRESS / 1e6:g} MPa, sheared by one "
        f"sampling length, with contacts of an assumed rock ({DEFAULT_ROCK}):"
    )
    head = "sampling length (mm) | a | along the rows | across them"
    return "\n".join(["", what, "", *table(head, rows), ""])


def _toml(fit: SurfaceFit, name: str) -> str:
    """The part of a law file that a scan knows; stiffness and friction are left to add."""
    p = fit.parameters
    return (
        f"# From {name!a}, sampling length {fit.asperities.size:.4g} m. To make it a law, add\n"
        "# [asperity] with K, lam, eta and mu; or give commands --default-rock.\n"
        f"version = {VERSION}\n"
        f"asperity_density = {p['asperity_density']!r}  # 1/m2\n"
        f"\n[orientation]\na = {p['a']!r}\nb = {p['b']!r}\nc = {p['c']!r}\n\n"
        f"[heights]\nalpha = {p['alpha']!r}\nbeta = {p['beta']!r}  # m\n"
        f'overlap = {p["overlap"]!r}  # m\nformation = "individual"\n'
    )


COMMAND = Command(
    "scan",
    "read heights, directions and number of asperities off a composite surface",
    "jointlaw scan scan.csv --spacing 20um --height-unit um --out out",
    _run,
    (
        option("file", help="matrix of heights or list of x, y, z, as text, ASC or NPY"),
        option(
            "--spacing",
            type=in_unit("m", positive=True),
            required=True,
            help="of the points: 20um",
        ),
        option(
            "--height-unit",
            type=lambda unit: in_unit("m")(f"1{unit}"),
            required=True,
            help="of the heights, such as um",
        ),
        option("--decimal", choices=tuple(DECIMAL_MARKS), help="the decimal mark of the file"),
        option(
            "--sampling-length",
            type=in_unit("m", positive=True),
            help=f"edge of a facet (default {SAMPLES} spacings)",
        ),
        *OUT,
    ),
)
