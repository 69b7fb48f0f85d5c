"""Undamped impacts under leapfrog: what they gain is the integrator's, and how small a step helps.

A whole Hertz impact lasts 4.03/omega of its stiffest moment, 2/share steps of this share of the
critical step 2/omega. Control: the bare power law F = y^(1 + eta), without any of this package.
"""

import numpy as np

import jointlaw as jl
from extremes.laws import build
from jointlaw.kernels.engine import Step


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
        self.step = Step(self.d, np.empty((n, 3)), None, None, keep=True)

    def move(self, d):
        """As `PowerLaw.move`."""
        self.d[:, 0] = d
        self.joints.take(self.step)
        return self.step.F[:, 0].copy()

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
