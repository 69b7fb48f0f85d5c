"""`jointlaw export`: a law as files for a host code."""

import argparse
from pathlib import Path

from ..hosts.c.export import export_c, identifier
from ..hosts.fem.export import SEATING, export_fem, require_seating
from ..hosts.lammps.export import export_lammps
from ..hosts.yade.export import export_yade
from ..laws.joint_law import JointLaw
from ..support.files import clear_run
from .command import LAW, OUT, Command, in_unit, option, read_law

START = {
    "yade": "yade -n -x settle_and_incline.py",
    "c": "make && ./example",
    "fem": "make",
    "lammps": "./build.sh && lmp -in in.tower",
}


def _export(options: argparse.Namespace) -> None:
    law, host, folder = read_law(options), options.host, options.out
    if options.shear_limit and host != "yade":
        raise ValueError(
            f"--shear-limit shapes a table for YADE; {host} runs the law itself: leave it out"
        )
    seating = {} if options.seating is None else {"seating": options.seating}
    if seating and host != "fem":
        raise ValueError(f"--seating is for fem; in {host} the host closes the joint: leave it out")
    require_seating(**seating)
    clear_run(folder)
    if host == "yade":
        _export_table(law, folder, options.shear_limit)
    else:
        export = {"c": export_c, "lammps": export_lammps, "fem": export_fem}[host]
        files = export(law, folder, identifier(Path(options.law).stem), **seating)
        print(f"wrote {', '.join(files)}")
    print(f"run: cd {folder} && {START[host]}")


def _export_table(law: JointLaw, folder: Path, shear_limit: float | None) -> None:
    """Write the joint for YADE, and print what its table drops."""
    table = export_yade(law, folder, shear_limit=shear_limit)
    missed = table.metadata["resolution_error_friction_angle"]
    print(
        f"wrote the joint for YADE to {folder}: {len(table.closure)} rows\n"
        f"its friction angle at the shear limit is {missed:.2g} degrees off that of finer nodes\n"
        f"bond: {table.metadata['bond']}; what the table drops (error against the law, share of\n"
        f"each path's largest traction):\n{table.report(law)}"
    )


COMMAND = Command(
    "export",
    "write a law for a host code: table, adapter and scripts in one folder",
    "jointlaw export yade jing-replica --out joint-for-yade",
    _export,
    (
        option(
            "host", choices=tuple(START), help="the host code; c: also C++; fem: finite elements"
        ),
        *LAW,
        option(
            "--shear-limit",
            metavar="LENGTH",
            type=in_unit("m", positive=True),
            help="yade: shear at which the friction of the table is read, such as 5um",
        ),
        option(
            "--seating",
            metavar="STRESS",
            type=in_unit("Pa"),
            help=f"fem: normal stress before the first step (default {SEATING / 1e3:g}kPa)",
        ),
        *OUT,
    ),
)
