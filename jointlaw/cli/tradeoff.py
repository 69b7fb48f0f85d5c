"""The command `jointlaw tradeoff`: what resolutions of a law cost and how accurate they are."""

import argparse
from dataclasses import replace
from typing import Any

from ..parameters.resolution import LOSS_REMOVED
from .command import Written, add_command, add_law, add_out, quantity, read_law, write_results


def add(commands: Any) -> None:
    """Add `tradeoff` to the subparsers of the command line."""
    parser = add_command(
        commands,
        "tradeoff",
        "measure what resolutions of a law cost here and how accurate they are; table and picture",
        "jointlaw tradeoff westerly-smooth --plane 0 --out out",
        _tradeoff,
    )
    add_law(parser, resolution=False)
    parser.add_argument(
        "--plane", metavar="ANGLE", help="motion in one plane at this azimuth, such as 30deg"
    )
    parser.add_argument(
        "--tolerance",
        metavar="SHARE",
        type=float,
        action="append",
        help="also find the coarsest law that keeps it: 0.01 (may be repeated)",
    )
    parser.add_argument("--loss", help=argparse.SUPPRESS)  # of former versions
    parser.add_argument(
        "--joints", type=int, default=10_000, help="of the batch that is timed; 0 times nothing"
    )
    add_out(parser)


def _tradeoff(options: argparse.Namespace) -> None:
    law = read_law(options)
    if options.plane is not None:
        law = replace(law, plane=quantity("--plane", options.plane, "rad"))
    if options.loss is not None:
        raise ValueError(f"--{LOSS_REMOVED}")
    chosen = {}
    for tolerance in options.tolerance or ():  # before the long work: a bad one is refused at once
        made = law.at_tolerance(tolerance)
        r, sliders = made.resolution, made.tables.sliders
        chosen[f"{tolerance:g}"] = {"u": r.u, "phi": r.phi, "depth": r.depth, "sliders": sliders}
    found = law.tradeoff(joints=options.joints)
    rows = [dict(zip(found.columns(), row, strict=True))
            for row in zip(*found.columns().values(), strict=True)]  # fmt: skip
    frontier = {(p.resolution.u, p.resolution.phi, p.resolution.depth) for p in found.frontier()}
    summary = {
        "law": options.law,
        "joints": found.joints,
        "timed on": found.how,
        "reference uncertainty": dict(zip(found.paths, found.uncertainty.tolist(), strict=True)),
        "frontier": [r for r in rows if (r["u"], r["phi"], r["depth"]) in frontier],
        "at tolerance": chosen,
        "units": {"error": "share of the path's largest traction", "ns": "ns per joint and update"},
    }
    print(found)
    for text, nodes in chosen.items():
        given = ", ".join(f"{k}={nodes[k]}" for k in ("u", "phi", "depth"))
        print(f"at_tolerance({text}): Resolution({given}), {nodes['sliders']} sliders")
    files: Written = {
        "tradeoff.csv": found.to_csv,
        "law.toml": law.to_toml,
        "tradeoff.png": found.plot,
    }
    write_results(options.out, files, summary, options.format)
