"""Sections 4.3 and 5, shear at a kept normal stress and friction angles: Figures 17 to 19."""

import math
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from ..laboratory.experiments import direct_shear
from ..parameters.heights import GammaHeights
from ..parameters.resolution import Resolution
from .closed_form import inclination
from .closure import mirrored
from .runs import (
    first_sliding,
    gamma_heights,
    incremental,
    law,
    ratio,
    resistance,
    simple,
    total,
    total_shear,
)
from .section import FORMS, LAW, QUOTED, TOTAL, Bound, Numbers, Section

SECTION = Section()
BIEGEL = (("biegel-smooth", "smooth", "C0"), ("biegel-rough", "rough", "C1"))
SMOOTH, ROUGH, REPLICA = "biegel-smooth", "biegel-rough", "jing-replica"
NORMAL, TO = 10e6, 1.5e-6  # Pa, printed; m, not printed


# ------------------------------------------------------------------------- granite at 10 MPa


@SECTION.figure(
    17,
    title="shear resistance of Westerly granite at a normal stress of 10 MPa",
    caption=(
        "Parameters of section 4.3; the contact density is that of section 4.1. In the right panel "
        "dotted lines repeat the total form; circles mark where all asperities in touch slide. In "
        "the total form the rough interface is stiffer at first and the smooth one stronger later; "
        "in the incremental law the smooth one is above from the start. Measured points and the "
        "end of the axis are not printed."
    ),
    panels=2,
)
def figure_17(left: Any, right: Any) -> None:
    for name, label, color in BIEGEL:
        printed, ours = total(name, TO, NORMAL), incremental(name, TO, NORMAL)
        x, y, row = printed.shear * 1e6, ratio(printed), first_sliding(ours)
        left.plot(x, y, color=color, label=label)
        right.plot(ours.shear * 1e6, ratio(ours), color=color, label=label)
        right.plot(x, y, ":", color=color, label=f"_{label}, total")
        circle = {"color": color, "label": f"{label}: all in touch slide"}
        right.plot(ours.shear[row : row + 1] * 1e6, ratio(ours)[row : row + 1], "o", **circle)
    for axes, title in ((left, TOTAL), (right, LAW)):
        axes.set(
            title=title,
            xlabel="shear displacement δ₂ (µm)",
            ylabel="F₂/F₁",
            xlim=(0.0, TO * 1e6),
            ylim=(0.0, 0.85),
        )


@SECTION.claim(
    "smooth-stronger",
    "Fig. 17",
    "at 10 MPa the smooth interface has the higher shear resistance",
    "F₂/F₁ smooth/rough at 0.1, 0.5, 1.5 µm: "
    + "; ".join(
        f"{form} " + ", ".join(f"{{{kind}_smooth_{i}:.3f}}/{{{kind}_rough_{i}:.3f}}" for i in "012")
        for kind, form in (("law", "incremental law"), ("total", "total form"))
    )
    + ". Incremental law: from the start. Total form: beyond {total_overtakes:.2f} µm",
    [Bound(f"{kind}_least", least=0.0) for kind in FORMS],
    in_part=[Bound(f"{kind}_end", least=0.0) for kind in FORMS],
)
def smooth_stronger() -> Numbers:
    numbers: Numbers = {}
    x = np.linspace(0.02e-6, TO, 75)
    for i, kind in enumerate(FORMS):
        smooth, rough = (resistance(name, x, TO, NORMAL)[i] for name in (SMOOTH, ROUGH))
        for j, at in enumerate((0.1e-6, 0.5e-6, 1.5e-6)):
            numbers[f"{kind}_smooth_{j}"] = float(np.interp(at, x, smooth))
            numbers[f"{kind}_rough_{j}"] = float(np.interp(at, x, rough))
        behind = x[smooth < rough]
        numbers |= {
            f"{kind}_least": float((smooth - rough).min()),
            f"{kind}_end": float(smooth[-1] - rough[-1]),
            f"{kind}_overtakes": float(behind[-1]) * 1e6 if len(behind) else 0.0,
        }
    return numbers


@SECTION.claim(
    "smooth-hardens",
    "Fig. 17",
    "and the higher deformation hardening",
    "F₂/F₁ over 1 µm after yield: "
    + "; ".join(
        f"{label} + {{law_{label}:.3f}} (total form + {{total_{label}:.3f}}) from "
        f"{{yield_{label}:.3f}} at {{at_{label}:.2f}} µm"
        for label in ("smooth", "rough")
    ),
    [Bound(f"{kind}_smooth", least=f"{kind}_rough") for kind in FORMS],
)
def smooth_hardens() -> Numbers:
    numbers: Numbers = {}
    for name, label, _ in BIEGEL:
        run = incremental(name, TO, NORMAL)
        row = first_sliding(run)  # yield: all in touch slide
        start = float(run.shear[row])
        printed, ours = resistance(name, np.array([start, start + 1e-6]), TO, NORMAL)
        numbers |= {
            f"law_{label}": float(np.ptp(ours)),
            f"total_{label}": float(np.ptp(printed)),
            f"yield_{label}": float(ours[0]),
            f"at_{label}": start * 1e6,
        }
    return numbers


@SECTION.claim(
    "smooth-reason",
    "section 4.3",
    "because its initial contact area is larger at the same stress",
    "at 10 MPa the smooth interface has {count:+.1%} contacts and {area:+.1%} contact area. In the "
    "total form heights cannot act: P(r0 + δ₁) cancels from F₂/F₁ at a given δ₂/δ₁. In the "
    "incremental law at 1 µm the rough interface ({rough:.3f}) gains from the smooth one's heights "
    "({heights:.3f}: contacts form where facets lean into the shear) and from its orientations "
    "({orientation:.3f})",
    [Bound("area", least=0.0)],
)
def smooth_reason() -> Numbers:
    smooth, rough = law(SMOOTH), law(ROUGH)
    closures = [float(found.closure(NORMAL)) for found in (smooth, rough)]
    count = float(smooth.contacts(closures[0]) / rough.contacts(closures[1]))
    leaning = [np.sum(f.weight * np.cos(f.theta)) for f in (smooth.facets, rough.facets)]
    area = count * closures[0] / closures[1] * float(leaning[0] / leaning[1])  # Hertz
    numbers = {"count": count - 1, "area": area - 1}
    for label, found in (
        ("rough", rough),
        ("heights", replace(rough, heights=smooth.heights)),
        ("orientation", replace(rough, orientation=smooth.orientation)),
    ):
        run = direct_shear(found.joint(), 1e-6, NORMAL, steps=60)
        numbers[label] = float(ratio(run)[-1])
    return numbers


# ------------------------------------------------------------ friction angles of the replica

STRESSES = (0.1e6, 0.3e6, 1e6, 3e6, 10e6)  # Pa, our choice
NEARLY_ZERO = 10.0  # Pa
SLIP = 1e-3  # m, our choice of a fixed slip at which to read a friction angle
_COARSE = Resolution(8, 12, 16)  # cells: yield is read where the last of them slides


@cache
def law_yield(stress: float, azimuth: float) -> tuple[float, float]:
    """When all asperities of the replica in touch slide, along an azimuth (rad).

    At a kept normal stress (Pa): friction angle (deg), and shear over the seated closure.
    """
    found = replace(law(REPLICA), resolution=_COARSE)
    closure = float(found.closure(stress))
    record = direct_shear(found.joint(), 0.6 * closure, stress, "stress", azimuth, steps=40)
    row = first_sliding(record)
    return float(record.friction_angle[row]), float(record.shear[row]) / closure


def total_yield(azimuth: float) -> float:
    """Friction angle (deg) of the replica when all in touch slide, total form, any stress.

    All slide once the direction of delta stands off the steepest facet by arctan(mu lambda).
    """
    p = law(REPLICA).asperity
    return total_angle(_steepest() + math.atan(p.mu * p.lam), azimuth)


def total_angle(tilt: float, azimuth: float) -> float:
    """Friction angle (deg) of the replica at a tilt arctan(shear/closure) (rad), total form."""
    found = replace(law(REPLICA), heights=None)  # their count cancels
    test = total_shear(found, [tilt], azimuth, normal=1e6)
    return math.degrees(math.atan(ratio(test)[0]))


@cache
def slip_angles(stress: float, azimuth: float) -> tuple[float, float]:
    """Friction angle (deg) of the replica at a fixed slip: total form, incremental law."""
    found = replace(law(REPLICA), resolution=_COARSE)
    record = direct_shear(found.joint(), SLIP, stress, "stress", azimuth, steps=40)
    test = total(REPLICA, 2 * SLIP, stress, azimuth=azimuth)
    printed = np.interp(SLIP, test.shear, np.degrees(np.arctan(ratio(test))))
    return float(printed), float(record.friction_angle[-1])


def slip_limit() -> float:
    """Friction angle (deg) of the replica at a slip far above the closure: arctan mu + pi/2a."""
    return math.degrees(math.atan(law(REPLICA).asperity.mu) + _steepest())


def _steepest() -> float:
    """Largest inclination (rad) of the replica."""
    return 0.5 * math.pi / law(REPLICA).orientation.a


@SECTION.figure(
    18,
    title="directional friction angle, concrete replica",
    caption=(
        "arctan(shear resistance/normal stress) when all asperities in touch first slide, μ = "
        "0.47 and the parameters of section 4.2. In the total form it does not depend on the "
        "normal stress at all. Grey: arctan(μ) + π/2a, reached when the slip is far above the "
        "closure, hence at any slip when the normal stress is zero. Measured points are not "
        "printed."
    ),
    panels=2,
    polar=True,
)
def figure_18(left: Any, right: Any) -> None:
    whole = np.radians(np.arange(0.0, 361.0, 7.5))
    quarter = whole[:13].tolist()
    left.plot(whole, mirrored([total_yield(x) for x in quarter]), label="every normal stress")
    for stress, style, label in (
        (NEARLY_ZERO, "--", "normal stress to 0"),
        (1e6, "-", "1 MPa"),
        (10e6, ":", "10 MPa"),
    ):
        angles = mirrored([law_yield(stress, x)[0] for x in quarter])
        right.plot(whole, angles, style, label=label)
    circle = np.radians(np.arange(0.0, 361.0, 2.0))
    limit = np.full(circle.shape, slip_limit())
    for axes, title in ((left, TOTAL), (right, LAW)):
        axes.plot(circle, limit, "-.", color="0.4", label="slip far above closure")
        axes.set(title=title, xlabel="azimuth φ (°)", ylabel="friction angle (°)", ylim=(0.0, 60.0))


@SECTION.claim(
    "friction-anisotropy",
    "Fig. 18",
    "friction angle of the replica depends on direction",
    "when all in touch slide, at 0, 45, 90°: incremental law (1 MPa) {law_0:.1f}°, {law_45:.1f}°, "
    "{law_90:.1f}°; total form {total_0:.1f}°, {total_45:.1f}°, {total_90:.1f}°. c < 0 makes axis "
    "3 the stronger",
    [Bound(f"{kind}_range", least=1.0, why="yield is read to about 0.3°") for kind in FORMS],
)
def friction_anisotropy() -> Numbers:
    numbers: Numbers = {}
    for kind, angle in (("total", total_yield), ("law", lambda x: law_yield(1e6, x)[0])):
        angles = {f"{kind}_{x}": angle(math.radians(x)) for x in (0, 45, 90)}
        numbers |= angles | {f"{kind}_range": max(angles.values()) - min(angles.values())}
    return numbers


@SECTION.figure(
    19,
    title="friction angle against normal stress, concrete replica",
    caption=(
        "The same interface by two definitions of yield: all asperities in touch slide (nearly "
        "independent of normal stress), and a slip of 1 mm (falls with normal stress). Grey line: "
        "arctan(μ) + π/2a, at zero normal stress for any slip. The contact density is not "
        "printed: with another one the dashed curves shift along the stress axis. Measured points "
        "are not printed."
    ),
    panels=2,
)
def figure_19(*panels: Any) -> None:
    x, limit = np.array(STRESSES) * 1e-6, slip_limit()
    for part, (axes, kind) in enumerate(zip(panels, (TOTAL, LAW), strict=True)):
        for degrees, color in ((0, "C0"), (90, "C1")):
            turn = math.radians(degrees)
            slides = [total_yield(turn) if part == 0 else law_yield(s, turn)[0] for s in STRESSES]
            fixed = [slip_angles(s, turn)[part] for s in STRESSES]
            axes.plot(x, slides, "o-", color=color, label=f"all in touch slide, {degrees}°")
            axes.plot(x, fixed, "s--", color=color, label=f"slip of 1 mm, {degrees}°")
        label = "normal stress 0, any slip"
        axes.axhspan(limit - 0.3, limit + 0.3, color="C7", label=label, **QUOTED)
        axes.set(
            title=kind,
            xlabel="normal stress (MPa)",
            ylabel="friction angle (°)",
            xscale="log",
            ylim=(0.0, 65.0),
        )
        axes.set_xticks(x, [f"{stress:g}" for stress in x])
        axes.minorticks_off()


@SECTION.claim(
    "friction-independent",
    "Fig. 18, 19",
    "friction angle nearly independent of normal stress above zero",
    "if yield is when all in touch slide: {low:.1f}° to {high:.1f}° from 0.1 to 10 MPa (total "
    "form: {total:.1f}° at every stress). Not if yield is a slip of 1 mm, at the assumed contact "
    "density: {law_first:.1f}° falls to {law_last:.1f}° (total form {total_first:.1f}° to "
    "{total_last:.1f}°)",
    [
        Bound(f"{reading}_range", most=3.0, why="our reading of nearly, over two decades of stress")
        for reading in ("slides", "law", "total")
    ],
    one_reading=[
        Bound("slides_range", most=3.0, why="our reading of nearly, over two decades of stress")
    ],
)
def friction_against_stress() -> Numbers:
    angles = [law_yield(s, 0.0)[0] for s in STRESSES]
    small, slip = law_yield(NEARLY_ZERO, 0.0)
    numbers = {
        "low": min(angles),
        "high": max(angles),
        "slides_range": max(angles) - min(angles),
        "total": total_yield(0.0),
        "limit": slip_limit(),
        "far": total_angle(math.pi / 2 + 0.98 * _steepest(), 0.0),
        "at_1MPa": angles[2],
        "slip": slip,
        "small": small,
        "rise": slip_limit() - angles[2],
        "rise_small": small - angles[2],
    }
    ends = (slip_angles(s, 0.0) for s in (STRESSES[0], STRESSES[-1]))
    for kind, first, last in zip(FORMS, *ends, strict=True):
        numbers |= {f"{kind}_first": first, f"{kind}_last": last}
        numbers[f"{kind}_range"] = abs(first - last)
    return numbers


SECTION.claim(
    "friction-at-zero",
    "Fig. 18, 19",
    "friction angle distinctly larger at zero normal stress",
    "at zero normal stress every slip is far above the closure, and the angle is arctan μ + π/2a = "
    "{limit:.1f}° ({far:.1f}° in the total form, all but the steepest 2 % separated), against "
    "{at_1MPa:.1f}° at 1 MPa when all in touch slide. But in the limit of small stress the yield "
    "at which all in touch slide comes at {slip:.2f} closures and {small:.1f}°, lower",
    [
        Bound("rise", least=3.0, why="more than it changes with stress above zero"),
        Bound("rise_small", least=3.0, why="more than it changes with stress above zero"),
    ],
    one_reading=[Bound("rise", least=3.0, why="more than it changes with stress above zero")],
)(friction_against_stress)


# -------------------------------------------------------------------------------- section 5


@SECTION.claim(
    "averages-not-enough",
    "section 5",
    "average height and inclination do not determine the behavior",
    "one mean inclination ({mean:.1f}°), three shapes: F₂/F₁ at δ₂ = 2 δ₁ is {minus:.3f} (b = -1), "
    "{zero:.3f} (b = 0), {two:.3f} (b = 2), apart by {spread:.0%}. One mean height, its variance "
    "doubled: F₁ at 0.4 µm × {wide:.2f}",
    [
        Bound("spread", least=0.01, why="far above the error of the total form"),
        Bound("wide", least=1.01, why="far above the error of a virgin curve"),
    ],
)
def averages_not_enough() -> Numbers:
    mean = inclination(law("linear-a3").orientation)[0]
    ratios = {}
    for name, b in (("minus", -1.0), ("zero", 0.0), ("two", 2.0)):
        found = simple((6 - b) / (6 * mean), law("linear-a3").asperity.mu, b=b)
        ratios[name] = float(ratio(total_shear(found, [math.atan(2.0)], closure=1.0))[0])
    granite, h = law("westerly-smooth"), gamma_heights("westerly-smooth")
    doubled = GammaHeights.from_moments(h.mean, 2.0 * h.variance, h.overlap)
    wide = replace(granite, heights=doubled).normal_stress(0.4e-6) / granite.normal_stress(0.4e-6)
    return {
        "mean": math.degrees(mean),
        **ratios,
        "spread": max(ratios.values()) / min(ratios.values()) - 1,
        "wide": float(wide),
    }
