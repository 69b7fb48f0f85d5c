"""`jointlaw shear`: a direct shear test on one joint."""

import argparse
import math
from functools import partial
from typing import Any

from ..laboratory.experiments import CONTROLS, direct_shear
from .command import add_command, add_test_options, in_unit, read_law, run_test, several


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    what = "direct shear test: seat the joint at a normal stress, shear it, write curve and picture"
    example = "jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse -2um --out out"
    parser = add_command(commands, "shear", what, example, _shear)
    parser.add_argument(
        "--normal-stress",
        metavar="STRESS",
        type=in_unit("Pa", positive=True),
        default="10MPa",
        help="normal stress (default 10MPa)",
    )
    parser.add_argument(
        "--to",
        metavar="LENGTH",
        type=in_unit("m"),
        required=True,
        help="shear displacement, such as 2um",
    )
    parser.add_argument(
        "--reverse",
        metavar="LENGTHS",
        type=several(in_unit("m")),
        default=[],
        help="further turning points, separated by commas: --reverse -2um,0",
    )
    parser.add_argument(
        "--azimuth",
        metavar="ANGLE",
        type=in_unit("rad"),
        default="0",
        help="direction of shear from axis 2 towards axis 3, such as 30deg (default 0)",
    )
    parser.add_argument(
        "--control",
        choices=CONTROLS,
        default="stress",
        help="keep the normal stress (default), let it grow with dilation by --normal-stiffness, "
        "or keep the closure",
    )
    parser.add_argument(
        "--normal-stiffness",
        metavar="STIFFNESS",
        type=in_unit("Pa/m"),
        help="of the surroundings, for --control stiffness, such as 5GPa/m",
    )
    add_test_options(parser, steps=200)


def _shear(options: argparse.Namespace) -> None:
    law = read_law(options)
    if (options.control == "stiffness") != (options.normal_stiffness is not None):
        raise ValueError("--control stiffness and --normal-stiffness go together; give both")
    test = partial(
        direct_shear,
        law.joint(),
        [options.to, *options.reverse],
        options.normal_stress,
        options.control,
        options.azimuth,
        options.normal_stiffness,
        options.steps,
    )
    record = run_test(test, law, options)
    peak = "peak friction angle" if record.has_peak else "no peak: largest friction angle"
    secant = record.secant_stiffness
    print(
        f"{peak} {record.peak_friction_angle:.2f} deg, at the end "
        f"{record.residual_friction_angle:.2f} deg, largest dilation angle "
        f"{record.dilation_angle:.2f} deg"
        + ("" if math.isnan(secant) else f", secant shear stiffness {secant:.4g} Pa/m")
    )
