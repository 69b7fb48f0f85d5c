"""Closed forms of section 3: Tables 1 and 2 for every real a >= 1 and every admissible b and c.

With U = a theta in [0, pi/2], beta = 2/a and the azimuth integrated out, the density of Eq. 14 is

    g0(U) = (1 - b/8) sin U + (3b/8) sin 3U         the count, and
    g2(U) = (3c/8) (3 sin U - sin 3U)               its share of cos 2 phi,

while sin^2, cos^2 and sin cos of theta are 1, cos and sin of beta U. So every entry of both tables
is a sum of integrals of sin pU cos beta U and sin pU sin beta U with p = 1 and 3, or of sin kU and
cos kU with k = p + beta and p - beta. Written with sinc they have no pole at k = 0 (a = 2).

Stiffnesses are per asperity, C/N, in the unit of kn and ks (N/m). An `orientation` may be an
`Orientation` or a `Shape`, whose a may be infinite.
"""

import math
from typing import NamedTuple

import numpy as np

from ..parameters.orientation import Orientation, bounded
from ..support.checks import Array, at_least, number


class Shape(NamedTuple):
    """The parameters a, b, c of Eq. 14; `Shape(math.inf)` is the perfectly smooth interface."""

    a: float
    b: float = 0.0
    c: float = 0.0


HasShape = Orientation | Shape


def elastic(orientation: HasShape, kn: float, ks: float) -> Array:
    """Elastic stiffness of the interface: Table 1, which is Eq. 26, for any a, b, c.

    kn, ks: normal and shear stiffness of an asperity (N/m), >= 0.
    Returns (C11, C22, C33)/N in N/m, shape (3,); the cross terms are zero.
    Raises ValueError for a negative or non-finite stiffness and outside the bounds of Eq. 18.
    """
    kn = at_least("kn", kn, 0.0)
    ks = at_least("ks", ks, 0.0)
    (sin2, sin2_anisotropic), (cos2, _), _ = _moments(_shape(orientation), 0.0)
    normal = kn * cos2 + ks * sin2
    shear = (kn * sin2 + ks * (1.0 + cos2)) / 2
    anisotropy = (kn - ks) * sin2_anisotropic / 2
    return np.array([normal, shear + anisotropy, shear - anisotropy])


def inelastic(orientation: HasShape, kn: float, ks: float, mu: float) -> Array:
    """Inelastic stiffness under closure: Table 2, which is Eq. 29, for any a, b, c.

    kn, ks: normal and shear stiffness of an asperity (N/m), >= 0; mu: its friction, >= 0.
    Returns (C11p, C22p, C33p)/N in N/m, shape (3,); the cross terms are zero. All terms are zero
    where no asperity is inclined beyond the sliding angle of Eq. 30, so at a = infinity for every
    mu > 0; at mu = 0 the limit is (0, ks (1 + c)/2, ks (1 - c)/2).
    Raises ValueError for a negative or non-finite number and outside the bounds of Eq. 18.
    """
    shape = _shape(orientation)
    theta_s = sliding_angle(kn, ks, mu)
    U_s = theta_s * shape.a if theta_s > 0 else 0.0
    if U_s >= math.pi / 2:
        return np.zeros(3)
    moments = _moments(shape, U_s)
    (sin2, _), (cos2, cos2_anisotropic), (sincos, sincos_anisotropic) = moments
    normal = ks * sin2 - mu * kn * sincos
    shear = (ks * cos2 + mu * kn * sincos) / 2
    anisotropy = (ks * cos2_anisotropic + mu * kn * sincos_anisotropic) / 2
    return np.array([normal, shear + anisotropy, shear - anisotropy])


def closure_stiffness(orientation: HasShape, kn: float, ks: float, mu: float) -> float:
    """C11/N = (C11e - C11p)/N of a closing interface, in N/m: Eq. 31 and 32 at mu = 0, for any a.

    Without friction it is kn times the mean of cos^2 theta, independent of ks.
    """
    return float(elastic(orientation, kn, ks)[0] - inelastic(orientation, kn, ks, mu)[0])


def sliding_angle(kn: float, ks: float, mu: float) -> float:
    """Inclination in rad beyond which asperities slide in closure: arctan(mu kn/ks), Eq. 30."""
    kn = at_least("kn", kn, 0.0)
    ks = at_least("ks", ks, 0.0)
    return math.atan2(at_least("mu", mu, 0.0) * kn, ks)


def shear_stiffness(orientation: HasShape, kn: float, ks: float, azimuth: float) -> float:
    """Resultant elastic shear stiffness in N/m per asperity along an azimuth (rad): Eq. 28.

    kn, ks: normal and shear stiffness of an asperity in N/m. Returns the norm of the shear force
    per unit displacement, not only its component along the displacement.
    """
    azimuth = number("azimuth", azimuth)
    _, c22, c33 = elastic(orientation, kn, ks)
    return math.hypot(c22 * math.cos(azimuth), c33 * math.sin(azimuth))


def _shape(orientation: HasShape) -> Shape:
    """The parameters a, b, c, checked against Eq. 18; a may be infinite."""
    return Shape(*bounded(orientation.a, orientation.b, orientation.c, smooth=True))


def _moments(shape: Shape, U0: float) -> Array:
    """Integrals of sin^2, cos^2, sin cos (3 rows) of theta from U0/a to pi/(2a).

    Weighted with g0 (first column) and with g2 (second).
    """
    b = shape.b
    c = shape.c
    beta = 2.0 / shape.a
    first = _integrals(1.0, beta, U0)
    third = _integrals(3.0, beta, U0)
    weight_1 = np.array([1 - b / 8, 9 * c / 8])
    weight_3 = np.array([3 * b / 8, -3 * c / 8])
    one, cos, sin = np.outer(first, weight_1) + np.outer(third, weight_3)
    return np.array([(one - cos) / 2, (one + cos) / 2, sin / 2])


def _integrals(p: float, beta: float, U0: float) -> Array:
    """Integrals of sin pU times 1, cos beta U and sin beta U from U0 to pi/2, shape (3,)."""
    middle = (math.pi / 2 + U0) / 2
    half = (math.pi / 2 - U0) / 2
    k = np.array([p, p + beta, p - beta])
    length = 2 * half * np.sinc(k * half / math.pi)
    sine = length * np.sin(k * middle)
    cosine = length * np.cos(k * middle)
    return np.array([sine[0], (sine[1] + sine[2]) / 2, (cosine[2] - cosine[1]) / 2])
