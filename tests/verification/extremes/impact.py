"""Undamped impacts under leapfrog: what they gain in energy, and how small a step helps.

A whole Hertz impact lasts 4.03/omega of its stiffest moment, 2/share steps of this share of the
critical step 2/omega.
"""

import numpy as np

import jointlaw as jl
from extremes.laws import build
from jointlaw.kernels.engine import Step


class Flat:
    """n joints whose facets all lie flat, so that F = y^(1 + eta), and mu is of no account."""

    def __init__(self, n, eta):
        law = build(
            a=1e8, b=0.0, c=0.0, K=1.0, lam=1.0, eta=eta, mu=0.4, density=1.0, range=1.0,
            resolution=jl.Resolution(1, 3, 1),
        )  # fmt: skip
        self.law, self.joints, self.d = law, law.joints(n), np.zeros((n, 3))
        self.step = Step(self.d, np.empty((n, 3)), None, None, keep=True)

    def move(self, d):
        """Force (n,) after closing by d (n,)."""
        self.d[:, 0] = d
        self.joints.take(self.step)
        return self.step.F[:, 0].copy()


def deepest(eta):
    """Closure that a unit mass reaches which touches at speed 1."""
    return (0.5 * (2.0 + eta)) ** (1.0 / (2.0 + eta))


def gains(eta, share, n=400):
    """Change of energy, of itself, of one impact at each of n phases of the step; and of each
    phase the places, as shares of a step, of the first and the last sample in contact."""
    dt = share * 2.0 / np.sqrt((1.0 + eta) * deepest(eta) ** eta)
    contact, v = Flat(n, eta), np.ones(n)
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
