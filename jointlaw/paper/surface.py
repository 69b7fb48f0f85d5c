"""Section 2, surface geometry: heights (Eq. 11-13) and orientations (Eq. 14-18), Figures 3 to 7."""

import math
from typing import Any

import numpy as np
from scipy.integrate import quad

from ..parameters.orientation import Orientation
from ..support.checks import Array
from .closed_form import Shape, inclination
from .quadrature import directions, random_shapes
from .runs import gamma_heights, law
from .section import Bound, Numbers, Section, largest, near, rounding

SECTION = Section()
WESTERLY = (("westerly-smooth", "smooth", "C0"), ("westerly-rough", "rough", "C1"))


# ------------------------------------------------------------------------------------ heights


@SECTION.figure(
    3,
    title="asperity height distributions, Westerly granite",
    caption=(
        "Gamma densities of Eq. 12 with the printed parameters (smooth: α = 3.82, β = 1.15 "
        "µm; rough: α = 6.14, β = 3.52 µm) and, right, the share of asperities in touch, "
        "Eq. 11 over N. Dots: the overlap r₀ at zero closure. The measured heights of the paper's "
        "figure are not printed as numbers."
    ),
    panels=2,
)
def figure_3(density: Any, in_touch: Any) -> None:
    r = np.linspace(0.0, 60e-6, 401)
    for name, label, color in WESTERLY:
        heights = gamma_heights(name)
        at = np.array([heights.overlap])
        text = f"{label}, r₀ = {heights.overlap * 1e6:g} µm"
        for axes, share, scale in ((density, heights.pdf, 1e-6), (in_touch, heights.cdf, 1.0)):
            axes.plot(r * 1e6, share(r) * scale, color=color, label=text)
            dot = {"color": color, "label": f"_{label} at r0"}
            axes.plot(at * 1e6, share(at) * scale, "o", **dot)
    density.set(title="height density", xlabel="overlap r (µm)", ylabel="H(r) (1/µm)")
    in_touch.set(title="asperities in touch", xlabel="overlap r (µm)", ylabel="Nᵣ/N (share)")


@SECTION.claim(
    "contact-count",
    "Eq. 11",
    "asperities in touch: N_r = int_0^r N H dr",
    "`law.contacts` agrees with the integral to {worst:.0e}",
    [Bound("worst", most=1e-10, why="the quadrature and the gamma function deliver about 1e-12")],
)
def contact_count() -> Numbers:
    misses = []
    for name, _, _ in WESTERLY:
        found, heights = law(name), gamma_heights(name)
        for closure in (0.0, 1e-7, 5e-7, 5e-6):
            share, _ = quad(heights.pdf, 0.0, heights.overlap + closure, epsrel=1e-12)
            misses.append(found.contacts(closure) / (found.asperity_density * share) - 1)
    return {"worst": largest(misses)}


@SECTION.claim(
    "height-moments",
    "Eq. 13",
    "mean beta (alpha + 1), variance beta^2 (alpha + 1)",
    "quadrature agrees to {worst:.0e}; mean height {smooth:.2f} µm smooth, {rough:.1f} µm rough",
    [Bound("worst", most=1e-8, why="sum with a step of beta/500 over a smooth density")],
)
def height_moments() -> Numbers:
    misses, means = [], {}
    for name, label, _ in WESTERLY:
        heights = gamma_heights(name)
        x = np.linspace(0.0, 80.0, 40001)[1:] * heights.beta
        mass = heights.pdf(x) * x[0]
        mean = float(np.sum(x * mass))
        spread = float(np.sum((x - mean) ** 2 * mass))
        misses += [mean / heights.mean - 1, spread / heights.variance - 1]
        means[label] = mean * 1e6
    return {"worst": largest(misses), **means}


# ------------------------------------------------------------------------------- orientations


@SECTION.figure(
    4,
    6,
    title="axes and signs",
    caption=(
        "In place of the paper's sketches. Axis 1 is the interface normal, along the closing "
        "motion; n = (cos θ, sin θ cos φ, sin θ sin φ) is the facet normal, s and "
        "t span the facet (Eq. 25). δ₁ > 0 closes, F₁ > 0 presses; F is the resistance in "
        "the sense of δ. A facet that leans towards the shear is loaded by it; one that leans "
        "away unloads and may separate."
    ),
    panels=2,
)
def figure_4(side: Any, plan: Any) -> None:
    theta, phi = math.radians(32), math.radians(40)
    n = np.array([math.sin(theta), -math.cos(theta)])
    s = np.array([math.cos(theta), math.sin(theta)])
    arc = np.radians(np.linspace(-90, -90 + 32, 30))
    turn = np.radians(np.linspace(0, 40, 30))
    edge = 0.62
    x, y = np.outer(s, [-edge, edge])
    for label, line in (
        ("_facet", (x, y)),
        ("_left", ([-1.7, x[0]], [y[0], y[0]])),
        ("_right", ([x[1], 1.7], [y[1], y[1]])),
    ):
        side.plot(*line, color="0.1", label=label)
    side.plot(0.55 * np.cos(arc), 0.55 * np.sin(arc), color="0.4", label="_theta")
    plan.plot(0.45 * np.cos(turn), 0.45 * np.sin(turn), color="0.4", label="_phi")
    blue, red, origin = "C0", "C3", (0.0, 0.0)
    for axes, tail, head, text, color in (
        (side, origin, (0.0, -1.0), "1", "0.4"),
        (side, origin, n, "n", blue),
        (side, origin, s, "s", blue),
        (side, (-1.15, 0.95), (-1.15, 0.35), "δ₁ > 0", red),
        (side, (-1.0, 1.0), (-0.45, 1.0), "shear > 0", red),
        (plan, origin, (1.1, 0.0), "2", "0.4"),
        (plan, origin, (0.0, 1.1), "3", "0.4"),
        (plan, origin, (0.9 * math.cos(phi), 0.9 * math.sin(phi)), "n", blue),
        (plan, origin, (-0.8 * math.sin(phi), 0.8 * math.cos(phi)), "t", blue),
    ):
        _arrow(axes, np.array(tail), np.array(head), text, color)
    for axes, where, text, color in (
        (side, (0.16, -0.72), "θ", "0.2"),
        (side, (0.9, 1.25), "moving body: gets traction −F", red),
        (side, (0.85, -1.15), "body at rest: gets +F", "0.2"),
        (plan, (0.56, 0.2), "φ", "0.2"),
        (plan, (0.55, -0.3), "azimuth turns from 2 to 3", "0.2"),
    ):
        axes.text(*where, text, color=color, ha="center")
    side.set(
        title="section along the azimuth of the asperity",
        xlabel="along the interface",
        ylabel="axis 1 (downwards)",
    )
    plan.set(title="plan of the interface, seen along axis 1", xlabel="axis 2", ylabel="axis 3")
    for axes in (side, plan):
        axes.set(xlim=(-1.8, 1.8), ylim=(-1.4, 1.4), aspect="equal")
        axes.set_axis_off()


def _arrow(axes: Any, tail: Array, head: Array, text: str, color: str) -> None:
    """An arrow with its text beyond the head."""
    arrow = {"arrowstyle": "-|>", "color": color, "lw": 1.4, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=head, xytext=tail, arrowprops=arrow)
    along = (head - tail) / np.hypot(*(head - tail))
    side = "center" if abs(along[0]) < 0.9 else "left" if along[0] > 0 else "right"
    axes.text(*(head + along * [0.08, 0.11]), text, color=color, ha=side, va="center")


@SECTION.figure(
    5,
    title="orientation densities of smooth and rough interfaces",
    caption=(
        "Eq. 14 with b = c = 0. The paper sketches this figure without values; a = 3 and a = 6 are "
        "those that it later uses for its rough and smooth interface."
    ),
)
def figure_5(axes: Any) -> None:
    for a, text in ((6, "smooth"), (3, "rough"), (1, "very rough, all directions")):
        _plot_density(axes, Orientation(a), f"a = {a:g}: {text}", 90.0)
    axes.set_title("b = c = 0")


@SECTION.figure(
    7,
    title="dependence of the orientation density on a, b and c",
    caption=(
        "Eq. 14 per solid angle, 0 ≤ θ ≤ π/2a. All parameters are printed. For b = 0 the "
        "density is constant at a = 1 only; at a = 2 it is constant in cos(a θ), not per solid "
        "angle."
    ),
    panels=3,
)
def figure_7(*panels: Any) -> None:
    for axes, letter, a in zip(panels, "ab", (1.0, 2.0), strict=False):
        for b in (-1, 0, 2):
            _plot_density(axes, Orientation(a, b), f"b = {b:g}".replace("-", "−"), 90 / a)
        axes.set_title(f"({letter}) a = {a:g}, c = 0")
    for phi in (0, 45, 90):
        _plot_density(panels[2], Orientation(1.0, 0.0, 1 / 3), f"φ = {phi}°", 90.0, phi)
    panels[2].set_title("(c) a = 1, b = 0, c = 1/3")


def _plot_density(
    axes: Any, orientation: Orientation, label: str, end: float, phi: float = 0.0
) -> None:
    """Density along the azimuth phi over the inclinations from 0 to `end` (degrees)."""
    edge = 90 / orientation.a
    theta = np.unique([*np.linspace(0.0, end, 361), edge, edge + 1e-6])
    theta = theta[theta <= end]
    axes.plot(theta, orientation.density(np.radians(theta), math.radians(phi)), label=label)
    axes.set(xlabel="inclination θ (°)", ylabel="density ξ (1/sr)")


@SECTION.claim(
    "density-domain",
    "Eq. 14",
    "sentence: 0 <= theta <= 2pi/a; equation: 0 <= theta <= pi/(2a)",
    "the sentence is wrong: over 2pi/a the density sums to {sentence:.0f} (b = c = 0), over "
    "pi/(2a) to {equation:.0f}",
    [rounding("sentence", 1.0)],
    misprint=[rounding("equation", 1.0)],
)
def density_domain() -> Numbers:
    a, numbers = 2.0, {}
    for name, end in (("sentence", 2 * math.pi / a), ("equation", math.pi / (2 * a))):
        numbers[name] = abs(quad(lambda theta: a * math.sin(a * theta), 0.0, end)[0])
    return numbers


@SECTION.claim(
    "density-unity",
    "Eq. 15",
    "the density integrates to 1",
    "to {worst:.0e} at 100 random a, b, c",
    [rounding("worst")],
)
def density_unity() -> Numbers:
    totals = [directions(o.a, o.b, o.c).weight.sum() - 1 for o in random_shapes(100)]
    return {"worst": largest(totals)}


@SECTION.claim(
    "contacts-by-direction",
    "Eq. 16",
    "N_Omega = N_r xi(Omega) dOmega",
    "counts by direction sum to N_r to {worst:.0e}",
    [rounding("worst")],
)
def contacts_by_direction() -> Numbers:
    found, closure = law("westerly-rough"), 3e-7
    x, w = np.polynomial.legendre.leggauss(40)
    end = math.pi / (2 * found.orientation.a)
    theta = 0.5 * end * (x + 1)
    by_direction = np.array([float(found.contacts(closure, (t, 0.3))) for t in theta])
    total = float(np.sum(by_direction * np.sin(theta) * w) * 0.5 * end * 2 * math.pi)
    return {"worst": abs(total / float(found.contacts(closure)) - 1)}


@SECTION.claim(
    "inclination-moments",
    "Eq. 17",
    "mean and variance of the inclination",
    "both to {worst:.0e} (rad, rad²) at 100 random a, b, c",
    [rounding("worst")],
)
def inclination_moments() -> Numbers:
    misses = []
    for o in random_shapes(100):
        nodes = directions(o.a, o.b, o.c)
        theta = np.arccos(nodes.n[0])
        mean = np.sum(theta * nodes.weight)
        variance = np.sum((theta - mean) ** 2 * nodes.weight)
        misses.append(np.subtract(inclination(o), (mean, variance)))
    return {"worst": largest(misses)}


@SECTION.claim(
    "density-bounds",
    "Eq. 18",
    "-1 <= b <= 2 and |c| <= 1/3 - b/6 keep the density >= 0",
    "exact: least density (over its value at b = c = 0) {inside:.1e} > 0 inside, {on:.0e} on the "
    "bounds, negative (at most {outside:.1e}) 1 % outside",
    [Bound("inside", least=0.0), rounding("on"), Bound("outside", most=0.0)],
)
def density_bounds() -> Numbers:
    inside = [_least(o.b, 0.99 * o.c) for o in random_shapes(200) if -0.99 < o.b < 1.99]
    on = [_least(b, c) for b, c in _boundary()]
    outside = [_least(b, c) for b, c in _boundary(1.01)]
    return {"inside": min(inside), "on": largest(on), "outside": max(outside)}


def _least(b: float, c: float) -> float:
    """Least value over all directions of the bracket of Eq. 14."""
    u2 = np.linspace(0.0, 1.0, 201)
    bracket: Array = 1 + b / 2 * (3 * u2 - 1) - 3 * abs(c) * (1 - u2)
    return float(bracket.min())


def _boundary(scale: float = 1.0) -> list[tuple[float, float]]:
    """Points on the bounds of Eq. 18, or beyond them for scale > 1."""
    slanted = [(b, scale * (1 / 3 - b / 6)) for b in np.linspace(-1.0, 1.9, 30)]
    return [*slanted, *((-1.0 * scale, c) for c in (0.0, 0.2)), (2.0 * scale, 0.0)]


@SECTION.claim(
    "smooth-limit",
    "section 2.2.2",
    "as a grows the density tends to a delta function",
    "E[θ] = {mean:.4f}° ± {spread:.4f}° at a = 10⁴, {at_infinity:.0f} at a = ∞",
    [
        Bound("mean", most=0.009, why="all inclinations are below 90°/a"),
        Bound("spread", most=0.009, why="all inclinations are below 90°/a"),
        rounding("at_infinity"),
    ],
)
def smooth_limit() -> Numbers:
    mean, variance = inclination(Shape(1e4))
    return {
        "mean": math.degrees(mean),
        "spread": math.degrees(math.sqrt(variance)),
        "at_infinity": math.degrees(inclination(Shape(math.inf))[0]),
    }


@SECTION.claim(
    "inclination-extent",
    "Fig. 7a, b",
    "extent pi/2 at a = 1 and pi/4 at a = 2",
    "{a1:.2f}° and {a2:.2f}°",
    [
        near("a1", 90.0, 0.02, "looked for on a grid of 0.01°"),
        near("a2", 45.0, 0.02, "looked for on a grid of 0.01°"),
    ],
)
def inclination_extent() -> Numbers:
    theta = np.linspace(0.0, 90.0, 9001)
    edges = [theta[Orientation(a).density(np.radians(theta)) > 0][-1] for a in (1.0, 2.0)]
    return {"a1": float(edges[0]), "a2": float(edges[1])}


@SECTION.claim(
    "shape-b",
    "Fig. 7a",
    "b = -1 crowds contacts towards the horizon, b = 2 towards the normal",
    "share inclined above 45° at a = 1: {minus:.3f} (b = −1), {zero:.3f} (b = 0), {two:.3f} "
    "(b = 2)",
    [Bound("minus", least="zero"), Bound("two", most="zero")],
)
def shape_b() -> Numbers:
    return {
        name: float(directions(1.0, b, 0.0, math.pi / 4).weight.sum())
        for name, b in (("minus", -1.0), ("zero", 0.0), ("two", 2.0))
    }


@SECTION.claim(
    "shape-b0",
    "section 2.2.2",
    "for b = 0 contacts are equally distributed in theta",
    "per solid angle at a = 1 only: density at the axis over that at the edge is {a1:.3f} "
    "(a = 1), {a2:.3f} (a = 2), {a3:.3f} (a = 3); uniform in cos aθ for every a",
    [rounding("a1", 1.0), rounding("a2", 1.0), rounding("a3", 1.0)],
    one_reading=[rounding("a1", 1.0)],
)
def shape_b0() -> Numbers:
    shapes = {f"a{a}": Orientation(a) for a in (1, 2, 3)}
    return {
        name: float(o.density(0.0) / o.density(math.pi / (2 * o.a))) for name, o in shapes.items()
    }


@SECTION.claim(
    "shape-c",
    "Fig. 7c",
    "c = 1/3 makes the density anisotropic in azimuth, c = 0 isotropic",
    "at θ = 90°, a = 1: {axis_2:.3f} along axis 2, {axis_3:.0e} along axis 3 (1/sr); ratio "
    "{ratio:.0f} for c = 0",
    [Bound("axis_2", least="axis_3"), rounding("ratio", 1.0)],
)
def shape_c() -> Numbers:
    edge = math.pi / 2
    skew, even = Orientation(1.0, 0.0, 1 / 3), Orientation(1.0)
    two, three = (float(skew.density(edge, phi)) for phi in (0.0, edge))
    ratio = float(even.density(edge, 0.0) / even.density(edge, edge))
    return {"axis_2": two, "axis_3": abs(three), "ratio": ratio}


@SECTION.claim(
    "mean-inclination",
    "sections 4.1, 4.3",
    "mean inclination 19° for a = 3 and 10° for a = 6",
    "{a3:.2f}° and {a6:.2f}°",
    [near("a3", 19.0, 0.5, "printed in degrees"), near("a6", 10.0, 0.5, "printed in degrees")],
)
def mean_inclination() -> Numbers:
    return {f"a{a}": math.degrees(inclination(Shape(a))[0]) for a in (3, 6)}
