"""The integrals of section 3 by brute force, term by term as printed: what the tables are held to.

Shares no code with `closed_form`: Gauss-Legendre in theta and equal azimuths over the density of
Eq. 14, and the tensors of Eq. 24, 26 and 29 contracted as they stand.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..parameters.orientation import Orientation, largest_c
from ..support.checks import Array
from .section import Numbers, largest


class Directions(NamedTuple):
    """n, s, t of Eq. 25, shape (3, theta, phi), and xi sin(theta) dtheta dphi (theta, phi)."""

    n: Array
    s: Array
    t: Array
    weight: Array


def directions(
    a: float, b: float, c: float, start: float = 0.0, order: int = 64, azimuths: int = 32
) -> Directions:
    """Nodes over start <= theta <= pi/(2a) and the whole circle of azimuths (rad)."""
    x, w = np.polynomial.legendre.leggauss(order)
    width = math.pi / (2 * a) - start
    T, P = np.meshgrid(
        start + width * (x + 1) / 2, 2 * math.pi * np.arange(azimuths) / azimuths, indexing="ij"
    )
    shape = 1 + b / 4 * (3 * np.cos(2 * a * T) + 1) + 3 * c * np.sin(a * T) ** 2 * np.cos(2 * P)
    xi_sin = a * np.sin(a * T) / (2 * math.pi) * shape  # sin(theta) of Eq. 14 cancels
    weight = xi_sin * (w * width / 2)[:, None] * (2 * math.pi / azimuths)
    ct, st, cp, sp = np.cos(T), np.sin(T), np.cos(P), np.sin(P)
    return Directions(
        np.array([ct, st * cp, st * sp]),
        np.array([-st, ct * cp, ct * sp]),
        np.array([np.zeros_like(T), -sp, cp]),
        weight,
    )


def elastic(a: float, b: float, c: float, kn: float, ks: float) -> Array:
    """Eq. 26 with the stiffness of Eq. 24: the tensor C^e/N, shape (3, 3)."""
    n, s, t, weight = directions(a, b, c)
    return np.asarray(np.einsum("ijab,ab->ij", _stiffness(n, s, t, kn, ks), weight))


def inelastic(a: float, b: float, c: float, kn: float, ks: float, mu: float) -> Array:
    """Eq. 29 with M, q and zeta = s of Eq. 6 and 9: the tensor C^p/N, shape (3, 3)."""
    start = math.atan2(mu * kn, ks)
    if start >= 0.5 * math.pi / a:
        return np.zeros((3, 3))
    n, s, t, weight = directions(a, b, c, start)
    K = _stiffness(n, s, t, kn, ks)
    q = s + mu * n
    M = 1 / np.einsum("ijab,jab,iab->ab", K, s, q)
    K_zeta, q_K = np.einsum("ikab,kab->iab", K, s), np.einsum("mjab,mab->jab", K, q)
    return np.asarray(np.einsum("ab,iab,jab,ab->ij", M, K_zeta, q_K, weight))


def _stiffness(n: Array, s: Array, t: Array, kn: float, ks: float) -> Array:
    """K_ij of every direction, Eq. 24."""
    pair = "iab,jab->ijab"
    normal, shear = np.einsum(pair, n, n), np.einsum(pair, s, s) + np.einsum(pair, t, t)
    return np.asarray(kn * normal + ks * shear)


def random_shapes(count: int) -> list[Orientation]:
    """Admissible a, b, c drawn at random, always the same ones."""
    draw = np.random.default_rng(1999)
    shapes = []
    for _ in range(count):
        b = draw.uniform(-1.0, 2.0)
        bound = largest_c(b)
        shapes.append(Orientation(1 + draw.exponential(2.0), b, draw.uniform(-bound, bound)))
    return shapes


def misses(
    seed: int,
    integrated: Callable[..., Array],
    closed: Callable[..., Array],
    *ranges: tuple[float, float],
) -> Numbers:
    """How far a closed form is off the integral, at 200 random a, b, c and at a = 1 and 2.

    K_n = 1; ranges: from which the other parameters are drawn. Returns the largest difference on
    the diagonal ("worst") and the largest cross term ("cross").
    """
    draw = np.random.default_rng(seed)
    worst, cross = [], []
    for o in (*random_shapes(200), Orientation(1.0, 0.3, 0.2), Orientation(2.0, 0.3, 0.2)):
        given = [1.0, *(float(draw.uniform(*ends)) for ends in ranges)]
        tensor = integrated(o.a, o.b, o.c, *given)
        worst.append(np.diag(tensor) - closed(o, *given))
        cross.append(tensor - np.diag(np.diag(tensor)))
    return {"worst": largest(worst), "cross": largest(cross)}
