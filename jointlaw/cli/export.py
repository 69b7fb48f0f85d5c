"""The command `jointlaw export`: a law as files for a host code."""

import argparse
from typing import Any

from ..hosts.yade.export import export_yade
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
    parser.add_argument("host", choices=("yade",), help="the host code")
    add_law(parser)
    parser.add_argument("--closure", help="last closure of the table, such as 2um")
    parser.add_argument("--shear-limit", help="shear at which friction is read, such as 5um")
    parser.add_argument("--tolerance", type=float, default=1e-3, help="of interpolation (0.001)")
    add_out(parser)


def _export(options: argparse.Namespace) -> None:
    law = read_law(options)
    settings: dict[str, Any] = {"tolerance": options.tolerance}
    for name in ("closure", "shear_limit"):
        if (text := getattr(options, name)) is not None:
            settings[name] = quantity(f"--{name.replace('_', '-')}", text, "m")
    table = export_yade(law, options.out, **settings)
    print(f"wrote the joint for YADE to {options.out}: {len(table.closure)} rows")
    print("what the table drops (error against the law, share of each path's largest traction):")
    print(table.report(law))
    print(f"run: cd {options.out} && yade -n -x direct_shear.py")
