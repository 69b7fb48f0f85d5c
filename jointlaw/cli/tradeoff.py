"""`jointlaw tradeoff`: what resolutions of a law cost and how accurate they are."""

import argparse
from dataclasses import replace
from typing import Any

from .command import Written, add_command, add_law, add_out, in_unit, read_law, write_results


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    what = "measure what resolutions of a law cost and how accurate they are"
    example = "jointlaw tradeoff westerly-smooth --plane 0 --out out"
    parser = add_command(commands, "tradeoff", what, example, _tradeoff)
    add_law(parser, resolution=False)
    parser.add_argument(
        "--plane",
        metavar="ANGLE",
        type=in_unit("rad"),
        help="motion in one plane at this azimuth, such as 30deg",
    )
    parser.add_argument(
        "--joints", type=int, default=10_000, help="of the batch that is timed; 0 times nothing"
    )
    add_out(parser, pictures=False)


def _tradeoff(options: argparse.Namespace) -> None:
    law = read_law(options)
    if options.plane is not None:
        law = replace(law, plane=options.plane)
    found = law.tradeoff(joints=options.joints)
    summary = {
        "law": options.law,
        "joints": found.joints,
        "timed on": found.how,
        "reference uncertainty": dict(zip(found.paths, found.uncertainty.tolist(), strict=True)),
        "frontier": [str(price.resolution) for price in found.frontier()],
        "units": {"error": "share of the path's largest traction", "ns": "ns per joint and update"},
    }
    print(found)
    files: Written = {
        "tradeoff.csv": found.to_csv,
        "law.toml": law.to_toml,
    }
    write_results(options.out, files, summary, "")
