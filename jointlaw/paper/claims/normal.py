"""Claims on sliding: Eq. 5 to 10, 19 to 23, Table 2, Eq. 29 to 32."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from ...law import JointLaw
from ...parameters.asperity import Asperity
from ...parameters.orientation import Orientation
from ...parameters.resolution import Resolution
from ...support.checks import Array
from ..closed_form import HasShape, Shape, closure_stiffness, inelastic, sliding_angle
from ..secant import secant, series_limit, shear_factor
from . import quadrature
from .registry import Finding, claim
from .surface import random_shapes


@claim("sliding-asperity", "Eq. 5-10", "a sliding asperity carries f_i q_i = 0, so |f_s| = mu f_n")
def sliding_asperity() -> Finding:
    """Eq. 10 evaluated as printed for one asperity in random motion."""
    draw, worst = np.random.default_rng(10), 0.0
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
        f = K @ (delta - (K @ q @ delta) / (K @ zeta @ q) * zeta)
        shear = f - (f @ n) * n
        worst = max(worst, abs(float(np.linalg.norm(shear) - mu * (f @ n))), abs(float(f @ q)))
    text = f"to {worst:.0e} K_n δ, with ζ against the sliding (δ_r of Eq. 10 is δ_rj)"
    return Finding("holds", text, {"worst": worst})


@claim("total-force", "Eq. 19-23", "F_i = (C^e - C^p)_ij delta_j sums the asperity forces")
def total_force() -> Finding:
    """The total form against a plain sum of asperity forces over a fine grid."""
    worst = 0.0
    for delta in ((1.0, 0.0, 0.0), (1.0, 0.8, 0.3), (1.0, 2.5, -1.0), (0.1, 0.6, 0.2)):
        for eta, contact in ((0.0, "exact"), (0.5, "exact"), (0.5, "series")):
            found = simple(2.0, 0.6, eta=eta, lam=1.2, b=0.5, c=0.1)
            F = secant(found, delta, contact).F
            brute = _brute_force(found, np.array(delta), contact)
            worst = max(worst, float(np.max(np.abs(F - brute)) / np.max(np.abs(F))))
    text = f"to {worst:.0e} against a sum over 480 000 asperities (the grid's own error)"
    return Finding("holds", text, {"worst": worst})


@claim("sliding-angle", "Eq. 30", "in closure asperities slide beyond theta_s = arctan(mu K_n/K_s)")
def sliding_angle_claim() -> Finding:
    """Sliding share of the total form against the share of orientations beyond theta_s."""
    worst = 0.0
    for a, lam, mu in ((1.0, 1.0, 0.6), (2.0, 1.5, 0.3), (3.0, 1.2, 0.3)):
        start = sliding_angle(lam, 1.0, mu)
        share = math.cos(a * start) if a * start < math.pi / 2 else 0.0
        worst = max(worst, abs(secant(simple(a, mu, lam=lam), (1.0, 0.0, 0.0)).sliding - share))
    half, double = (math.degrees(sliding_angle(1.0, k, 0.6)) for k in (0.5, 2.0))
    text = (
        f"sliding share to {worst:.0e}; at μ = 0.6 the angle runs from {half:.1f}° (K_s = K_n/2) "
        f"to {double:.1f}° (K_s = 2 K_n)"
    )
    return Finding("holds", text, {"worst": worst, "half": half, "double": double})


@claim("table-2", "Table 2", "C11p, C22p = C33p in closed form (a = 1, 2, infinity; b = c = 0)")
def table_2() -> Finding:
    """Closed forms against quadrature at random a, b, c, and against the rows as printed."""
    worst, _ = _against_quadrature()
    rows = max(_printed_difference(a, mu) for a in (1.0, 2.0) for mu in (0.0, 0.2, 0.6))
    free = inelastic(Shape(math.inf), 1.0, 0.5, 0.0)
    rough = inelastic(Shape(math.inf), 1.0, 0.5, 0.1)
    text = (
        f"every a, b, c: quadrature agrees to {worst:.0e}; rows a = 1, 2 as printed to {rows:.0e}. "
        f"Last row wrong: C22p is {free[1] / 0.5:g} K_s at μ = 0 and {rough[1]:g} for μ > 0, not "
        "K_s"
    )
    numbers = {"worst": worst, "rows": rows, "free": free[1] / 0.5, "rough": rough[1]}
    return Finding("misprint", text, numbers)


@claim("inelastic-cross-terms", "section 3.2", "C12p = C13p = C23p = 0 in closure")
def inelastic_cross_terms() -> Finding:
    """Off-diagonal terms by quadrature, and in the total form."""
    cross = _against_quadrature()[1]
    Cp = secant(simple(1.5, 0.3, b=0.5, c=0.2), (1.0, 0.0, 0.0)).Cp
    ours = float(np.max(np.abs(Cp - np.diag(np.diag(Cp)))))
    text = f"largest {cross:.0e} K_n at 200 random a, b, c; {ours:.0e} in `secant`"
    return Finding("holds", text, {"worst": cross, "secant": ours})


@claim("frictionless-c11p", "Eq. 31", "mu = 0: C11p = 2 K_s/3 (a = 1), K_s/4 (a = 2)")
def frictionless_c11p() -> Finding:
    """Closed form at mu = 0."""
    one, two = (float(inelastic(Shape(a), 1.0, 0.7, 0.0)[0]) / 0.7 for a in (1.0, 2.0))
    text = f"{one:.6f} K_s and {two:.6f} K_s"
    return Finding("holds", text, {"a=1": one, "a=2": two})


@claim("frictionless-c11", "Eq. 32", "mu = 0: C11 = K_n/3 (a = 1), 3 K_n/4 (a = 2), whatever K_s")
def frictionless_c11() -> Finding:
    """Closure stiffness at mu = 0 for several K_s."""
    stiffness = {
        a: np.array([closure_stiffness(Shape(a), 1.0, ks, 0.0) for ks in (0.1, 0.7, 3.0)])
        for a in (1.0, 2.0)
    }
    spread = max(float(np.ptp(values)) for values in stiffness.values())
    one, two = (float(values[0]) for values in stiffness.values())
    text = f"{one:.6f} K_n and {two:.6f} K_n; changes by {spread:.0e} as K_s goes from 0.1 to 3 K_n"
    return Finding("holds", text, {"a=1": one, "a=2": two, "spread": spread})


@claim("inelastic-vanishes", "section 3.2", "C11p vanishes as a grows, C11 tends to K_n")
def inelastic_vanishes() -> Finding:
    """Closed forms at growing a, without and with friction."""
    free = float(inelastic(Shape(100.0), 1.0, 0.5, 0.0)[0])
    rough = float(inelastic(Shape(3.0), 1.0, 1.0, 0.6)[0])
    c11 = closure_stiffness(Shape(math.inf), 1.0, 0.5, 0.3)
    text = (
        f"μ = 0: {free:.1e} K_n at a = 100; μ = 0.6, K_s = K_n: exactly {rough:g} from a = 2.91; "
        f"C11 = {c11:g} K_n"
    )
    return Finding("holds", text, {"free": free, "rough": rough, "c11": c11})


def simple(
    a: float, mu: float, eta: float = 0.0, lam: float = 1.0, b: float = 0.0, c: float = 0.0
) -> JointLaw:
    """A law without heights, K = 1 and N = 1."""
    return JointLaw(
        orientation=Orientation(a, b, c),
        asperity=Asperity(K=1.0, lam=lam, eta=eta, mu=mu),
        asperity_density=1.0,
        closure_range=1.0,
        resolution=Resolution(1, 3, 64),
    )


def _brute_force(found: JointLaw, delta: Array, contact: str) -> Array:
    """F by Eq. 19: the forces of 600 x 800 asperities on an equal grid, added up."""
    o, p = found.orientation, found.asperity
    U = (np.arange(600) + 0.5) / 600  # equal shares of cos(a theta)
    phi = (np.arange(800) + 0.5) * 2 * math.pi / 800
    limit = 1.0 if contact == "exact" else series_limit(p.eta)
    theta, P = np.meshgrid(np.arccos(U) / o.a, phi, indexing="ij")
    bracket = 1 + o.b / 2 * (3 * U**2 - 1)
    weight = bracket[:, None] + 3 * o.c * (1 - U**2)[:, None] * np.cos(2 * P)
    n = np.array([np.cos(theta), np.sin(theta) * np.cos(P), np.sin(theta) * np.sin(P)])
    dn = np.maximum(np.tensordot(delta, n, 1), 0.0)
    slip: Array = delta[:, None, None] - np.tensordot(delta, n, 1) * n
    ds = np.sqrt((slip**2).sum(0))
    fn = p.lam * p.K * dn ** (1 + p.eta)
    x = ds / np.where(dn > 0, p.mu * p.lam * dn, np.inf)
    share = np.where(x < limit, x * shear_factor(np.minimum(x, limit), p.eta, contact), 1.0)
    force = weight * (fn * n + p.mu * fn * share * slip / ds)
    total: Array = force.mean(axis=(1, 2))
    return total


@cache
def _against_quadrature() -> tuple[float, float]:
    """Largest difference on the diagonal and largest cross term, over K_n, at random a, b, c."""
    draw = np.random.default_rng(29)
    worst = cross = 0.0
    shapes: list[HasShape] = [*random_shapes(200), Shape(1.0, 0.3, 0.2), Shape(2.0, 0.3, 0.2)]
    for o in shapes:
        ks, mu = float(draw.uniform(0.1, 2.0)), float(draw.uniform(0.0, 0.5))
        tensor = quadrature.inelastic(o.a, o.b, o.c, 1.0, ks, mu)
        worst = max(worst, float(np.max(np.abs(np.diag(tensor) - inelastic(o, 1.0, ks, mu)))))
        cross = max(cross, float(np.max(np.abs(tensor - np.diag(np.diag(tensor))))))
    return worst, cross


def _printed_difference(a: float, mu: float) -> float:
    """Largest miss of a row of Table 2 as printed, at K_n = 1, K_s = 0.8."""
    kn, ks = 1.0, 0.8
    t = sliding_angle(kn, ks, mu)
    sin, cos = math.sin, math.cos
    if a == 1.0:
        c11 = mu * kn * (sin(t) ** 3 - 1) / 3 + ks * cos(t) * (3 - cos(t) ** 2) / 3
        c22 = mu * kn * (1 - sin(t) ** 3) / 6 + ks * cos(t) ** 3 / 6
    else:
        bend = 4 * t - math.pi - sin(4 * t)
        c11 = mu * kn * bend / 8 + ks * (4 * cos(2 * t) - cos(4 * t) - 1) / 8
        c22 = mu * kn * (math.pi + sin(4 * t) - 4 * t) / 16
        c22 += ks * (4 * cos(2 * t) + cos(4 * t) + 1) / 16
    ours = inelastic(Shape(a), kn, ks, mu)
    return float(max(abs(c11 - ours[0]), abs(c22 - ours[1]), abs(c22 - ours[2])))
