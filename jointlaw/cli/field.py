"""`jointlaw field`: a law from JRC, JCS, a friction angle and a stiffness."""

import argparse
from typing import Any

from ..calibration.field import ASSUMED, from_field, peak_displacement, tested
from .command import Written, add_command, add_out, in_unit, write_results

QUANTITIES = {  # unit, default, and what it is
    "jcs": ("Pa", None, "strength of the joint wall: 100MPa"),
    "length": ("m", None, "of the joint: 10cm"),
    "normal_stress": ("Pa", None, "at which the law is right: 1MPa"),
    "normal_stiffness": ("Pa/m", None, "at that stress: 30GPa/m"),
    "basic_friction": ("rad", "30deg", "angle of the flat rock (default 30deg)"),
}


def add(commands: Any) -> None:
    """Add `field` to the subparsers of the command line."""
    what = "a law from field values: JRC, JCS, friction angle, stiffness at a normal stress"
    example = (
        "jointlaw field --jrc 10 --jcs 100MPa --length 0.1m --normal-stress 1MPa "
        "--normal-stiffness 30GPa/m --out out"
    )
    parser = add_command(commands, "field", what, example, _run)
    about = "joint roughness coefficient, such as 10"
    parser.add_argument("--jrc", type=float, required=True, help=about)
    for name, (unit, default, about) in QUANTITIES.items():
        parser.add_argument(
            f"--{name.replace('_', '-')}",
            type=in_unit(unit, positive=True),
            required=default is None,
            default=default,
            help=about,
        )
    add_out(parser)


def _run(options: argparse.Namespace) -> None:
    given = {name: getattr(options, name) for name in ("jrc", *QUANTITIES)}
    law, slip = from_field(**given), peak_displacement(options.jrc, options.length)
    record, stiffness = tested(law, options.normal_stress, slip)
    text = (
        f"At {options.normal_stress / 1e6:.4g} MPa: peak friction angle "
        f"{record.peak_friction_angle:.1f} deg, largest dilation angle "
        f"{record.peak_dilation_angle:.1f} deg, normal stiffness {stiffness / 1e9:.3g} GPa/m.\n"
        f"mu = {law.asperity.mu:.3g}, a = {law.orientation.a:.3g}, asperity_density = "
        f"{law.asperity_density:.3g} per m2, mating_length = {law.mating_length:.3g} m.\n\n"
        f"{ASSUMED}\n"
    )
    print(text)
    files: Written = {"law.toml": law.to_toml, "report.md": text, "shear.png": record.plot}
    write_results(
        options.out, files, {"given_SI": given, "result": record.summary()}, options.format
    )
