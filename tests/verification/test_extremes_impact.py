"""Undamped impacts under leapfrog: what they gain in energy, and how small a step helps.

A whole Hertz impact lasts 4.03/omega of its stiffest moment, 2/share steps of this share of the
critical step 2/omega.
"""

import numpy as np
import pytest
from extremes.laws import build

import jointlaw as jl

pytestmark = pytest.mark.slow


def deepest(eta):
    """Closure that a unit mass reaches which touches at speed 1."""
    return (0.5 * (2.0 + eta)) ** (1.0 / (2.0 + eta))


def gains(eta, share, n=400):
    """Change of energy, of itself, of one impact at each of n phases of the step; and of each
    phase the places, as shares of a step, of the first and the last sample in contact."""
    dt = share * 2.0 / np.sqrt((1.0 + eta) * deepest(eta) ** eta)
    # all facets lie flat: F = y^(1 + eta), and mu is of no account
    contact = build(
        a=1e8, b=0.0, c=0.0, K=1.0, lam=1.0, eta=eta, mu=0.4, density=1.0, range=1.0,
        resolution=jl.Resolution(1, 3, 1),
    ).joints(n)  # fmt: skip
    x, v, closing = -(np.arange(n) + 0.5) / n * dt, np.ones(n), np.eye(3)[0]
    contact.update(np.outer(x, closing))
    first, last = np.full(n, np.nan), np.full(n, np.nan)
    for _ in range(int(8.0 / share) + 8):
        x = x + v * dt
        v = v - contact.update(np.outer(v * dt, closing), tangent=False)[0][:, 0] * dt
        first = np.where(np.isnan(first) & (x > 0), x / dt, first)
        last = np.where(x > 0, x / np.abs(v * dt), last)
    assert (x < 0).all()
    assert (v < 0).all()
    return v**2 - 1.0, first, last


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
