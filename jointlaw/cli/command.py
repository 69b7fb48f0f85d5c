"""How every subcommand of `jointlaw` is made: one line of help and one worked example."""

from __future__ import annotations

import argparse
from typing import Any


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
