"""The virgin curve and its bounds, against integrals written independently."""

import mpmath as mp
import numpy as np
import pytest
from builders import law, slow_heights
from slow_bed import cap_quadrature
from slow_virgin import virgin

import jointlaw as jl
from jointlaw.discretisation.virgin_curve import exact_force, virgin_curve

FORMATIONS = [None, "population", "individual"]
FAR = [1e-4, 0.01, 0.3, 1.0, 3.0, 12.0, 60.0, 500.0]  # closure ranges


def closure_stress(y, formation, eta, mu, lam=1.2, a=3.0, b=0.5):
    """F1 under pure closure: each facet at min(tan/lam, mu) of its normal force."""
    n, w = cap_quadrature(a, b, 0.0, 60, 8)  # a kink in theta: second order in 60
    c1, s1 = n[:, 0], np.hypot(n[:, 1], n[:, 2])
    per_facet = w * lam * c1 ** (1.0 + eta) * (c1 + s1 * np.minimum(s1 / c1 / lam, mu))
    return per_facet.sum() * virgin(y, eta, slow_heights(formation))[0]


@pytest.mark.parametrize("formation", FORMATIONS)
@pytest.mark.parametrize("eta", [0.3, 0.5, 1.0])
def test_closure_from_tiny_to_huge(formation, eta):
    one = law(eta=eta, mu=5.0, formation=formation, resolution="reference")
    for y in FAR:
        exact = closure_stress(y, formation, eta, mu=5.0)
        # the curve's table is asked for 1e-10 of its largest value, P(r0) is 0.06 of that
        assert one.normal_stress(y) == pytest.approx(exact, rel=1e-8)
        joint = one.joint()
        assert joint.update([y, 0.0, 0.0])[0][0] == pytest.approx(exact, rel=1e-8)
        assert one.closure(exact) == pytest.approx(y, rel=1e-8)


@pytest.mark.parametrize("eta", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("alpha", [-1.0 + 1e-9, -0.99, -0.5, -0.1])
def test_a_density_infinite_at_the_point_of_contact(alpha, eta):
    """Phi of "individual" gamma heights without overlap is Kummer's function, and rises as
    y^(2 + alpha + eta): over thirty decades, from a table good to 1e-10 of the largest S / w^p."""
    heights = jl.GammaHeights(alpha, 1.15, 0.0, "individual")
    curve = virgin_curve(eta, heights)
    p, q = mp.mpf(alpha) + 1, mp.mpf(eta) + 1
    rise = mp.gamma(q + 1) / mp.gamma(p + q + 1)
    y = np.geomspace(1e-30, 1e4, 35)
    force, slope = curve.force(y)
    # at touch the force is a power of y, and so is its integral
    assert curve.energy(y)[0] / (y[0] * force[0]) == pytest.approx(1 / float(p + q + 1), rel=1e-6)
    with mp.workdps(30):
        for k, z in enumerate(map(mp.mpf, y / 1.15)):
            S = rise * z**p * mp.hyp1f1(p, p + q + 1, -z)
            DS = p * (S - rise * z ** (p + 1) / (p + q + 1) * mp.hyp1f1(p + 1, p + q + 2, -z))
            assert force[k] / y[k] ** (1 + eta) == pytest.approx(float(S), rel=1e-9)
            # a derivative of the table is one order lower
            assert slope[k] / y[k] ** eta == pytest.approx(float((1 + eta) * S + DS), rel=1e-6)
            assert exact_force(y[k : k + 1], eta, heights)[0] == pytest.approx(force[k], rel=1e-9)
