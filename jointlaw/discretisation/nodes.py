"""Where the law puts its nodes: inclinations against the density, touch depths against the curve.

Both rules only choose places. What the law keeps exact (docs/theory-incremental.md) holds at any
number of nodes. On the presets and random laws these rules had the smallest errors of the worst
laws at few nodes; Gauss-Legendre inclinations with cells from (i/n)^1.5 are as good up to 48
sliders in a plane, and better beyond (at 576 a median error of 0.32 % instead of 0.74 %).
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..parameters.orientation import shape
from ..support.checks import Array, read_only
from .virgin_curve import VirginCurve

# Tried on random laws. A cell of width h misses Phi by Phi'' h^2/8, so cells have equal shares of
# the integral of sqrt(Phi''); _LOW and _OPEN halve the error of the worst laws against that alone.
# Equal stiffness a cell, geometric cells and powers of i/n were worse for some laws.
_STEEPEST = 10.0  # largest tan(theta) that counts: at a = 1 it grows without bound
_LOW = 0.15  # power of Phi that draws nodes towards small loads
_OPEN = 1.8  # shares of the grading for the last cell: few cells then lie where most loads are
_MANY = 8  # cells: more of them also reach farther, to twice the shear at twice as many
UNUSED = 1e300  # m: no closure comes so far
_GRID = 512  # panels on which the touch-depth density is summed


@lru_cache(maxsize=256)
def inclinations(b: float, count: int) -> tuple[Array, Array]:
    """Places in u = cos(a theta), steepest first, and shares (count,) of the density on 0..1.

    The Gauss rule of the density 1 + b/2 (3u^2 - 1) over v, u = v^p, by the three-term recurrence
    of its orthogonal polynomials (Golub & Welsch 1969): shares sum to 1 even for one node, which
    then lies at the mean of u. Two nodes have p = 2, three to seven p = 3: so one of them is near
    the steepest facets, which alone carry a joint that has slipped far. More come near them with
    p = 1, and converge faster.
    """
    power = 2 if count == 2 else 3 if 3 <= count <= 7 else 1
    x, w = np.polynomial.legendre.leggauss((power + 1) * (count + 1))
    x, w = 0.5 * (x + 1.0), 0.5 * w
    u = x**power
    w = w * power * x ** (power - 1) * np.maximum(shape(u, b), 0.0)
    middle, side = np.zeros(count), np.zeros(count)
    before, now = np.zeros_like(x), np.sqrt(w / w.sum())  # orthonormal polynomials times sqrt(w)
    for k in range(count):
        middle[k] = np.sum(x * now**2)
        after = (x - middle[k]) * now - (side[k - 1] * before if k else 0.0)
        side[k] = np.linalg.norm(after)
        before, now = now, after / side[k]
    matrix = np.diag(middle) + np.diag(side[:-1], 1) + np.diag(side[:-1], -1)
    places, vectors = np.linalg.eigh(matrix)
    places, shares = np.clip(places, 0.0, 1.0) ** power, vectors[0] ** 2
    return read_only((places, shares))


def azimuths(rings: int, phi: int) -> list[int]:
    """Azimuths on the half circle of each ring: phi on the steepest, half as many on the flattest.

    They are no fewer than three: that many integrate cos 4 phi exactly, and with it c. Where phi
    is a multiple of four all are even, so that rings turned by a quarter are themselves.
    """
    step = 2 if phi % 4 == 0 else 1
    numbers = np.ceil(np.linspace(phi, phi / 2, rings) / step - 0.5).astype(int) * step
    return [int(n) for n in np.maximum(numbers, 2 + step)]


def depth_nodes(
    curve: VirginCurve,
    closure_range: float,
    slope: Array,
    cells: NDArray[np.intp],
    lowest: float = 1.0,
) -> Array:
    """Limits zeta (M, D + 1) in m of the depth cells of facets of this tan(theta) (M,).

    Each facet has `cells` (M,) of them, D at most; limits that it has no use for lie at UNUSED.
    lowest: as in `Resolution`.

    A cell of width h lumps springs of density Phi'' and by that errs by Phi'' h^2/8 at most: equal
    shares of int sqrt(Phi'') dz make the error of all cells the same. A small power of Phi shifts
    nodes towards small loads. They span the effective closure y = closure + tan(theta) shear, not
    the closure. The last cell has no end: it holds all springs that touch at greater depths, and
    more cells before it do not lower its error. So where there are many cells, they reach farther,
    to twice the shear.

    Errors as shares of the largest load of a path are the same for all loads if the density is
    sqrt(Phi''/Phi). So it falls from the `lowest` closure on.
    """
    shear = np.clip(cells.max() / _MANY, 1.0, 2.0)
    reach = closure_range * (1.0 + shear * np.minimum(slope, _STEEPEST))
    # graded: Phi'' may be singular at touch
    edges = reach.max() * (np.arange(_GRID + 1) / _GRID) ** 4
    middle = 0.5 * (edges[1:] + edges[:-1])
    # ratios only: the same joint in other units then has the same nodes to the bit
    with np.errstate(all="ignore"):
        force, bend = curve.force(middle)[0], np.maximum(curve.curvature(middle), 0.0)
        density = np.sqrt(bend / bend.max()) * (force / force[-1]) ** -_LOW
        density *= np.maximum(force / curve.force(lowest * edges[-1:])[0], 1.0) ** (_LOW - 0.5)
    density = np.where(np.isfinite(density), density, 0.0)
    share = density * np.diff(edges)
    # a least density: a curve without curvature, one linear spring, has none, and any nodes will do
    share = share / max(share.sum(), 1e-300) + 1e-6 * np.diff(edges) / edges[-1]
    total = np.concatenate([[0.0], np.cumsum(share)])
    several, count = np.arange(1, cells.max()), cells[:, None]
    wanted = np.interp(reach, edges, total)[:, None] * (several / (count - 1 + _OPEN))
    inner = np.where(several < count, np.interp(wanted, total, edges), UNUSED)
    zero, end = np.zeros((len(slope), 1)), np.full((len(slope), 1), np.inf)
    return np.concatenate([zero, inner, end], axis=1)
