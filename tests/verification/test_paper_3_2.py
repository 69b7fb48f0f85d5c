"""Section 3.2, sliding in closure: Eq. 5 to 10, 19 to 23, Table 2, Eq. 29 to 32, Fig. 10."""

import math

import numpy as np
import pytest
from builders import law
from paper_laws import directions, shapes

import jointlaw as jl
from jointlaw.paper.closed_form import Shape, closure_stiffness, inelastic, sliding_angle
from jointlaw.paper.secant import secant, series_limit, shear_factor

ROUNDING = 1e-12  # of sums of some hundred terms of order one
KN, KS = 1.7, 0.9


def linear(a, mu, b=0.0, c=0.0, **more):
    """Constant asperity stiffness: K_n = lam K and K_s = K."""
    return law(a=a, b=b, c=c, K=KS, lam=KN / KS, eta=0.0, mu=mu, **more)


@pytest.mark.parametrize("delta", [[1.0, 2.0, 0.0], [0.3, -1.0, 2.0]])
def test_sliding_asperity(delta):
    """Eq. 5-10: a sliding asperity carries f_i q_i = 0, so |f_s| = mu f_n
    Holds: Eq. 10 is the force of a single asperity, with ζ against the sliding and δ_rj for δ_r
    """
    n, mu, K = np.array([1.0, 0.0, 0.0]), 0.4, np.diag([KN, KS, KS])
    zeta = -np.array([0.0, *delta[1:]]) / math.hypot(*delta[1:])
    q = zeta + mu * n
    f = K @ (delta - (K @ q @ delta) / (K @ zeta @ q) * zeta)  # Eq. 10 as printed
    assert f @ q == pytest.approx(0.0, abs=ROUNDING)
    assert math.hypot(*f[1:]) == pytest.approx(mu * f[0], rel=ROUNDING)
    # asperities that lean by 1e-8 at most
    assert pytest.approx(f, abs=1e-7) == secant(linear(1e8, mu), delta).F


@pytest.mark.parametrize(
    ("delta", "eta", "contact"),
    [
        ([1.0, 0.8, 0.3], 0.0, "exact"),
        ([1.0, 0.8, 0.3], 0.5, "exact"),
        ([0.1, 0.6, 0.2], 0.5, "exact"),
        ([1.0, 0.2, 0.0], 0.5, "series"),
    ],
)
def test_total_force(delta, eta, contact):
    """Eq. 19-23: F_i = (C^e - C^p)_ij delta_j sums the asperity forces
    Holds: to 3e-6 against the sum over 80 000 asperities, which is what the sum errs by
    """
    a, b, c, lam, mu = 2.0, 0.5, 0.1, 1.2, 0.6
    n, weight = directions(a, b, c, order=240, azimuths=320)
    normal = np.tensordot(delta, n, 1)
    dn, slip = np.maximum(normal, 0.0), np.reshape(delta, (3, 1, 1)) - normal * n
    ds = np.sqrt((slip**2).sum(0))
    limit = 1.0 if contact == "exact" else series_limit(eta)
    x = ds / np.where(dn > 0, mu * lam * dn, np.inf)
    share = np.where(x < limit, x * shear_factor(np.minimum(x, limit), eta, contact), 1.0)
    forces = lam * dn ** (1 + eta) * (n + mu * share * slip / ds)
    found = secant(law(a, b, c, lam=lam, eta=eta, mu=mu), delta, contact)
    assert pytest.approx((weight * forces).sum(axis=(1, 2)), abs=3e-6) == found.F
    np.testing.assert_array_equal(found.F, (found.Ce - found.Cp) @ delta)


@pytest.mark.parametrize(("a", "mu"), [(1.0, 0.4), (2.0, 0.2), (3.0, 0.1)])
def test_sliding_angle(a, mu):
    """Eq. 30: in closure asperities slide beyond theta_s = arctan(mu K_n/K_s)
    Holds: so the sliding share at b = 0 is cos aθ_s, to rounding in the total form
    """
    start = math.atan(mu * KN / KS)
    share = math.cos(a * start)
    assert sliding_angle(KN, KS, mu) == pytest.approx(start, rel=1e-15)
    assert secant(linear(a, mu), [1.0, 0.0, 0.0]).sliding == pytest.approx(share, abs=ROUNDING)
    joint = linear(a, mu, resolution=jl.Resolution(250, 3, 1)).joint()
    joint.update([1.0, 0.0, 0.0])
    # a step function on 250 nodes: off by at most one weight, pi/2/250
    assert joint.measures().sliding == pytest.approx(share, abs=math.pi / 500)


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.3])
def test_table_2_as_printed(mu):
    """Table 2: C11p, C22p = C33p in closed form (a = 1, 2, infinity; b = c = 0)
    Misprint: a = 1 and 2 agree to rounding; at a = infinity C22p is K_s/2 at μ = 0 and 0 for μ > 0,
    not K_s
    """
    t = sliding_angle(KN, KS, mu)
    sin, cos, bend = math.sin(t), math.cos(t), 4 * t - math.pi - math.sin(4 * t)
    two, four = 4 * math.cos(2 * t), math.cos(4 * t)
    c11 = mu * KN * (sin**3 - 1) / 3 + KS * cos * (3 - cos**2) / 3
    c22 = mu * KN * (1 - sin**3) / 6 + KS * cos**3 / 6
    assert inelastic(Shape(1.0), KN, KS, mu) == pytest.approx([c11, c22, c22], abs=ROUNDING)
    c11 = mu * KN * bend / 8 + KS * (two - four - 1) / 8
    c22 = -mu * KN * bend / 16 + KS * (two + four + 1) / 16
    assert inelastic(Shape(2.0), KN, KS, mu) == pytest.approx([c11, c22, c22], abs=ROUNDING)
    smooth = [0.0, KS / 2, KS / 2] if mu == 0 else [0.0, 0.0, 0.0]
    assert inelastic(Shape(math.inf), KN, KS, mu) == pytest.approx(smooth, abs=ROUNDING)


def test_inelastic_stiffness_of_any_shape():
    """Section 3.2: C12p = C13p = C23p = 0 in closure
    Holds: to rounding, at 40 random a, b, c

    Eq. 29: C^p as an integral over the sliding orientations
    Holds: the closed form for every a, b, c agrees to rounding
    """
    for o, mu in zip(shapes(40), np.linspace(0.0, 0.5, 40), strict=True):
        Cp = secant(linear(o.a, mu, o.b, o.c), [0.7, 0.0, 0.0]).Cp
        assert pytest.approx(np.diag(inelastic(o, KN, KS, mu)), abs=ROUNDING) == Cp


@pytest.mark.parametrize("a", [1.0, 2.0, 3.3])
def test_incremental_law_closes_with_both_tables(a):
    exact = closure_stiffness(Shape(a), KN, KS, 0.25)
    F, C = linear(a, 0.25, resolution=jl.Resolution(400, 3, 1)).joint().update([1.0, 0.0, 0.0])
    # the integrand has a kink at theta_s: second order in the nodes, (1/400)^2 = 6e-6
    assert (F[0], C[0, 0]) == pytest.approx((exact, exact), abs=1e-5)


def test_frictionless_closure():
    """Eq. 31: mu = 0 gives C11p = 2 K_s/3 (a = 1), K_s/4 (a = 2)
    Holds: to rounding

    Eq. 32: mu = 0 gives C11 = K_n/3 (a = 1), 3 K_n/4 (a = 2), whatever K_s
    Holds: to rounding, for K_s from 0.1 to 3 K_n
    """
    for a, ks, lost, left in (
        (1, 0.1, 2 / 3, 1 / 3),
        (1, 3.0, 2 / 3, 1 / 3),
        (2, 0.7, 1 / 4, 3 / 4),
    ):
        found = inelastic(Shape(a), 1.0, ks, 0.0)[0] / ks, closure_stiffness(Shape(a), 1.0, ks, 0.0)
        assert found == pytest.approx((lost, left), rel=1e-14)


def test_sliding_vanishes_on_smooth_interfaces():
    """Section 3.2: C11p vanishes as a grows, and C11 tends to K_n
    Holds: as E[θ²] < 2/a² at μ = 0, and exactly from θ_s = π/2a on at μ > 0
    """
    for a in (10.0, 100.0, 1e4):
        free = inelastic(Shape(a, 0.0, 0.2), 1.0, 1.0, 0.0)
        assert free == pytest.approx([0.0, 0.6, 0.4], abs=2 / a**2)  # K_s (1 +- c)/2
    edge = math.tan(math.pi / 6)  # mu at which theta_s is the edge, a = 3, K_s = K_n
    assert not inelastic(Shape(3.0), 1.0, 1.0, edge * (1 + 1e-9)).any()
    assert inelastic(Shape(3.0), 1.0, 1.0, edge * (1 - 1e-6)).any()
    assert closure_stiffness(Shape(math.inf), 1.0, 0.5, 0.3) == pytest.approx(1.0, rel=1e-15)
