"""The picture of strength envelopes of the page on the incremental law.

    python docs/draw/envelopes.py FOLDER

envelopes.png: peak shear stress and friction angle against normal stress, from 0.1 to 10 MPa. Two
laws of `from_field` (JRC 10, JCS 100 MPa, basic friction angle 30 degrees) that meet Barton's peak
at 1 MPa: with degradation by stress and by work; and the first without degradation. Barton's curve
(Barton & Choubey 1977), from which they come, and the curve of Ladanyi & Archambault (1970) with a
compressive strength of JCS and the initial dilation that gives it the same strength at 1 MPa, both
from 0.5 to 10 MPa. Prints the friction angles as a table.
"""

from dataclasses import replace

import numpy as np
from command_line import output_folder
from scipy.optimize import brentq

import jointlaw as jl
from jointlaw.calibration.field import peak_displacement, shear_past_peak
from jointlaw.support.pyplot import style

JRC = 10.0
JCS = 100e6  # Pa
BASIC_FRICTION = np.radians(30.0)
LENGTH = 0.1  # m
FIELD_STRESS = 1e6  # Pa, at which the laws meet Barton's peak
STRESSES = np.array([0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0]) * 1e6  # Pa
EMPIRICAL_STRESSES = np.geomspace(0.5e6, 10e6, 41)  # Pa
# Ladanyi & Archambault: exponents of the sheared area and of the dilation; Fairhurst's ratio of
# compressive to tensile strength
AREA_EXPONENT = 1.5
DILATION_EXPONENT = 4.0
STRENGTH_RATIO = 10.0


def barton(stress):
    """Peak friction angle (rad) at normal stresses in Pa."""
    return BASIC_FRICTION + np.radians(JRC * np.log10(JCS / stress))


def ladanyi_archambault(stress, initial_dilation):
    """Peak friction angle (rad) at normal stresses in Pa; initial_dilation: a slope."""
    relative = stress / JCS
    sheared = 1 - (1 - relative) ** AREA_EXPONENT
    dilation = (1 - relative) ** DILATION_EXPONENT * initial_dilation
    rock = (
        (np.sqrt(1 + STRENGTH_RATIO) - 1) / STRENGTH_RATIO * np.sqrt(1 + STRENGTH_RATIO * relative)
    )
    friction = np.tan(BASIC_FRICTION)
    slides = relative * (1 - sheared) * (dilation + friction)
    strength = (slides + sheared * rock) / (1 - (1 - sheared) * dilation * friction)
    return np.arctan(strength / relative)


def peaks(law):
    """Peak friction angles (rad) of a law at STRESSES."""
    slip = peak_displacement(JRC, LENGTH)
    tests = [shear_past_peak(law, stress, slip) for stress in STRESSES]
    return np.radians([test.record.peak_friction_angle for test in tests])


def main():
    folder = output_folder(__doc__)
    field = {"jrc": JRC, "jcs": JCS, "length": LENGTH, "normal_stress": FIELD_STRESS,
             "normal_stiffness": 30e9, "basic_friction": BASIC_FRICTION}  # fmt: skip
    by_stress = jl.from_field(**field, degradation="stress")
    laws = {
        "degradation by stress": by_stress,
        "degradation by work": jl.from_field(**field),
        "no degradation": replace(by_stress, degradation_stress=np.inf),
    }
    angles = {name: peaks(law) for name, law in laws.items()}
    dilation = brentq(
        lambda i: ladanyi_archambault(FIELD_STRESS, i) - barton(FIELD_STRESS), 0.05, 1.2
    )
    empirical = {
        "Barton": barton(EMPIRICAL_STRESSES),
        "Ladanyi & Archambault": ladanyi_archambault(EMPIRICAL_STRESSES, dilation),
    }
    print("| peak friction angle, degrees |", *(f"{s / 1e6:g} MPa |" for s in STRESSES))
    print("|---|" + "---|" * len(STRESSES))
    for name, angle in angles.items():
        print(f"| {name} |", *(f"{a:.1f} |" for a in np.degrees(angle)))
    for name, angle in (
        ("Barton", barton(STRESSES)),
        ("Ladanyi & Archambault", ladanyi_archambault(STRESSES, dilation)),
    ):
        inside = EMPIRICAL_STRESSES[0] <= STRESSES
        cells = np.where(inside, np.degrees(angle), np.nan)
        print(f"| {name} |", *("|" if np.isnan(a) else f"{a:.1f} |" for a in cells))

    with style() as plt:
        figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
        colours = ("#c95500", "#1f6fd0", "#7a5bc4")
        for (name, angle), colour in zip(angles.items(), colours, strict=True):
            left.plot(STRESSES / 1e6, STRESSES * np.tan(angle) / 1e6, color=colour, label=name)
            right.semilogx(STRESSES / 1e6, np.degrees(angle), color=colour, marker="o", ms=3)
        for (name, angle), dashes in zip(empirical.items(), ("--", ":"), strict=True):
            shear = EMPIRICAL_STRESSES * np.tan(angle) / 1e6
            left.plot(EMPIRICAL_STRESSES / 1e6, shear, "k", ls=dashes, label=name)
            right.semilogx(EMPIRICAL_STRESSES / 1e6, np.degrees(angle), "k", ls=dashes)
        left.set(xlabel="normal stress (MPa)", ylabel="peak shear stress (MPa)", xlim=(0, 10))
        left.set_ylim(bottom=0)
        left.legend(frameon=False, fontsize=8)
        right.set(xlabel="normal stress (MPa)", ylabel="peak friction angle (degrees)")
        figure.savefig(folder / "envelopes.png", dpi=100)


if __name__ == "__main__":
    main()
