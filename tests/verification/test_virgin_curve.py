"""The virgin curve and its bounds, against integrals written independently."""

import mpmath as mp
import numpy as np
import pytest

import jointlaw as jl
from jointlaw.discretisation.virgin_curve import exact_force, virgin_curve


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
