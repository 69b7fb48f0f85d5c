"""The command line `jointlaw`."""

import argparse
import re
import sys
from collections.abc import Sequence
from typing import NoReturn

from ..laboratory.experiments import PathError
from ..support.files import require_free
from ..support.progress import explained
from ..support.version import __version__
from . import closure, export, figures, fit, presets, replay, scan, shear, tradeoff

WAIT = "the first run after an installation also compiles the law, once"
COMMANDS = (shear, closure, presets, replay, figures, export, fit, scan, tradeoff)

# Commands ("replay") and options ("tradeoff --loss") that were removed: what to use instead
REMOVED = {
    "closure --yield-interference": "write yield_interference into [asperity] of a law file; "
    "jointlaw presets NAME > mine.toml starts one",
    "shear --yield-interference": "write yield_interference into [asperity] of a law file; "
    "jointlaw presets NAME > mine.toml starts one",
    "tradeoff --loss": "small cycles need more depth cells: write resolution = { u = 3, phi = 6, "
    "depth = 300 } into the law's file; docs/how-accurate.md says how many",
}


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line each, as those of the commands are."""

    def error(self, message: str) -> NoReturn:
        """Raise ValueError with the name of the command."""
        raise ValueError(f"{self.prog}: {message.removeprefix('argument ')}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    try:
        options = _read(sys.argv[1:] if arguments is None else arguments)
    except ValueError as error:
        print(error, file=sys.stderr)
        return 2
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


def _read(arguments: Sequence[str]) -> argparse.Namespace:
    """The options of the command line. Raises ValueError with one line for the user."""
    command = arguments[0] if arguments else ""
    for word in ("", *arguments[1:]):
        given = f"{command} {word.partition('=')[0]}".strip()
        if given in REMOVED:
            raise ValueError(f"jointlaw {given} was removed: {REMOVED[given]}")
    parser = Parser(
        prog="jointlaw",
        description="A micromechanical, anisotropic, path-dependent rock joint.",
        epilog="each command has its own help with an example: jointlaw shear --help",
    )
    parser.add_argument("--version", action="version", version=f"jointlaw {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for one in COMMANDS:
        one.add(commands)
    return parser.parse_args(_with_negative_values(arguments))


def _with_negative_values(arguments: Sequence[str]) -> list[str]:
    """Arguments with "--reverse -2um" written as "--reverse=-2um".

    argparse takes a word that begins with a minus, and is not a plain number, for an option.
    """
    joined: list[str] = []
    for argument in arguments:
        if joined and re.match(r"--[a-z-]+$", joined[-1]) and re.match(r"-[.\d]", argument):
            joined[-1] += "=" + argument
        else:
            joined.append(argument)
    return joined
