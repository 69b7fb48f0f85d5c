"""The command line `jointlaw`."""

import argparse
import os
import re
import shlex
import sys
from collections.abc import Sequence
from typing import Any, NoReturn

from ..laboratory.experiments import PathError
from ..support.checks import one_of
from ..support.files import require_free
from ..support.version import __version__
from . import browser, card, export, field, fit, laboratory, presets, scan
from .command import Command, Group

COMMANDS = (
    browser.COMMAND,
    presets.COMMAND,
    card.COMMAND,
    laboratory.CLOSURE,
    laboratory.SHEAR,
    fit.COMMAND,
    scan.COMMAND,
    field.COMMAND,
    export.COMMAND,
)
EPILOG = """\
examples:
  jointlaw browser --out joint
  jointlaw shear biegel-rough --to 2um --out out
  jointlaw shear --help

Quantities are typed with their unit: 10MPa, 2um, 30deg, 5GPa/m.
"""
EXIT_FAILED_TEST = 1
EXIT_INVALID_INPUT = 2
EXIT_INTERRUPTED = 130
EXIT_OUTPUT_CLOSED = 141  # as of programs that SIGPIPE ends


class Parser(argparse.ArgumentParser):
    """A parser that raises ValueError with one line, instead of printing its usage."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        # "-2um" after an option is its value, as from Python 3.14 on; before, only "-2" is
        self._negative_number_matcher = re.compile(r"-\.?\d")

    def error(self, message: str) -> NoReturn:
        """Raise ValueError with the message; `main` prints it."""
        raise ValueError(f"{message.removeprefix('argument ')} (help: {self.prog} --help)")


def discard_output() -> None:
    """Connect the standard output to nothing, after the reader of its pipe has ended.

    The interpreter flushes it at exit, which would print an error.
    """
    nothing = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nothing, sys.stdout.fileno())
    os.close(nothing)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status (docs/commands.md)."""
    words = sys.argv[1:] if arguments is None else arguments
    name = " ".join(["jointlaw", *words[:1]])
    try:
        options = _parse(words)
        options.words = shlex.join(["jointlaw", *words])
        if getattr(options, "out", None) and not options.force:
            require_free(options.out)
        status = int(options.run(options) or 0)
        sys.stdout.flush()
        return status
    except BrokenPipeError:  # the reader of a pipe, such as `head`, has ended
        discard_output()
        return EXIT_OUTPUT_CLOSED
    except KeyboardInterrupt:
        print(f"{name}: interrupted; no further files are written", file=sys.stderr)
        return EXIT_INTERRUPTED
    except PathError as error:
        print(f"{name}: {error}", file=sys.stderr)
        return EXIT_FAILED_TEST
    except (ValueError, ImportError, OSError) as error:
        print(f"{name}: {error}", file=sys.stderr)
        return EXIT_INVALID_INPUT


def _parse(words: Sequence[str]) -> argparse.Namespace:
    """The options of the command line. Raises ValueError with one line for the user."""
    parser = Parser(
        prog="jointlaw",
        description="Micromechanical law of rock joints: laboratory tests, fits, exports to hosts.",
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=lambda options: parser.print_help())
    parser.add_argument("--version", action="version", version=f"jointlaw {__version__}")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", title="commands")
    _add_commands(commands, COMMANDS)
    if words and not words[0].startswith("-"):
        one_of("the command", words[0], tuple(commands.choices))
    return parser.parse_args(words)


def _add_commands(parsers: Any, commands: Sequence[Command]) -> None:
    """Add a parser for each command with its options, and for its subcommands."""
    for command in commands:
        parser = parsers.add_parser(
            command.name,
            help=command.purpose,
            description=command.purpose[0].upper() + command.purpose[1:] + ".",
            epilog=f"example:\n  {command.example}",
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        parser.set_defaults(run=command.run)
        for item in command.options:
            if isinstance(item, Group):
                group = parser.add_argument_group(item.title)
                for names, settings in item.options:
                    group.add_argument(*names, **settings)
            else:
                names, settings = item
                parser.add_argument(*names, **settings)
        if command.subcommands:
            parser.set_defaults(run=lambda options, parser=parser: parser.print_help())
            hosts = parser.add_subparsers(dest="host", metavar="HOST", title="hosts")
            _add_commands(hosts, command.subcommands)
