"""The paper's total form: F = (C^e - C^p) delta, loaded monotonically from zero (Eq. 19-23, 37).

It has no state, and on a closed path it creates energy. It reproduces the paper; joints with memory
are `law.joint()`.

For a displacement delta an asperity of normal n has the closure d_n = n . delta and the shear
displacement d_s = |delta - d_n n|. It is separated where d_n <= 0 and slides where
d_s >= x_s mu lam d_n. Both limits are circles about the direction of delta on the sphere of
normals, at pi/2 and at arctan(x_s mu lam). The integrals are split there: at each inclination
theta the azimuths at which the two circles are crossed are known, and so are the inclinations at
which the crossings begin and end. On every panel between them the integrand is smooth for a Gauss
rule with nodes clustered at both ends.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..laws.joint_law import JointLaw
from ..parameters.asperity import Asperity
from ..parameters.orientation import Orientation
from ..support.checks import Array, numbers, one_of

_THETA_NODES = 32  # per panel: errors of |C| of 1e-8 at most, typically 1e-12
_PHI_NODES = 24
_ELASTIC, _SLIDING, _SEPARATED = range(3)


@dataclass(frozen=True)
class Secant:
    """Result of the total form.

    F: (3,) in Pa, the traction (Ce - Cp) delta.
    Ce, Cp: (3, 3) in Pa/m, the elastic and the inelastic part of Eq. 22 and 23.
    sliding, separated: fractions of all orientations.
    """

    F: Array
    Ce: Array
    Cp: Array
    sliding: float
    separated: float


def secant(law: JointLaw, delta: ArrayLike, contact: str = "exact") -> Secant:
    """Traction and stiffness at a total displacement that was reached from zero in one direction.

    Orientation, asperity, heights (distribution and overlap) and asperity_density of the law are
    used. The fraction of asperities in contact is P(r0 + delta_1) for every orientation (Eq. 37 as
    printed), so `formation`, resolution, closure_range, plane and mating_length have no effect.

    Parameters
    ----------
    law: a `JointLaw`.
    delta: (3,) in m: closure, shear along axis 2, shear along axis 3.
    contact: shear stiffness of an asperity before it slides. "exact" is Eq. 35 (with the exponent
        1 + eta, so constant at eta = 0), "series" the truncation of Eq. 36, which slides at
        x_s = d_s/(mu lam d_n) = 0.899 for eta = 1/2; the exact form slides at x_s = 1. K_s of a
        sliding asperity is K_s at the onset of sliding.

    C^e includes separated asperities and C^p subtracts them, as in Eq. 22 and 23; K_n (Eq. 33) is
    lam K max(d_n, 0)^eta, so they contribute at eta = 0 only. At delta = 0 all are separated.

    Raises ValueError for a wrong shape, a number that is not finite or beyond
    `law.max_effective_closure`, an unknown `contact`, or "series" with eta >= 1.

    >>> F = jl.secant(law, [2e-7, 1e-7, 0.0]).F
    """
    d = numbers("delta", delta, "m")
    if not isinstance(law, JointLaw):
        raise ValueError(f"law: {type(law).__name__} has no asperities; give a JointLaw")
    if d.shape != (3,) or not np.isfinite(d).all():
        raise ValueError(f"delta = {delta!r} must be three finite numbers (m): closure, two shears")
    if not np.abs(d).sum() <= law.max_effective_closure:
        raise ValueError(
            f"delta = {delta!r} m is out of bounds: its components must add up to no more than "
            f"law.max_effective_closure = {law.max_effective_closure:g} m, beyond "
            "which squares of forces overflow"
        )
    one_of("contact", contact, ("exact", "series"))
    asperity = law.asperity
    limit = 1.0 if contact == "exact" else series_limit(asperity.eta)
    Ce = np.zeros((3, 3))
    Cp = np.zeros((3, 3))
    fractions = np.zeros(3)
    for theta, phi, weight, zone in _panels(law.orientation, asperity, d, limit):
        fractions += np.bincount(zone, weight, minlength=3)
        st = np.sin(theta)
        n = np.array([np.cos(theta), st * np.cos(phi), st * np.sin(phi)])
        elastic, inelastic = _stiffness(asperity, d, n, zone, limit, contact)
        Ce += (weight * elastic).sum(-1)
        Cp += (weight * inelastic).sum(-1)
    density = law.asperity_density * contact_fraction(law, float(d[0]))
    Ce = density * Ce
    Cp = density * Cp
    return Secant((Ce - Cp) @ d, Ce, Cp, float(fractions[_SLIDING]), float(fractions[_SEPARATED]))


def contact_fraction(law: JointLaw, closure: ArrayLike) -> Any:
    """Fraction of the asperities that are in contact at a closure (m); an array for an array.

    The probability P(r0 + delta_1) of Eq. 12 for a law with heights, 1 for a law without.
    """
    if law.heights is None:
        return np.ones_like(closure, float)[()]
    return law.heights.cdf(law.heights.overlap + np.asarray(closure))


def shear_factor(x: ArrayLike, eta: float, contact: str = "exact") -> Array:
    """K_s lam/K_n at x = d_s/(mu lam d_n), 0 <= x <= 1: Eq. 35, or Eq. 36 for "series".

    The exponent is 1 + eta; the paper prints 3/2, for eta = 1/2.
    """
    x = np.asarray(x, float)
    if contact == "series":
        return (1 + eta) * (1 - eta / 2 * x - eta * (1 - eta) / 6 * x**2)
    inside = np.clip(x, 1e-12, 1 - 1e-16)
    return np.asarray(-np.expm1((1 + eta) * np.log1p(-inside)) / inside)


def series_limit(eta: float) -> float:
    """Sliding limit x_s = d_s/(mu lam d_n) of the series of Eq. 36, where f_s = mu f_n.

    It is 0.899 at eta = 1/2, and 1 for the exact Eq. 35. Raises ValueError unless 0 <= eta < 1.
    """
    if not 0.0 <= eta < 1.0:
        raise ValueError(f'asperity.eta = {eta:g}: "series" needs 0 <= eta < 1; use "exact"')
    from scipy.optimize import brentq  # a third of the package's import time

    return float(brentq(lambda x: x * float(shear_factor(x, eta, "series")) - 1, 0.0, 1.0))


def _stiffness(
    asperity: Asperity, d: Array, n: Array, zone: Array, limit: float, contact: str
) -> tuple[Array, Array]:
    """K_ij of Eq. 24 and the integrand of Eq. 23, each (3, 3, M), for the normals n (3, M)."""
    dn = d @ n
    slip = d[:, None] - dn * n
    ds = np.sqrt(np.einsum("im,im->m", slip, slip))
    closure = np.maximum(dn, 0.0)
    kn = asperity.lam * asperity.K * closure**asperity.eta
    sliding_shear = asperity.mu * asperity.lam * closure
    x = np.minimum(ds / np.where(sliding_shear > 0, sliding_shear, 1.0), limit)
    x = np.where(zone == _ELASTIC, x, limit)
    ks = kn / asperity.lam * shear_factor(x, asperity.eta, contact)
    nn = n[:, None] * n[None]
    K = kn * nn + ks * (np.eye(3)[:, :, None] - nn)
    tau = slip / np.where(ds > 0, ds, 1.0)  # zeta = -tau: friction opposes the sliding, Eq. 6
    sliding = tau[:, None] * (ks * tau - asperity.mu * kn * n)[None]
    inelastic = np.where(zone == _SLIDING, sliding, K)
    return K, np.where(zone == _ELASTIC, 0.0, inelastic)


def _panels(
    orientation: Orientation, asperity: Asperity, d: Array, limit: float
) -> Iterator[tuple[Array, Array, Array, Array]]:
    """Theta, phi, weight and zone (elastic, sliding, separated) of the nodes, panel by panel."""
    tilt = math.atan2(math.hypot(d[1], d[2]), d[0])
    azimuth = math.atan2(d[2], d[1])
    cone = math.atan(limit * asperity.mu * asperity.lam)
    circles = np.array([cone, 0.5 * math.pi] if d.any() else [0.0, 0.0])
    top = 0.5 * math.pi / orientation.a
    ends = np.abs(tilt - circles), tilt + circles, 2 * math.pi - tilt - circles
    edges = np.unique(np.clip([0.0, top, tilt, *np.concatenate(ends)], 0.0, top))
    x, w = _end_clustered_gauss(_THETA_NODES)
    y, v = _end_clustered_gauss(_PHI_NODES)
    for low, high in pairwise(edges):
        theta = low + (high - low) * x
        crossings = (_crossing_azimuth(theta, tilt, radius) for radius in circles)
        boundaries = [np.zeros_like(theta), *crossings, np.full_like(theta, math.pi)]
        for zone, (start, stop) in enumerate(pairwise(boundaries)):
            width = stop - start
            if not (width > 0).any():
                continue
            offset = start[:, None] + width[:, None] * y
            area = (high - low) * w[:, None] * width[:, None] * v
            thetas = np.broadcast_to(theta[:, None], offset.shape)
            for phi in (azimuth + offset, azimuth - offset):
                weight = area * orientation.density(thetas, phi) * np.sin(thetas)
                yield thetas.ravel(), phi.ravel(), weight.ravel(), np.full(thetas.size, zone)


def _crossing_azimuth(theta: Array, tilt: float, radius: float) -> Array:
    """Azimuth from delta, 0 to pi, at which the parallel theta leaves the circle about delta."""
    scale = np.sin(theta) * math.sin(tilt)
    excess = math.cos(radius) - np.cos(theta) * math.cos(tilt)
    without_crossing = np.where(excess > 0, 0.0, math.pi)
    cosine = np.clip(excess / np.where(scale > 0, scale, 1.0), -1.0, 1.0)
    return np.where(scale > 1e-300, np.arccos(cosine), without_crossing)


def _end_clustered_gauss(order: int) -> tuple[Array, Array]:
    """Nodes and weights of Gauss-Legendre on 0 to 1, substituted by sin^2.

    The substitution makes square roots at both ends smooth.
    """
    x, w = np.polynomial.legendre.leggauss(order)
    angle = 0.25 * math.pi * (x + 1)
    return np.sin(angle) ** 2, 0.25 * math.pi * w * np.sin(2 * angle)
