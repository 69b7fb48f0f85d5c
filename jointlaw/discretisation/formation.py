"""Formation of contacts: the smooth factor S = Phi / y^(1+eta) of the first-loading curve.

By population S is P(r0 + y), the fraction of asperities in contact. By individual contacts it is an
integral over the heights that are reached, int_0^y H(r0 + s) (1 - s/y)^(1+eta) ds, with a density H
that may be infinite at r = 0, jump at breakpoints, or vary over decades. It is evaluated to
rounding here, without a table: a histogram in closed form, other densities by Gauss rules on panels
between their breakpoints.
"""

from functools import lru_cache

import numpy as np
from scipy import special

from ..parameters.heights import HeightDistribution, Heights
from ..support.checks import Array

_POWER_LAW_RANGE = 1e-15  # of the heights: this close to contact their density is a power of y
_MIN_BREAKPOINT_DISTANCE = 1e-9  # relative: closer breakpoints are merged
_MIN_HALVING_DISTANCE = 0.4  # of a halving from a breakpoint, in halvings
_MAX_SINGULAR_EXPONENT = 0.999  # a larger exponent needs no special treatment


def smooth_factor(y: Array, eta: float, heights: HeightDistribution) -> tuple[Array, Array]:
    """S and D S at y >= 0, infinity included."""
    r0 = heights.overlap
    S = np.ones_like(y)
    DS = np.zeros_like(y)
    finite = np.isfinite(y)
    yf = y[finite]
    if heights.formation == "population":
        S[finite] = heights.cdf(r0 + yf)
        with np.errstate(invalid="ignore"):  # 0 times an infinite density at r = 0
            DS[finite] = np.where(yf > 0, yf * heights.pdf(r0 + yf), 0.0)
        return S, DS
    upper, lower = _integrate_individual(yf, eta, heights)
    S[finite] = float(heights.cdf(r0)) + upper
    DS[finite] = (1 + eta) * (lower - upper)
    return S, DS


def contact_exponent(heights: HeightDistribution) -> float:
    """Exponent p of S ~ y^p near first contact, for heights whose density is infinite there.

    0 where some asperities are in contact from the start, or where the density is finite.
    """
    r0 = heights.overlap
    highest = float(heights.breakpoints()[-1])
    if heights.cdf(r0) > 0:
        return 0.0
    y = max(highest - r0, 0.0) * _POWER_LAW_RANGE
    in_contact = float(heights.cdf(r0 + y))
    exponent = y * float(heights.pdf(r0 + y)) / in_contact if in_contact > 0 else 1.0
    return exponent if exponent < _MAX_SINGULAR_EXPONENT else 0.0


def _integrate_individual(y: Array, eta: float, heights: HeightDistribution) -> tuple[Array, Array]:
    """int_0^y H(r0 + s) (1 - s/y)^p ds for p = 1 + eta and p = eta.

    Gauss-Legendre on panels between the breakpoints. On the panel that contains y and the one below
    it, together, a Gauss-Jacobi rule includes the power (1 - s/y)^p, so that no ordinary rule meets
    its singularity at s = y. A histogram is integrated in closed form.
    """
    r0 = heights.overlap
    points = heights.breakpoints()
    reachable = points[points > r0] - r0
    if isinstance(heights, Heights):
        upper = _integrate_steps(y, 1 + eta, heights, reachable)
        return upper, _integrate_steps(y, eta, heights, reachable)
    exponent = contact_exponent(heights)
    if exponent:  # quantiles of the heights may lie decades below the halvings
        reachable = reachable[reachable > reachable[-1] * _POWER_LAW_RANGE]
    edges = _panel_edges(r0, reachable)
    x, w = np.polynomial.legendre.leggauss(16)
    x = 0.5 * (x + 1)
    w = 0.5 * w
    widths = np.diff(edges)
    nodes = edges[:-1, None] + widths[:, None] * x
    mass = widths[:, None] * w * heights.pdf(r0 + nodes)
    if exponent:  # in the panels next to the point of contact the density is a power
        xj, wj = special.roots_jacobi(16, 0.0, exponent - 1)
        nodes[0] = edges[1] * 0.5 * (xj + 1)
        mass[0] = heights.cdf(r0 + edges[1]) * wj / wj.sum()
    panel = np.searchsorted(edges, y, side="left") - 1  # edges[panel] < y
    # number of panels with the ordinary rule: all beyond the last edge, else up to two below y
    ordinary = np.where(panel < len(widths), panel - 1, len(widths))
    start = edges[np.maximum(ordinary, 0)]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.clip(1 - nodes.ravel() / y[:, None], 0.0, None)
    is_ordinary = np.repeat(np.arange(len(widths)), 16) < ordinary[:, None]
    ratio = np.where(is_ordinary & (y[:, None] > 0), ratio, 0.0)
    power = np.where(ratio > 0, ratio**eta, 0.0)
    integrals = []
    for p, kernel in ((1 + eta, power * ratio), (eta, power)):
        integral = kernel @ mass.ravel()
        xj, wj = _jacobi_rule(p)
        span = np.maximum(y - start, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            fraction = np.where(y > 0, span / y, 0.0)
        singular = np.flatnonzero((span > 0) & (panel < len(widths)))  # H(0) may be infinite
        s = start[singular, None] + span[singular, None] * xj
        integral[singular] += (span * fraction**p)[singular] * (heights.pdf(r0 + s) @ wj)
        if exponent:
            first = np.flatnonzero((y > 0) & (panel < 2))
            beta = special.beta(exponent, p + 1)
            integral[first] = heights.cdf(r0 + y[first]) * exponent * beta
        integrals.append(integral)
    return integrals[0], integrals[1]


@lru_cache(maxsize=16)  # a fit evaluates the same rule at every step
def _jacobi_rule(p: float) -> tuple[Array, Array]:
    """Nodes and weights for int_0^1 f(x) (1 - x)^p dx."""
    x, w = special.roots_jacobi(40, p, 0.0)
    return 0.5 * (x + 1), w / 2 ** (p + 1)


def _integrate_steps(y: Array, p: float, heights: HeightDistribution, reachable: Array) -> Array:
    """int_0^y H(r0 + s) (1 - s/y)^p ds for a constant density between breakpoints."""
    edges = np.concatenate([[0.0], reachable])
    density = heights.pdf(heights.overlap + 0.5 * (edges[:-1] + edges[1:]))
    with np.errstate(divide="ignore", invalid="ignore"):
        relative = np.where(y[:, None] > 0, np.minimum(edges / y[:, None], 1.0), 1.0)  # s/y
        low = 1.0 - relative[:, :-1]
        width = np.diff(relative)
        # low^(p+1) - high^(p+1), without cancellation where both are close to 1
        decrease = -np.expm1((p + 1) * np.log1p(-np.minimum(width / low, 1.0)))
    integrals = np.where(low > 0, low ** (p + 1) * decrease, 0.0) / (p + 1)
    return y * (integrals @ density)


def _panel_edges(r0: float, reachable: Array) -> Array:
    """Panel edges in s = r - r0: the breakpoints, and halvings towards r = 0, where H may diverge.

    A panel far narrower than the one below it would bring the singularity of (1 - s/y)^p close to
    an ordinary rule. So breakpoints that differ by rounding are merged, and halvings close to a
    breakpoint are left out.
    """
    if reachable.size == 0:
        return np.array([0.0, 1.0])
    is_distinct = np.diff(reachable, prepend=0.0) > _MIN_BREAKPOINT_DISTANCE * reachable
    points = reachable[is_distinct]
    halvings = (r0 + reachable[-1]) * 0.5 ** np.arange(1.0, 50.0)
    halvings = halvings[halvings > r0]
    distance = np.abs(np.log2(halvings[:, None] / (r0 + points))).min(axis=1)
    kept_halvings = halvings[distance > _MIN_HALVING_DISTANCE] - r0
    return np.unique(np.concatenate([[0.0], points, kept_halvings]))
