"""`jointlaw scan`: orientation and heights of asperities from a scanned surface."""

import argparse
import math
from pathlib import Path
from typing import Any

from ..laboratory.experiments import direct_shear
from ..parameters.rock import ROCK, require_rock
from ..parameters.toml import VERSION
from ..support.checks import Array
from ..support.markdown import table
from ..support.text_numbers import DECIMAL_MARKS
from ..surface.fit import SAMPLES, SurfaceFit, from_surface
from ..surface.scan_files import read_scan
from .command import DEFAULT_ROCK, JSON, OUT, Command, Contents, option, quantity, write_results

REPORT_STRESS = 1e6  # Pa, normal stress of the friction angles in the report
SAMPLING_LENGTH_RATIO = 2  # second sampling length of the report over the first


def _run(options: argparse.Namespace) -> None:
    name = Path(options.file).name
    z = read_scan(options.file, options.height_unit, options.spacing, options.decimal)
    fit = from_surface(z, options.spacing, options.sampling_length)
    require_rock(fit.parameters, f"{name}: the fitted ")
    text = fit.report() + _report_friction(fit, z)
    summary: dict[str, Any] = {
        "parameters_SI": fit.parameters,
        "standard_error_SI": {
            name: estimate.standard_error for name, estimate in fit.estimates.items()
        },
        "sampling_length_m": fit.asperities.size,
        "not_identifiable": fit.not_identifiable,
    }
    files: Contents = {"surface.toml": _surface_toml(fit, name), "report.md": text}
    write_results(options, files, summary, text)


def _report_friction(fit: SurfaceFit, z: Array) -> str:
    """Markdown table of friction angles of the surface at two sampling lengths.

    The second is the first times SAMPLING_LENGTH_RATIO; a length at which asperities cannot be
    fitted has the reason in its row.
    """
    rows = []
    for length in (fit.asperities.size, SAMPLING_LENGTH_RATIO * fit.asperities.size):
        try:
            resampled = from_surface(z, fit.spacing, length)
            angles = _friction_angles(resampled)
        except ValueError as error:
            rows.append(f"{1e3 * length:.3g} | {error} | |")
        else:
            rows.append(f"{1e3 * length:.3g} | {resampled.orientation.a:.3g} | {angles}")
    introduction = (
        f"Friction angle of a joint with this surface at {REPORT_STRESS / 1e6:g} MPa, sheared by "
        f"one sampling length, with contacts of an assumed rock ({DEFAULT_ROCK}):"
    )
    head = "sampling length (mm) | a | along the rows | across the rows"
    return "\n".join(["", introduction, "", *table(head, rows), ""])


def _friction_angles(fit: SurfaceFit) -> str:
    """Cells with the friction angle along and across the rows of the scan (Markdown)."""
    if not fit.orientation_is_representative:
        return " | ".join(["not estimated: the law does not represent this surface, see Z2"] * 2)
    cells = []
    for plane in (0.0, math.pi / 2):
        joint = fit.law(ROCK, plane=plane).joint()
        record = direct_shear(joint, fit.asperities.size, REPORT_STRESS, steps=100)
        cells.append(f"{record.peak_friction_angle:.1f}°")
    return " | ".join(cells)


def _surface_toml(fit: SurfaceFit, name: str) -> str:
    """A parameter file without contacts: their stiffness and friction are left to the user."""
    p = fit.parameters
    return (
        f"# From {name!a}, sampling length {fit.asperities.size:.4g} m. To complete the law, add\n"
        "# [asperity] with K, lam, eta and mu; or use the option --default-rock of the commands.\n"
        f"version = {VERSION}\n"
        f"asperity_density = {p['asperity_density']!r}  # 1/m2\n"
        f"\n[orientation]\na = {p['a']!r}\nb = {p['b']!r}\nc = {p['c']!r}\n\n"
        f"[heights]\nalpha = {p['alpha']!r}\nbeta = {p['beta']!r}  # m\n"
        f'overlap = {p["overlap"]!r}  # m\nformation = "individual"\n'
    )


COMMAND = Command(
    "scan",
    "estimate heights, orientations and density of asperities from a scanned composite surface",
    "jointlaw scan scan.csv --spacing 20um --height-unit um --out out",
    _run,
    (
        option(
            "file",
            metavar="FILE",
            help="matrix of heights, or list of x, y, z, as text, ASC or NPY",
        ),
        option(
            "--spacing",
            metavar="LENGTH",
            type=quantity("m", positive=True),
            required=True,
            help="distance of neighbouring points, such as 20um",
        ),
        option(
            "--height-unit",
            metavar="UNIT",
            type=lambda unit: quantity("m")(f"1{unit}"),
            required=True,
            help="unit of the heights, such as um",
        ),
        option(
            "--decimal",
            choices=tuple(DECIMAL_MARKS),
            help="decimal mark, if no number of the file shows it",
        ),
        option(
            "--sampling-length",
            metavar="LENGTH",
            type=quantity("m", positive=True),
            help=f"edge length of a facet (default {SAMPLES} spacings)",
        ),
        *OUT,
        JSON,
    ),
)
