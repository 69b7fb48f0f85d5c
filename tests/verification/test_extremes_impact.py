"""Undamped impacts under leapfrog: what they gain is the integrator's, and how small a step helps.

A whole Hertz impact lasts 4.03/omega of its stiffest moment, 2/share steps of this share of the
critical step 2/omega. Control: the bare power law F = y^(1 + eta), without any of this package.
"""

import numpy as np
import pytest
from extreme_laws import COMPILED, build

import jointlaw as jl


class PowerLaw:
    """n contacts F = y^(1 + eta)."""

    def __init__(self, n, eta):
        self.y, self.eta = np.zeros(n), eta

    def move(self, d):
        """Force (n,) after closing by d (n,)."""
        self.y = self.y + d
        return np.maximum(self.y, 0.0) ** (1.0 + self.eta) * (self.y > 0.0)

    def stored(self):
        """Elastic energy (n,)."""
        return np.maximum(self.y, 0.0) ** (2.0 + self.eta) / (2.0 + self.eta)


class Flat:
    """The same contacts as joints whose facets all lie flat: mu is of no account."""

    def __init__(self, n, eta):
        law = build(
            a=1e8, b=0.0, c=0.0, K=1.0, lam=1.0, eta=eta, mu=0.4, density=1.0, range=1.0,
            resolution=jl.Resolution(1, 3, 1),
        )  # fmt: skip
        self.law, self.joints, self.d = law, law.joints(n), np.zeros((n, 3))
        self.F = np.empty((n, 3))

    def move(self, d):
        """As `PowerLaw.move`."""
        self.d[:, 0] = d
        self.joints.update(self.d, tangent=False, out=(self.F, None))
        return self.F[:, 0].copy()

    def stored(self):
        """As `PowerLaw.stored`."""
        return self.joints.stored_energy


def deepest(eta, load=0.0):
    """Closure that a unit mass reaches which touches at speed 1, under a constant load."""
    top = 1.0
    for _ in range(200):
        top = ((2.0 + eta) * (0.5 + load * top)) ** (1.0 / (2.0 + eta))
    return top


def gains(contact, eta, share, n=400):
    """Change of energy, of itself, of one impact at each of n phases of the step; and of each
    phase the places, as shares of a step, of the first and the last sample in contact."""
    dt = share * 2.0 / np.sqrt((1.0 + eta) * deepest(eta) ** eta)
    contact, v = contact(n, eta), np.ones(n)
    x = -(np.arange(n) + 0.5) / n * dt
    contact.move(x)
    first, last = np.full(n, np.nan), np.full(n, np.nan)
    for _ in range(int(8.0 / share) + 8):
        x = x + v * dt
        v = v - contact.move(v * dt) * dt
        first = np.where(np.isnan(first) & (x > 0), x / dt, first)
        last = np.where(x > 0, x / np.abs(v * dt), last)
    assert (x < 0).all()
    assert (v < 0).all()
    return v**2 - 1.0, first, last


def bouncing(contact, share, steps, drop=1.0, n=32, eta=0.5, enough=1e6):
    """Masses that bounce under a load, from `drop` depths above: the largest growth of energy, of
    itself, and the steps taken, fewer than asked when it has grown `enough`."""
    load = 0.5 / (drop * deepest(eta))
    dt = share * 2.0 / np.sqrt((1.0 + eta) * deepest(eta, load) ** eta)
    x = -np.random.default_rng(0).random(n) * 0.5 * drop * deepest(eta)
    v, contact, most = np.sqrt(1.0 + 2.0 * load * x), contact(n, eta), 1.0
    F, begun = contact.move(x), None
    for k in range(steps):
        faster = v + (load - F) * dt
        if k % 97 == 0:
            energy = 0.5 * v * faster + contact.stored() - load * x
            begun = energy if k == 0 else begun
            most = max(most, float(np.max(energy / begun)))
            if most > enough:
                break
        v, x = faster, x + faster * dt
        F = contact.move(v * dt)
    return most - 1.0, k + 1


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
