"""`jointlaw shear` and `jointlaw closure`: laboratory tests on one joint."""

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from ..laboratory.experiments import PathError, closure_test, direct_shear
from ..laboratory.record import UNITS, TestRecord
from ..laws.joint_law import JointLaw
from ..parameters.rock import require_rock
from .command import (
    LAW,
    OUT,
    PICTURES,
    Command,
    Option,
    Written,
    in_unit,
    option,
    read_law,
    several,
    write_results,
)


def _shear(options: argparse.Namespace) -> None:
    require_rock({"normal stress": options.normal_stress}, "--normal-stress: ")
    law = read_law(options)
    record = _run(
        law,
        options,
        direct_shear,
        law.joint(),
        [options.to, *options.reverse],
        options.normal_stress,
        options.normal_stiffness,
        options.azimuth,
        options.steps,
    )
    peak = "peak friction angle" if record.has_peak else "no peak: largest friction angle"
    secant = record.secant_stiffness
    print(
        f"{peak} {record.peak_friction_angle:.2f} deg, at the end "
        f"{record.residual_friction_angle:.2f} deg, largest dilation angle "
        f"{record.peak_dilation_angle:.2f} deg"
        + ("" if math.isnan(secant) else f", secant shear stiffness {secant:.4g} Pa/m")
    )


def _closure(options: argparse.Namespace) -> None:
    for stress in options.normal_stress:
        require_rock({"normal stress": stress}, "--normal-stress: ")
    law = read_law(options)
    joint = replace(law, plane=None, closure_only=True).joint()  # the same numbers, sooner
    record = _run(law, options, closure_test, joint, options.normal_stress, options.steps)
    at = int(np.argmax(record.F1))
    print(
        f"closure {1e6 * record.closure[at]:.4g} um at {1e-6 * record.F1[at]:.4g} MPa, "
        f"{record.dissipated[-1]:.3g} J/m2 lost, {joint.plastic_work:.3g} of it to yielding"
    )


def _run(
    law: JointLaw, options: argparse.Namespace, test: Callable[..., TestRecord], *arguments: Any
) -> TestRecord:
    """Run a test and write its record, also that of a test that stopped early."""
    try:
        record = test(*arguments)
    except PathError as error:
        if len(error.record):
            _write(error.record, law, options)
        raise
    _write(record, law, options)
    return record


def _write(record: TestRecord, law: JointLaw, options: argparse.Namespace) -> None:
    """Curve (CSV), picture, law and summary of a test."""
    name, (length, stress) = options.command, options.units.split(",")
    files: Written = {
        f"{name}.csv": partial(record.to_csv, length=length, stress=stress),
        "law.toml": law.to_toml,
        f"{name}.png": record.plot,
    }
    settings = {k: v for k, v in vars(options).items() if k not in ("run", "out", "force")}
    summary = {"settings_SI": settings, "result": record.summary(), "units": UNITS}
    write_results(options.out, files, summary, options.format)


def _common(steps: int) -> tuple[Option, ...]:
    """Options of both commands."""
    return (
        *LAW,
        option(
            "--steps", metavar="N", type=int, default=steps, help=f"steps per leg (default {steps})"
        ),
        option(
            "--units",
            metavar="LENGTH,STRESS",
            choices=("m,Pa", "mm,kPa", "mm,MPa", "um,MPa"),
            default="m,Pa",
            help="of the CSV: one of m,Pa (default) or mm,kPa or mm,MPa or um,MPa",
        ),
        *OUT,
        PICTURES,
    )


SHEAR = Command(
    "shear",
    "direct shear test: seat the joint at a normal stress, shear it, write curve and picture",
    "jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse -2um --out out",
    _shear,
    (
        option(
            "--normal-stress",
            metavar="STRESS",
            type=in_unit("Pa", positive=True),
            default="10MPa",
            help="normal stress (default 10MPa)",
        ),
        option(
            "--to",
            metavar="LENGTH",
            type=in_unit("m"),
            required=True,
            help="shear displacement, such as 2um",
        ),
        option(
            "--reverse",
            metavar="LENGTHS",
            type=several("m"),
            default=[],
            help="further turning points, separated by commas: --reverse -2um,0",
        ),
        option(
            "--azimuth",
            metavar="ANGLE",
            type=in_unit("rad"),
            default="0",
            help="direction of shear from axis 2 towards axis 3, such as 30deg (default 0)",
        ),
        option(
            "--normal-stiffness",
            metavar="STIFFNESS",
            type=in_unit("Pa/m"),
            default="0",
            help="of the surroundings, such as 5GPa/m: the normal stress grows by it times the "
            "dilation (default 0: it is kept)",
        ),
        *_common(steps=200),
    ),
)
CLOSURE = Command(
    "closure",
    "closure test: load the joint to a normal stress and unload it",
    "jointlaw closure westerly-smooth --normal-stress 20MPa --out out",
    _closure,
    (
        option(
            "--normal-stress",
            metavar="STRESSES",
            type=several("Pa", positive=True),
            default="20MPa",
            help="largest normal stress (default 20MPa), or one per cycle: 5MPa,20MPa",
        ),
        *_common(steps=100),
    ),
)
