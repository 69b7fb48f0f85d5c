"""The pictures of the page "Why not Coulomb or Barton-Bandis?".

    python docs/draw/why.py FOLDER

three-laws.png: one shear cycle. The law's joint is rough Westerly granite at a constant normal
stress. Coulomb's line (a spring and a slider) and Barton and Bandis' curve (mobilised roughness:
Barton, Bandis & Bakhtar 1985) are fitted to its first loading, by least squares. Neither defines
unloading: it follows Masing's rule, the first curve doubled. Prints the energy that a cycle
dissipates. along-across.png: an anisotropic joint sheared along axis 2, then along axis 3. jrc.png:
the law of `from_field` and Barton's curves at three normal stresses. strength-surface.png: the
strength of that anisotropic joint by direction and normal stress.
"""

from dataclasses import replace

import numpy as np
from command_line import output_folder
from scipy.integrate import trapezoid
from scipy.optimize import least_squares

import jointlaw as jl
from jointlaw.calibration.field import peak_displacement
from jointlaw.support.pyplot import style

NORMAL_STRESS = 10e6  # Pa
MAX_SLIP = 0.6e-6  # m
STEPS_PER_LEG = 150
# Barton, Bandis & Bakhtar: slip over its value at the peak, and mobilised over peak roughness;
# friction grows up to the first value
RELATIVE_SLIP = 0.3, 0.6, 1.0, 2.0, 4.0, 10.0, 25.0, 100.0
MOBILISED_ROUGHNESS = 0.0, 0.75, 1.0, 0.85, 0.7, 0.5, 0.4, 0.0

JOINTLAW_COLOUR = "#c95500"
COULOMB_COLOUR = "#7a5bc4"
BARTON_COLOUR = "#2c8a5b"
AXIS_3_COLOUR = "#1f6fd0"
ROUGH_LAW = replace(jl.presets.load("biegel-rough"), resolution="fine")
ANISOTROPIC_LAW = replace(ROUGH_LAW, orientation=jl.Orientation(3.0, 0.0, 0.3))

JRC = 10.0
JCS = 100e6  # Pa
BASIC_FRICTION = 30.0  # deg
FIELD_STRESSES = 1e6, 2e6, 5e6  # Pa


def coulomb(slip, stiffness, strength):
    """Shear stress (MPa) at a first slip (µm), with stiffness (MPa/µm) and strength (MPa)."""
    return np.minimum(stiffness * slip, strength)


def fit_coulomb(slip, stress):
    """Stiffness (MPa/µm) and strength (MPa) of Coulomb's line through slip (µm), stress (MPa)."""
    return least_squares(lambda q: coulomb(slip, *q) - stress, (40.0, 5.0)).x


def barton_bandis(slip, normal_stress, peak_slip, roughness, residual_friction):
    """Shear stress at a first slip, in the unit of the normal stress.

    roughness: JRC log10(JCS/stress) in degrees; residual_friction in degrees.
    """
    no_friction = -residual_friction / roughness  # before slip
    mobilised = np.interp(
        slip / peak_slip, (0.0, *RELATIVE_SLIP), (no_friction, *MOBILISED_ROUGHNESS)
    )
    angle = residual_friction + roughness * mobilised
    return normal_stress * np.tan(np.radians(angle))


def with_corners(slip, corners):
    """The path of a cycle with all points at which Masing's branches have corners.

    corners: slips at which the first loading has corners, in the unit of the path.
    """
    largest = slip.max()
    ends = int(np.argmax(slip)), int(np.argmin(slip))
    loading, unloading, reloading = np.split(slip, [ends[0] + 1, ends[1] + 1])
    corners = np.asarray(corners)[np.asarray(corners) < largest]
    legs = [
        np.union1d(loading, corners),
        np.union1d(unloading, largest - 2 * corners)[::-1],
        np.union1d(reloading, 2 * corners - largest),
    ]
    legs[1] = legs[1][legs[1] < largest]
    legs[2] = legs[2][legs[2] > -largest]
    return np.concatenate(legs)


def masing(first_loading, slip):
    """Shear stress of a cycle to the largest slip, back to its opposite, and up again."""
    largest_slip = slip.max()
    reversal = int(np.argmax(slip))
    second_reversal = int(np.argmin(slip))
    loading = first_loading(slip[: reversal + 1])
    backward = (largest_slip - slip[reversal + 1 : second_reversal + 1]) / 2
    unloading = loading[-1] - 2 * first_loading(backward)
    forward = (slip[second_reversal + 1 :] + largest_slip) / 2
    reloading = unloading[-1] + 2 * first_loading(forward)
    return np.concatenate([loading, unloading, reloading])


def three_laws(plt):
    """A shear cycle of the joint law and of two laws that are fitted to its first loading.

    Prints the energy that each dissipates.
    """
    legs = [MAX_SLIP, -MAX_SLIP, MAX_SLIP]
    record = jl.direct_shear(ROUGH_LAW.joint(), legs, NORMAL_STRESS, steps=STEPS_PER_LEG)
    slip = record.shear * 1e6
    stress = record.shear_stress / 1e6
    first = slice(STEPS_PER_LEG + 1)
    friction = np.degrees(np.arctan(ROUGH_LAW.asperity.mu))

    def barton_curve(x, peak_slip, roughness):
        return barton_bandis(x, NORMAL_STRESS / 1e6, peak_slip, roughness, friction)

    coulomb_fit = fit_coulomb(slip[first], stress[first])
    barton_fits = [
        least_squares(lambda q: barton_curve(slip[first], *q) - stress[first], (peak_slip, 10.0))
        for peak_slip in (0.2, 0.6, 1.5)
    ]
    barton_fit = min(barton_fits, key=lambda fit: fit.cost).x
    coulomb_path = with_corners(slip, [coulomb_fit[1] / coulomb_fit[0]])
    barton_path = with_corners(slip, barton_fit[0] * np.array(RELATIVE_SLIP))
    curves = (
        ("jointlaw", slip, stress, JOINTLAW_COLOUR),
        ("Coulomb, fitted to it", coulomb_path,
         masing(lambda x: coulomb(x, *coulomb_fit), coulomb_path), COULOMB_COLOUR),
        ("Barton-Bandis, fitted to it", barton_path,
         masing(lambda x: barton_curve(x, *barton_fit), barton_path), BARTON_COLOUR),
    )  # fmt: skip
    figure, axes = plt.subplots(figsize=(7.8, 5.4))
    for i, (name, path, values, colour) in enumerate(curves):
        reversal = int(np.argmax(path))
        dissipated = trapezoid(values[reversal:], path[reversal:])  # MPa µm = J/m2
        print(f"{name}: {dissipated:.2f} J/m2 dissipated in a cycle")
        axes.plot(path, values, color=colour, zorder=3 - i)
        axes.text(0.03, 0.95 - 0.09 * i, f"{name}: {dissipated:.1f} J/m² dissipated", va="top",
                  color=colour, weight="bold", transform=axes.transAxes)  # fmt: skip
    axes.set(
        xlabel="slip (µm)",
        ylabel="shear stress (MPa)",
        ylim=(-7.5, 11.5),
        title="Computed shear cycle at a normal stress of 10 MPa",
    )
    return figure


def along_across(plt):
    """Both shear stresses along the path, and Coulomb's slider, fitted to the first leg."""
    joint = ANISOTROPIC_LAW.joint()
    records = [
        jl.direct_shear(joint, MAX_SLIP, NORMAL_STRESS, azimuth=azimuth, steps=STEPS_PER_LEG)
        for azimuth in (0.0, np.pi / 2)
    ]
    stresses = np.concatenate([np.stack([r.F2, r.F3], -1) for r in records]) / 1e6
    leg = np.arange(STEPS_PER_LEG + 1.0)
    path = np.concatenate([leg, STEPS_PER_LEG + leg]) * 1e6 * MAX_SLIP / STEPS_PER_LEG
    first = slice(STEPS_PER_LEG + 1)
    stiffness, strength = fit_coulomb(path[first], stresses[first, 0])
    coulomb_stresses = np.zeros_like(stresses)
    for i in range(1, len(stresses)):
        axis = int(i > STEPS_PER_LEG + 1)
        trial = coulomb_stresses[i - 1] + stiffness * (path[i] - path[i - 1]) * np.eye(2)[axis]
        coulomb_stresses[i] = trial * min(1.0, strength / max(np.hypot(*trial), 1e-9))
    figure, axes = plt.subplots(figsize=(7.8, 4.6))
    for k, colour in enumerate((JOINTLAW_COLOUR, AXIS_3_COLOUR)):
        axes.plot(path, stresses[:, k], color=colour)
        line_style = ("-", "--")[k]
        axes.plot(path, coulomb_stresses[:, k], color=COULOMB_COLOUR, alpha=0.6, ls=line_style,
                  lw=1.8)  # fmt: skip
    for x, y, text, colour in (
        (0.36, 6.4, "along axis 2", JOINTLAW_COLOUR),
        (1.2, 3.35, "along axis 3", AXIS_3_COLOUR),
        (1.2, 6.4, "Coulomb, fitted", COULOMB_COLOUR),
    ):
        axes.text(x, y, text, color=colour, ha="right", weight="bold")
    axes.axvline(MAX_SLIP * 1e6, color="0.5", ls=":")
    axes.set(xlabel="slip (µm): first along axis 2, then along axis 3", ylabel="shear stress (MPa)")
    return figure


def jrc(plt):
    """Shear stress over normal stress, at three normal stresses."""
    law = jl.from_field(jrc=JRC, jcs=JCS, length=0.1, normal_stress=1e6, normal_stiffness=30e9,
                        basic_friction=np.radians(BASIC_FRICTION))  # fmt: skip
    peak_slip = 1e3 * peak_displacement(JRC, 0.1)  # mm
    slip = np.linspace(0, 4, 300)
    figure, axes = plt.subplots(figsize=(7.8, 4.6))
    for stress, opacity in zip(FIELD_STRESSES, (1.0, 0.65, 0.4), strict=True):
        record = jl.direct_shear(law.joint(), 4e-3, stress, steps=300)
        ratio = record.shear_stress / stress
        roughness = JRC * np.log10(JCS / stress)
        barton_ratio = barton_bandis(slip, 1.0, peak_slip, roughness, BASIC_FRICTION)
        axes.plot(record.shear * 1e3, ratio, color=JOINTLAW_COLOUR, alpha=opacity)
        axes.plot(slip, barton_ratio, color=BARTON_COLOUR, alpha=opacity, ls="--")
        axes.text(4.05, ratio[-1], f"{stress / 1e6:g} MPa", va="center")
    for y, text, colour in (
        (0.17, "from_field at 1 MPa", JOINTLAW_COLOUR),
        (0.08, "Barton, JRC 10", BARTON_COLOUR),
    ):
        axes.text(0.97, y, text, color=colour, ha="right", weight="bold",
                  transform=axes.transAxes)  # fmt: skip
    axes.set(xlabel="slip (mm)", ylabel="shear stress / normal stress (-)", xlim=(0, 4.6), ylim=0)
    return figure


def strength(law, normal_stress, azimuth):
    """The largest shear stress (MPa) to a slip of 2 µm in this direction."""
    record = jl.direct_shear(law.joint(), 2e-6, normal_stress, azimuth=azimuth, steps=80)
    return record.shear_stress.max() / 1e6


def strength_surface(plt):
    """Strength of the anisotropic joint, with a mating length of 0.6 µm, in three views."""
    law = replace(ANISOTROPIC_LAW, mating_length=0.6e-6, resolution=jl.Resolution(4, 8, 6))
    normal_stresses = np.linspace(1, 20, 9)  # MPa
    quadrant = np.array([[strength(law, 1e6 * stress, azimuth)
                          for azimuth in np.radians(np.arange(0, 91, 7.5))]
                         for stress in normal_stresses])  # fmt: skip
    mirrored = quadrant[:, -2::-1]
    strengths = np.hstack([quadrant, mirrored, quadrant[:, 1:], mirrored])
    azimuths = np.radians(np.arange(0, 361, 7.5))
    x = strengths * np.cos(azimuths)
    y = strengths * np.sin(azimuths)
    z = np.broadcast_to(normal_stresses[:, None], x.shape)
    contours = (2, 5, 8)
    figure = plt.figure(figsize=(7.8, 7.6))
    plt.rcParams.update({"font.size": 12})
    solid = figure.add_subplot(2, 1, 1, projection="3d", computed_zorder=False)
    solid.plot_surface(x, y, z, color=JOINTLAW_COLOUR, alpha=0.55, lw=0)
    for k in contours:
        solid.plot(x[k], y[k], normal_stresses[k], color="k", lw=1.5)
    solid.set(xlabel="τ₂ (MPa)", ylabel="τ₃ (MPa)", zlabel="σ (MPa)", yticks=(-5, 0, 5))
    solid.set_box_aspect((1, 1, 0.7), zoom=0.95)
    plan = figure.add_subplot(2, 2, 3)
    for k in contours:
        plan.plot(x[k], y[k], color="k", lw=1.5)
        plan.text(0, y[k].max() - 0.3, f"{normal_stresses[k]:.0f} MPa", ha="center", va="top",
                  fontsize=10)  # fmt: skip
    plan.set(aspect="equal", xlabel="τ₂ (MPa)", ylabel="τ₃ (MPa)")
    envelopes = figure.add_subplot(2, 2, 4)
    for k, name, colour in (
        (0, "along axis 2", JOINTLAW_COLOUR),
        (12, "along axis 3", AXIS_3_COLOUR),
    ):
        envelopes.plot(normal_stresses, strengths[:, k], color=colour, label=name)
    envelopes.set(xlabel="σ (MPa)", ylabel="strength (MPa)")
    envelopes.legend(loc="upper left")
    return figure


def main(folder):
    """Draw all pictures."""
    with style() as plt:
        plt.rcParams.update({
            "font.size": 14,
            "axes.titlesize": 15,
            "lines.linewidth": 2.4,
            "axes.grid": True,
            "grid.alpha": 0.3,
        })  # fmt: skip
        for draw in (three_laws, along_across, jrc, strength_surface):
            draw(plt).savefig(folder / f"{draw.__name__.replace('_', '-')}.png", dpi=100)


if __name__ == "__main__":
    main(output_folder(__doc__))
