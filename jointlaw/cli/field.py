"""`jointlaw field`: a law from JRC, JCS, a friction angle and a stiffness."""

import argparse
import math

from ..calibration.field import (
    DEGRADATION,
    assumptions,
    from_field,
    peak_displacement,
    shear_past_peak,
)
from .command import (
    JSON,
    OUT,
    PICTURE_FORMAT,
    Command,
    Contents,
    law_text,
    new_about,
    option,
    quantity,
    write_results,
)

FIELD_VALUES = ("jrc", "jcs", "length", "normal_stress", "normal_stiffness", "basic_friction")
_STRESS = quantity("Pa", positive=True)
VALID_NEAR = {  # by --degradation; with the normal stress in MPa
    "work": "from field values: valid near a normal stress of {:.4g} MPa; for other stresses fit a "
    "closure and a shear test (jointlaw fit)",
    "stress": "from field values: stiffness and displacements are valid near a normal stress of "
    "{:.4g} MPa, peak strength also at others (docs/field.md); cycles of shear do not degrade the "
    "asperities",
}
ORIGIN = {
    "mu": "from the basic friction angle",
    "a": "from JRC and JCS, by the peak friction angle",
    "asperity_density": "from the normal stiffness",
    "mating_length": "from Barton's peak displacement",
    "slope_wear": "assumed: over 1.25 mating lengths",
    "degradation_stress": "assumed: JCS/4",
    **dict.fromkeys(("K", "lam", "eta", "alpha", "beta", "overlap"), "assumed"),
    **dict.fromkeys(("b", "c"), "assumed: no dependence on direction"),
}


def _run(options: argparse.Namespace) -> None:
    values = {name: getattr(options, name) for name in FIELD_VALUES}
    law = from_field(**values, degradation=options.degradation)
    barton_displacement = peak_displacement(options.jrc, options.length)
    roughness_angle = options.jrc * math.log10(options.jcs / options.normal_stress)
    barton_friction = math.degrees(options.basic_friction) + roughness_angle
    barton_dilation = roughness_angle / 2
    test = shear_past_peak(law, options.normal_stress, barton_displacement)
    text = (
        f"Joint of {options.length:.4g} m at a normal stress of {options.normal_stress / 1e6:.4g} "
        "MPa (Barton's value in brackets):\n"
        f"- peak friction angle {test.record.peak_friction_angle:.1f} deg "
        f"({barton_friction:.1f})\n"
        f"- shear displacement at the peak {1e3 * test.peak_displacement:.3g} mm "
        f"({1e3 * barton_displacement:.3g})\n"
        f"- largest dilation angle {test.record.peak_dilation_angle:.1f} deg "
        f"({barton_dilation:.1f})\n"
        f"- normal stiffness {test.normal_stiffness / 1e9:.3g} GPa/m\n\n"
        f"Law: mu = {law.asperity.mu:.3g}, a = {law.orientation.a:.3g}, asperity_density = "
        f"{law.asperity_density:.3g} per m2, mating_length = {law.mating_length:.3g} m.\n\n"
        f"{assumptions(options.degradation)}\n"
    )
    valid_near = VALID_NEAR[options.degradation].format(options.normal_stress / 1e6)
    other = {"work": "degradation_stress", "stress": "slope_wear"}[options.degradation]
    origin = {name: text for name, text in ORIGIN.items() if name != other}
    about = new_about(options, (), (valid_near,), origin)
    files: Contents = {
        "law.toml": law_text(law, about),
        "report.md": text,
        "shear.png": test.record.plot,
    }
    summary = {"given_SI": values, "result": test.record.summary(), "warnings": about.warnings}
    write_results(options, files, summary, text)


COMMAND = Command(
    "field",
    "build a law from field values: JRC, JCS, friction angle, stiffness at a normal stress",
    "jointlaw field --jrc 10 --jcs 100MPa --length 0.1m --normal-stress 1MPa "
    "--normal-stiffness 30GPa/m --out out",
    _run,
    (
        option(
            "--jrc",
            metavar="NUMBER",
            type=float,
            required=True,
            help="joint roughness coefficient of a joint of this --length, such as 10 "
            "(docs/field.md scales the JRC of a sample to it)",
        ),
        option(
            "--jcs",
            metavar="STRESS",
            type=_STRESS,
            required=True,
            help="joint wall compressive strength at this --length, such as 100MPa",
        ),
        option(
            "--length",
            metavar="LENGTH",
            type=quantity("m", positive=True),
            required=True,
            help="length of the joint, such as 10cm",
        ),
        option(
            "--normal-stress",
            metavar="STRESS",
            type=_STRESS,
            required=True,
            help="normal stress at which the law has these values, such as 1MPa",
        ),
        option(
            "--normal-stiffness",
            metavar="STIFFNESS",
            type=quantity("Pa/m", positive=True),
            required=True,
            help="tangent normal stiffness at that stress, such as 30GPa/m",
        ),
        option(
            "--basic-friction",
            metavar="ANGLE",
            type=quantity("rad", positive=True),
            default="30deg",
            help="friction angle of the flat rock surface (default 30deg)",
        ),
        option(
            "--degradation",
            choices=tuple(DEGRADATION),
            default="work",
            help="what degrades the asperities: the work of shear, or the contact stress, by which "
            "the peak follows Barton's at other normal stresses too (default work)",
        ),
        *OUT,
        JSON,
        PICTURE_FORMAT,
    ),
)
