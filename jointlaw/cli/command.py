"""What the subcommands of `jointlaw` share: help with an example, options, and files of results."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..support.files import replace_file, write_json

Files = Mapping[str, str | Callable[[Path], Any]]
SUMMARY_VERSION = 1  # of summary.json; higher once a key changes its meaning


def add_command(commands: Any, name: str, what: str, example: str) -> argparse.ArgumentParser:
    """Add a subcommand with its one-line purpose and an example that runs as printed."""
    parser: argparse.ArgumentParser = commands.add_parser(
        name,
        help=what,
        description=what,
        epilog=f"example:\n  {example}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    return parser


def add_out(parser: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add the option --out."""
    parser.add_argument(
        "--out", metavar="DIR", type=Path, required=required, help="folder for the results"
    )


def write_results(
    folder: Path,
    files: Files,
    summary: Mapping[str, Any],
) -> None:
    """Write a folder of results and say so.

    files: by name the text of a file, or a function that writes it to a path; what needs
    matplotlib is left out with a message where that is not installed. summary: goes to
    summary.json with a version.
    """
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, content in files.items():
        try:
            if isinstance(content, str):
                replace_file(folder / name, content.encode())
            else:
                content(folder / name)
            written.append(name)
        except ImportError as error:
            print(f"no picture: {error}", file=sys.stderr)
    write_json(folder / "summary.json", {"version": SUMMARY_VERSION, **summary})
    print(f"wrote {', '.join([*written, 'summary.json'])} to {folder}")
