"""Laws and paths of the verification tests, in units of the closure range; the paper's laws, random
orientations, and a quadrature over the orientations of Eq. 14 as printed."""

from dataclasses import replace
from functools import cache
from math import pi

import numpy as np

import jointlaw as jl

SMOOTH_HEIGHTS = {"alpha": 3.82, "beta": 1.15, "overlap": 2.0}  # Westerly granite, in um


def law(a=3.0, b=0.5, c=0.1, K=1.0, lam=1.2, eta=0.5, mu=0.4, formation=None, damage=(), **more):
    """A joint law of unit closure range; `formation` switches the printed smooth heights on.

    damage: yield_interference of the asperities, as a mapping.
    """
    heights = None if formation is None else jl.GammaHeights(**SMOOTH_HEIGHTS, formation=formation)
    more = {"asperity_density": 1.0, "closure_range": 1.0, "resolution": "fine"} | more
    return jl.JointLaw(
        orientation=jl.Orientation(a, b, c),
        asperity=jl.Asperity(K=K, lam=lam, eta=eta, mu=mu, **dict(damage)),
        heights=heights,
        **more,
    )


def random_corners(rng, n, legs=6):
    """Corners (n, legs, 3): closed first, then at random, open in the middle, closed at the end."""
    corners = rng.uniform(-1.0, 1.0, (n, legs, 3)) * [0.6, 1.0, 1.0] + [0.4, 0.0, 0.0]
    corners[:, 0] *= [0.0, 0.3, 0.3]
    corners[:, 0, 0] = rng.uniform(0.5, 1.0, n)
    corners[:, legs // 2] *= [0.0, 1.0, 1.0]
    corners[:, legs // 2, 0] = rng.uniform(-4.0, -3.0, n) * (rng.random(n) < 0.5) - 0.2
    corners[:, -1, 0] = rng.uniform(0.5, 1.0, n)
    return corners


def increments(corners, steps):
    """Equal increments (n, legs * steps, 3) through corners (n, legs, 3), from zero."""
    legs = np.diff(corners, axis=1, prepend=0.0)
    return np.repeat(legs / steps, steps, axis=1)


@cache
def preset(name):
    """A preset with 12 x 32 orientations, and 8 cells a facet unless asperities are linear."""
    law = jl.presets.load(name)
    return replace(law, resolution=jl.Resolution(12, 16, 8 if law.asperity.eta else 1))


def shapes(count):
    """Random admissible orientations, the same in every run."""
    rng = np.random.default_rng(1999)
    b = rng.uniform(-1.0, 2.0, count)
    c = rng.uniform(-1.0, 1.0, count) * (1 / 3 - b / 6)
    return map(jl.Orientation, 1 + rng.exponential(2.0, count), b, c)


def directions(a, b, c, start=0.0, order=64, azimuths=32):
    """n of Eq. 25 (3, theta, phi), and xi sin(theta) dtheta dphi (theta, phi)."""
    x, w = np.polynomial.legendre.leggauss(order)
    half = (pi / (2 * a) - start) / 2
    P = 2 * pi * np.arange(azimuths) / azimuths * np.ones((order, 1))
    T = start + half * (x[:, None] + 1) + 0 * P
    shape = 1 + b / 4 * (3 * np.cos(2 * a * T) + 1) + 3 * c * np.sin(a * T) ** 2 * np.cos(2 * P)
    weight = a * np.sin(a * T) / azimuths * shape * half * w[:, None]  # sin(theta) cancels
    return np.array([np.cos(T), np.sin(T) * np.cos(P), np.sin(T) * np.sin(P)]), weight
