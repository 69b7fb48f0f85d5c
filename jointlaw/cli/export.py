"""`jointlaw export`: a law as files for a host code."""

import argparse
from pathlib import Path
from typing import Any

from ..hosts.c.export import export_c, identifier
from ..hosts.fem.export import SEATING, export_fem, require_seating
from ..hosts.lammps.export import export_lammps
from ..hosts.yade.export import export_yade
from ..laws.joint_law import JointLaw
from ..support.files import clear_run
from ..tables.tabulate import require_3d
from .command import add_command, add_law, add_out, in_unit, read_law

HOSTS = {  # what is written, and what runs it
    "yade": ("for YADE: table, law, adapter, script", "yade -n -x settle_and_incline.py"),
    "c": ("for C, C++ and Fortran: one header, tables, examples", "make && ./example"),
    "fem": ("for finite elements: MGIS, UMAT, shear tests in OpenGeoSys and Kratos", "make"),
    "lammps": ("for LAMMPS: a pair style, an input script", "./build.sh && lmp -in in.tower"),
}


def add(commands: Any) -> None:
    """Add the subcommand to the command line, with one of its own for each host."""
    what = "write a law for a host code: all that it needs, in one folder"
    parser = add_command(commands, "export", what, _example("lammps"), _export)
    hosts = parser.add_subparsers(dest="host", required=True, metavar="HOST")
    for host, (about, _) in HOSTS.items():
        one = add_command(hosts, host, f"write a law {about}", _example(host), _export)
        add_law(one)
        if host == "yade":
            one.add_argument(
                "--shear-limit",
                metavar="LENGTH",
                type=in_unit("m", positive=True),
                help="shear at which the friction of the table is read, such as 5um",
            )
        if host == "fem":
            one.add_argument(
                "--seating",
                metavar="STRESS",
                type=in_unit("Pa"),
                default=SEATING,
                help=f"normal stress before the first step (default {SEATING / 1e3:g}kPa)",
            )
        add_out(one, pictures=False)


def _example(host: str) -> str:
    return f"jointlaw export {host} jing-replica --out joint-for-{host}"


def _export(options: argparse.Namespace) -> None:
    law, host, folder = read_law(options), options.host, options.out
    if host in ("yade", "lammps"):
        require_3d(law, f"motion in {host.upper()}")
    seating = {"seating": options.seating} if host == "fem" else {}
    require_seating(**seating)
    clear_run(folder)
    if host == "yade":
        _export_table(law, folder, options.shear_limit)
    else:
        export = {"c": export_c, "lammps": export_lammps, "fem": export_fem}[host]
        files = export(law, folder, identifier(Path(options.law).stem), **seating)
        print(f"wrote {', '.join(files)}")
    print(f"run: cd {folder} && {HOSTS[host][1]}")


def _export_table(law: JointLaw, folder: Path, shear_limit: float | None) -> None:
    """Write the joint for YADE, and print what its table drops."""
    more: dict[str, Any] = {} if shear_limit is None else {"shear_limit": shear_limit}
    table = export_yade(law, folder, tolerance=1e-3, **more)
    missed = table.metadata["resolution_error_friction_angle"]
    print(
        f"wrote the joint for YADE to {folder}: {len(table.closure)} rows\n"
        f"its friction angle at the shear limit is {missed:.2g} degrees off that of finer nodes\n"
        f"bond: {table.metadata['bond']}; what the table drops (error against the law, share of\n"
        f"each path's largest traction):\n{table.report(law)}"
    )
