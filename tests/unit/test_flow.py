"""Flow along a joint: the cubic law against its integral, rough gaps, bad input."""

import numpy as np
import pytest
from scipy.integrate import quad

from jointlaw.laboratory.flow import hydraulic_aperture, transmissivity


def test_smooth_plates_let_through_what_the_velocity_profile_says():
    h, viscosity, gradient = 2e-4, 1.3e-3, 9789.0  # Pa/m for a unit gradient of head
    flow, _ = quad(lambda z: gradient / (2 * viscosity) * z * (h - z), 0.0, h, epsrel=1e-12)
    assert transmissivity(h, viscosity) == pytest.approx(flow, rel=1e-9)


def test_rough_gaps_let_through_as_their_geometric_mean():
    rng = np.random.default_rng(0)
    gaps = np.exp(rng.normal(np.log(1e-4), 0.6, 400_000))
    expected = np.exp(np.mean(np.log(gaps)))
    found = hydraulic_aperture(0.0, gaps.mean(), gaps.std())
    assert found == pytest.approx(expected, rel=0.01)  # 0.6/sqrt(4e5) of the sample, and its tails


def test_aperture_follows_closure_and_dilation():
    closure = np.array([0.0, 5e-5, -2e-5, 2e-4])
    np.testing.assert_allclose(
        hydraulic_aperture(closure, 1e-4), [1e-4, 5e-5, 1.2e-4, 0.0], rtol=1e-15
    )
    rough = hydraulic_aperture(closure, 1e-4, 3e-5)
    assert (rough[:3] < hydraulic_aperture(closure, 1e-4)[:3]).all()
    assert rough[3] == 0.0
