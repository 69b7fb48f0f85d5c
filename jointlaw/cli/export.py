"""`jointlaw export`: a law as files for a host code."""

import argparse
from pathlib import Path
from typing import Any

from ..hosts.c.export import export_c, identifier
from ..hosts.lammps.export import export_lammps
from ..hosts.yade.export import export_yade
from ..law import JointLaw
from ..support.files import clear_run
from .command import add_command, add_law, add_out, in_unit, read_law

# Host: its name, and how to start what was written
HOSTS = {
    "yade": ("YADE", "yade -n -x direct_shear.py"),
    "c": ("C and C++", "make && ./example"),
    "lammps": ("LAMMPS", "./build.sh && lmp -in in.tower"),
}
FOR_TABLES = ("closure", "shear_limit", "tolerance")  # of `tabulate`


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    what = "write a law for a host code: table, adapter and scripts in one folder"
    example = "jointlaw export yade jing-replica --out joint-for-yade"
    parser = add_command(commands, "export", what, example, _export)
    parser.add_argument("host", choices=tuple(HOSTS), help="the host code; c: also C++")
    add_law(parser)
    length = in_unit("m", positive=True)
    parser.add_argument("--closure", type=length, help="yade: last closure of the table, 2um")
    parser.add_argument(
        "--shear-limit", type=length, help="yade: shear at which friction is read, such as 5um"
    )
    parser.add_argument("--tolerance", type=float, help="yade: of interpolation (0.001)")
    add_out(parser, pictures=False)


def _export(options: argparse.Namespace) -> None:
    law = read_law(options)
    name, start = HOSTS[options.host]
    of_table = {key: getattr(options, key) for key in FOR_TABLES}
    of_table = {key: value for key, value in of_table.items() if value is not None}
    if options.host != "yade" and of_table:
        option = f"--{next(iter(of_table)).replace('_', '-')}"
        raise ValueError(
            f"{option} shapes a table for YADE; {name} runs the law itself: leave it out"
        )
    clear_run(options.out)
    print(f"writing the joint for {name} to {options.out}")
    if options.host == "yade":
        _print_table(law, options.out, of_table)
    else:
        export = export_c if options.host == "c" else export_lammps
        print(", ".join(export(law, options.out, identifier(Path(options.law).stem))))
    print(f"run: cd {options.out} && {start}")


def _print_table(law: JointLaw, folder: Path, of_table: dict[str, Any]) -> None:
    """Write a table for YADE, and print what it drops."""
    table = export_yade(law, folder, **{"tolerance": 1e-3, **of_table})
    missed = table.metadata["resolution_error_friction_angle"]
    print(f"{len(table.closure)} rows")
    print(f"its friction angle at the shear limit is {missed:.2g} degrees off that of finer nodes")
    print("what the table drops (error against the law, share of each path's largest traction):")
    print(table.report(law))
