"""The command `jointlaw figures`: the paper's figures, and the table of its claims."""

import argparse
from typing import Any

from ..support.files import clear_run
from .command import add_command, add_out


def add(subparsers: Any) -> None:
    """Add `figures` to the subcommands, with `run`, a function of the options, as its default."""
    what = "regenerate the figures of Misra 1999, or print the table of its claims with our numbers"
    parser = add_command(subparsers, "figures", what, "jointlaw figures 14 15 --out out", _figures)
    parser.add_argument("numbers", metavar="N", nargs="*", type=int, help="figures (default: all)")
    add_out(parser, required=False)
    parser.add_argument(
        "--claims",
        metavar="KEY",
        nargs="*",
        help="print the claims table instead: all claims, or those of these keys",
    )


def _figures(options: argparse.Namespace) -> None:
    from ..paper.contents import claims_table, write_figures  # numbers are computed on demand only

    if options.claims is not None:
        if options.numbers or options.out:
            raise ValueError("--claims prints a table: give neither figures nor --out with it")
        print(claims_table(options.claims))
    elif options.out is None:
        raise ValueError("--out is missing: name the folder for the figures")
    else:
        clear_run(options.out)
        files = write_figures(options.out, options.numbers, options.format)
        print(f"wrote {len(files)} files to {options.out}")
