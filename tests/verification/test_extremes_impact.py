"""Undamped impacts under leapfrog: what they gain is the integrator's, and how small a step helps.

A whole Hertz impact lasts 4.03/omega of its stiffest moment, 2/share steps of this share of the
critical step 2/omega. Control: the bare power law F = y^(1 + eta), without any of this package.
"""

import numpy as np
import pytest
from extremes.impact import Flat, PowerLaw, bouncing, gains
from extremes.laws import COMPILED


@pytest.mark.parametrize("share", [0.95, 0.6, 0.2])
@pytest.mark.parametrize("eta", [0.0, 0.5, 2.0])
def test_joints_gain_what_the_bare_power_law_gains(eta, share):
    """Rounding of 1e-16, which the few steps of an impact hardly amplify."""
    bare, joint = (gains(contact, eta, share)[0] for contact in (PowerLaw, Flat))
    np.testing.assert_allclose(joint, bare, rtol=0.0, atol=1e-12)
    assert np.abs(bare).max() > 1e-7  # there is something to gain


@pytest.mark.parametrize("share", [0.95, 0.7, 0.3, 0.05])
def test_impact_on_a_linear_contact_in_closed_form(share):
    """In contact leapfrog keeps v- v+ + omega^2 x^2 exactly, and free flight keeps v^2. With the
    first sample in contact a part u of a step past touch, and the last a part w before the end,
    E_out/E_in = [1 - 4 share^2 u (1 - u)] / [1 - 4 share^2 w (1 - w)], at most 1/(1 - share^2)."""
    gained, u, w = gains(Flat, 0.0, share)
    lost = [1.0 - 4.0 * share**2 * s * (1.0 - s) for s in (u, w)]
    np.testing.assert_allclose(1.0 + gained, lost[0] / lost[1], rtol=1e-11)
    assert gained.max() <= 1.0 / (1.0 - share**2) - 1.0 + 1e-12


def test_an_undamped_hertz_impact_gains_less_in_smaller_steps():
    """The figures of docs/sharp-bits.md, which hold at any phase, with a third in hand."""
    for share, promised in ((0.5, 0.1), (0.2, 6e-3), (0.1, 6e-4), (0.05, 1e-4)):
        assert gains(Flat, 0.5, share)[0].max() < promised
    assert gains(Flat, 0.5, 0.95)[0].max() > 1.0


@pytest.mark.parametrize("contact", [PowerLaw, Flat])
def test_undamped_bouncing_breaks_loose_at_most_of_the_critical_step_and_not_at_a_fifth(contact):
    """1e6 steps are in docs/extremes.md."""
    assert bouncing(contact, 0.95, 3000)[0] > 1e6
    assert bouncing(contact, 0.2, 6000 if COMPILED else 2000)[0] < 0.03
