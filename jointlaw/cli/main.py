"""The command line `jointlaw`."""

import argparse
import re
import sys
from collections.abc import Sequence

from ..laboratory.experiments import PathError
from ..support.files import require_free
from ..support.progress import explained
from ..support.version import __version__
from . import closure, export, figures, fit, presets, replay, scan, shear, tradeoff

WAIT = "the first run after an installation also compiles the law, once"
COMMANDS = (shear, closure, presets, replay, figures, export, fit, scan, tradeoff)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    parser = argparse.ArgumentParser(
        prog="jointlaw",
        description="A micromechanical, anisotropic, path-dependent rock joint.",
        epilog="each command has its own help with an example: jointlaw shear --help",
    )
    parser.add_argument("--version", action="version", version=f"jointlaw {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for command in COMMANDS:
        command.add(commands)
    options = parser.parse_args(_joined(sys.argv[1:] if arguments is None else arguments))
    try:
        if getattr(options, "out", None) and not options.force:
            require_free(options.out)
        with explained(f"jointlaw {options.command} is at work; {getattr(options, 'wait', WAIT)}"):
            return int(options.run(options) or 0)
    except KeyboardInterrupt:
        print(f"jointlaw {options.command}: interrupted; nothing more is written", file=sys.stderr)
        return 130
    except (PathError, ValueError, ImportError, OSError) as error:
        print(f"jointlaw {options.command}: {error}", file=sys.stderr)
        return 1 if isinstance(error, PathError) else 2


def _joined(arguments: Sequence[str]) -> list[str]:
    """Arguments, "--reverse -2um" as "--reverse=-2um": argparse takes a lone -2um for an option."""
    joined: list[str] = []
    for argument in arguments:
        if joined and re.match(r"--[a-z-]+$", joined[-1]) and re.match(r"-[.\d]", argument):
            joined[-1] += "=" + argument
        else:
            joined.append(argument)
    return joined
