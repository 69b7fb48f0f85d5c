"""Water in joints: mean gaps of laws with one closure curve, and flow under a slide.

python docs/measure/aperture.py mean-gap
python docs/measure/aperture.py slide
"""

import math

import numpy as np
from common import print_table, run_command

import jointlaw as jl
from jointlaw.calibration import datasets
from jointlaw.calibration.measured import first_loading

COMPLIANCE = 2e-12  # m/Pa, of rock and machine
ALPHAS = (2.0, 3.7, 8.0, 20.0, 60.0)
WATER = 9810.0  # N/m3
ROCK = 2600 * 9.81  # N/m3
HEIGHT = 20.0  # m, of the slide of Hoek and Bray (1981, chapter 7)
CRACK = 6.0  # m, depth of its tension crack, full of water
FACE = math.radians(60)
PLANE = math.radians(35)
FRICTION = math.tan(math.radians(40))
STRESS_SCALES = (0.5e6, 2e6, 10e6)  # Pa, s of e0/(1 + 9 stress/s)
ELEMENTS = 2000


def mean_gap():
    """Mean gap between the faces of laws that fit one closure curve, by alpha of the heights.

    The mean gap is the mean height of the asperities less the closure. Data: the fracture
    grimsel_vd1_closure without the compliance of its rock.
    """
    stress, closure = first_loading(*datasets.load("grimsel_vd1_closure"))
    curve = jl.ClosureCurve(stress, closure, compliance=COMPLIANCE)
    rows = []
    for alpha in ALPHAS:
        fit = jl.fit_curves([curve], fixed={"alpha": alpha})
        misfit = fit.predict(curve.closure) / curve.stress - 1
        preload_closure = fit.parameters["preload_closure"]
        gap = fit.law.heights.mean - preload_closure - curve.closure
        rms = 100 * math.sqrt(np.mean(misfit**2))
        rows.append([f"{alpha:g}", f"{rms:.1f}", f"{1e6 * gap[0]:.0f}", f"{1e6 * gap[-1]:.0f}"])
    low, high = (f"mean gap at {curve.stress[k] / 1e6:.2g} MPa (um)" for k in (0, -1))
    print_table(["alpha", "rms misfit of the stress (%)", low, high], rows)


def slide():
    """Factor of safety of a slide with steady flow along its plane, by the form of the aperture.

    The pressure falls from the foot of a full tension crack to zero at the toe: linearly for a
    constant aperture. Effective normal stress: uniform, or from the column of rock above.
    """
    back = (HEIGHT - CRACK) / math.tan(PLANE)  # m from the toe to the crack
    crest = HEIGHT / math.tan(FACE)
    x = (np.arange(ELEMENTS) + 0.5) / ELEMENTS * back
    above_face = x * (math.tan(FACE) - math.tan(PLANE))
    column = np.where(x < crest, above_face, HEIGHT - x * math.tan(PLANE))
    length = math.hypot(back, HEIGHT - CRACK)
    weight = ROCK * column.mean() * back
    push = 0.5 * WATER * CRACK**2  # of the water in the crack
    reduction = push * math.sin(PLANE) / length
    normal_stresses = {
        "uniform": np.full(ELEMENTS, weight * math.cos(PLANE) / length) - reduction,
        "column of rock": ROCK * column * math.cos(PLANE) ** 2 - reduction,
    }

    def factor(pressure):
        normal = weight * math.cos(PLANE) - pressure.mean() * length - push * math.sin(PLANE)
        return normal * FRICTION / (weight * math.sin(PLANE) + push * math.cos(PLANE))

    constant = factor(steady_pressure(normal_stresses["uniform"], math.inf))
    rows = []
    for name, normal_stress in normal_stresses.items():
        for scale in STRESS_SCALES:
            value = factor(steady_pressure(normal_stress, scale))
            change = 100 * (value / constant - 1)
            rows.append([name, f"{scale / 1e6:g}", f"{value:.3f}", f"{change:+.1f}"])
    print(f"factor of safety with a constant aperture: {constant:.3f}\n")
    print_table(["effective normal stress", "s (MPa)", "factor of safety", "change (%)"], rows)


def steady_pressure(normal_stress, scale):
    """Water pressure (n,) in Pa along the plane, from the toe, by the cubic law.

    The aperture is Bandis' form of the effective stress with this stress scale (Pa).
    """
    top = WATER * CRACK
    pressure = top * (np.arange(ELEMENTS) + 0.5) / ELEMENTS
    for _ in range(200):
        effective = np.maximum(normal_stress - pressure, 0.0)
        resistance = (1 + 9 * effective / scale) ** 3
        passed = np.cumsum(resistance) - resistance / 2
        pressure = 0.5 * (pressure + top * passed / resistance.sum())
    return pressure


if __name__ == "__main__":
    run_command(__doc__, mean_gap, slide)
