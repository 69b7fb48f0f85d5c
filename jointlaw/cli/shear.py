"""`jointlaw shear`: a direct shear test on one joint."""

import argparse
import math
from functools import partial
from typing import Any

from ..laboratory.experiments import CONTROLS, direct_shear
from .command import add_command, add_test_options, given, quantity, read_law, run_test


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    parser = add_command(
        commands,
        "shear",
        "direct shear test: seat the joint at a normal stress, shear it, write curve and picture",
        "jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse -2um --out out",
        _shear,
    )
    parser.add_argument(
        "--normal-stress", metavar="STRESS", default="10MPa", help="normal stress (default 10MPa)"
    )
    parser.add_argument(
        "--to", metavar="LENGTH", required=True, help="shear displacement, such as 2um"
    )
    parser.add_argument(
        "--reverse",
        metavar="LENGTHS",
        default="",
        help="further turning points, separated by commas: --reverse -2um,0",
    )
    parser.add_argument(
        "--azimuth",
        metavar="ANGLE",
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
        help="of the surroundings, for --control stiffness, such as 5GPa/m",
    )
    add_test_options(parser, steps=200)


def _shear(options: argparse.Namespace) -> None:
    law = read_law(options)
    points = [quantity("--to", options.to, "m")]
    if options.reverse:
        points += [quantity("--reverse", p, "m") for p in options.reverse.split(",")]
    stiffness = given(options, "normal_stiffness", "Pa/m")
    if (options.control == "stiffness") != (stiffness is not None):
        raise ValueError("--control stiffness and --normal-stiffness go together; give both")
    normal = quantity("--normal-stress", options.normal_stress, "Pa", positive=True)
    azimuth = quantity("--azimuth", options.azimuth, "rad")
    control, steps = options.control, options.steps
    test = partial(direct_shear, law.joint(), points, normal, control, azimuth, stiffness, steps)
    record = run_test(test, law, options)
    secant = record.secant_stiffness
    print(
        f"peak friction angle {record.peak_friction_angle:.2f} deg, at the end "
        f"{record.residual_friction_angle:.2f} deg, largest dilation angle "
        f"{record.dilation_angle:.2f} deg"
        + ("" if math.isnan(secant) else f", secant shear stiffness {secant:.4g} Pa/m")
    )
