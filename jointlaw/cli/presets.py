"""`jointlaw presets`: the parameter sets of the paper."""

import argparse
from typing import Any

from .. import presets
from .command import add_command


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    what = "list the parameter sets of the paper, or print one as TOML to start a file of your own"
    example = "jointlaw presets biegel-rough > mine.toml"
    parser = add_command(commands, "presets", what, example, _presets)
    parser.add_argument("name", nargs="?", help="print this one")


def _presets(options: argparse.Namespace) -> None:
    if options.name:
        print(presets.text(options.name), end="")
    else:
        for name in presets.names():
            print(f"{name:16s} {presets.about(name)['title']}")
