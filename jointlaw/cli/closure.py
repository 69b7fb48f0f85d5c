"""`jointlaw closure`: a closure test on one joint."""

import argparse
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..laboratory.experiments import closure_test
from .command import add_command, add_test_options, csv_units, quantity, read_law, run_test


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    parser = add_command(
        commands,
        "closure",
        "closure test: load the joint to a normal stress and unload it",
        "jointlaw closure westerly-smooth --normal-stress 20MPa --out out",
        _closure,
    )
    parser.add_argument(
        "--normal-stress",
        metavar="STRESSES",
        default="20MPa",
        help="largest normal stress (default 20MPa), or one per cycle: 5MPa,20MPa",
    )
    parser.add_argument("--no-unload", action="store_true", help="stop at the largest stress")
    add_test_options(parser, steps=100)


def _closure(options: argparse.Namespace) -> None:
    law = read_law(options)
    stresses = [
        quantity("--normal-stress", s, "Pa", positive=True)
        for s in options.normal_stress.split(",")
    ]
    joint = replace(law, plane=None, closure_only=True).joint()  # the same numbers, sooner
    test = partial(closure_test, joint, stresses, unload=not options.no_unload, steps=options.steps)
    record = run_test(test, law, options)
    at = int(np.argmax(record.F1))
    length, stress = csv_units(options)
    closed = record.closure[at] / quantity("--units", f"1{length}", "m")
    pressed = record.F1[at] / quantity("--units", f"1{stress}", "Pa")
    print(
        f"closure {closed:.4g} {length} at {pressed:.4g} {stress}, "
        f"{record.dissipated[-1]:.3g} J/m2 lost, {joint.plastic_work:.3g} of it to yielding"
    )
