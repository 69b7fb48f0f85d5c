"""Section 3.1, elastic stiffness: Table 1, Eq. 24 to 28, Figures 8 and 9."""

import math
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ..support.checks import Array
from . import quadrature
from .closed_form import HasShape, Shape, elastic, hertz_mindlin_ratio, shear_stiffness
from .section import QUOTED, Bound, Numbers, Section, largest, near, rounding

SECTION = Section()


@SECTION.claim(
    "table-1",
    "Table 1",
    "C11, C22, C33 in closed form (a = 1, 2, 3, infinity)",
    "every a, b, c: quadrature agrees to {worst:.0e}. Rows as printed agree to {rows:.0e}, except "
    "C33 at a = 3: the c term needs a minus (as printed off by {c33:.4f} K_n at c = 0.11, K_s = "
    "K_n/2)",
    [rounding("worst"), rounding("rows"), rounding("c33")],
    misprint=[rounding("worst"), rounding("rows")],
)
def table_1() -> Numbers:
    rows = np.ravel([_printed_difference(a, 0.7, 0.11) for a in (1.0, 2.0, 3.0)])
    found = quadrature.misses(26, quadrature.elastic, elastic, (0.1, 2.0))
    return found | {"rows": largest(rows[:-1]), "c33": abs(float(rows[-1]))}


SECTION.claim(
    "elastic-cross-terms",
    "section 3.1",
    "cross terms C_ij, i != j, are identically zero",
    "largest cross term {cross:.0e} K_n at 200 random a, b, c",
    [rounding("cross")],
)(table_1)


def _printed_difference(a: float, b: float, c: float) -> Array:
    """Row of Table 1 as printed less the closed form, K_n = 1, K_s = 1/2."""
    kn, ks = 1.0, 0.5
    d, r3 = kn - ks, math.sqrt(3)
    if a == 1.0:
        base, twist = (kn + 2 * ks) / 3 - b / 15 * d, 2 * c / 5 * d
        row = [(kn + 2 * ks) / 3 + 2 * b / 15 * d, base + twist, base - twist]
    elif a == 2.0:
        base, twist = (kn + 7 * ks) / 8 - b / 32 * d, 5 * c / 32 * d
        row = [(3 * kn + ks) / 4 + b / 16 * d, base + twist, base - twist]
    else:
        lean, twist = (69 * r3 - 72) * b, (531 * r3 - 688) * c / 3080 * d
        base = -(kn - 6 * ks) / 5 + 3 * r3 / 20 * d - lean / 3080 * d
        first = (7 * kn - 2 * ks) / 5 - 3 * r3 / 10 * d + lean / 1540 * d
        row = [first, base + twist, base + twist]
    return np.array(row) - elastic(Shape(a, b, c), kn, ks)


def stiffness_ratio(shape: HasShape, kappa: float) -> float:
    """C22/C11 at K_n = 1, K_s = kappa."""
    c11, c22, _ = elastic(shape, 1.0, kappa)
    return float(c22 / c11)


@SECTION.figure(
    8,
    title="elastic stiffness ratio of the interface",
    caption=(
        "Closed forms of Table 1 (here for every a and b), c = 0. (a) Kₛ/Kₙ = 0.5. (b) The bands "
        "are the ranges quoted in the text: 0.78 to 1.1 measured, 0.67 to 1 of Hertz-Mindlin "
        "contacts. The paper does not print which a and b it draws in (b); ours are in the legend."
    ),
    panels=2,
)
def figure_8(left: Any, right: Any) -> None:
    a = np.geomspace(1.0, 30.0, 200)
    for b in (-1, 0, 2):
        label = f"b = {b}".replace("-", "−")
        left.plot(a, [stiffness_ratio(Shape(x, b), 0.5) for x in a], label=label)
    left.plot(a, np.full(a.shape, 0.5), ":", color="0.4", label="a = ∞: Kₛ/Kₙ")
    ticks = (1, 2, 3, 6, 10, 20, 30)
    left.set(title="(a) Kₛ/Kₙ = 0.5", xlabel="a", ylabel="C₂₂/C₁₁", xscale="log")
    left.set_xticks(ticks, ticks)
    left.minorticks_off()
    kappa = np.linspace(0.3, 1.2, 91)
    for a_, b, label in (
        (1, -1, "a = 1, b = −1"),
        (1, 0, "a = 1, b = 0"),
        (1, 2, "a = 1, b = 2"),
        (2, 0, "a = 2, b = 0"),
        (3, 0, "a = 3, b = 0"),
        (math.inf, 0, "a = ∞"),
    ):
        right.plot(kappa, [stiffness_ratio(Shape(a_, b), k) for k in kappa], label=label)
    right.axhspan(0.78, 1.1, color="C7", label="measured, Krolikowski and Szczepek", **QUOTED)
    right.axvspan(0.67, 1.0, color="C9", label="Hertz-Mindlin, ν = 0.5 to 0", **QUOTED)
    right.set(title="(b)", xlabel="asperity stiffness ratio Kₛ/Kₙ", ylabel="C₂₂/C₁₁", ylim=(0, 1.4))


@SECTION.claim(
    "ratio-limit",
    "section 3.1, Fig. 8a",
    "C22/C11 tends to K_s/K_n as a grows",
    "K_s/K_n = 0.5: {a1:.4f} (a = 1), {a3:.4f} (a = 3), {a10:.4f} (a = 10), {a100:.4f} (a = 100), "
    "{ainf:.4f} (a = ∞)",
    [
        Bound("a1", least="a3"),
        Bound("a3", least="a10"),
        near("a100", 0.5, 2 / 100**2, "off by the order of E[θ²] < 2/a²"),
        rounding("ainf", 0.5),
    ],
)
def ratio_limit() -> Numbers:
    return {f"a{a:g}": stiffness_ratio(Shape(a), 0.5) for a in (1, 3, 10, 100, math.inf)}


@SECTION.claim(
    "single-asperity",
    "section 3.1",
    "at a = infinity the interface is one asperity",
    "C/N = ({c11:g}, {c22:g}, {c33:g}) K_n for K_s = K_n/2, any b and c",
    [rounding("c11", 1.0), rounding("c22", 0.5), rounding("c33", 0.5)],
)
def single_asperity() -> Numbers:
    c = elastic(Shape(math.inf, 1.0, 0.1), 1.0, 0.5)
    return dict(zip(("c11", "c22", "c33"), c.tolist(), strict=True))


@SECTION.claim(
    "ratio-above-one",
    "Fig. 8a",
    "C22/C11 > 1 is possible (b = -1) at K_s/K_n = 0.5",
    "{at_one:.4f} = 0.7/0.6 at a = 1, b = −1; above 1 up to a = {until:.3f}",
    [Bound("at_one", least=1.0)],
)
def ratio_above_one() -> Numbers:
    until = brentq(lambda a: stiffness_ratio(Shape(a, -1.0), 0.5) - 1, 1.0, 3.0)
    return {"at_one": stiffness_ratio(Shape(1.0, -1.0), 0.5), "until": float(until)}


@SECTION.claim(
    "hertz-mindlin-ratio",
    "Eq. 27",
    "K_s/K_n from 1 to 0.67; 0.83 for nu = 0.3",
    "{none:.3f} to {half:.3f}; at ν = 0.3 it is {quartz:.4f}, so 0.82, not 0.83",
    [
        rounding("none", 1.0),
        near("half", 0.67, 0.005, "printed with two digits"),
        near("quartz", 0.83, 0.005, "printed with two digits"),
    ],
    misprint=[rounding("none", 1.0), rounding("half", 2 / 3), rounding("quartz", 1.4 / 1.7)],
)
def hertz_mindlin() -> Numbers:
    return {
        "none": hertz_mindlin_ratio(0.0),
        "quartz": hertz_mindlin_ratio(0.3),
        "half": hertz_mindlin_ratio(0.5),
    }


@SECTION.claim(
    "measured-ratios",
    "Fig. 8b",
    "orientations explain the measured C22/C11 of 0.78 to 1.1",
    "isotropic (c = 0) interfaces reach {low:.3f} to {high:.3f} over all ν, {quartz_low:.3f} to "
    "{quartz_high:.3f} for quartz (ν = 0.3); with c up to its bound {high_c:.3f} and "
    "{quartz_high_c:.3f}. No orientation takes the ratio below K_s/K_n itself, so 0.78 is out of "
    "reach for quartz",
    [
        Bound("quartz_low", most=0.78),  # the asperities of the measured rock are of quartz
        Bound("quartz_high", least=1.1),
    ],
    in_part=[Bound("low", most=0.78), Bound("high_c", least=1.1)],
)
def measured_ratios() -> Numbers:
    quartz = hertz_mindlin_ratio(0.3)
    low, high = _range((2 / 3, 1.0), 0.0)
    quartz_low, quartz_high = _range((quartz,), 0.0)
    return {
        "low": low,
        "high": high,
        "high_c": _range((2 / 3, 1.0), 1.0)[1],
        "quartz_low": quartz_low,
        "quartz_high": quartz_high,
        "quartz_high_c": _range((quartz,), 1.0)[1],
    }


def _range(kappas: tuple[float, ...], twist: float) -> tuple[float, float]:
    """Least and largest C22/C11 over a, b and these K_s/K_n, with c at `twist` of its bound."""
    values = [
        stiffness_ratio(Shape(a, b, sign * twist * (1 / 3 - b / 6)), kappa)
        for a in (*np.linspace(1.0, 4.0, 31), math.inf)
        for b in np.linspace(-1.0, 2.0, 13)
        for sign in (-1, 1)
        for kappa in kappas
    ]
    return min(values), max(values)


@SECTION.figure(
    9,
    title="directional elastic shear stiffness",
    caption=(
        "Resultant Cₛ of Eq. 28 over C₁₁ for a = 1, b = 0, Kₛ/Kₙ = 0.5. All parameters are "
        "printed. Direction 2 is at 0 degrees."
    ),
    polar=True,
)
def figure_9(axes: Any) -> None:
    phi = np.radians(np.linspace(0.0, 360.0, 181))
    for c, label in ((1 / 3, "c = 1/3"), (0.0, "c = 0")):
        shape = Shape(1.0, 0.0, c)
        c11 = elastic(shape, 1.0, 0.5)[0]
        axes.plot(phi, [shear_stiffness(shape, 1.0, 0.5, x) / c11 for x in phi], label=label)
    axes.set(xlabel="azimuth φ (°)", ylabel="Cₛ/C₁₁", ylim=(0.0, 1.2))


@SECTION.claim(
    "anisotropic-stiffness",
    "Fig. 9",
    "c = 1/3: stiffer along axis 2 than axis 3; c = 0: a circle",
    "C_s/C11 = {axis_2:.3f} along 2, {axis_3:.3f} along 3; for c = 0 round to {roundness:.0e}. It "
    "needs K_s < K_n: at K_s = 2 K_n the order reverses (C22/C33 = {reverse:.3f})",
    [Bound("axis_2", least="axis_3"), rounding("roundness")],
)
def anisotropic_stiffness() -> Numbers:
    skew, even = Shape(1.0, 0.0, 1 / 3), Shape(1.0)
    circle = [shear_stiffness(even, 1.0, 0.5, x) for x in np.linspace(0, math.pi, 37)]
    numbers = {"roundness": max(circle) / min(circle) - 1}
    for name, azimuth in (("axis_2", 0.0), ("axis_3", math.pi / 2)):
        c_s = shear_stiffness(skew, 1.0, 0.5, azimuth)
        numbers[name] = c_s / float(elastic(skew, 1.0, 0.5)[0])
    _, c22, c33 = elastic(skew, 0.5, 1.0)
    return numbers | {"reverse": float(c22 / c33)}
