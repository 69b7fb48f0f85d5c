"""`jointlaw export`: a law as files for a host code."""

import argparse
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from ..hosts.c.export import export_c, identifier
from ..hosts.fem.export import SEATING, export_fem
from ..hosts.lammps.export import export_lammps
from ..hosts.yade.export import export_yade
from ..support.files import clear_run
from .command import LAW, OUT, Command, Option, in_unit, option, read_law

START = {
    "yade": "yade -n -x settle_and_incline.py",
    "c": "make && ./example",
    "fem": "make",
    "lammps": "./build.sh && lmp -in in.tower",
}


def _export(options: argparse.Namespace) -> None:
    law, host, folder = read_law(options), options.host, options.out
    with TemporaryDirectory() as whole:  # a law that is refused leaves the folder as it was
        if host == "yade":
            table = export_yade(law, whole, shear_limit=options.shear_limit)
            missed = table.metadata["resolution_error_friction_angle"]
            told = (
                f"wrote the joint for YADE, a table of {len(table.closure)} rows\n"
                f"its friction angle at the shear limit is {missed:.2g} degrees off that of finer "
                f"nodes\nbond: {table.metadata['bond']}; what the table drops (error against the "
                f"law, share of\neach path's largest traction):\n{table.report(law)}"
            )
        else:
            export = {"c": export_c, "lammps": export_lammps, "fem": export_fem}[host]
            seating = {"seating": options.seating} if host == "fem" else {}
            files = export(law, whole, identifier(Path(options.law).stem), **seating)
            told = f"wrote {', '.join(files)}"
        clear_run(folder)
        for file in Path(whole).iterdir():
            shutil.copy(file, folder)
    print(f"{told}\nrun: cd {folder} && {START[host]}")


def _example(host: str) -> str:
    return f"jointlaw export {host} jing-replica --out joint-for-{host}"


def _host(host: str, about: str, *own: Option) -> Command:
    """The command for one host, with options of its own."""
    return Command(host, f"write a law {about}", _example(host), _export, (*LAW, *own, *OUT))


COMMAND = Command(
    "export",
    "write a law for a host code: all that it needs, in one folder",
    _example("lammps"),
    _export,
    parts=(
        _host(
            "yade",
            "for YADE: table, law, adapter, script",
            option(
                "--shear-limit",
                metavar="LENGTH",
                type=in_unit("m", positive=True),
                help="shear at which the friction of the table is read, such as 5um",
            ),
        ),
        _host("c", "for C, C++ and Fortran: one header, tables, examples"),
        _host(
            "fem",
            "for finite elements: MGIS, UMAT, shear tests in OpenGeoSys and Kratos",
            option(
                "--seating",
                metavar="STRESS",
                type=in_unit("Pa"),
                default=SEATING,
                help=f"normal stress before the first step (default {SEATING / 1e3:g}kPa)",
            ),
        ),
        _host("lammps", "for LAMMPS: a pair style, an input script"),
    ),
)
