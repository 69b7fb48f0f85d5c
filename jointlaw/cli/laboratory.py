"""The commands `jointlaw shear` and `jointlaw closure`: laboratory tests on one joint."""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from ..laboratory.experiments import CONTROLS, PathError, closure_test, direct_shear
from ..laboratory.record import UNITS, Record
from ..law import JointLaw
from ..support import units
from ..support.checks import number
from .command import Files, add_command, add_law, add_out, read_law, write_results


def add_shear_command(commands: Any) -> None:
    parser = add_command(
        commands,
        "shear",
        "direct shear test: seat the joint at a normal stress, shear it, write curve and picture",
        "jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse -2um --out out",
    )
    add_law(parser)
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
    _common(parser, steps=200)
    parser.set_defaults(run=_shear)


def _shear(options: argparse.Namespace) -> int:
    law = read_law(options)
    points = [_quantity("--to", options.to, "m")]
    if options.reverse:
        points += [_quantity("--reverse", p, "m") for p in options.reverse.split(",")]
    stiffness = None
    if options.normal_stiffness is not None:
        stiffness = _quantity("--normal-stiffness", options.normal_stiffness, "Pa/m")
    if (options.control == "stiffness") != (stiffness is not None):
        raise ValueError("--control stiffness and --normal-stiffness go together; give both")
    normal = _quantity("--normal-stress", options.normal_stress, "Pa", positive=True)
    azimuth = _quantity("--azimuth", options.azimuth, "rad")
    try:
        record = direct_shear(
            law.joint(), points, normal, options.control, azimuth, stiffness, options.steps
        )
    except PathError as error:
        return _stopped(error, law, options, "shear")
    _write(record, law, options, "shear")
    secant = record.secant_stiffness
    print(
        f"peak friction angle {record.peak_friction_angle:.2f} deg, at the end "
        f"{record.residual_friction_angle:.2f} deg, largest dilation angle "
        f"{record.dilation_angle:.2f} deg"
        + ("" if math.isnan(secant) else f", secant shear stiffness {secant:.4g} Pa/m")
    )
    return 0


def add_closure_command(commands: Any) -> None:
    parser = add_command(
        commands,
        "closure",
        "closure test: load the joint to a normal stress and unload it",
        "jointlaw closure westerly-smooth --normal-stress 20MPa --out out",
    )
    add_law(parser)
    parser.add_argument(
        "--normal-stress",
        metavar="STRESSES",
        default="20MPa",
        help="largest normal stress (default 20MPa), or one per cycle: 5MPa,20MPa",
    )
    parser.add_argument("--no-unload", action="store_true", help="stop at the largest stress")
    _common(parser, steps=100)
    parser.set_defaults(run=_closure)


def _closure(options: argparse.Namespace) -> int:
    law = read_law(options)
    stresses = [
        _quantity("--normal-stress", s, "Pa", positive=True)
        for s in options.normal_stress.split(",")
    ]
    try:
        joint = replace(law, plane=None, closure_only=True).joint()  # the same numbers, sooner
        record = closure_test(joint, stresses, unload=not options.no_unload, steps=options.steps)
    except PathError as error:
        return _stopped(error, law, options, "closure")
    _write(record, law, options, "closure")
    at = int(np.argmax(record.F1))
    print(
        f"closure {record.closure[at]:.4g} m at {record.F1[at]:.4g} Pa, "
        f"{record.dissipated[-1]:.3g} J/m2 lost to friction"
    )
    return 0


def _common(parser: argparse.ArgumentParser, steps: int) -> None:
    parser.add_argument(
        "--steps", metavar="N", type=int, default=steps, help=f"steps per leg (default {steps})"
    )
    add_out(parser)


def _quantity(option: str, text: str, unit: str, *, positive: bool = False) -> float:
    """The SI value of an option, named in errors."""
    try:
        value = units.parse(text, unit)
    except ValueError as error:
        raise ValueError(f"{option}: {error}") from None
    number(option, value)
    if positive and value <= 0:
        raise ValueError(f"{option} = {text} is out of bounds: it must be > 0 {unit}")
    return value


def _write(record: Record, law: JointLaw, options: argparse.Namespace, name: str) -> None:
    """Picture, curve (CSV, NPZ), law and summary of a test."""
    files: Files = {
        f"{name}.png": record.plot,
        f"{name}.csv": record.to_csv,
        f"{name}.npz": record.to_npz,
        "law.toml": law.to_toml,
    }
    settings = {k: v for k, v in vars(options).items() if k not in ("run", "out")}
    summary = {"settings": settings, "result": record.summary(), "units": UNITS}
    write_results(options.out, files, summary)


def _stopped(error: PathError, law: JointLaw, options: argparse.Namespace, name: str) -> int:
    print(f"jointlaw {name}: {error}", file=sys.stderr)
    if len(error.record):
        _write(error.record, law, options, name)
    return 1
