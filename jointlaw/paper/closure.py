"""Sections 4.1 and 4.2, closure and initial shear stiffness: Figures 11 to 13."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from ..law import JointLaw
from ..support.checks import Array
from .runs import gamma_heights, law, total_closure
from .secant import secant
from .section import LAW, TOTAL, Bound, Numbers, Section
from .surface import WESTERLY

SECTION = Section()
SMOOTH, ROUGH, REPLICA = "westerly-smooth", "westerly-rough", "jing-replica"
TOP_STRESS = 50e6  # Pa, our choice: the paper does not print the range of its axes


# ------------------------------------------------------------------------------------ closure


@SECTION.figure(
    11,
    title="normal closure, Westerly granite",
    caption=(
        "All parameters of section 4.1 except the friction, which the paper does not print here "
        "(0.3, from section 4.3). The smooth interface is softer at first, since fewer of its "
        "asperities touch at zero closure, and stiffer beyond the crossing. The two forms part "
        "little: only in the shear force of inclined contacts (Eq. 35 against exact oblique "
        "loading). Dotted: each asperity feels only the closure since it touched. Measured points "
        "and the range of the axes are not printed."
    ),
    panels=3,
)
def figure_11(printed: Any, ours: Any, both: Any) -> None:
    stress = JointLaw.normal_stress
    for name, label, color in WESTERLY:
        one, single = law(name), _individual(name)
        for axes, found, curve, text, style in (
            (printed, one, total_closure, label, "-"),
            (ours, one, stress, label, "-"),
            (ours, single, stress, f"{label}, formation individual", ":"),
            (both, one, total_closure, f"{label}, total", "--"),
            (both, one, stress, label, "-"),
        ):
            top = 20e6 if axes is both else TOP_STRESS
            closure = np.linspace(0.0, float(found.closure(top)), 101)
            axes.plot(closure * 1e6, curve(found, closure) * 1e-6, style, color=color, label=text)
    for axes, title in ((printed, TOTAL), (ours, LAW), (both, "both, first 20 MPa")):
        axes.set(title=title, xlabel="closure δ₁ (µm)", ylabel="normal stress F₁ (MPa)")


def _individual(name: str) -> JointLaw:
    """The law of a preset in which each asperity feels only the closure since it touched."""
    return replace(law(name), heights=replace(gamma_heights(name), formation="individual"))


@SECTION.claim(
    "closure-stiffer",
    "Fig. 11",
    "the smooth interface is stiffer in closure",
    "beyond a crossing at {crossing:.3f} µm, {stress:.1f} MPa (total form {total:.3f} µm; "
    'formation "individual" {individual:.3f} µm), softer before it, since fewer of its asperities '
    "touch at zero closure; at 50 MPa it has closed {smooth:.3f} µm, the rough one {rough:.3f} µm",
    [Bound("start", least=1.0), Bound("smooth", most="rough")],
    in_part=[Bound("smooth", most="rough")],
)
def closure_stiffer() -> Numbers:
    pair, stress = (law(SMOOTH), law(ROUGH)), JointLaw.normal_stress
    cross = _crossing(pair, stress)
    smooth, rough = (float(found.closure(TOP_STRESS)) * 1e6 for found in pair)
    return {
        "start": _smooth_over_rough(pair, stress, 0.02e-6),
        "crossing": cross * 1e6,
        "stress": float(stress(pair[0], cross)) * 1e-6,
        "total": _crossing(pair, total_closure) * 1e6,
        "individual": _crossing((_individual(SMOOTH), _individual(ROUGH)), stress) * 1e6,
        "smooth": smooth,
        "rough": rough,
    }


Pair = tuple[JointLaw, JointLaw]


def _smooth_over_rough(pair: Pair, stress: Callable[..., Any], closure: float) -> float:
    smooth, rough = (float(stress(found, closure)) for found in pair)
    return smooth / rough


def _crossing(pair: Pair, stress: Callable[..., Any]) -> float:
    """Closure (m) beyond which the smooth interface carries more."""
    return float(
        brentq(lambda u: _smooth_over_rough(pair, stress, u) - 1, 0.02e-6, 2e-6, xtol=1e-12)
    )


@SECTION.claim(
    "closure-hardening",
    "Fig. 11",
    "the smooth interface hardens more with closure",
    "dF₁/dδ₁ grows by a factor {smooth:.2f} (smooth) and {rough:.2f} (rough) from 0.1 to 0.4 µm",
    [Bound("smooth", least="rough")],
)
def closure_hardening() -> Numbers:
    at = np.array([0.1e-6, 0.4e-6])
    step, gains = 1e-4 * at, {}
    for name, label, _ in WESTERLY:
        rise = law(name).normal_stress(at + step) - law(name).normal_stress(at - step)
        low, high = rise / (2 * step)
        gains[label] = float(high / low)
    return gains


@SECTION.claim(
    "closure-reasons",
    "section 4.1",
    "narrow heights and concentrated orientations both stiffen",
    "at 0.4 µm: heights of the smooth interface alone × {heights:.3f}, its orientations alone × "
    "{orientation:.3f}",
    [Bound("heights", least=1.0), Bound("orientation", least=1.0)],
)
def closure_reasons() -> Numbers:
    rough, smooth = law(ROUGH), law(SMOOTH)
    base = rough.normal_stress(0.4e-6)
    heights = replace(rough, heights=smooth.heights).normal_stress(0.4e-6)
    orientation = replace(rough, orientation=smooth.orientation).normal_stress(0.4e-6)
    return {"heights": float(heights / base), "orientation": float(orientation / base)}


# ------------------------------------------------------------------- initial shear stiffness


@cache
def initial_shear_stiffness(
    found: JointLaw, stress: float, azimuth: float = 0.0
) -> tuple[float, float]:
    """dF/d(shear) in Pa/m along an azimuth at zero shear: total form, incremental law."""
    along = np.array([0.0, math.cos(azimuth), math.sin(azimuth)])
    closure = float(found.closure(stress))
    slip = 1e-6 * closure
    delta = np.array([closure, 0.0, 0.0]) + slip * along
    printed = float(secant(found, delta).F @ along) / slip
    joint = found.joint()
    joint.update([closure, 0.0, 0.0])
    _, C = joint.trial(slip * along)
    return printed, float(along @ np.asarray(C) @ along)


@SECTION.figure(
    12,
    title="initial shear stiffness against normal stress",
    caption=(
        "dF₂/dδ₂ at zero shear and constant closure, after closing to the normal stress. (a) "
        "Parameters of section 4.1, friction 0.3 as in section 4.3. (b) Parameters of section 4.2; "
        "the paper prints no contact density for the replica, so its stiffness is drawn over one "
        "value of its own, and the stress axis shifts with the density that is assumed. The "
        "incremental law is stiffer, since asperities that slid in closure stick when the shear "
        "begins. Measured points and axis ranges are not printed."
    ),
    panels=4,
)
def figure_12(*panels: Any) -> None:
    granite = np.linspace(0.5e6**0.5, TOP_STRESS**0.5, 34) ** 2  # dense where the curves bend
    replica = np.linspace(0.1e6**0.5, 10e6**0.5, 34) ** 2
    unit = initial_shear_stiffness(law(REPLICA), 10e6)[1]
    for part, kind in enumerate((TOTAL, LAW)):
        upper, lower = panels[part], panels[2 + part]
        for name, label, color in WESTERLY:
            values = [initial_shear_stiffness(law(name), float(s))[part] * 1e-12 for s in granite]
            upper.plot(granite * 1e-6, values, color=color, label=label)
        for azimuth, style in ((0, "-"), (45, "--"), (90, ":")):
            turn = math.radians(azimuth)
            shares = [
                initial_shear_stiffness(law(REPLICA), float(s), turn)[part] / unit for s in replica
            ]
            lower.plot(replica * 1e-6, shares, style, color="C2", label=f"azimuth {azimuth}°")
        for axes, title, what, top in (
            (upper, f"(a) granite, {kind}", "initial shear stiffness (MPa/µm)", 210.0),
            (lower, f"(b) replica, {kind}", "stiffness/(incremental, 0°, 10 MPa)", 1.05),
        ):
            axes.set(title=title, xlabel="normal stress (MPa)", ylabel=what, ylim=(0.0, top))


@SECTION.claim(
    "shear-stiffness",
    "Fig. 12a",
    "the smooth interface has the higher initial shear stiffness",
    "smooth/rough at 0.1, 1, 10, 50 MPa: total form {total_0:.2f}, {total_1:.2f}, {total_2:.2f}, "
    "{total_3:.2f}; incremental law {law_0:.2f}, {law_1:.2f}, {law_2:.2f}, {law_3:.2f}",
    [Bound(f"{kind}_{i}", least=1.0) for kind in ("total", "law") for i in range(4)],
    in_part=[Bound(f"{kind}_{i}", least=1.0) for kind in ("total", "law") for i in range(1, 4)],
)
def shear_stiffness() -> Numbers:
    numbers: Numbers = {}
    for i, stress in enumerate((0.1e6, 1e6, 10e6, 50e6)):
        smooth, rough = (initial_shear_stiffness(law(name), stress) for name in (SMOOTH, ROUGH))
        numbers |= {f"total_{i}": smooth[0] / rough[0], f"law_{i}": smooth[1] / rough[1]}
    return numbers


@SECTION.claim(
    "shear-stiffness-slows",
    "Fig. 12a",
    "shear stiffness grows ever more slowly with normal stress",
    "smooth, slope in 1/µm between 1, 5, 10, 20, 50 MPa: total form {total_0:.1f}, {total_1:.1f}, "
    "{total_2:.1f}, {total_3:.1f}; incremental law {law_0:.1f}, {law_1:.1f}, {law_2:.1f}, "
    "{law_3:.1f}",
    [
        bound
        for kind in ("total", "law")
        for bound in (
            *(Bound(f"{kind}_{i + 1}", most=f"{kind}_{i}") for i in range(3)),
            Bound(f"{kind}_3", least=0.0),
        )
    ],
)
def shear_stiffness_slows() -> Numbers:
    stress = np.array([1e6, 5e6, 10e6, 20e6, 50e6])
    values = [initial_shear_stiffness(law(SMOOTH), float(s)) for s in stress]
    slopes = np.diff(values, axis=0) / np.diff(stress)[:, None] * 1e-6  # (MPa/um)/MPa
    total, ours = slopes.T.tolist()
    return {f"total_{i}": x for i, x in enumerate(total)} | {
        f"law_{i}": x for i, x in enumerate(ours)
    }


@SECTION.claim(
    "contacts-form-early",
    "section 4.2",
    "most new contacts form at low normal stress",
    "of the contacts new up to 50 MPa, by 12.5 and 25 MPa have formed {smooth_0:.0%} and "
    "{smooth_1:.0%} (smooth), {rough_0:.0%} and {rough_1:.0%} (rough)",
    [
        Bound(f"{label}_{i}", least=share, why="more than its part of the stress")
        for label in ("smooth", "rough")
        for i, share in enumerate((0.25, 0.5))
    ],
)
def contacts_form_early() -> Numbers:
    shares: Numbers = {}
    for name, label, _ in WESTERLY:
        found, heights = law(name), gamma_heights(name)
        start = found.asperity_density * float(heights.cdf(heights.overlap))
        formed = found.contacts(found.closure([12.5e6, 25e6, TOP_STRESS])) - start
        shares |= {f"{label}_{i}": float(formed[i] / formed[-1]) for i in range(2)}
    return shares


@SECTION.claim(
    "slowing-reason",
    "section 4.2",
    "the nonlinearity comes from the forming of contacts",
    "stiffness goes with stress to the power {formed:.2f} at 10 MPa; without any forming of "
    "contacts to the power {without:.2f} (Hertz: 1/3), slower still: forming straightens it",
    [Bound("formed", most="without")],
)
def slowing_reason() -> Numbers:
    def exponent(found: JointLaw) -> float:
        low, high = (initial_shear_stiffness(found, s)[1] for s in (9e6, 11e6))
        return math.log(high / low) / math.log(11 / 9)

    formed = law(SMOOTH)
    return {"formed": exponent(formed), "without": exponent(replace(formed, heights=None))}


@SECTION.figure(
    13,
    title="directional initial shear stiffness, concrete replica",
    caption=(
        "Parameters of section 4.2 (a = 3, b = −1, c = −0.3, λ = 0.33), stiffness along the "
        "motion divided by its mean over all azimuths, since the contact density is not printed. "
        "The three stresses fall on one curve. Direction 2 (0 degrees) is the stiffer one although "
        "c < 0, because λ < 1 makes asperities stiffer in shear than in closure. Measured points "
        "are not printed."
    ),
    panels=2,
    polar=True,
)
def figure_13(*panels: Any) -> None:
    azimuth = np.radians(np.arange(0.0, 361.0, 7.5))
    for part, (axes, kind) in enumerate(zip(panels, (TOTAL, LAW), strict=True)):
        for stress, style, every in ((0.5e6, "-", 1), (2e6, "s", (0, 4)), (10e6, "o", (2, 4))):
            quarter = [initial_shear_stiffness(law(REPLICA), stress, x)[part] for x in azimuth[:13]]
            values = mirrored(quarter)
            label = f"{stress * 1e-6:g} MPa"
            axes.plot(azimuth, values / values[:-1].mean(), style, markevery=every, label=label)
        axes.set(title=kind, xlabel="azimuth φ (°)", ylabel="stiffness/mean", ylim=(0.0, 1.4))


def mirrored(quarter: ArrayLike) -> Array:
    """Values over the azimuths of the first quarter carried round the circle by symmetry."""
    first = np.asarray(quarter)
    half = np.concatenate([first, first[-2::-1]])
    return np.concatenate([half, half[1:]])


@SECTION.claim(
    "replica-stiffness",
    "Fig. 13",
    "initial shear stiffness of the replica depends on direction",
    "axis 2 over axis 3: total form {total:.3f}, incremental law {law:.3f}, the same at every "
    "stress. Axis 2 is stiffer though c < 0, because λ = 0.33 makes K_s > K_n",
    [Bound(f"{kind}_anisotropy", least=0.05, why="nodes err by 0.01") for kind in ("total", "law")],
)
def replica_stiffness() -> Numbers:
    numbers: Numbers = {}
    for part, kind in enumerate(("total", "law")):
        ratio = np.array([
            initial_shear_stiffness(law(REPLICA), stress)[part]
            / initial_shear_stiffness(law(REPLICA), stress, math.pi / 2)[part]
            for stress in (0.5e6, 2e6, 10e6)
        ])  # fmt: skip
        numbers |= {
            kind: float(ratio[1]),
            f"{kind}_anisotropy": float(np.abs(np.log(ratio)).min()),
            f"{kind}_spread": float(np.ptp(ratio) / ratio.min()),
        }
    return numbers
