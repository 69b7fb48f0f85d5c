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
    JSON,
    LAW,
    OUT,
    PICTURE_FORMAT,
    Command,
    Contents,
    Group,
    law_text,
    option,
    quantities,
    quantity,
    read_about,
    read_law,
    settings,
    write_results,
)

_CSV_UNITS = ("m,Pa", "mm,kPa", "mm,MPa", "um,MPa")


def _run_shear(options: argparse.Namespace) -> None:
    require_rock({"normal stress": options.normal_stress}, "--normal-stress: ")
    law = read_law(options)
    test = partial(
        direct_shear,
        law.joint(),
        [options.to, *options.reverse],
        options.normal_stress,
        options.normal_stiffness,
        options.azimuth,
        options.steps,
    )
    _run_test(test, _describe_shear, law, options)


def _describe_shear(record: TestRecord) -> str:
    """Friction and dilation of a shear test, for the terminal."""
    kind = "peak friction angle" if record.has_peak else "largest friction angle (no peak)"
    lines = [
        f"{kind}: {record.peak_friction_angle:.2f} deg",
        f"final friction angle: {record.residual_friction_angle:.2f} deg",
        f"largest dilation angle: {record.peak_dilation_angle:.2f} deg",
    ]
    stiffness = record.secant_stiffness
    if not math.isnan(stiffness):
        lines.append(f"secant shear stiffness up to there: {stiffness:.4g} Pa/m")
    return "\n".join(lines)


def _run_closure(options: argparse.Namespace) -> None:
    for stress in options.normal_stress:
        require_rock({"normal stress": stress}, "--normal-stress: ")
    law = read_law(options)
    joint = replace(law, plane=None, closure_only=True).joint()  # same numbers, fewer sliders
    test = partial(closure_test, joint, options.normal_stress, options.steps)

    def describe(record: TestRecord) -> str:
        row = int(np.argmax(record.F1))
        return (
            f"closure at {1e-6 * record.F1[row]:.4g} MPa: {1e6 * record.closure[row]:.4g} um\n"
            f"dissipated energy: {record.dissipated[-1]:.3g} J/m2, of which plastic work of "
            f"asperities: {joint.plastic_work:.3g}"
        )

    _run_test(test, describe, law, options)


def _run_test(
    test: Callable[[], TestRecord],
    describe: Callable[[TestRecord], str],
    law: JointLaw,
    options: argparse.Namespace,
) -> None:
    """Run a test and write its record.

    A PathError is raised again after the record up to it was written, if that has any row.
    """
    try:
        record = test()
    except PathError as error:
        if len(error.record):
            _write(error.record, describe(error.record), law, options)
        raise
    _write(record, describe(record), law, options)


def _write(record: TestRecord, text: str, law: JointLaw, options: argparse.Namespace) -> None:
    """Write curve (CSV), picture, law and summary of a test."""
    length, stress = options.units.split(",")
    about = read_about(options)
    files: Contents = {
        f"{options.command}.csv": partial(record.to_csv, length=length, stress=stress),
        "law.toml": law_text(law, about),
        f"{options.command}.png": record.plot,
    }
    summary: dict[str, Any] = {
        "settings_SI": settings(options),
        "result": record.summary(),
        "units": UNITS,
        "warnings": about.warnings,
    }
    write_results(options, files, summary, text)


def _output(steps: int) -> Group:
    """Options of both commands."""
    return Group(
        "output",
        (
            *OUT,
            JSON,
            PICTURE_FORMAT,
            option(
                "--steps",
                metavar="N",
                type=int,
                default=steps,
                help=f"steps from one turning point to the next (default {steps})",
            ),
            option(
                "--units",
                metavar="LENGTH,STRESS",
                choices=_CSV_UNITS,
                default=_CSV_UNITS[0],
                help=f"units of the CSV file: {' or '.join(_CSV_UNITS)} (default {_CSV_UNITS[0]})",
            ),
        ),
    )


SHEAR = Command(
    "shear",
    "direct shear test: apply a normal stress, shear the joint, write the curve and a picture",
    "jointlaw shear biegel-rough --normal-stress 10MPa --to 2um --reverse -2um --out out",
    _run_shear,
    (
        *LAW,
        Group(
            "test",
            (
                option(
                    "--normal-stress",
                    metavar="STRESS",
                    type=quantity("Pa", positive=True),
                    default="10MPa",
                    help="normal stress (default 10MPa)",
                ),
                option(
                    "--to",
                    metavar="LENGTH",
                    type=quantity("m"),
                    required=True,
                    help="shear displacement, such as 2um",
                ),
                option(
                    "--reverse",
                    metavar="LENGTHS",
                    type=quantities("m"),
                    default=[],
                    help="shear displacements of further turning points, separated by commas: "
                    "--reverse -2um,0",
                ),
                option(
                    "--azimuth",
                    metavar="ANGLE",
                    type=quantity("rad"),
                    default="0",
                    help="direction of shear from axis 2 towards axis 3, such as 30deg (default 0)",
                ),
                option(
                    "--normal-stiffness",
                    metavar="STIFFNESS",
                    type=quantity("Pa/m"),
                    default="0",
                    help="constant normal stiffness (CNS) of the surrounding rock, such as 5GPa/m: "
                    "dilation raises the normal stress (default 0: constant normal load, CNL)",
                ),
            ),
        ),
        _output(steps=200),
    ),
)
CLOSURE = Command(
    "closure",
    "closure test: load the joint to a normal stress and unload it, in one or more cycles",
    "jointlaw closure westerly-smooth --normal-stress 20MPa --out out",
    _run_closure,
    (
        *LAW,
        Group(
            "test",
            (
                option(
                    "--normal-stress",
                    metavar="STRESSES",
                    type=quantities("Pa", positive=True),
                    default="20MPa",
                    help="largest normal stress of each cycle, separated by commas: 5MPa,20MPa "
                    "(default 20MPa)",
                ),
            ),
        ),
        _output(steps=100),
    ),
)
