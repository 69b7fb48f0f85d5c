"""The command line `jointlaw`."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence

from ..support.version import __version__
from .closure import add_closure_command
from .export import add_export_command
from .figures import add_figures_command
from .fit import add_fit_command
from .presets import add_presets_command
from .replay import add_replay_command
from .scan import add_scan_command
from .shear import add_shear_command
from .tradeoff import add_tradeoff_command

COMMANDS = (
    add_shear_command,
    add_closure_command,
    add_presets_command,
    add_replay_command,
    add_figures_command,
    add_export_command,
    add_fit_command,
    add_scan_command,
    add_tradeoff_command,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="jointlaw",
        description="A micromechanical, anisotropic, path-dependent rock joint.",
        epilog="each command has its own help with an example: jointlaw shear --help",
    )
    parser.add_argument("--version", action="version", version=f"jointlaw {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for add in COMMANDS:
        add(commands)
    options = parser.parse_args(_joined(sys.argv[1:] if arguments is None else arguments))
    try:
        return int(options.run(options))
    except (ValueError, ImportError, OSError) as error:
        print(f"jointlaw {options.command}: {error}", file=sys.stderr)
        return 2


def _joined(arguments: Sequence[str]) -> list[str]:
    """Arguments with "--reverse -2um" joined to "--reverse=-2um", lest -2um pass for an option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and re.match(r"--[a-z-]+$", joined[-1]) and re.match(r"-[.\d]", argument):
            joined[-1] += "=" + argument
        else:
            joined.append(argument)
    return joined
