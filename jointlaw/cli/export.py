"""The command `jointlaw export`: a law as files for a host code."""

import argparse
from pathlib import Path
from typing import Any

from ..hosts.c.export import export_c, identifier
from ..hosts.yade.export import export_yade
from ..law import JointLaw
from ..support.files import clear_run
from .command import add_command, add_law, add_out, quantity, read_law


def add(commands: Any) -> None:
    """Add `export` to the subparsers of the command line."""
    parser = add_command(
        commands,
        "export",
        "write a law for a host code: table, adapter and scripts in one folder",
        "jointlaw export yade jing-replica --out joint-for-yade",
        _export,
    )
    parser.add_argument("host", choices=("yade", "c"), help="the host code; c: also C++")
    add_law(parser)
    parser.add_argument("--closure", help="yade: last closure of the table, such as 2um")
    parser.add_argument("--shear-limit", help="yade: shear at which friction is read, such as 5um")
    parser.add_argument("--tolerance", type=float, help="yade: of interpolation (0.001)")
    add_out(parser)


def _export(options: argparse.Namespace) -> None:
    law = read_law(options)
    clear_run(options.out)
    if options.host == "c":
        _export_c(law, options)
    else:
        _export_yade(law, options)


def _export_c(law: JointLaw, options: argparse.Namespace) -> None:
    for name in ("closure", "shear_limit", "tolerance"):
        if getattr(options, name) is not None:
            raise ValueError(
                f"--{name.replace('_', '-')} shapes a table for YADE; C runs the law itself: leave "
                "it out"
            )
    files = export_c(law, options.out, identifier(Path(options.law).stem))
    print(f"wrote the joint for C and C++ to {options.out}: {', '.join(files)}")
    print(f"run: cd {options.out} && make && ./example")


def _export_yade(law: JointLaw, options: argparse.Namespace) -> None:
    settings: dict[str, Any] = {
        "tolerance": 1e-3 if options.tolerance is None else options.tolerance
    }
    for name in ("closure", "shear_limit"):
        if (text := getattr(options, name)) is not None:
            settings[name] = quantity(f"--{name.replace('_', '-')}", text, "m")
    table = export_yade(law, options.out, **settings)
    print(f"wrote the joint for YADE to {options.out}: {len(table.closure)} rows")
    print("what the table drops (error against the law, share of each path's largest traction):")
    print(table.report(law))
    print(f"run: cd {options.out} && yade -n -x direct_shear.py")
