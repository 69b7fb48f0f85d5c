"""Claims of section 2: heights (Eq. 11-13) and orientations (Eq. 14-18, Figures 5 and 7)."""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import quad

from ...parameters.heights import GammaHeights
from ...parameters.orientation import Orientation
from ...support.checks import Array
from ..closed_form import Shape, inclination
from ..figures.runs import WESTERLY, law
from .quadrature import directions
from .registry import Finding, claim


def random_shapes(count: int) -> list[Orientation]:
    """Admissible a, b, c drawn at random, always the same ones."""
    draw = np.random.default_rng(1999)
    shapes = []
    for _ in range(count):
        b = draw.uniform(-1.0, 2.0)
        bound = 1 / 3 - b / 6
        shapes.append(Orientation(1 + draw.exponential(2.0), b, draw.uniform(-bound, bound)))
    return shapes


@claim("contact-count", "Eq. 11", "asperities in touch: N_r = int_0^r N H dr")
def contact_count() -> Finding:
    """Count by the law against quadrature of H."""
    worst = 0.0
    for name, _, _ in WESTERLY:
        found, heights = law(name), _heights(name)
        for closure in (0.0, 1e-7, 5e-7, 5e-6):
            area, _ = quad(heights.pdf, 0.0, heights.overlap + closure, epsrel=1e-12)
            exact = found.asperity_density * area
            worst = max(worst, abs(float(found.contacts(closure)) / exact - 1))
    text = f"`law.contacts` agrees with the integral to {worst:.0e}"
    return Finding("holds", text, {"worst": worst})


@claim("height-moments", "Eq. 13", "mean beta (alpha + 1), variance beta^2 (alpha + 1)")
def height_moments() -> Finding:
    """Moments of the gamma density by quadrature."""
    worst, means = 0.0, {}
    for name, label, _ in WESTERLY:
        heights = _heights(name)
        x = np.linspace(0.0, 80.0, 40001)[1:] * heights.beta
        mass = heights.pdf(x) * x[0]
        mean = float(np.sum(x * mass))
        spread = float(np.sum((x - mean) ** 2 * mass))
        worst = max(worst, abs(mean / heights.mean - 1), abs(spread / heights.variance - 1))
        means[label] = mean * 1e6
    text = (
        f"quadrature agrees to {worst:.0e}; mean height {means['smooth']:.2f} µm smooth, "
        f"{means['rough']:.1f} µm rough"
    )
    return Finding("holds", text, {"worst": worst, **means})


@claim("density-domain", "Eq. 14", "sentence: 0 <= theta <= 2pi/a; equation: 0 <= theta <= pi/(2a)")
def density_domain() -> Finding:
    """The integral of Eq. 15 over both domains."""
    wide, _ = quad(lambda theta: 2.0 * math.sin(2.0 * theta), 0.0, math.pi)  # 2 pi/a at a = 2
    text = (
        f"the sentence is wrong: over 2pi/a the density sums to {abs(wide):.0f} (b = c = 0), over "
        "pi/(2a) to 1"
    )
    return Finding("misprint", text, {"sum_over_2pi/a": wide})


@claim("density-unity", "Eq. 15", "the density integrates to 1")
def density_unity() -> Finding:
    """Total of the density at random a, b, c."""
    totals = [directions(o.a, o.b, o.c).weight.sum() for o in random_shapes(100)]
    worst = float(np.max(np.abs(np.array(totals) - 1)))
    text = f"to {worst:.0e} at 100 random a, b, c"
    return Finding("holds", text, {"worst": worst})


@claim("contacts-by-direction", "Eq. 16", "N_Omega = N_r xi(Omega) dOmega")
def contacts_by_direction() -> Finding:
    """Counts by direction summed over all directions."""
    found, closure = law("westerly-rough"), 3e-7
    x, w = np.polynomial.legendre.leggauss(40)
    end = math.pi / (2 * found.orientation.a)
    theta = 0.5 * end * (x + 1)
    by_direction = np.array([float(found.contacts(closure, (t, 0.3))) for t in theta])
    total = float(np.sum(by_direction * np.sin(theta) * w) * 0.5 * end * 2 * math.pi)
    worst = abs(total / float(found.contacts(closure)) - 1)
    text = f"counts by direction sum to N_r to {worst:.0e}"
    return Finding("holds", text, {"worst": worst})


@claim("inclination-moments", "Eq. 17", "mean and variance of the inclination")
def inclination_moments() -> Finding:
    """Both moments against quadrature."""
    worst = 0.0
    for o in random_shapes(100):
        nodes = directions(o.a, o.b, o.c)
        theta = np.arccos(nodes.n[0])
        mean = float(np.sum(theta * nodes.weight))
        variance = float(np.sum((theta - mean) ** 2 * nodes.weight))
        ours = inclination(o)
        worst = max(worst, abs(mean - ours[0]), abs(variance - ours[1]))
    text = f"both to {worst:.0e} (rad, rad²) at 100 random a, b, c"
    return Finding("holds", text, {"worst": worst})


@claim("density-bounds", "Eq. 18", "-1 <= b <= 2 and |c| <= 1/3 - b/6 keep the density >= 0")
def density_bounds() -> Finding:
    """Least density inside the bounds, on them, and just outside."""
    inside = min(_least(o.b, 0.99 * o.c) for o in random_shapes(200) if -0.99 < o.b < 1.99)
    on = max(abs(_least(b, c)) for b, c in _boundary())
    outside = max(_least(b, c) for b, c in _boundary(1.01))
    text = (
        f"exact: least density (over its value at b = c = 0) {inside:.1e} > 0 inside, {on:.0e} on "
        f"the bounds, negative (at most {outside:.1e}) 1 % outside"
    )
    return Finding("holds", text, {"inside": inside, "on": on, "outside": outside})


@claim("smooth-limit", "section 2.2.2", "as a grows the density tends to a delta function")
def smooth_limit() -> Finding:
    """Mean and standard deviation of the inclination at large a."""
    mean, variance = inclination(Shape(1e4))
    text = (
        f"E[θ] = {math.degrees(mean):.4f}° ± {math.degrees(math.sqrt(variance)):.4f}° at a = 10⁴, "
        "0 at a = ∞"
    )
    return Finding("holds", text, {"mean": mean, "at_infinity": inclination(Shape(math.inf))[0]})


@claim("inclination-extent", "Fig. 7a, b", "extent pi/2 at a = 1 and pi/4 at a = 2")
def inclination_extent() -> Finding:
    """Largest inclination with a positive density."""
    theta = np.linspace(0.0, math.pi / 2, 9001)
    edges = [float(theta[np.asarray(Orientation(a).density(theta)) > 0][-1]) for a in (1.0, 2.0)]
    text = f"{math.degrees(edges[0]):.2f}° and {math.degrees(edges[1]):.2f}°"
    return Finding("holds", text, {"a=1": edges[0], "a=2": edges[1]})


@claim("shape-b", "Fig. 7a", "b = -1 crowds contacts towards the horizon, b = 2 towards the normal")
def shape_b() -> Finding:
    """Share of asperities steeper than 45 degrees at a = 1."""
    share = {b: _steep_share(b) for b in (-1.0, 0.0, 2.0)}
    text = (
        f"share inclined above 45° at a = 1: {share[-1.0]:.3f} (b = −1), {share[0.0]:.3f} (b = 0), "
        f"{share[2.0]:.3f} (b = 2)"
    )
    return Finding("holds", text, {f"b={b:g}": value for b, value in share.items()})


@claim("shape-b0", "section 2.2.2", "for b = 0 contacts are equally distributed in theta")
def shape_b0() -> Finding:
    """Variation of the density per solid angle over the cap."""
    spread = {
        a: float(Orientation(a).density(0.0) / Orientation(a).density(math.pi / (2 * a)))
        for a in (1.0, 2.0, 3.0)
    }
    text = (
        "per solid angle at a = 1 only: density at the axis over that at the edge is "
        f"{spread[1.0]:.3f} (a = 1), {spread[2.0]:.3f} (a = 2), {spread[3.0]:.3f} (a = 3); uniform "
        "in cos aθ for every a"
    )
    return Finding("one reading", text, {f"a={a:g}": value for a, value in spread.items()})


@claim("shape-c", "Fig. 7c", "c = 1/3 makes the density anisotropic in azimuth, c = 0 isotropic")
def shape_c() -> Finding:
    """Density at the horizon along axes 2 and 3."""
    edge = math.pi / 2
    skew, even = Orientation(1.0, 0.0, 1 / 3), Orientation(1.0)
    two, three = (float(skew.density(edge, phi)) for phi in (0.0, edge))
    ratio = float(even.density(edge, 0.0) / even.density(edge, edge))
    text = (
        f"at θ = 90°, a = 1: {two:.3f} along axis 2, {abs(three):.0e} along axis 3 (1/sr); ratio "
        f"{ratio:.0f} for c = 0"
    )
    return Finding("holds", text, {"axis_2": two, "axis_3": three, "ratio_c0": ratio})


@claim("mean-inclination", "sections 4.1, 4.3", "mean inclination 19° for a = 3 and 10° for a = 6")
def mean_inclination() -> Finding:
    """Eq. 17 at b = c = 0."""
    mean = {a: math.degrees(inclination(Shape(a))[0]) for a in (3.0, 6.0)}
    text = f"{mean[3.0]:.2f}° and {mean[6.0]:.2f}°"
    return Finding("holds", text, {"a=3": mean[3.0], "a=6": mean[6.0]})


def _heights(name: str) -> GammaHeights:
    heights = law(name).heights
    assert isinstance(heights, GammaHeights)
    return heights


def _least(b: float, c: float) -> float:
    """Least value over all directions of the bracket of Eq. 14."""
    u2 = np.linspace(0.0, 1.0, 201)
    bracket: Array = 1 + b / 2 * (3 * u2 - 1) - 3 * abs(c) * (1 - u2)
    return float(bracket.min())


def _boundary(scale: float = 1.0) -> list[tuple[float, float]]:
    """Points on the bounds of Eq. 18, or beyond them for scale > 1."""
    slanted = [(b, scale * (1 / 3 - b / 6)) for b in np.linspace(-1.0, 1.9, 30)]
    return [*slanted, *((-1.0 * scale, c) for c in (0.0, 0.2)), (2.0 * scale, 0.0)]


def _steep_share(b: float) -> float:
    """Share of the asperities inclined by more than 45 degrees at a = 1."""
    return float(directions(1.0, b, 0.0, math.pi / 4).weight.sum())
