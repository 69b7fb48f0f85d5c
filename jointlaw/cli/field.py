"""`jointlaw field`: a law from JRC, JCS, a friction angle and a stiffness."""

import argparse
import math

from ..calibration.field import ASSUMED, from_field, peak_displacement, shear_past_peak
from .command import OUT, PICTURES, Command, Written, in_unit, option, write_results

GIVEN = ("jrc", "jcs", "length", "normal_stress", "normal_stiffness", "basic_friction")
_STRESS = in_unit("Pa", positive=True)


def _run(options: argparse.Namespace) -> None:
    given = {name: getattr(options, name) for name in GIVEN}
    law, slip = from_field(**given), peak_displacement(options.jrc, options.length)
    record, reached, stiffness = shear_past_peak(law, options.normal_stress, slip)
    half = options.jrc * math.log10(options.jcs / options.normal_stress) / 2
    text = (
        f"A joint of {options.length:.4g} m at {options.normal_stress / 1e6:.4g} MPa: peak "
        f"friction angle {record.peak_friction_angle:.1f} deg at a shear displacement of "
        f"{1e3 * reached:.3g} mm (Barton: {1e3 * slip:.3g}), largest dilation angle "
        f"{record.peak_dilation_angle:.1f} deg (Barton: {half:.1f}), normal stiffness "
        f"{stiffness / 1e9:.3g} GPa/m.\n"
        f"mu = {law.asperity.mu:.3g}, a = {law.orientation.a:.3g}, asperity_density = "
        f"{law.asperity_density:.3g} per m2, mating_length = {law.mating_length:.3g} m.\n\n"
        f"{ASSUMED}\n"
    )
    print(text)
    files: Written = {"law.toml": law.to_toml, "report.md": text, "shear.png": record.plot}
    write_results(
        options.out, files, {"given_SI": given, "result": record.summary()}, options.format
    )


COMMAND = Command(
    "field",
    "a law from field values: JRC, JCS, friction angle, stiffness at a normal stress",
    "jointlaw field --jrc 10 --jcs 100MPa --length 0.1m --normal-stress 1MPa "
    "--normal-stiffness 30GPa/m --out out",
    _run,
    (
        option(
            "--jrc",
            type=float,
            required=True,
            help="joint roughness coefficient of a joint of this --length, such as 10; "
            "docs/field.md scales that of a sample to it",
        ),
        option(
            "--jcs",
            type=_STRESS,
            required=True,
            help="strength of the joint wall, of this --length too: 100MPa",
        ),
        option(
            "--length", type=in_unit("m", positive=True), required=True, help="of the joint: 10cm"
        ),
        option(
            "--normal-stress", type=_STRESS, required=True, help="at which the law is right: 1MPa"
        ),
        option(
            "--normal-stiffness",
            type=in_unit("Pa/m", positive=True),
            required=True,
            help="at that stress: 30GPa/m",
        ),
        option(
            "--basic-friction",
            type=in_unit("rad", positive=True),
            default="30deg",
            help="angle of the flat rock (default 30deg)",
        ),
        *OUT,
        PICTURES,
    ),
)
