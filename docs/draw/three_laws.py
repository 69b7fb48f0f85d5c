"""Why not Coulomb or Barton-Bandis: one cycle of shear by three laws.

    python docs/draw/three_laws.py FOLDER

The law's joint is rough Westerly granite at a kept normal stress. Coulomb's line (a spring and a
slider) and Barton and Bandis' curve (mobilised roughness: Barton, Bandis & Bakhtar 1985) are fitted
to its first shearing, by least squares. Of the way back neither says anything: it follows Masing's
rule, the first curve twice as large. Writes FOLDER/three-laws.png and prints what a cycle loses.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.integrate import trapezoid
from scipy.optimize import least_squares

import jointlaw as jl
from jointlaw.support.pyplot import style

STRESS, REACH, STEPS = 10e6, 0.6e-6, 150
# slip over that at the peak, and mobilised over peak roughness; before the first row friction grows
MOBILISED = ((0.3, 0.6, 1.0, 2.0, 4.0, 10.0, 25.0, 100.0),
             (0.0, 0.75, 1.0, 0.85, 0.7, 0.5, 0.4, 0.0))  # fmt: skip
COLOURS = {"jointlaw": "#d95f02", "Coulomb": "#1f6fd0", "Barton-Bandis": "#7a7a7a"}


def coulomb(slip, stiffness, strength):
    """Shear stress (MPa) at a first slip (µm): MPa/µm and MPa."""
    return np.minimum(stiffness * slip, strength)


def barton_bandis(slip, peak, roughness, residual):
    """The same; slip (µm) at the peak, JRC log10(JCS/stress) and residual friction in degrees."""
    at, share = MOBILISED
    start = -residual / roughness  # no friction before slip
    angle = residual + roughness * np.interp(slip / peak, (0.0, *at), (start, *share))
    return STRESS / 1e6 * np.tan(np.radians(angle))


def masing(backbone, slip):
    """A cycle that begins with `backbone`: up to the largest slip, back to its opposite, and up."""
    top, turn = slip.max(), int(np.argmax(slip))
    back = int(np.argmin(slip))
    first = backbone(slip[: turn + 1])
    down = first[-1] - 2 * backbone((top - slip[turn + 1 : back + 1]) / 2)
    up = down[-1] + 2 * backbone((slip[back + 1 :] + top) / 2)
    return np.concatenate([first, down, up])


def main(folder):
    law = replace(jl.presets.load("biegel-rough"), resolution="fine")
    record = jl.direct_shear(law.joint(), [REACH, -REACH, REACH], STRESS, steps=STEPS)
    slip, stress = record.shear * 1e6, record.shear_stress / 1e6
    first = slice(STEPS + 1)
    friction = np.degrees(np.arctan(law.asperity.mu))
    line = least_squares(lambda q: coulomb(slip[first], *q) - stress[first], (40.0, 5.0)).x
    fits = [
        least_squares(
            lambda q: barton_bandis(slip[first], *q, friction) - stress[first], (peak, 10.0)
        )
        for peak in (0.2, 0.6, 1.5)
    ]
    curve = min(fits, key=lambda fit: fit.cost).x
    lines = {
        "jointlaw": stress,
        "Coulomb": masing(lambda x: coulomb(x, *line), slip),
        "Barton-Bandis": masing(lambda x: barton_bandis(x, *curve, friction), slip),
    }
    with style() as plt:
        plt.rcParams.update({"font.size": 15, "lines.linewidth": 2.4})
        figure, axes = plt.subplots(figsize=(7.8, 5.4))
        for i, (name, values) in enumerate(lines.items()):
            lost = trapezoid(values[STEPS:], slip[STEPS:])  # MPa µm = J/m2
            print(f"{name}: {lost:.2f} J/m2 lost in a cycle")
            axes.plot(slip, values, color=COLOURS[name], zorder=3 - i)
            axes.text(0.03, 0.95 - 0.09 * i, f"{name}: {lost:.1f} J/m² lost", va="top",
                      color=COLOURS[name], weight="bold", transform=axes.transAxes)  # fmt: skip
        axes.set(xlabel="slip (µm)", ylabel="shear stress (MPa)", ylim=(-7.5, 10.5))
        axes.set_title("One cycle of shear at a normal stress of 10 MPa", fontsize=15)
        axes.grid(alpha=0.3)
        figure.savefig(Path(folder) / "three-laws.png", dpi=100)


if __name__ == "__main__":
    main(sys.argv[1])
