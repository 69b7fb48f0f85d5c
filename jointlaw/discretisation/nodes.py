"""Nodes: inclinations of the rings of facets, and limits of the cells.

Both rules only choose places. The properties that the law keeps exactly
(docs/theory-incremental.md) hold at any number of nodes. On the presets and random laws these rules
had the smallest errors of the worst laws at few nodes; Gauss-Legendre inclinations with cells from
(i/n)^1.5 are as accurate up to 48 sliders in a plane, and more accurate beyond (at 576 a median
error of 0.32 % instead of 0.74 %).

The error of a cell of width h is at most Phi'' h^2/8, so cells with equal parts of the integral of
sqrt(Phi'') have equal errors. Two corrections halve the error of the worst laws: a small power of
Phi shifts nodes towards small loads, and the last cell, which is open-ended, gets a larger part, so
that few cells are placed where most loads are. Equal stiffness per cell, geometric cells and powers
of i/n were less accurate for some laws.
"""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from ..parameters.orientation import shape
from ..support.checks import Array, read_only
from .first_loading_curve import FirstLoadingCurve

_MAX_SLOPE = 10.0  # largest tan(theta) that counts: at a = 1 it is unbounded
_SMALL_LOAD_EXPONENT = 0.15  # power of Phi that shifts nodes towards small loads
_LAST_CELL_PART = 1.8  # part of the grading for the last cell, relative to the others
_CELLS_FOR_SHEAR = 8  # more cells also extend farther, to twice the shear at twice as many
UNUSED = 1e300  # m: beyond any closure
_GRADING_PANELS = 512  # on which the density of the grading is summed


@lru_cache(maxsize=256)
def inclinations(b: float, count: int) -> tuple[Array, Array]:
    """Nodes in u = cos(a theta), steepest first, and weights (count,) of the density on 0..1.

    The Gauss rule of the density 1 + b/2 (3u^2 - 1) over v, u = v^p, by the three-term recurrence
    of its orthogonal polynomials (Golub & Welsch 1969). The weights sum to 1 even for one node,
    which is then at the mean of u. Two nodes have p = 2, three to seven p = 3, so that one of them
    is close to the steepest facets, which alone carry a joint after large slip. More nodes are
    close to them with p = 1, and converge faster.
    """
    power = 2 if count == 2 else 3 if 3 <= count <= 7 else 1
    x, w = np.polynomial.legendre.leggauss((power + 1) * (count + 1))
    x = 0.5 * (x + 1.0)
    w = 0.5 * w
    u = x**power
    w = w * power * x ** (power - 1) * np.maximum(shape(u, b), 0.0)
    diagonal = np.zeros(count)
    off_diagonal = np.zeros(count)
    previous = np.zeros_like(x)
    current = np.sqrt(w / w.sum())  # orthonormal polynomials times sqrt(w)
    for k in range(count):
        diagonal[k] = np.sum(x * current**2)
        residual = (x - diagonal[k]) * current
        residual = residual - (off_diagonal[k - 1] * previous if k else 0.0)
        off_diagonal[k] = np.linalg.norm(residual)
        previous = current
        current = residual / off_diagonal[k]
    matrix = np.diag(diagonal) + np.diag(off_diagonal[:-1], 1) + np.diag(off_diagonal[:-1], -1)
    nodes, vectors = np.linalg.eigh(matrix)
    return read_only((np.clip(nodes, 0.0, 1.0) ** power, vectors[0] ** 2))


def azimuths(rings: int, phi: int) -> list[int]:
    """Azimuths on the half circle of each ring: phi on the steepest, half as many on the flattest.

    At least three, which integrate cos 4 phi exactly, and with it c. If phi is a multiple of four,
    all numbers are even, so that rings are symmetric to a rotation by a quarter.
    """
    step = 2 if phi % 4 == 0 else 1
    counts = np.ceil(np.linspace(phi, phi / 2, rings) / step - 0.5).astype(int) * step
    return [int(n) for n in np.maximum(counts, 2 + step)]


def cell_limits(
    curve: FirstLoadingCurve,
    closure_range: float,
    slope: Array,
    cells: NDArray[np.intp],
    lowest: float = 1.0,
) -> Array:
    """Limits zeta (M, D + 1) in m of the cells of facets with this slope tan(theta) (M,).

    cells: number of cells (M,) of each facet, D at most; limits beyond it are UNUSED. lowest: as in
    `Resolution`.

    Cells span the effective closure y = closure + tan(theta) shear, not the closure. The last cell
    has no end: it holds all springs that engage at greater depths, and more cells before it do not
    decrease its error. So many cells extend farther, to twice the shear.

    Errors relative to the largest load of a path are the same for all loads if the density is
    sqrt(Phi''/Phi). The density therefore decreases from the `lowest` closure on.
    """
    shear = np.clip(cells.max() / _CELLS_FOR_SHEAR, 1.0, 2.0)
    largest_closure = closure_range * (1.0 + shear * np.minimum(slope, _MAX_SLOPE))
    # graded, because Phi'' may be singular at first contact
    edges = largest_closure.max() * (np.arange(_GRADING_PANELS + 1) / _GRADING_PANELS) ** 4
    middle = 0.5 * (edges[1:] + edges[:-1])
    # ratios only: the same joint in other units then has bitwise the same nodes
    with np.errstate(all="ignore"):
        force = curve.force(middle)[0]
        curvature = np.maximum(curve.curvature(middle), 0.0)
        density = np.sqrt(curvature / curvature.max())
        density = density * (force / force[-1]) ** -_SMALL_LOAD_EXPONENT
        relative = force / curve.force(lowest * edges[-1:])[0]
        density *= np.maximum(relative, 1.0) ** (_SMALL_LOAD_EXPONENT - 0.5)
    density = np.where(np.isfinite(density), density, 0.0)
    part = density * np.diff(edges)
    # a minimum density, for a curve without curvature (one linear spring), where any nodes will do
    part = part / max(part.sum(), 1e-300) + 1e-6 * np.diff(edges) / edges[-1]
    total = np.concatenate([[0.0], np.cumsum(part)])
    limit = np.arange(1, cells.max())
    count = cells[:, None]
    last = np.interp(largest_closure, edges, total)[:, None]
    target = last * (limit / (count - 1 + _LAST_CELL_PART))
    inner = np.where(limit < count, np.interp(target, total, edges), UNUSED)
    first = np.zeros((len(slope), 1))
    end = np.full((len(slope), 1), np.inf)
    return np.concatenate([first, inner, end], axis=1)
