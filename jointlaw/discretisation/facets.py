"""Facets: the quadrature nodes of the orientation density of Eq. 14, and sums over them."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..parameters.asperity import Asperity
from ..parameters.orientation import Orientation, shape
from ..support.checks import Array, read_only
from .nodes import azimuths, inclinations


@dataclass(frozen=True, eq=False)
class Facets:
    """Quadrature nodes of the orientation density, as arrays over the facets (M,).

    theta, phi: inclination and azimuth (rad); weight: of the quadrature, sums to 1. n, s, t (dim,
    M): facet normal and the two in-facet directions of Eq. 25; dim is 3, 2 (closure, shear along
    the plane) for motion in one plane, or 1 for closure alone. cell_fraction (0 to 1): number of
    cells relative to the facet of largest weight, the third root of the weight: then one more cell
    decreases the error of every facet by the same amount. opposite: index of the facet of the same
    inclination with the opposite azimuth.
    """

    theta: Array
    phi: Array
    weight: Array
    n: Array
    s: Array
    t: Array
    cell_fraction: Array
    opposite: NDArray[np.intp]

    def scale(self, asperity: Asperity, asperity_density: float) -> Array:
        """A = N w lam K c1^(1+eta) of each facet (M,): its normal force is A Phi(y)."""
        c1 = np.cos(self.theta)
        K = asperity_density * self.weight * asperity.lam * asperity.K
        return K * c1 ** (1 + asperity.eta)


def facets(
    orientation: Orientation,
    u: int,
    phi: int,
    plane: float | None = None,
    closure_only: bool = False,
) -> Facets:
    """Quadrature nodes: rings of one inclination each, with evenly spaced azimuths from 0 on.

    orientation: the density; u: number of rings; phi: intervals of azimuth on the half circle of
    the steepest ring (`azimuths`); plane: azimuth (rad) of the plane of motion, None in 3-D;
    closure_only: for closure alone.

    Without a plane the whole circle has twice as many azimuths. In a plane the half circle measured
    from it suffices, with c replaced by c cos(2 plane), because mirror images across the plane have
    the same motion; the facets at 0 and pi, in the plane itself, then have half the weight of a
    pair. For closure alone all azimuths have the same motion, and one represents them: c sums to
    zero.
    """
    cos_a, ring_weight = inclinations(orientation.b, u)
    b = orientation.b
    c = orientation.c
    if plane is not None:
        c *= math.cos(2 * plane)
    azimuth_counts = azimuths(u, phi)
    if closure_only:
        c = 0.0
        rings = [(np.zeros(1), np.ones(1))] * u
    else:
        rings = [_ring(m, is_full=plane is None) for m in azimuth_counts]
    P, fraction = (np.concatenate(part) for part in zip(*rings, strict=True))
    counts = [len(azimuth) for azimuth, _ in rings]
    U = np.repeat(cos_a, counts)
    # <= 1 by Eq. 18, but for rounding where the density is zero
    anisotropy = np.clip(3 * c * (1 - U**2) / shape(U, b), -1.0, 1.0)
    weight = np.repeat(ring_weight, counts) * fraction * (1 + anisotropy * np.cos(2 * P))
    theta = np.arccos(U) / orientation.a
    ct = np.cos(theta)
    st = np.sin(theta)
    cp = np.cos(P)
    sp = np.sin(P)
    zero = np.zeros_like(ct)
    n = np.array([ct, st * cp, st * sp])
    s = np.array([-st, ct * cp, ct * sp])
    t = np.array([zero, -sp, cp])
    dim = 1 if closure_only else 3 if plane is None else 2
    facet_weight = ring_weight / azimuth_counts
    cell_fraction = np.repeat(np.cbrt(facet_weight / facet_weight.max()), counts)
    first = np.cumsum([0, *counts[:-1]])
    opposite_in_ring = [
        np.roll(np.arange(m), m // 2) if plane is None else np.arange(m)[::-1] for m in counts
    ]
    opposite = np.concatenate([i + ring for i, ring in zip(first, opposite_in_ring, strict=True)])
    weight = np.maximum(weight, 0.0)
    arrays = (theta, P, weight, n[:dim], s[:dim], t[:dim], cell_fraction, opposite)
    return Facets(*read_only(arrays))


def _ring(m: int, is_full: bool) -> tuple[Array, Array]:
    """Azimuths and weights of a full ring of 2 m facets, or of m + 1 facets of a half circle."""
    azimuth = np.arange(2.0 * m if is_full else m + 1.0) * (math.pi / m)
    weight = np.full_like(azimuth, (0.5 if is_full else 1.0) / m)
    if not is_full:
        weight[[0, -1]] /= 2.0
    return azimuth, weight
