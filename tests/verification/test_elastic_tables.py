"""Elastic and sliding stiffness against the paper's closed forms (Tables 1 and 2)."""

import numpy as np
import pytest
from builders import law
from scipy.integrate import dblquad

import jointlaw as jl

R3 = np.sqrt(3.0)
KN, KS = 1.7, 0.9
D = KN - KS
# Table 1 as printed, with the sign of the c term of C33 at a = 3 corrected to minus
TABLE_1 = {
    1: lambda b, c: (
        (KN + 2 * KS) / 3 + 2 * b / 15 * D,
        (KN + 2 * KS) / 3 - b / 15 * D + 2 * c / 5 * D,
        (KN + 2 * KS) / 3 - b / 15 * D - 2 * c / 5 * D,
    ),
    2: lambda b, c: (
        (3 * KN + KS) / 4 + b / 16 * D,
        (KN + 7 * KS) / 8 - b / 32 * D + 5 * c / 32 * D,
        (KN + 7 * KS) / 8 - b / 32 * D - 5 * c / 32 * D,
    ),
    3: lambda b, c: (
        (7 * KN - 2 * KS) / 5 - 3 * R3 / 10 * D + (69 * R3 - 72) * b / 1540 * D,
        -(KN - 6 * KS) / 5
        + 3 * R3 / 20 * D
        - (69 * R3 - 72) * b / 3080 * D
        + (531 * R3 - 688) * c / 3080 * D,
        -(KN - 6 * KS) / 5
        + 3 * R3 / 20 * D
        - (69 * R3 - 72) * b / 3080 * D
        - (531 * R3 - 688) * c / 3080 * D,
    ),
}


def linear(a, b, c, mu, **more):
    """Constant asperity stiffness: one spring, K_n = lam K and K_s = K."""
    return law(a=a, b=b, c=c, K=KS, lam=KN / KS, eta=0.0, mu=mu, **more)


def admissible(rng, n):
    """Random b and c inside Eq. 18, and its corners."""
    b = np.append(rng.uniform(-1.0, 2.0, n), [-1.0, -1.0, 0.0, 2.0])
    c = np.append(rng.uniform(-1.0, 1.0, n), [1.0, -1.0, 1.0, 0.0]) * (1.0 / 3.0 - b / 6.0)
    return zip(b, c, strict=True)


@pytest.mark.parametrize("a", TABLE_1)
def test_table_1(a):
    for b, c in admissible(np.random.default_rng(a), 4):
        joint = linear(a, b, c, mu=1e9, resolution="reference").joint()
        joint.update([1.0, 0.0, 0.0])
        F, C = joint.trial([0.0, 0.0, 0.0])
        exact = np.diag(TABLE_1[a](b, c))
        # Gauss-Legendre in u converges geometrically: 10 nodes leave rounding; so the cross terms
        assert np.allclose(C, exact, rtol=0.0, atol=1e-10)
        assert np.allclose(F, exact[:, 0], rtol=0.0, atol=1e-10)


@pytest.mark.parametrize("a", [1.7, 4.0, 10.0])
def test_elastic_stiffness_is_equation_26_at_any_a(a):
    b, c = 0.8, -0.15

    def density(theta, phi):  # Eq. 14 times sin(theta)
        shape = 1 + b / 4 * (3 * np.cos(2 * a * theta) + 1)
        shape += 3 * c * np.sin(a * theta) ** 2 * np.cos(2 * phi)
        return a * np.sin(a * theta) / (2 * np.pi) * shape

    def n(theta, phi):
        sin = np.sin(theta)
        return np.cos(theta), sin * np.cos(phi), sin * np.sin(phi)

    joint = linear(a, b, c, mu=1e9, resolution="reference").joint()
    joint.update([1.0, 0.0, 0.0])
    C = joint.trial([0.0, 0.0, 0.0])[1]
    for i in range(3):

        def stiffness(theta, phi, i=i):
            return (KS + D * n(theta, phi)[i] ** 2) * density(theta, phi)

        exact = dblquad(stiffness, 0, 2 * np.pi, 0, np.pi / (2 * a), epsabs=1e-11)[0]
        assert C[i, i] == pytest.approx(exact, abs=1e-10)


@pytest.mark.parametrize("eta", [0.0, 0.5])
@pytest.mark.parametrize("a", [1.0, 2.0, 5.0])
def test_sliding_under_closure_starts_at_equation_30(a, eta):
    tan = np.tan(np.arccos(0.5) / a)  # the one inclination of a rule of one node
    for factor, share in ((1.0 + 1e-6, 0.0), (1.0 - 1e-6, 1.0)):
        one = law(a=a, b=0.0, c=0.0, K=KS, lam=KN / KS, eta=eta, mu=factor * tan * KS / KN,
                  resolution=jl.Resolution(1, 3, 4))  # fmt: skip
        joint = one.joint()
        joint.update([0.7, 0.0, 0.0])
        # eta = 1/2 too: shear and normal force of a facet grow in one proportion
        assert joint.sliding == pytest.approx(share, abs=1e-12)


def test_share_of_sliding_contacts_under_closure():
    for a, mu in ((1.0, 0.4), (2.0, 0.2)):
        joint = linear(a, 0.0, 0.0, mu, resolution=jl.Resolution(250, 3, 1)).joint()
        joint.update([1.0, 0.0, 0.0])
        exact = np.cos(a * np.arctan(mu * KN / KS))  # share with u < cos(a theta_s) at b = 0
        # a step function on 250 nodes: off by at most one weight, pi/2/250
        assert joint.sliding == pytest.approx(exact, abs=np.pi / 500)


@pytest.mark.parametrize("a", [1, 2])
def test_table_2_with_friction(a):
    mu = 0.25
    ts = np.arctan(mu * KN / KS)
    lost = {
        1: mu * KN / 3 * (np.sin(ts) ** 3 - 1) + KS / 3 * np.cos(ts) * (3 - np.cos(ts) ** 2),
        2: mu * KN / 8 * (4 * ts - np.pi - np.sin(4 * ts))
        + KS / 8 * (4 * np.cos(2 * ts) - np.cos(4 * ts) - 1),
    }[a]
    joint = linear(a, 0.0, 0.0, mu, resolution=jl.Resolution(400, 3, 1)).joint()
    F, C = joint.update([1.0, 0.0, 0.0])
    exact = TABLE_1[a](0.0, 0.0)[0] - lost
    # the integrand has a kink at theta_s: second order in the nodes, (1/400)^2 = 6e-6
    assert F[0] == pytest.approx(exact, abs=1e-5)
    assert C[0, 0] == pytest.approx(exact, abs=1e-5)
