"""`jointlaw export`: a law as files for a host code."""

import argparse
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from ..hosts.c.export import export_c, identifier
from ..hosts.fem.export import SEATING, export_fem
from ..hosts.lammps.export import export_lammps
from ..hosts.yade.export import export_yade
from ..support.files import clear_run
from .command import LAW, OUT, Command, Option, option, quantity, read_law

RUN_COMMANDS = {  # what to type in the exported folder
    "yade": "yade -n -x settle_and_incline.py",
    "c": "make && ./example",
    "fem": "make",
    "lammps": "./build.sh && lmp -in in.tower",
}


def _run(options: argparse.Namespace) -> None:
    law = read_law(options)
    with TemporaryDirectory() as complete:  # a law that is refused leaves the folder unchanged
        text = _export(law, complete, options)
        clear_run(options.out)
        for file in Path(complete).iterdir():
            shutil.copy(file, options.out)
    print(f"{text}\nrun: cd {options.out} && {RUN_COMMANDS[options.host]}")


def _export(law: Any, folder: str, options: argparse.Namespace) -> str:
    """Write the files of a host; returns the text for the user."""
    if options.host == "yade":
        return _export_yade(law, folder, options.shear_limit)
    name = identifier(Path(options.law).stem)
    if options.host == "fem":
        files = export_fem(law, folder, name, seating=options.seating)
    else:
        export = {"c": export_c, "lammps": export_lammps}[options.host]
        files = export(law, folder, name)
    return f"wrote {', '.join(files)}"


def _export_yade(law: Any, folder: str, shear_limit: float | None) -> str:
    """Write the files for YADE; returns the errors of the table for the user."""
    table = export_yade(law, folder, shear_limit=shear_limit)
    angle_error = table.metadata["resolution_error_friction_angle"]
    return (
        f"wrote the joint for YADE: a table of {len(table.closure)} rows, law, adapter, script\n"
        f"error of the friction angle at the shear limit, against a finer resolution: "
        f"{angle_error:.2g} deg\n"
        f"bond: {table.metadata['bond']}\n"
        "largest errors of the table against the law, in % of the largest traction of each path:\n"
        f"{table.report(law)}"
    )


def _example(host: str) -> str:
    return f"jointlaw export {host} jing-replica --out joint-for-{host}"


def _host(host: str, purpose: str, *options: Option) -> Command:
    """The command for one host, with further options of its own."""
    return Command(host, purpose, _example(host), _run, (*LAW, *options, *OUT))


COMMAND = Command(
    "export",
    "write a law for a host code into one folder: YADE, LAMMPS, C, finite elements",
    _example("lammps"),
    _run,
    subcommands=(
        _host(
            "yade",
            "write a law for YADE: table, law, adapter, script",
            option(
                "--shear-limit",
                metavar="LENGTH",
                type=quantity("m", positive=True),
                help="shear displacement at which friction and dilation of the table are computed, "
                "such as 5um (default: mating length, or ten closure ranges without one)",
            ),
        ),
        _host("c", "write a law for C, C++ and Fortran: one header, tables, examples"),
        _host(
            "fem",
            "write a law for finite elements: MGIS, UMAT, shear tests in OpenGeoSys and Kratos",
            option(
                "--seating",
                metavar="STRESS",
                type=quantity("Pa"),
                default=SEATING,
                help=f"normal stress before the first step (default {SEATING / 1e3:g}kPa)",
            ),
        ),
        _host("lammps", "write a law for LAMMPS: a pair style, an input script"),
    ),
)
