"""Figures 10 to 13: sliding in closure, closure curves, initial shear stiffness."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from ...law import JointLaw
from ...parameters.asperity import Asperity
from ...parameters.orientation import Orientation
from ...parameters.resolution import Resolution
from ...support.checks import Array
from ..secant import secant
from .runs import WESTERLY, changed, law
from .sheet import LAW, TOTAL, Curve, Panel, Sheet, sheet
from .total import total_closure

TOP_STRESS = 50e6  # Pa, our choice: the paper does not print the range of its axes


def figure_10() -> Sheet:
    """Orientations that slide in closure, and their share in both forms."""
    a, mu = 2.0, 0.6
    start = math.degrees(math.atan(mu))
    theta = np.linspace(0.0, 45.0, 181)
    count = a * np.sin(a * np.radians(theta)) * math.pi / 180
    slides = theta >= start
    left = [
        Curve("all asperities", theta, count),
        Curve("sliding, θ ≥ θ_s", theta[slides], count[slides], "-", "C3"),
        Curve(
            f"θ_s = {start:.1f}°", np.full(2, start), np.array([0.0, count[slides][0]]), ":", "C3"
        ),
    ]
    friction = np.linspace(0.0, 1.2, 25)
    right = []
    for color, wide in (("C0", 1.0), ("C1", 2.0), ("C2", 3.0)):
        exact, ours = [], []
        for value in friction:
            one, joint = _closed_linear(wide, float(value))
            exact.append(one)
            ours.append(joint)
        right.append(Curve(f"a = {wide:g}, total", friction, np.array(exact), "-", color))
        right.append(Curve(f"a = {wide:g}, incremental", friction, np.array(ours), "o", color))
    return sheet(
        "10",
        [
            Panel("count", "inclination θ (°)", "share per degree (1/°)", left),
            Panel("share that slides, K_s = K_n", "asperity friction μ", "sliding share", right),
        ],
    )


def figure_11() -> Sheet:
    """Closure curves of the smooth and the rough interface."""
    panels = []
    for title, top in ((TOTAL, TOP_STRESS), (LAW, TOP_STRESS), ("both, first 20 MPa", 20e6)):
        curves = []
        for name, label, color in WESTERLY:
            if title != LAW:
                closure = np.linspace(0.0, float(law(name).closure(top)), 101)
                stress = total_closure(law(name), closure)
                style = "--" if top < TOP_STRESS else "-"
                text = f"{label}, total" if top < TOP_STRESS else label
                curves.append(Curve(text, closure * 1e6, stress * 1e-6, style, color))
            if title != TOTAL:
                closure, stress = _closed(law(name), top)
                curves.append(Curve(label, closure * 1e6, stress * 1e-6, "-", color))
            if title == LAW:
                closure, stress = _closed(changed(name, formation="individual"), top)
                text = f"{label}, formation individual"
                curves.append(Curve(text, closure * 1e6, stress * 1e-6, ":", color))
        panels.append(Panel(title, "closure δ₁ (µm)", "normal stress F₁ (MPa)", curves))
    return sheet(
        "11",
        panels,
    )


def figure_12() -> Sheet:
    """Initial shear stiffness against normal stress."""
    stress = np.linspace(0.5e6, TOP_STRESS, 34)
    panels = []
    for part, kind in ((0, TOTAL), (1, LAW)):
        curves = []
        for name, label, color in WESTERLY:
            values = np.array([initial_shear_stiffness(law(name), float(s))[part] for s in stress])
            curves.append(Curve(label, stress * 1e-6, values * 1e-12, "-", color))
        axis = "initial shear stiffness (MPa/µm)"
        title = f"(a) granite, {kind}"
        panels.append(Panel(title, "normal stress (MPa)", axis, curves, ylim=(0.0, 210.0)))
    low = np.linspace(0.1e6, 10e6, 34)
    for part, kind in ((0, TOTAL), (1, LAW)):
        curves = []
        for azimuth, style in ((0, "-"), (45, "--"), (90, ":")):
            turn = math.radians(azimuth)
            unit = initial_shear_stiffness(law("jing-replica"), 10e6)[1]
            shares = np.array(
                [
                    initial_shear_stiffness(law("jing-replica"), float(s), turn)[part] / unit
                    for s in low
                ]
            )
            curves.append(Curve(f"azimuth {azimuth}°", low * 1e-6, shares, style, "C2"))
        axis = "stiffness/(incremental, 0°, 10 MPa)"
        title = f"(b) replica, {kind}"
        panels.append(Panel(title, "normal stress (MPa)", axis, curves, ylim=(0.0, 1.05)))
    return sheet(
        "12",
        panels,
    )


def figure_13() -> Sheet:
    """Directional dependence of the initial shear stiffness of the replica."""
    azimuth = np.arange(0.0, 361.0, 7.5)
    panels = []
    for part, kind in ((0, TOTAL), (1, LAW)):
        curves = []
        for stress, style in ((0.5e6, "-"), (2e6, "--"), (10e6, ":")):
            quarter = {
                x: initial_shear_stiffness(law("jing-replica"), stress, math.radians(x))[part]
                for x in np.arange(0.0, 91.0, 7.5)
            }
            values = np.array([quarter[_folded(x)] for x in azimuth])
            scaled = values / values[:-1].mean()
            curves.append(Curve(f"{stress * 1e-6:g} MPa", azimuth, scaled, style))
        panels.append(
            Panel(kind, "azimuth φ (°)", "stiffness/mean", curves, polar=True, ylim=(0.0, 1.4))
        )
    return sheet(
        "13",
        panels,
    )


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


def _folded(azimuth: float) -> float:
    """The azimuth of the first quarter that mirrors this one (degrees)."""
    turned = azimuth % 180.0
    return float(min(turned, 180.0 - turned))


def _closed(found: JointLaw, top: float) -> tuple[Array, Array]:
    closure = np.linspace(0.0, float(found.closure(top)), 101)
    return closure, np.asarray(found.normal_stress(closure))


def _closed_linear(a: float, mu: float) -> tuple[float, float]:
    """Sliding share in closure, total form and incremental law, K_s = K_n."""
    found = JointLaw(
        orientation=Orientation(a),
        asperity=Asperity(K=1.0, lam=1.0, eta=0.0, mu=mu),
        asperity_density=1.0,
        closure_range=1.0,
        resolution=Resolution(12, 3, 1),
    )
    joint = found.joint()
    joint.update([1.0, 0.0, 0.0])
    return secant(found, (1.0, 0.0, 0.0)).sliding, float(joint.sliding)
