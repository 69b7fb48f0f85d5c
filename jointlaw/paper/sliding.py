"""Section 3.2, sliding in closure: Eq. 5 to 10, 19 to 23, Table 2, Eq. 29 to 32, Figure 10.

Then section 4, one asperity and its power law: Eq. 33 to 36, and the limits of Eq. 37b.
"""

import math
from typing import Any

import numpy as np
from scipy.integrate import quad

from ..law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.resolution import Resolution
from ..support.checks import Array
from . import quadrature
from .closed_form import Shape, closure_stiffness, inelastic, sliding_angle
from .runs import simple
from .secant import secant, series_limit, shear_factor
from .section import Bound, Numbers, Section, largest, near, rounding

SECTION = Section()


@SECTION.claim(
    "sliding-asperity",
    "Eq. 5-10",
    "a sliding asperity carries f_i q_i = 0, so |f_s| = mu f_n",
    "to {worst:.0e} K_n δ, with ζ against the sliding (δ_r of Eq. 10 is δ_rj)",
    [rounding("worst")],
)
def sliding_asperity() -> Numbers:
    draw, misses = np.random.default_rng(10), []
    for _ in range(200):
        n = draw.normal(size=3)
        n /= np.linalg.norm(n)
        delta = draw.normal(size=3)
        delta = delta if delta @ n > 0 else -delta
        slip = delta - (delta @ n) * n
        zeta = -slip / np.linalg.norm(slip)
        kn, ks, mu = draw.uniform(0.1, 1.0, 3)
        K = kn * np.outer(n, n) + ks * (np.eye(3) - np.outer(n, n))
        q = zeta + mu * n
        f = K @ (delta - (K @ q @ delta) / (K @ zeta @ q) * zeta)  # Eq. 10 as printed
        misses += [np.linalg.norm(f - (f @ n) * n) - mu * (f @ n), f @ q]
    return {"worst": largest(misses)}


@SECTION.claim(
    "total-force",
    "Eq. 19-23",
    "F_i = (C^e - C^p)_ij delta_j sums the asperity forces",
    "to {worst:.0e} against a sum over 480 000 asperities (the grid's own error)",
    [Bound("worst", most=3e-6, why="sums over kinks: the square of the grid's step, 1/600")],
)
def total_force() -> Numbers:
    misses = []
    for delta in ((1.0, 0.0, 0.0), (1.0, 0.8, 0.3), (1.0, 2.5, -1.0), (0.1, 0.6, 0.2)):
        for eta, contact in ((0.0, "exact"), (0.5, "exact"), (0.5, "series")):
            found = simple(2.0, 0.6, eta=eta, lam=1.2, b=0.5, c=0.1)
            F = secant(found, delta, contact).F
            misses.append(
                _brute_force(found, np.array(delta), contact) / largest(F) - F / largest(F)
            )
    return {"worst": largest(misses)}


def _brute_force(found: JointLaw, delta: Array, contact: str) -> Array:
    """F by Eq. 19: the forces of 600 x 800 asperities added up."""
    o, p = found.orientation, found.asperity
    n, _, _, weight = quadrature.directions(o.a, o.b, o.c, order=600, azimuths=800)
    limit = 1.0 if contact == "exact" else series_limit(p.eta)
    normal = np.tensordot(delta, n, 1)
    dn = np.maximum(normal, 0.0)
    slip = delta[:, None, None] - normal * n
    ds = np.sqrt((slip**2).sum(0))
    fn = p.lam * p.K * dn ** (1 + p.eta)
    x = ds / np.where(dn > 0, p.mu * p.lam * dn, np.inf)
    share = np.where(x < limit, x * shear_factor(np.minimum(x, limit), p.eta, contact), 1.0)
    return np.asarray((weight * (fn * n + p.mu * fn * share * slip / ds)).sum(axis=(1, 2)))


@SECTION.claim(
    "sliding-angle",
    "Eq. 30",
    "in closure asperities slide beyond theta_s = arctan(mu K_n/K_s)",
    "sliding share to {worst:.0e}; at μ = 0.6 the angle runs from {half:.1f}° (K_s = K_n/2) to "
    "{double:.1f}° (K_s = 2 K_n)",
    [rounding("worst")],
)
def sliding_angle_claim() -> Numbers:
    misses = []
    for a, lam, mu in ((1.0, 1.0, 0.6), (2.0, 1.5, 0.3), (3.0, 1.2, 0.3)):
        start = sliding_angle(lam, 1.0, mu)
        share = math.cos(a * start) if a * start < math.pi / 2 else 0.0
        misses.append(secant(simple(a, mu, lam=lam), (1.0, 0.0, 0.0)).sliding - share)
    half, double = (math.degrees(sliding_angle(1.0, k, 0.6)) for k in (0.5, 2.0))
    return {"worst": largest(misses), "half": half, "double": double}


@SECTION.figure(
    10,
    title="asperities that slide in closure",
    caption=(
        "Left: share of asperities per degree of inclination for a = 2, b = c = 0, and those "
        "beyond θₛ = arctan(μ Kₙ/Kₛ), Eq. 30, at μ = 0.6 and Kₛ = Kₙ (the paper's "
        "sketch prints no values). Right: share of those that slide against μ. Lines: total form; "
        "dots: incremental law, whose orientations are discrete (96 inclinations)."
    ),
    panels=2,
)
def figure_10(left: Any, right: Any) -> None:
    a, start = 2.0, math.degrees(math.atan(0.6))
    theta = np.linspace(0.0, 45.0, 181)
    count = a * np.sin(a * np.radians(theta)) * math.pi / 180
    slides = theta >= start
    edge = [0.0, count[slides][0]]
    left.plot(theta, count, label="all asperities")
    left.plot(theta[slides], count[slides], color="C3", label="sliding, θ ≥ θₛ")
    left.plot([start, start], edge, ":", color="C3", label=f"θₛ = {start:.1f}°")
    left.set(
        title="all asperities by inclination",
        xlabel="inclination θ (°)",
        ylabel="share per degree (1/°)",
    )
    friction = np.linspace(0.0, 1.2, 25)
    for color, wide in (("C0", 1.0), ("C1", 2.0), ("C2", 3.0)):
        total, ours = np.transpose([_sliding_shares(wide, float(mu)) for mu in friction])
        right.plot(friction, total, color=color, label=f"a = {wide:g}, total")
        right.plot(friction, ours, "o", color=color, label=f"a = {wide:g}, incremental")
    title = "share that slides, Kₛ = Kₙ"
    right.set(title=title, xlabel="asperity friction μ", ylabel="sliding share")


def _sliding_shares(a: float, mu: float) -> tuple[float, float]:
    """Sliding share in closure, total form and incremental law, Kₛ = Kₙ."""
    found = simple(a, mu, resolution=Resolution(96, 3, 1))
    joint = found.joint()
    joint.update([1.0, 0.0, 0.0])
    return secant(found, (1.0, 0.0, 0.0)).sliding, float(joint.sliding)


@SECTION.claim(
    "table-2",
    "Table 2",
    "C11p, C22p = C33p in closed form (a = 1, 2, infinity; b = c = 0)",
    "every a, b, c: quadrature agrees to {worst:.0e}; rows a = 1, 2 as printed to {rows:.0e}. Last "
    "row wrong: C22p is {free:g} K_s at μ = 0 and {rough:g} for μ > 0, not K_s",
    [
        rounding("worst"),
        rounding("rows"),
        rounding("free", 1.0),
        rounding("rough", 1.0),
    ],
    misprint=[rounding("worst"), rounding("rows"), rounding("free", 0.5), rounding("rough")],
)
def table_2() -> Numbers:
    rows = [_printed_difference(a, mu) for a in (1.0, 2.0) for mu in (0.0, 0.2, 0.6)]
    free, rough = (inelastic(Shape(math.inf), 1.0, 0.5, mu)[1] / 0.5 for mu in (0.0, 0.1))
    found = quadrature.misses(29, quadrature.inelastic, inelastic, (0.1, 2.0), (0.0, 0.5))
    Cp = secant(simple(1.5, 0.3, b=0.5, c=0.2), (1.0, 0.0, 0.0)).Cp
    secant_cross = largest(Cp - np.diag(np.diag(Cp)))
    return found | {"rows": largest(rows), "free": free, "rough": rough, "secant": secant_cross}


SECTION.claim(
    "inelastic-cross-terms",
    "section 3.2",
    "C12p = C13p = C23p = 0 in closure",
    "largest {cross:.0e} K_n at 200 random a, b, c; {secant:.0e} in `secant`",
    [rounding("cross"), rounding("secant")],
)(table_2)


def _printed_difference(a: float, mu: float) -> Array:
    """Row of Table 2 as printed less the closed form, at K_n = 1, K_s = 0.8."""
    kn, ks = 1.0, 0.8
    t = sliding_angle(kn, ks, mu)
    sin, cos = math.sin, math.cos
    if a == 1.0:
        c11 = mu * kn * (sin(t) ** 3 - 1) / 3 + ks * cos(t) * (3 - cos(t) ** 2) / 3
        c22 = mu * kn * (1 - sin(t) ** 3) / 6 + ks * cos(t) ** 3 / 6
    else:
        bend = 4 * t - math.pi - sin(4 * t)
        c11 = mu * kn * bend / 8 + ks * (4 * cos(2 * t) - cos(4 * t) - 1) / 8
        c22 = -mu * kn * bend / 16 + ks * (4 * cos(2 * t) + cos(4 * t) + 1) / 16
    return np.array([c11, c22, c22]) - inelastic(Shape(a), kn, ks, mu)


@SECTION.claim(
    "frictionless-c11p",
    "Eq. 31",
    "mu = 0: C11p = 2 K_s/3 (a = 1), K_s/4 (a = 2)",
    "{c11p_a1:.6f} K_s and {c11p_a2:.6f} K_s",
    [rounding("c11p_a1", 2 / 3), rounding("c11p_a2", 1 / 4)],
)
def frictionless() -> Numbers:
    numbers = {"spread": 0.0}
    for a in (1, 2):
        c11 = [closure_stiffness(Shape(a), 1.0, ks, 0.0) for ks in (0.1, 0.7, 3.0)]
        numbers[f"c11p_a{a}"] = float(inelastic(Shape(a), 1.0, 0.7, 0.0)[0]) / 0.7
        numbers[f"c11_a{a}"] = c11[0]
        numbers["spread"] = max(numbers["spread"], max(c11) - min(c11))
    return numbers


SECTION.claim(
    "frictionless-c11",
    "Eq. 32",
    "mu = 0: C11 = K_n/3 (a = 1), 3 K_n/4 (a = 2), whatever K_s",
    "{c11_a1:.6f} K_n and {c11_a2:.6f} K_n; changes by {spread:.0e} as K_s goes from 0.1 to 3 K_n",
    [rounding("c11_a1", 1 / 3), rounding("c11_a2", 3 / 4), rounding("spread")],
)(frictionless)


@SECTION.claim(
    "inelastic-vanishes",
    "section 3.2",
    "C11p vanishes as a grows, C11 tends to K_n",
    "μ = 0: {free:.1e} K_n at a = 100; μ = 0.6, K_s = K_n: exactly {rough:g} from a = 2.91; C11 = "
    "{c11:g} K_n",
    [
        near("free", 0.0, 2 / 100**2, "of the order of E[θ²] < 2/a²"),
        rounding("rough"),
        rounding("c11", 1.0),
    ],
)
def inelastic_vanishes() -> Numbers:
    return {
        "free": float(inelastic(Shape(100.0), 1.0, 0.5, 0.0)[0]),
        "rough": float(inelastic(Shape(3.0), 1.0, 1.0, 0.6)[0]),
        "c11": closure_stiffness(Shape(math.inf), 1.0, 0.5, 0.3),
    }


# -------------------------------------------------------------- section 4, one asperity


@SECTION.claim(
    "hertz-parameters",
    "section 4.1",
    "G = 20 GPa, nu = 0.3, R = 40 um give K = 200 GPa um^1/2, lambda = 1.2",
    "K = {K:.1f} GPa µm^1/2, λ = {lam:.3f}",
    [
        near("K", 200.0, 5.0, "printed with two digits"),
        near("lam", 1.2, 0.05, "printed with two digits"),
    ],
)
def hertz_parameters() -> Numbers:
    asperity = Asperity.hertz_mindlin(20e9, 0.3, 40e-6, 0.3)
    return {"K": asperity.K * 1e-6, "lam": asperity.lam}


@SECTION.claim(
    "shear-law",
    "Eq. 35",
    "K_s falls from 3 K_n/2 lambda to K_n/lambda at sliding",
    "factors {start:.6f} and {end:.6f}; the incremental law on a flat facet follows Eq. 35 to "
    "{law:.0e} μ f_n (64 depth cells)",
    [
        near("start", 1.5, 1e-11, "read at x = 1e-12"),
        rounding("end", 1.0),
        Bound("law", most=2e-3, why="64 depth cells; falls with their number"),
    ],
)
def shear_law() -> Numbers:
    mu, lam = 0.3, 1.2
    joint = simple(1e6, mu, eta=0.5, lam=lam).joint()  # facets that are nearly flat
    joint.update([1.0, 0.0, 0.0])
    worst = 0.0
    for x in np.linspace(0.0, 1.2, 61):
        F, _ = joint.trial([0.0, x * mu * lam, 0.0])
        exact = min(x, 1.0) * float(shear_factor(min(x, 1.0), 0.5))
        worst = max(worst, abs(float(F[1]) / (mu * float(F[0])) - exact))
    start, end = shear_factor([0.0, 1.0], 0.5).tolist()
    return {"start": start, "end": end, "law": worst}


@SECTION.claim(
    "shear-series",
    "Eq. 36",
    "the series falls from 3 K_n/2 lambda to 1.063 K_n/lambda at sliding",
    "{start:.4f} to {end:.4f}, so f_s would be {end:.4f} μ f_n at sliding (and up to {peak:.3f}): "
    "it must be capped, and the cap is reached at d_s = {limit:.3f} μλ d_n already",
    [
        rounding("start", 1.5),
        near("end", 1.063, 1e-3, "printed with four digits"),
        Bound("peak", most=1.0 + 1e-12, why="no more than friction, but for rounding"),
    ],
    one_reading=[rounding("start", 1.5), near("end", 1.063, 1e-3, "printed with four digits")],
)
def shear_series() -> Numbers:
    x = np.linspace(0.0, 2.0, 200001)
    factor = shear_factor(x, 0.5, "series")
    return {
        "start": float(factor[0]),
        "end": float(shear_factor(1.0, 0.5, "series")),
        "limit": series_limit(0.5),
        "peak": float((x * factor).max()),
    }


@SECTION.claim(
    "sliding-angle-power",
    "section 4",
    "theta_s = arctan(lambda mu) for the power law",
    "{exact:.3f}° with Eq. 35 (arctan λμ = {arctan:.3f}°; a = 3, λ = 1.2, μ = 0.3); {series:.3f}° "
    "with the capped series of Eq. 36",
    [Bound("miss", most=1e-9, why="arccos of a share that is known to rounding")],
)
def sliding_angle_power() -> Numbers:
    a, mu, lam = 3.0, 0.3, 1.2
    found = simple(a, mu, eta=0.5, lam=lam)
    numbers = {"arctan": math.degrees(math.atan(lam * mu))}
    for contact in ("exact", "series"):
        share = secant(found, (1.0, 0.0, 0.0), contact).sliding
        numbers[contact] = math.degrees(math.acos(share) / a)
    return numbers | {"miss": abs(numbers["exact"] - numbers["arctan"])}


@SECTION.claim(
    "sliding-limits",
    "Eq. 37b",
    "the sliding domain runs from 0 to theta_s",
    "the limits are those of the asperities that do not slide: at μ = 0 they would give C11p = "
    "{within:.0f} where Eq. 31 has {beyond:.4f} K_s; the text above it and Eq. 29 (θ_s to π/2a) "
    "are right",
    [rounding("within", 2 / 3)],
    misprint=[rounding("beyond", 2 / 3)],
)
def sliding_limits() -> Numbers:
    mu = 0.0
    within, _ = quad(lambda theta: math.sin(theta) ** 3, 0.0, sliding_angle(1.0, 1.0, mu))
    return {"within": within, "beyond": float(inelastic(Shape(1.0), 1.0, 1.0, mu)[0])}
