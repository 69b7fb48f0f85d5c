"""The command line `jointlaw`."""

import argparse
import re
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from ..laboratory.experiments import PathError
from ..support.checks import one_of
from ..support.files import require_free
from ..support.version import __version__
from . import browser, export, field, fit, laboratory, presets, scan
from .command import Command

COMMANDS = (
    browser.COMMAND,
    laboratory.SHEAR,
    laboratory.CLOSURE,
    presets.COMMAND,
    export.COMMAND,
    fit.COMMAND,
    scan.COMMAND,
    field.COMMAND,
)


class Parser(argparse.ArgumentParser):
    """A parser whose errors are one line each, as those of the commands are."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        # "-2um" after an option is its value, as from Python 3.14 on; before, only "-2" is
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message: str) -> NoReturn:
        """Raise ValueError; `main` prints it."""
        raise ValueError(message.removeprefix("argument "))


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    words = sys.argv[1:] if arguments is None else arguments
    name = " ".join(["jointlaw", *words[:1]])
    try:
        options = _read(words)
        if getattr(options, "out", None) and not options.force:
            require_free(options.out)
        return int(options.run(options) or 0)
    except KeyboardInterrupt:
        print(f"{name}: interrupted; nothing more is written", file=sys.stderr)
        return 130
    except (PathError, ValueError, ImportError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return 1 if isinstance(error, PathError) else 2


def _read(words: Sequence[str]) -> argparse.Namespace:
    """The options of the command line. Raises ValueError with one line for the user."""
    parser = Parser(
        prog="jointlaw",
        description="A micromechanical, anisotropic, path-dependent rock joint.",
        epilog="each command has its own help with an example: jointlaw shear --help",
    )
    parser.add_argument("--version", action="version", version=f"jointlaw {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add(commands, COMMANDS)
    if words and not words[0].startswith("-"):
        one_of("the command", words[0], tuple(commands.choices))
    return parser.parse_args(words)


def _add(commands: Any, ours: Sequence[Command]) -> None:
    """Add commands with their options, and those of their own."""
    for one in ours:
        command = commands.add_parser(
            one.name,
            help=one.what,
            description=one.what,
            epilog=f"example:\n  {one.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        command.set_defaults(run=one.run)
        for names, settings in one.options:
            command.add_argument(*names, **settings)
        if one.parts:
            _add(command.add_subparsers(dest="host", required=True, metavar="HOST"), one.parts)
