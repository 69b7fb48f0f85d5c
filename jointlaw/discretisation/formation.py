"""Formation of contacts: the smooth factor S = Phi / y^(1+eta) of the virgin curve, exactly."""

from functools import lru_cache

import numpy as np
from scipy import special

from ..parameters.heights import HeightDistribution, Heights
from ..support.checks import Array

_CLOSE = 1e-15  # of the heights: this near the point of contact their density is a power
_SAME = 1e-9  # breakpoints closer than that are one
_APART = 0.4  # least distance of a halving from a breakpoint, in halvings
_SMOOTH = 0.999  # a power that needs no help


def factor(y: Array, eta: float, heights: HeightDistribution) -> tuple[Array, Array]:
    """S and D S at y >= 0, infinity included."""
    r0 = heights.overlap
    S, DS = np.ones_like(y), np.zeros_like(y)
    finite = np.isfinite(y)
    yf = y[finite]
    if heights.formation == "population":
        S[finite] = heights.cdf(r0 + yf)
        with np.errstate(invalid="ignore"):  # 0 times an infinite density at r = 0
            DS[finite] = np.where(yf > 0, yf * heights.pdf(r0 + yf), 0.0)
        return S, DS
    grown, slope = _individual(yf, eta, heights)
    S[finite] = float(heights.cdf(r0)) + grown
    DS[finite] = (1 + eta) * (slope - grown)
    return S, DS


def rise(heights: HeightDistribution) -> float:
    """p of S ~ y^p where the density is infinite at the very point of contact; 0 elsewhere."""
    r0, top = heights.overlap, float(heights.breakpoints()[-1])
    if heights.cdf(r0) > 0:
        return 0.0
    y = max(top - r0, 0.0) * _CLOSE
    touching = float(heights.cdf(r0 + y))
    power = y * float(heights.pdf(r0 + y)) / touching if touching > 0 else 1.0
    return power if power < _SMOOTH else 0.0


def _individual(y: Array, eta: float, heights: HeightDistribution) -> tuple[Array, Array]:
    """int_0^y H(r0 + s) (1 - s/y)^p ds for p = 1 + eta and p = eta.

    Gauss-Legendre on panels between the breakpoints, and a Gauss-Jacobi rule that knows the power
    on the panel in which y lies together with the one below it, so that the end singularity of
    (1 - s/y)^p is never seen by an ordinary rule. A histogram is integrated in closed form.
    """
    r0, points = heights.overlap, heights.breakpoints()
    beyond = points[points > r0] - r0
    if isinstance(heights, Heights):
        return _steps(y, 1 + eta, heights, beyond), _steps(y, eta, heights, beyond)
    rising = rise(heights)
    if rising:  # its quantiles may lie decades below the halvings
        beyond = beyond[beyond > beyond[-1] * _CLOSE]
    edges = _panels(r0, beyond)
    x, w = np.polynomial.legendre.leggauss(16)
    x, w = 0.5 * (x + 1), 0.5 * w
    widths = np.diff(edges)
    nodes = edges[:-1, None] + widths[:, None] * x
    mass = widths[:, None] * w * heights.pdf(r0 + nodes)
    if rising:  # in the panels next to the point of contact the density is a power
        xj, wj = special.roots_jacobi(16, 0.0, rising - 1)
        nodes[0] = edges[1] * 0.5 * (xj + 1)
        mass[0] = heights.cdf(r0 + edges[1]) * wj / wj.sum()
    panel = np.searchsorted(edges, y, side="left") - 1  # edges[panel] < y
    # panels of the ordinary rule: beyond the last edge every one, else those below the one below y
    ordinary = np.where(panel < len(widths), panel - 1, len(widths))
    start = edges[np.maximum(ordinary, 0)]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.clip(1 - nodes.ravel() / y[:, None], 0.0, None)
    below = np.repeat(np.arange(len(widths)), 16) < ordinary[:, None]
    ratio = np.where(below & (y[:, None] > 0), ratio, 0.0)
    power = np.where(ratio > 0, ratio**eta, 0.0)
    results = []
    for p, bed in ((1 + eta, power * ratio), (eta, power)):
        far = bed @ mass.ravel()
        xj, wj = _jacobi(p)
        span = np.maximum(y - start, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(y > 0, span / y, 0.0)
        reached = np.flatnonzero((span > 0) & (panel < len(widths)))  # H(0) may be infinite
        s = start[reached, None] + span[reached, None] * xj
        far[reached] += (span * share**p)[reached] * (heights.pdf(r0 + s) @ wj)
        if rising:
            near = np.flatnonzero((y > 0) & (panel < 2))
            far[near] = heights.cdf(r0 + y[near]) * rising * special.beta(rising, p + 1)
        results.append(far)
    return results[0], results[1]


@lru_cache(maxsize=16)  # a fit asks for the same rule at every step
def _jacobi(p: float) -> tuple[Array, Array]:
    """The rule for int_0^1 f(x) (1 - x)^p dx."""
    x, w = special.roots_jacobi(40, p, 0.0)
    return 0.5 * (x + 1), w / 2 ** (p + 1)


def _steps(y: Array, p: float, heights: HeightDistribution, beyond: Array) -> Array:
    """int_0^y H(r0 + s) (1 - s/y)^p ds for a density that is constant between breakpoints."""
    edges = np.concatenate([[0.0], beyond])
    density = heights.pdf(heights.overlap + 0.5 * (edges[:-1] + edges[1:]))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(y[:, None] > 0, np.minimum(edges / y[:, None], 1.0), 1.0)  # s/y
        low, width = 1.0 - share[:, :-1], np.diff(share)
        # low^(p+1) - high^(p+1), without cancellation where both are close to 1
        drop = -np.expm1((p + 1) * np.log1p(-np.minimum(width / low, 1.0)))
    pieces = np.where(low > 0, low ** (p + 1) * drop, 0.0) / (p + 1)
    return y * (pieces @ density)


def _panels(r0: float, beyond: Array) -> Array:
    """Panel edges in s = r - r0: the breakpoints, and halvings towards r = 0 (H may blow up).

    A panel far narrower than the one below it would bring the end singularity of (1 - s/y)^p near
    to an ordinary rule: no two breakpoints that differ by rounding, no halving next to one.
    """
    if beyond.size == 0:
        return np.array([0.0, 1.0])
    points = beyond[np.diff(beyond, prepend=0.0) > _SAME * beyond]
    halvings = (r0 + beyond[-1]) * 0.5 ** np.arange(1.0, 50.0)
    halvings = halvings[halvings > r0]
    away = np.abs(np.log2(halvings[:, None] / (r0 + points))).min(axis=1)
    edges = np.concatenate([[0.0], points, halvings[away > _APART] - r0])
    return np.unique(edges)
