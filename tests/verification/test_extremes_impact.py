"""Undamped impacts under leapfrog: what they gain is the integrator's, in closed form."""

import numpy as np
import pytest
from extremes.impact import gains

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("share", [0.95, 0.7, 0.3, 0.05])
def test_impact_on_a_linear_contact_in_closed_form(share):
    """In contact leapfrog keeps v- v+ + omega^2 x^2 exactly, and free flight keeps v^2. With the
    first sample in contact a part u of a step past touch, and the last a part w before the end,
    E_out/E_in = [1 - 4 share^2 u (1 - u)] / [1 - 4 share^2 w (1 - w)], at most 1/(1 - share^2)."""
    gained, u, w = gains(0.0, share)
    lost = [1.0 - 4.0 * share**2 * s * (1.0 - s) for s in (u, w)]
    np.testing.assert_allclose(1.0 + gained, lost[0] / lost[1], rtol=1e-11)
    assert gained.max() <= 1.0 / (1.0 - share**2) - 1.0 + 1e-12


def test_an_undamped_hertz_impact_gains_less_in_smaller_steps(record):
    """The figures of docs/limits.md, at 4000 phases of the step, with a third in hand."""
    most = {0.95: np.inf, 0.8: 0.4, 0.5: 0.1, 0.2: 6e-3, 0.1: 6e-4, 0.05: 1e-4}
    for share, promised in most.items():
        gained = gains(0.5, share, 4000)[0]
        record("impact", share, gained.min(), gained.max())
        assert gained.max() < promised
    assert gains(0.5, 0.95)[0].max() > 1.0
