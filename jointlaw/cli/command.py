"""What the subcommands of `jointlaw` share: help with an example, options, and files of results."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from .. import presets
from ..law import JointLaw
from ..parameters.resolution import NAMED
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


def add_law(parser: argparse.ArgumentParser, *, resolution: bool = True) -> None:
    """Add a law, by its preset or file, and the option --resolution; `read_law` reads both."""
    parser.add_argument("law", metavar="PRESET_OR_FILE", help="preset name or TOML file")
    if resolution:
        parser.add_argument("--resolution", choices=tuple(NAMED), help="instead of the law's own")


def read_law(options: argparse.Namespace) -> JointLaw:
    """The law that the options name."""
    law = presets.load_any(options.law)
    resolution = getattr(options, "resolution", None)
    return law if resolution is None else replace(law, resolution=resolution)


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
