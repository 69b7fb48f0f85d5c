"""Facets: the few orientations that stand for the density of Eq. 14, and sums over them."""

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

    `n`, `s`, `t` (dim, M) are the facet normal and the two in-facet directions of Eq. 25; dim is 3,
    2 (closure, shear along the plane) for motion in one plane, or 1 for closure alone. `weight`
    sums to 1. `share` (0 to 1) is the share of the depth cells that a facet needs: as the third
    root of its weight, for then a cell more lowers the error of every facet by as much.
    `opposite` is the facet of the same inclination that faces the other way.
    """

    theta: Array
    phi: Array
    weight: Array
    n: Array
    s: Array
    t: Array
    share: Array
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

    `u` rings, `phi` intervals of azimuth on the half circle of the longest (`nodes`). With `plane`
    None the whole circle is covered by twice as many azimuths; with a plane at that azimuth (rad)
    the half circle measured from it suffices, c being replaced by c cos(2 plane): mirror images
    across it share one motion. A facet then stands at 0 and at pi, in the plane itself, with half
    the weight of a pair. With `closure_only` all azimuths share one motion, and one stands for
    them: c sums to zero.
    """
    cos_a, share = inclinations(orientation.b, u)
    b, c = orientation.b, orientation.c
    if plane is not None:
        c *= math.cos(2 * plane)
    numbers = azimuths(u, phi)
    if closure_only:
        c, rings = 0.0, [(np.zeros(1), np.ones(1))] * u
    else:
        rings = [_ring(m, full=plane is None) for m in numbers]
    P, even = (np.concatenate(part) for part in zip(*rings, strict=True))
    counts = [len(azimuth) for azimuth, _ in rings]
    U = np.repeat(cos_a, counts)
    # no more than 1 by Eq. 18, but for rounding where the density is zero
    lean = np.clip(3 * c * (1 - U**2) / shape(U, b), -1.0, 1.0)
    weight = np.repeat(share, counts) * even * (1 + lean * np.cos(2 * P))
    theta = np.arccos(U) / orientation.a
    ct, st, cp, sp = np.cos(theta), np.sin(theta), np.cos(P), np.sin(P)
    zero = np.zeros_like(ct)
    n = np.array([ct, st * cp, st * sp])
    s = np.array([-st, ct * cp, ct * sp])
    t = np.array([zero, -sp, cp])
    dim = 1 if closure_only else 3 if plane is None else 2
    each = share / numbers
    depth = np.repeat(np.cbrt(each / each.max()), counts)
    first = np.cumsum([0, *counts[:-1]])
    turned = [
        np.roll(np.arange(n), n // 2) if plane is None else np.arange(n)[::-1] for n in counts
    ]
    opposite = np.concatenate([k + ring for k, ring in zip(first, turned, strict=True)])
    arrays = (theta, P, np.maximum(weight, 0.0), n[:dim], s[:dim], t[:dim], depth, opposite)
    return Facets(*read_only(arrays))


def _ring(m: int, full: bool) -> tuple[Array, Array]:
    """Azimuths and shares of a full ring of 2 m facets, or of the m + 1 of its half circle."""
    azimuth = np.arange(2.0 * m if full else m + 1.0) * (math.pi / m)
    even = np.full_like(azimuth, (0.5 if full else 1.0) / m)
    if not full:
        even[[0, -1]] /= 2.0
    return azimuth, even
