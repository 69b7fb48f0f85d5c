"""The paper's laws, random shapes, and a plain grid over the orientations of Eq. 14 as printed."""

from dataclasses import replace
from functools import cache
from math import pi

import numpy as np

import jointlaw as jl


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
    """n of Eq. 25 (3, theta, phi), and xi sin(theta) dtheta dphi (theta, phi)."""
    x, w = np.polynomial.legendre.leggauss(order)
    half = (pi / (2 * a) - start) / 2
    P = 2 * pi * np.arange(azimuths) / azimuths * np.ones((order, 1))
    T = start + half * (x[:, None] + 1) + 0 * P
    shape = 1 + b / 4 * (3 * np.cos(2 * a * T) + 1) + 3 * c * np.sin(a * T) ** 2 * np.cos(2 * P)
    weight = a * np.sin(a * T) / azimuths * shape * half * w[:, None]  # sin(theta) cancels
    return np.array([np.cos(T), np.sin(T) * np.cos(P), np.sin(T) * np.sin(P)]), weight
