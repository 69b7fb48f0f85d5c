"""`jointlaw closure`: a closure test on one joint."""

import argparse
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..laboratory.experiments import closure_test
from ..support.units import parse
from .command import add_command, add_test_options, in_unit, read_law, run_test, several


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    what = "closure test: load the joint to a normal stress and unload it"
    example = "jointlaw closure westerly-smooth --normal-stress 20MPa --out out"
    parser = add_command(commands, "closure", what, example, _closure)
    parser.add_argument(
        "--normal-stress",
        metavar="STRESSES",
        type=several(in_unit("Pa", positive=True)),
        default="20MPa",
        help="largest normal stress (default 20MPa), or one per cycle: 5MPa,20MPa",
    )
    parser.add_argument("--no-unload", action="store_true", help="stop at the largest stress")
    add_test_options(parser, steps=100)


def _closure(options: argparse.Namespace) -> None:
    law = read_law(options)
    joint = replace(law, plane=None, closure_only=True).joint()  # the same numbers, sooner
    unload, steps = not options.no_unload, options.steps
    test = partial(closure_test, joint, options.normal_stress, unload=unload, steps=steps)
    record = run_test(test, law, options)
    at = int(np.argmax(record.F1))
    length, stress = options.units
    closed, pressed = record.closure[at] / parse(f"1{length}", "m"), record.F1[at]
    print(
        f"closure {closed:.4g} {length} at {pressed / parse(f'1{stress}', 'Pa'):.4g} {stress}, "
        f"{record.dissipated[-1]:.3g} J/m2 lost, {joint.plastic_work:.3g} of it to yielding"
    )
