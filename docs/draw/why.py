"""The pictures of the page "Why not Coulomb or Barton-Bandis?".

    python docs/draw/why.py FOLDER

three-laws.png: one cycle of shear. The law's joint is rough Westerly granite at a kept normal
stress. Coulomb's line (a spring and a slider) and Barton and Bandis' curve (mobilised roughness:
Barton, Bandis & Bakhtar 1985) are fitted to its first shearing, by least squares. Of the way back
neither says anything: it follows Masing's rule, the first curve twice as large. Prints what a cycle
loses. along-across.png: an anisotropic joint sheared along axis 2, then along axis 3. jrc.png: the
law of `from_field` beside Barton's curves at three normal stresses. strength-surface.png: the
strength of that anisotropic joint by direction and normal stress.
"""

from dataclasses import replace

import numpy as np
from folder import asked
from scipy.integrate import trapezoid
from scipy.optimize import least_squares

import jointlaw as jl
from jointlaw.calibration.field import peak_displacement
from jointlaw.support.pyplot import style

STRESS, REACH, STEPS = 10e6, 0.6e-6, 150
# slip over that at the peak, and mobilised over peak roughness; before the first row friction grows
MOBILISED = ((0.3, 0.6, 1.0, 2.0, 4.0, 10.0, 25.0, 100.0),
             (0.0, 0.75, 1.0, 0.85, 0.7, 0.5, 0.4, 0.0))  # fmt: skip
OURS, COULOMB, BARTON = COLOURS = "#c95500", "#7a5bc4", "#2c8a5b"
OTHER = "#1f6fd0"
ROUGH = replace(jl.presets.load("biegel-rough"), resolution="fine")
LEANING = replace(ROUGH, orientation=jl.Orientation(3.0, 0.0, 0.3))
JRC, JCS, BASIC, STRESSES = 10.0, 100e6, 30.0, (1e6, 2e6, 5e6)  # and the friction of flat rock, deg


def coulomb(slip, stiffness, strength):
    """Shear stress (MPa) at a first slip (µm): MPa/µm and MPa."""
    return np.minimum(stiffness * slip, strength)


def fitted(slip, stress):
    """Stiffness and strength of Coulomb's line through these."""
    return least_squares(lambda q: coulomb(slip, *q) - stress, (40.0, 5.0)).x


def barton_bandis(slip, stress, peak, roughness, residual):
    """The same; stress (MPa), slip at the peak, JRC log10(JCS/stress), residual friction (deg)."""
    at, share = MOBILISED
    start = -residual / roughness  # no friction before slip
    angle = residual + roughness * np.interp(slip / peak, (0.0, *at), (start, *share))
    return stress * np.tan(np.radians(angle))


def masing(backbone, slip):
    """A cycle that begins with `backbone`: up to the largest slip, back to its opposite, and up."""
    top, turn = slip.max(), int(np.argmax(slip))
    back = int(np.argmin(slip))
    first = backbone(slip[: turn + 1])
    down = first[-1] - 2 * backbone((top - slip[turn + 1 : back + 1]) / 2)
    up = down[-1] + 2 * backbone((slip[back + 1 :] + top) / 2)
    return np.concatenate([first, down, up])


def three_laws(plt):
    """Prints what each loses, too."""
    record = jl.direct_shear(ROUGH.joint(), [REACH, -REACH, REACH], STRESS, steps=STEPS)
    slip, stress = record.shear * 1e6, record.shear_stress / 1e6
    first, friction = slice(STEPS + 1), np.degrees(np.arctan(ROUGH.asperity.mu))
    line = fitted(slip[first], stress[first])

    def curve(x, *q):
        return barton_bandis(x, STRESS / 1e6, *q, friction)

    fits = [least_squares(lambda q: curve(slip[first], *q) - stress[first], (peak, 10.0))
            for peak in (0.2, 0.6, 1.5)]  # fmt: skip
    best = min(fits, key=lambda fit: fit.cost).x
    lines = {
        "jointlaw": stress,
        "Coulomb, fitted to it": masing(lambda x: coulomb(x, *line), slip),
        "Barton-Bandis, fitted to it": masing(lambda x: curve(x, *best), slip),
    }
    figure, axes = plt.subplots(figsize=(7.8, 5.4))
    for i, ((name, values), colour) in enumerate(zip(lines.items(), COLOURS, strict=True)):
        lost = trapezoid(values[STEPS:], slip[STEPS:])  # MPa µm = J/m2
        print(f"{name}: {lost:.2f} J/m2 lost in a cycle")
        axes.plot(slip, values, color=colour, zorder=3 - i)
        axes.text(0.03, 0.95 - 0.09 * i, f"{name}: {lost:.1f} J/m² lost", va="top", color=colour,
                  weight="bold", transform=axes.transAxes)  # fmt: skip
    axes.set(
        xlabel="slip (µm)",
        ylabel="shear stress (MPa)",
        ylim=(-7.5, 11.5),
        title="A cycle of shear at a normal stress of 10 MPa: three laws, no test",
    )
    return figure


def along_across(plt):
    """Both shear stresses over the path; Coulomb's slider, fitted to the first leg."""
    joint = LEANING.joint()
    legs = [
        jl.direct_shear(joint, REACH, STRESS, azimuth=way, steps=STEPS) for way in (0.0, np.pi / 2)
    ]
    ours = np.concatenate([np.stack([r.F2, r.F3], -1) for r in legs]) / 1e6
    step = 1e6 * REACH / STEPS
    path = np.concatenate([np.arange(STEPS + 1.0), STEPS + np.arange(STEPS + 1.0)]) * step
    stiffness, strength = fitted(path[: STEPS + 1], ours[: STEPS + 1, 0])
    theirs = np.zeros_like(ours)
    for i in range(1, len(ours)):
        axis, moved = int(i > STEPS + 1), path[i] - path[i - 1]
        theirs[i] = theirs[i - 1] + stiffness * moved * np.eye(2)[axis]
        theirs[i] *= min(1.0, strength / max(np.hypot(*theirs[i]), 1e-9))
    figure, axes = plt.subplots(figsize=(7.8, 4.6))
    for k, colour in enumerate((OURS, OTHER)):
        axes.plot(path, ours[:, k], color=colour)
        axes.plot(path, theirs[:, k], color=COULOMB, alpha=0.6, ls=("-", "--")[k], lw=1.8)
    for x, y, text, colour in (
        (0.58, 6.3, "along axis 2", OURS),
        (1.2, 4.9, "along axis 3", OTHER),
        (1.2, 0.3, "Coulomb, fitted to the first 0.6 µm", COULOMB),
    ):
        axes.text(x, y, text, color=colour, ha="right", weight="bold")
    axes.axvline(REACH * 1e6, color="0.5", ls=":")
    axes.set(xlabel="slip (µm): first along axis 2, then along axis 3", ylabel="shear stress (MPa)")
    return figure


def jrc(plt):
    """Shear stress over normal stress, at three normal stresses."""
    law = jl.from_field(jrc=JRC, jcs=JCS, length=0.1, normal_stress=1e6, normal_stiffness=30e9,
                        basic_friction=np.radians(BASIC))  # fmt: skip
    peak = 1e3 * peak_displacement(JRC, 0.1)  # mm
    figure, axes = plt.subplots(figsize=(7.8, 4.6))
    for stress, shade in zip(STRESSES, (1.0, 0.65, 0.4), strict=True):
        record = jl.direct_shear(law.joint(), 4e-3, stress, steps=300)
        axes.plot(record.shear * 1e3, record.shear_stress / stress, color=OURS, alpha=shade)
        x, rough = np.linspace(0, 4, 300), JRC * np.log10(JCS / stress)
        axes.plot(x, barton_bandis(x, 1.0, peak, rough, BASIC), color=BARTON, alpha=shade, ls="--")
        axes.text(4.05, record.shear_stress[-1] / stress, f"{stress / 1e6:g} MPa", va="center")
    axes.text(0.97, 0.08, "Barton, JRC 10", color=BARTON, ha="right", weight="bold",
              transform=axes.transAxes)  # fmt: skip
    axes.text(0.97, 0.17, "from_field at 1 MPa", color=OURS, ha="right", weight="bold",
              transform=axes.transAxes)  # fmt: skip
    axes.set(xlabel="slip (mm)", ylabel="shear stress over normal stress", xlim=(0, 4.6), ylim=0)
    return figure


def strongest(law, stress, way):
    """The largest shear stress (MPa) to a slip of 2 µm in this direction."""
    return (
        jl.direct_shear(law.joint(), 2e-6, stress, azimuth=way, steps=80).shear_stress.max() / 1e6
    )


def strength_surface(plt):
    """Strength of the joint, whose slopes fade over 0.6 µm, in three views."""
    law = replace(LEANING, mating_length=0.6e-6, resolution=jl.Resolution(4, 8, 6))
    ways, normal = np.radians(np.arange(0, 91, 15)), np.linspace(1, 20, 9) * 1e6
    quarter = np.array([[strongest(law, s, w) for w in ways] for s in normal])
    strength = np.hstack([quarter, quarter[:, -2::-1], quarter[:, 1:], quarter[:, -2::-1]])
    turn, normal = np.radians(np.arange(0, 361, 15)), normal / 1e6
    x, y = strength * np.cos(turn), strength * np.sin(turn)
    figure = plt.figure(figsize=(7.8, 7.6))
    plt.rcParams.update({"font.size": 12})
    solid = figure.add_subplot(2, 1, 1, projection="3d", computed_zorder=False)
    solid.plot_surface(x, y, normal[:, None] + 0 * x, color=OURS, alpha=0.55, lw=0)
    for k in (2, 5, 8):
        solid.plot(x[k], y[k], normal[k], color="k", lw=1.5)
    solid.set(xlabel="τ₂ (MPa)", ylabel="τ₃ (MPa)", zlabel="σ (MPa)", yticks=(-5, 0, 5))
    solid.set_box_aspect((1, 1, 0.7), zoom=0.95)
    above, beside = figure.add_subplot(2, 2, 3), figure.add_subplot(2, 2, 4)
    for k in (2, 5, 8):
        above.plot(x[k], y[k], color="k", lw=1.5)
        above.text(0, y[k].max() - 0.3, f"{normal[k]:.0f} MPa", ha="center", va="top", fontsize=10)
    above.set(aspect="equal", xlabel="τ₂ (MPa)", ylabel="τ₃ (MPa)")
    for k, name, colour in ((0, "along axis 2", OURS), (6, "along axis 3", OTHER)):
        beside.plot(normal, strength[:, k], color=colour, label=name)
    beside.set(xlabel="σ (MPa)", ylabel="strength (MPa)")
    beside.legend(loc="upper left")
    return figure


def main(folder):
    with style() as plt:
        plt.rcParams.update(
            {
                "font.size": 14,
                "axes.titlesize": 15,
                "lines.linewidth": 2.4,
                "axes.grid": True,
                "grid.alpha": 0.3,
            }
        )
        for draw in (three_laws, along_across, jrc, strength_surface):
            draw(plt).savefig(folder / f"{draw.__name__.replace('_', '-')}.png", dpi=100)


if __name__ == "__main__":
    main(asked(__doc__))
