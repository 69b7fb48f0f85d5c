"""The integrals of section 3 by brute force, term by term as printed, and the paper's laws.

The integrals share no code with `closed_form`: Gauss-Legendre in theta and equal azimuths over the
density of Eq. 14, and the tensors of Eq. 24, 26 and 29 contracted as they stand.
"""

from dataclasses import replace
from functools import cache
from math import atan2, pi

import numpy as np

import jointlaw as jl

PAIR = "iab,jab->ijab"


@cache
def preset(name):
    """A preset with 12 x 32 orientations, and 8 depth cells unless asperities are linear."""
    found = jl.presets.load(name)
    return replace(found, resolution=jl.Resolution(12, 16, 8 if found.asperity.eta else 1))


def shapes(count):
    """Admissible a, b, c drawn at random, always the same ones."""
    draw = np.random.default_rng(1999)
    b = draw.uniform(-1.0, 2.0, count)
    c = draw.uniform(-1.0, 1.0, count) * (1 / 3 - b / 6)
    return map(jl.Orientation, 1 + draw.exponential(2.0, count), b, c)


def directions(a, b, c, start=0.0, order=64, azimuths=32):
    """n, s, t of Eq. 25 (3, theta, phi), and xi sin(theta) dtheta dphi (theta, phi)."""
    x, w = np.polynomial.legendre.leggauss(order)
    half = (pi / (2 * a) - start) / 2
    P = 2 * pi * np.arange(azimuths) / azimuths * np.ones((order, 1))
    T = start + half * (x[:, None] + 1) + 0 * P
    shape = 1 + b / 4 * (3 * np.cos(2 * a * T) + 1) + 3 * c * np.sin(a * T) ** 2 * np.cos(2 * P)
    weight = a * np.sin(a * T) / azimuths * shape * half * w[:, None]  # sin(theta) cancels
    n = np.array([np.cos(T), np.sin(T) * np.cos(P), np.sin(T) * np.sin(P)])
    s = np.array([-np.sin(T), np.cos(T) * np.cos(P), np.cos(T) * np.sin(P)])
    return n, s, np.array([0 * T, -np.sin(P), np.cos(P)]), weight


def stiffness(n, s, t, kn, ks):
    """K_ij of every direction, Eq. 24."""
    return kn * np.einsum(PAIR, n, n) + ks * (np.einsum(PAIR, s, s) + np.einsum(PAIR, t, t))


def elastic(o, kn, ks):
    """Eq. 26: the tensor C^e/N, shape (3, 3)."""
    *nst, weight = directions(o.a, o.b, o.c)
    return np.einsum("ijab,ab->ij", stiffness(*nst, kn, ks), weight)


def inelastic(o, kn, ks, mu):
    """Eq. 29 with M, q and zeta = s of Eq. 6 and 9: the tensor C^p/N, shape (3, 3)."""
    start = min(atan2(mu * kn, ks), pi / (2 * o.a))
    n, s, t, weight = directions(o.a, o.b, o.c, start)
    K, q = stiffness(n, s, t, kn, ks), s + mu * n
    M = 1 / np.einsum("ijab,jab,iab->ab", K, s, q)
    return np.einsum("ab,ikab,kab,mjab,mab,ab->ij", M, K, s, K, q, weight)
