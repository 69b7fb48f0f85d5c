"""The command `jointlaw figures`: the paper's figures, and the table of its claims."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from .command import add_command


def add_figures_command(subparsers: Any) -> None:
    """Add `figures` to the subcommands, with `run`, a function of the options, as its default."""
    what = "regenerate the figures of Misra 1999, or print the table of its claims with our numbers"
    parser = add_command(subparsers, "figures", what, "jointlaw figures 14 15 --out out")
    parser.add_argument("numbers", metavar="N", nargs="*", type=int, help="figures (default: all)")
    parser.add_argument("--out", type=Path, help="folder for PNG, CSV and summary.json")
    parser.add_argument(
        "--claims",
        metavar="KEY",
        nargs="*",
        help="print the claims table instead: all claims, or those of these keys",
    )
    parser.set_defaults(run=_figures)


def _figures(options: argparse.Namespace) -> int:
    if options.claims is not None:
        if options.numbers or options.out:
            raise ValueError("--claims prints a table: give neither figures nor --out with it")
        return _claims(options.claims)
    if options.out is None:
        raise ValueError("--out is missing: name the folder for the figures")
    from ..paper.figures import write  # numbers are computed on demand only

    files = write(options.out, options.numbers)
    print(f"wrote {len(files)} files to {options.out}")
    return 0


def _claims(keys: list[str]) -> int:
    from ..paper import claims
    from ..support.progress import track

    chosen = [claims.get(key).key for key in keys] or claims.keys()
    for key in track(chosen, "claims", len(chosen)):
        claims.measure(key)
    print(claims.table(chosen))
    return 0
