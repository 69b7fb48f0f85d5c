"""Claims of section 4.3 at a kept normal stress, and of section 5: Figures 17 to 19."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from ...laboratory.experiments import direct_shear
from ...law import JointLaw
from ...parameters.heights import GammaHeights
from ...parameters.orientation import Orientation
from ...support.checks import Array
from ..closed_form import inclination
from ..figures.runs import changed, incremental, law, ratio, total
from ..figures.strength import (
    NEARLY_ZERO,
    NORMAL,
    REPLICA,
    STRESSES,
    TO,
    first_sliding,
    law_slip_angle,
    law_yield,
    slip_limit,
    total_angle,
    total_slip_angle,
    total_yield,
)
from ..figures.total import total_shear
from .registry import Finding, claim

SMOOTH, ROUGH = "biegel-smooth", "biegel-rough"
SIDE = math.pi / 2


@claim(
    "smooth-stronger", "Fig. 17", "at 10 MPa the smooth interface has the higher shear resistance"
)
def smooth_stronger() -> Finding:
    """F2/F1 of both interfaces, and where the smooth one overtakes."""
    x = np.linspace(0.02e-6, TO, 75)
    excess = {i: _curve(SMOOTH, x)[i] - _curve(ROUGH, x)[i] for i in (0, 1)}
    behind = np.flatnonzero(excess[0] < 0)
    overtakes = float(x[behind[-1]]) * 1e6 if len(behind) else 0.0
    points = np.array([0.1e-6, 0.5e-6, 1.5e-6])
    parts = [
        f"{kind} "
        + ", ".join(
            f"{s:.3f}/{r:.3f}"
            for s, r in zip(_curve(SMOOTH, points)[i], _curve(ROUGH, points)[i], strict=True)
        )
        for i, kind in ((1, "incremental law"), (0, "total form"))
    ]
    text = (
        f"F₂/F₁ smooth/rough at 0.1, 0.5, 1.5 µm: {'; '.join(parts)}. Incremental law: from the "
        f"start. Total form: beyond {overtakes:.2f} µm"
    )
    numbers = {
        "law_least": float(excess[1].min()), "total_overtakes": overtakes,
        "total_end": float(excess[0][-1]), "law_end": float(excess[1][-1]),
    }  # fmt: skip
    return Finding("in part", text, numbers)


@claim("smooth-hardens", "Fig. 17", "and the higher deformation hardening")
def smooth_hardens() -> Finding:
    """Gain of F2/F1 after yield (all in touch slide) over the next micrometre."""
    numbers: dict[str, float] = {}
    parts = []
    for name, label in ((SMOOTH, "smooth"), (ROUGH, "rough")):
        run = incremental(name, TO, normal=NORMAL)
        row = first_sliding(run.sliding, run.separated)
        start = float(run.shear[row])
        gain = float(np.interp(start + 1e-6, run.shear, ratio(run)) - ratio(run)[row])
        printed = total(name, TO, normal=NORMAL)
        after = np.interp([start, start + 1e-6], printed.shear, ratio(printed))
        numbers |= {f"law_{label}": gain, f"total_{label}": float(after[1] - after[0])}
        numbers |= {f"yield_{label}": float(ratio(run)[row]), f"at_{label}": start * 1e6}
        parts.append(
            f"{label} + {gain:.3f} (total form + {after[1] - after[0]:.3f}) from "
            f"{ratio(run)[row]:.3f} at {start * 1e6:.2f} µm"
        )
    return Finding("holds", "F₂/F₁ over 1 µm after yield: " + "; ".join(parts), numbers)


@claim(
    "smooth-reason", "section 4.3", "because its initial contact area is larger at the same stress"
)
def smooth_reason() -> Finding:
    """Contacts and Hertzian contact area at 10 MPa, and F2/F1 with the heights exchanged."""
    count, area = {}, {}
    for name in (SMOOTH, ROUGH):
        found = law(name)
        closure = float(found.closure(NORMAL))
        count[name] = float(found.contacts(closure)) / found.asperity_density
        cosine = float(np.sum(found.facets.weight * np.cos(found.facets.theta)))
        area[name] = count[name] * closure * cosine
    swapped = {}
    for label, found in (
        ("rough", law(ROUGH)),
        ("heights", changed(ROUGH, heights=SMOOTH)),
        ("orientation", changed(ROUGH, orientation=SMOOTH)),
    ):
        run = direct_shear(found.joint(), 1e-6, NORMAL, steps=60)
        swapped[label] = float(ratio(run)[-1])
    more, wider = count[SMOOTH] / count[ROUGH] - 1, area[SMOOTH] / area[ROUGH] - 1
    text = (
        f"at 10 MPa the smooth interface has {more:+.1%} contacts and {wider:+.1%} contact area. "
        "In the total form heights cannot act: P(r0 + δ₁) cancels from F₂/F₁ at a given δ₂/δ₁. In "
        f"the incremental law at 1 µm the rough interface ({swapped['rough']:.3f}) gains from the "
        f"smooth one's heights ({swapped['heights']:.3f}: contacts form where facets lean into the "
        f"shear) and from its orientations ({swapped['orientation']:.3f})"
    )
    return Finding("fails", text, {"count": more, "area": wider, **swapped})


@claim("friction-anisotropy", "Fig. 18", "friction angle of the replica depends on direction")
def friction_anisotropy() -> Finding:
    """Friction angle at yield along axes 2 and 3, 1 MPa."""
    printed = {degrees: total_yield(math.radians(degrees)) for degrees in (0, 45, 90)}
    ours = {degrees: law_yield(1e6, math.radians(degrees)).angle for degrees in (0, 45, 90)}
    text = (
        "when all in touch slide, at 0, 45, 90°: incremental law (1 MPa) "
        + ", ".join(f"{x:.1f}°" for x in ours.values())
        + "; total form "
        + ", ".join(f"{x:.1f}°" for x in printed.values())
        + ". c < 0 makes axis 3 the stronger"
    )
    numbers = {f"law_{k}": v for k, v in ours.items()} | {
        f"total_{k}": v for k, v in printed.items()
    }
    return Finding("holds", text, numbers)


@claim(
    "friction-independent",
    "Fig. 18, 19",
    "friction angle nearly independent of normal stress above zero",
)
def friction_independent() -> Finding:
    """Friction angle against normal stress by two definitions of yield, axes 2 and 3."""
    slides = [law_yield(s, 0.0).angle for s in STRESSES]
    fixed = [law_slip_angle(s, 0.0) for s in STRESSES]
    printed = [total_slip_angle(s, 0.0) for s in (STRESSES[0], STRESSES[-1])]
    text = (
        f"if yield is when all in touch slide: {min(slides):.1f}° to {max(slides):.1f}° from 0.1 "
        f"to 10 MPa (total form: {total_yield(0.0):.1f}° at every stress). Not if yield is a slip "
        f"of 1 mm, at the assumed contact density: {fixed[0]:.1f}° falls to {fixed[-1]:.1f}° "
        f"(total form {printed[0]:.1f}° to {printed[1]:.1f}°)"
    )
    numbers = {
        "slides_low": min(slides), "slides_high": max(slides), "fixed_first": fixed[0],
        "fixed_last": fixed[-1], "total_first": printed[0], "total_last": printed[1],
    }  # fmt: skip
    return Finding("one reading", text, numbers)


@claim("friction-at-zero", "Fig. 18, 19", "friction angle distinctly larger at zero normal stress")
def friction_at_zero() -> Finding:
    """Friction angle as the normal stress goes to zero, in the two orders of the limit."""
    limit = slip_limit()
    small, one = law_yield(NEARLY_ZERO, 0.0), law_yield(1e6, 0.0)
    steepest = math.pi / 2 / law(REPLICA).orientation.a
    far = total_angle(math.pi / 2 + 0.98 * steepest, 0.0)
    text = (
        "at zero normal stress every slip is far above the closure, and the angle is arctan μ + "
        f"π/2a = {limit:.1f}° ({far:.1f}° in the total form, all but the steepest 2 % separated), "
        f"against {one.angle:.1f}° at 1 MPa when all in touch slide. But in the limit of small "
        f"stress the yield at which all in touch slide comes at {small.shear / small.closure:.2f} "
        f"closures and {small.angle:.1f}°, lower"
    )
    numbers = {"limit": limit, "far": far, "at_1MPa": one.angle, "small": small.angle}
    return Finding("one reading", text, numbers)


@claim(
    "averages-not-enough",
    "section 5",
    "average height and inclination do not determine the behavior",
)
def averages_not_enough() -> Finding:
    """F2/F1 at delta_2 = 2 delta_1 for three shapes of one mean inclination, linear asperities."""
    base = law("linear-a3")
    mean = inclination(base.orientation)[0]
    values = {}
    for b in (-1.0, 0.0, 2.0):
        shape = Orientation((6 - b) / (6 * mean), b)
        found = JointLaw(
            orientation=shape, asperity=base.asperity, asperity_density=1.0, closure_range=1.0,
            resolution=base.resolution,
        )  # fmt: skip
        test = total_shear(found, [math.atan(2.0)], closure=1.0)
        values[b] = float(ratio(test)[0])
    spread = max(values.values()) / min(values.values()) - 1
    base_heights = law("westerly-smooth").heights
    assert isinstance(base_heights, GammaHeights)
    closed = [
        replace(
            law("westerly-smooth"),
            heights=GammaHeights.from_moments(
                base_heights.mean, scale * base_heights.variance, base_heights.overlap
            ),
        ).normal_stress(0.4e-6)
        for scale in (1.0, 2.0)
    ]
    wide = float(closed[1] / closed[0])
    text = (
        f"one mean inclination ({math.degrees(mean):.1f}°), three shapes: F₂/F₁ at δ₂ = 2 δ₁ is "
        + ", ".join(f"{value:.3f} (b = {b:g})" for b, value in values.items())
        + f", apart by {spread:.0%}. One mean height, its variance doubled: F₁ at 0.4 µm "
        f"× {wide:.2f}"
    )
    return Finding(
        "holds", text, {f"b={b:g}": value for b, value in values.items()} | {"wide": wide}
    )


def _curve(name: str, x: Array) -> tuple[Array, Array]:
    """F2/F1 at the displacements x (m): total form, incremental law."""
    printed, ours = total(name, TO, normal=NORMAL), incremental(name, TO, normal=NORMAL)
    return np.interp(x, printed.shear, ratio(printed)), np.interp(x, ours.shear, ratio(ours))
