"""`jointlaw scan`: orientation and heights of asperities from a scanned surface."""

import argparse
import io
import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from ..laboratory.experiments import direct_shear
from ..parameters.rock import ROCK, require_rock
from ..parameters.toml import VERSION
from ..support.checks import Array
from ..support.files import replace_file
from ..support.markdown import table
from ..support.text_numbers import DECIMAL_MARKS
from ..surface.faces import MIRRORS, join_faces
from ..surface.fit import SAMPLES, SurfaceFit, from_surface
from ..surface.scan_files import read_scan
from .command import (
    DEFAULT_ROCK,
    JSON,
    OUT,
    PICTURE_FORMAT,
    Command,
    Contents,
    new_about,
    option,
    quantity,
    write_results,
)

REPORT_STRESS = 1e6  # Pa, normal stress of the friction angles in the report
SAMPLING_LENGTH_RATIO = 2  # second sampling length of the report over the first


def _run(options: argparse.Namespace) -> None:
    name = Path(options.file).name
    z = read_scan(options.file, options.height_unit, options.spacing, options.decimal)
    if options.mirror and not options.upper:
        raise ValueError("--mirror is about two faces: name the upper one after --upper")
    faces = None
    if options.upper:
        upper = read_scan(options.upper, options.height_unit, options.spacing, options.decimal)
        faces = join_faces(z, upper, options.spacing, options.mirror)
        z = faces.z
        name += f" and {Path(options.upper).name}"
    fit = from_surface(z, options.spacing, options.sampling_length)
    require_rock(fit.parameters, f"{name}: the fitted ")
    text = fit.report() + _report_friction(fit, z)
    if faces is not None:
        text += f"\n{faces.describe()}\n"
    summary: dict[str, Any] = {
        "parameters_SI": fit.parameters,
        "standard_error_SI": {
            name: estimate.standard_error for name, estimate in fit.estimates.items()
        },
        "sampling_length_m": fit.asperities.size,
        "not_identifiable": fit.not_identifiable,
    }
    inputs = [options.file, *([options.upper] if options.upper else [])]
    about = new_about(options, inputs, _warnings(fit), _origin(fit))
    summary["warnings"] = about.warnings
    files: Contents = {
        "surface.toml": f"{_surface_toml(fit, name)}\n{about.to_toml()}",
        "report.md": text,
        "scan.png": fit.plot,
    }
    if faces is not None:
        summary["faces"] = {
            "mirror": faces.mirror,
            "shift_m": faces.shift,
            "rotation_rad": faces.rotation,
            "correlation": faces.correlation,
        }
        files = {**files, "composite.npy": partial(_save_heights, z=z)}
    write_results(options, files, summary, text)


def _warnings(fit: SurfaceFit) -> Iterator[str]:
    """Yield the caveats of a law with these asperities."""
    yield f"asperities of a sampling length of {1e3 * fit.asperities.size:.4g} mm"
    yield from fit.warnings
    for name, reason in fit.not_identifiable.items():
        yield f"{name} is not identifiable from the scan: {reason}"


def _origin(fit: SurfaceFit) -> dict[str, str]:
    """Origin of the parameters that a scan determines."""
    return {
        name: f"measured on the scan, standard error {estimate.standard_error:.2g}"
        for name, estimate in fit.estimates.items()
    }


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


def _save_heights(path: Path, z: Array) -> None:
    """Write heights in m as an NPY file."""
    buffer = io.BytesIO()
    np.save(buffer, z)
    replace_file(path, buffer.getvalue())


COMMAND = Command(
    "scan",
    "estimate heights, orientations and density of asperities from a scanned composite surface",
    "jointlaw scan scan.csv --spacing 20um --height-unit um --out out",
    _run,
    (
        option(
            "file",
            metavar="FILE",
            help="matrix of heights of the composite surface, or list of x, y, z, as text, ASC or "
            "NPY; with --upper, of the lower face",
        ),
        option(
            "--upper",
            metavar="FILE",
            help="the other face of the joint, scanned likewise from outside its block: it is "
            "turned over and aligned with FILE, and both are added",
        ),
        option(
            "--mirror",
            choices=tuple(MIRRORS),
            help="how the grid of the upper face is turned over (default: the way that fits best)",
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
        PICTURE_FORMAT,
    ),
)
