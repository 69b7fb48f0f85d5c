"""The command `jointlaw export`: a law as files for a host code."""

import argparse
from pathlib import Path
from typing import Any

from ..hosts.c.export import export_c, identifier
from ..hosts.lammps.export import export_lammps
from ..hosts.yade.export import export_yade
from ..law import JointLaw
from ..support.files import clear_run
from .command import add_command, add_law, add_out, given, read_law


def add(commands: Any) -> None:
    """Add `export` to the subparsers of the command line."""
    parser = add_command(
        commands,
        "export",
        "write a law for a host code: table, adapter and scripts in one folder",
        "jointlaw export yade jing-replica --out joint-for-yade",
        _export,
    )
    parser.add_argument("host", choices=("yade", "c", "lammps"), help="the host code; c: also C++")
    add_law(parser)
    parser.add_argument("--closure", help="yade: last closure of the table, such as 2um")
    parser.add_argument("--shear-limit", help="yade: shear at which friction is read, such as 5um")
    parser.add_argument("--tolerance", type=float, help="yade: of interpolation (0.001)")
    add_out(parser, pictures=False)


def _export(options: argparse.Namespace) -> None:
    law = read_law(options)
    if options.host == "yade":
        _export_yade(law, options)
    else:
        _export_live(law, options)


def _export_live(law: JointLaw, options: argparse.Namespace) -> None:
    export, host, start = {
        "c": (export_c, "C and C++", "make && ./example"),
        "lammps": (export_lammps, "LAMMPS", "./build.sh && lmp -in in.tower"),
    }[options.host]
    for name in ("closure", "shear_limit", "tolerance"):
        if getattr(options, name) is not None:
            raise ValueError(
                f"--{name.replace('_', '-')} shapes a table for YADE; {host} runs the law itself: "
                "leave it out"
            )
    clear_run(options.out)
    files = export(law, options.out, identifier(Path(options.law).stem))
    print(f"wrote the joint for {host} to {options.out}: {', '.join(files)}")
    print(f"run: cd {options.out} && {start}")


def _export_yade(law: JointLaw, options: argparse.Namespace) -> None:
    settings: dict[str, Any] = {
        "tolerance": 1e-3 if options.tolerance is None else options.tolerance
    }
    for name in ("closure", "shear_limit"):
        if (value := given(options, name, "m")) is not None:
            settings[name] = value
    clear_run(options.out)
    table = export_yade(law, options.out, **settings)
    print(f"wrote the joint for YADE to {options.out}: {len(table.closure)} rows")
    missed = table.metadata["resolution_error_friction_angle"]
    print(f"its friction angle at the shear limit is {missed:.2g} degrees off that of finer nodes")
    print("what the table drops (error against the law, share of each path's largest traction):")
    print(table.report(law))
    print(f"run: cd {options.out} && yade -n -x settle_and_incline.py")
