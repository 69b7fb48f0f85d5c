"""Figures 3 to 7: heights, axes and signs, orientations."""

from __future__ import annotations

import math

import numpy as np

from ...parameters.orientation import Orientation
from .runs import law
from .sheet import Curve, Mark, Panel, Sheet, sheet


def figure_3() -> Sheet:
    """Asperity heights of the smooth and the rough interface, Eq. 12."""
    r = np.linspace(0.0, 60e-6, 401)
    pdf, cdf = [], []
    for name, label, color in (
        ("westerly-smooth", "smooth", "C0"),
        ("westerly-rough", "rough", "C1"),
    ):
        heights = law(name).heights
        assert heights is not None
        text = f"{label}, r₀ = {heights.overlap * 1e6:g} µm"
        pdf.append(Curve(text, r * 1e6, heights.pdf(r) * 1e-6, "-", color))
        cdf.append(Curve(text, r * 1e6, heights.cdf(r), "-", color))
        at = heights.overlap
        point = np.array([at]) * 1e6
        pdf.append(Curve(f"_{label} at r0", point, np.array([heights.pdf(at)]) * 1e-6, "o", color))
        cdf.append(Curve(f"_{label} at r0", point, np.array([heights.cdf(at)]), "o", color))
    return sheet(
        "03",
        [
            Panel("density", "overlap r (µm)", "H(r) (1/µm)", pdf),
            Panel("in touch", "overlap r (µm)", "N_r/N (share)", cdf),
        ],
    )


def figure_4() -> Sheet:
    """Axes, angles and signs, in place of Figures 4 and 6."""
    theta, phi = math.radians(32), math.radians(40)
    n = (math.sin(theta), -math.cos(theta))
    s = (math.cos(theta), math.sin(theta))
    arc = np.radians(np.linspace(-90, -90 + 32, 30))
    turn = np.radians(np.linspace(0, 40, 30))
    edge = 0.62
    facet = np.array([-edge, edge])
    blue, red = "C0", "C3"
    section = Panel(
        "section along the azimuth of the asperity",
        "along the interface",
        "axis 1 (downwards)",
        [
            Curve("_facet", facet * s[0], facet * s[1], "-", "0.1"),
            Curve("_left", np.array([-1.7, -edge * s[0]]), np.full(2, -edge * s[1]), "-", "0.1"),
            Curve("_right", np.array([edge * s[0], 1.7]), np.full(2, edge * s[1]), "-", "0.1"),
            Curve("_theta", 0.55 * np.cos(arc), 0.55 * np.sin(arc), "-", "0.4"),
        ],
        marks=[
            Mark(0.0, -1.0, "1", (0.0, 0.0), "0.4"),
            Mark(n[0], n[1], "n", (0.0, 0.0), blue),
            Mark(s[0], s[1], "s", (0.0, 0.0), blue),
            Mark(0.16, -0.72, "θ"),
            Mark(-1.15, 0.35, "δ₁ > 0", (-1.15, 0.95), red),
            Mark(-0.45, 1.0, "shear > 0", (-1.0, 1.0), red),
            Mark(0.9, 1.25, "moving body: gets traction −F", None, red),
            Mark(0.85, -1.15, "body at rest: gets +F"),
        ],
        xlim=(-1.8, 1.8),
        ylim=(-1.4, 1.4),
        picture=True,
    )  # fmt: skip
    plan = Panel(
        "plan of the interface, seen along axis 1",
        "axis 2",
        "axis 3",
        [Curve("_phi", 0.45 * np.cos(turn), 0.45 * np.sin(turn), "-", "0.4")],
        marks=[
            Mark(1.1, 0.0, "2", (0.0, 0.0), "0.4"),
            Mark(0.0, 1.1, "3", (0.0, 0.0), "0.4"),
            Mark(0.9 * math.cos(phi), 0.9 * math.sin(phi), "n", (0.0, 0.0), blue),
            Mark(-0.8 * math.sin(phi), 0.8 * math.cos(phi), "t", (0.0, 0.0), blue),
            Mark(0.56, 0.2, "φ"),
            Mark(0.55, -0.3, "azimuth turns from 2 to 3"),
        ],
        xlim=(-1.8, 1.8),
        ylim=(-1.4, 1.4),
        picture=True,
    )
    return sheet(
        "04-06",
        [section, plan],
    )


def figure_5() -> Sheet:
    """Orientation densities of smooth and rough interfaces."""
    curves = [
        _density(Orientation(a), f"a = {a:g}: {text}", 90.0)
        for a, text in ((6, "smooth"), (3, "rough"), (1, "very rough, all directions"))
    ]
    return sheet(
        "05",
        [Panel("b = c = 0", "inclination θ (°)", "density ξ (1/sr)", curves)],
    )


def figure_7() -> Sheet:
    """Dependence of the orientation density on a, b and c."""
    panels = []
    for letter, a in (("a", 1.0), ("b", 2.0)):
        curves = [_density(Orientation(a, b), f"b = {b:g}", 90 / a) for b in (-1, 0, 2)]
        title = f"({letter}) a = {a:g}, c = 0"
        panels.append(Panel(title, "inclination θ (°)", "density ξ (1/sr)", curves))
    skew = Orientation(1.0, 0.0, 1 / 3)
    curves = [_density(skew, f"φ = {phi}°", 90.0, phi) for phi in (0, 45, 90)]
    panels.append(
        Panel("(c) a = 1, b = 0, c = 1/3", "inclination θ (°)", "density ξ (1/sr)", curves)
    )
    return sheet(
        "07",
        panels,
    )


def _density(orientation: Orientation, label: str, end: float, phi: float = 0.0) -> Curve:
    """Density over the inclinations from 0 to `end` degrees."""
    theta = np.unique([*np.linspace(0.0, end, 361), 90 / orientation.a, 90 / orientation.a + 1e-6])
    theta = theta[theta <= end]
    density = orientation.density(np.radians(theta), math.radians(phi))
    return Curve(label, theta, density)
