"""The virgin curve: normal force of one asperity against its effective closure y.

    no heights:     Phi = y^(1+eta)
    population:     Phi = P(r0 + y) y^(1+eta)                                        (Eq. 37)
    individual:     Phi = P(r0) y^(1+eta) + int_0^y H(r0 + s) (y - s)^(1+eta) ds

Phi counts in units of lam K cos(theta)^(1+eta). What is tabulated is the smooth factor
S = Phi / y^(1+eta) on the half line y >= 0 folded into 0 <= t <= 1 by sqrt(y) = V t/(1 - t), so no
closure lies beyond the table. With D = y d/dy = t (1 - t)/2 d/dt,

    Phi'  = y^eta       [(1 + eta) S + D S]
    Phi'' = y^(eta - 1) [eta (1 + eta) S + (1 + 2 eta) D S + D D S]
    Psi   = int Phi dy = y^(2+eta) T,     D T = S - (2 + eta) T
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import special

from ._checks import Array
from .heights import HeightDistribution

TABLE_ERROR = 1e-10  # asked of S, relative to its largest value
WORST_ERROR = 1e-6  # refused beyond
_CELLS = (128, 256, 512, 1024, 2048, 4096, 8192)


class Curve(NamedTuple):
    """Table of the virgin curve: cubic pieces on equal cells of t, coefficients (cells, 4)."""

    eta: float
    scale: float  # V, in m^(1/2)
    S: Array
    T: Array
    error: float  # largest error of S seen between the nodes

    def force(self, y: Array) -> tuple[Array, Array]:
        """Phi and its slope Phi' at y (m); both zero where y <= 0."""
        x, i, _, _ = self._cell(y)
        c = self.S[i]
        S = c[..., 0] + x * (c[..., 1] + x * (c[..., 2] + x * c[..., 3]))
        DS = self._weight(y) * (c[..., 1] + x * (2 * c[..., 2] + x * (3 * c[..., 3])))
        power = np.where(y > 0, np.maximum(y, 0.0) ** self.eta, 0.0)
        return power * y * S, power * ((1 + self.eta) * S + DS)

    def curvature(self, y: Array) -> Array:
        """Phi'' at y (m); zero where y <= 0."""
        x, i, t, s = self._cell(y)
        c, cells = self.S[i], len(self.S)
        S = c[..., 0] + x * (c[..., 1] + x * (c[..., 2] + x * c[..., 3]))
        S1 = cells * (c[..., 1] + x * (2 * c[..., 2] + x * (3 * c[..., 3])))
        S2 = cells**2 * (2 * c[..., 2] + x * (6 * c[..., 3]))
        DS = 0.5 * t * s * S1
        DDS = 0.25 * (t * s) ** 2 * S2 + 0.25 * t * s * (s - t) * S1
        value = self.eta * (1 + self.eta) * S + (1 + 2 * self.eta) * DS + DDS
        power = np.where(y > 0, y, 1.0) ** (self.eta - 1)
        return np.where(y > 0, power * value, 0.0)

    def energy(self, y: Array) -> Array:
        """Psi = int_0^y Phi at y (m); zero where y <= 0."""
        x, i, _, _ = self._cell(y)
        c = self.T[i]
        T = c[..., 0] + x * (c[..., 1] + x * (c[..., 2] + x * c[..., 3]))
        energy: Array = np.maximum(y, 0.0) ** (2 + self.eta) * T
        return energy

    def _cell(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Place within its cell, cell number, t and 1 - t of each y."""
        v = np.sqrt(np.maximum(y, 0.0))
        t, s = v / (v + self.scale), self.scale / (v + self.scale)
        cells = len(self.S)
        i = np.minimum((t * cells).astype(np.intp), cells - 1)
        return t * cells - i, i, t, s

    def _weight(self, y: Array) -> Array:
        """t (1 - t)/2 times the number of cells: D in units of the place within a cell."""
        v = np.sqrt(np.maximum(y, 0.0))
        return 0.5 * len(self.S) * v * self.scale / (v + self.scale) ** 2


def virgin_curve(eta: float, heights: HeightDistribution | None, range_: float) -> Curve:
    """Tabulate the virgin curve; `range_` (m) is a typical closure, used where heights set none.

    Raises ValueError when Phi is not convex (the touch-depth density would turn negative and the
    energy guarantee would be lost), or when the heights are too narrow or too wide to tabulate.
    """
    if heights is None:
        flat = np.array([[1.0, 0.0, 0.0, 0.0]])
        return Curve(eta, float(np.sqrt(range_)), flat, flat / (2 + eta), 0.0)
    r0, points = heights.overlap, heights.breakpoints()
    beyond = points[points > r0] - r0
    far = float(beyond[-1]) if beyond.size else range_
    middle = float(points[len(points) // 2]) - r0
    scale = float(np.sqrt(max(middle, far / 30)))
    _require_convex(eta, heights, far)
    for cells in _CELLS:
        t = np.arange(2 * cells + 1) / (2 * cells)  # nodes and, between them, the points that test
        with np.errstate(divide="ignore"):
            y = (scale * t / (1 - t)) ** 2
        S, DS = _factor(y, eta, heights, beyond)
        St = np.zeros_like(t)  # S is smooth in y, hence flat in t at both ends
        St[1:-1] = 2 * DS[1:-1] / (t * (1 - t))[1:-1]
        table = _hermite(S[::2], St[::2] / cells)
        half = table @ np.array([1.0, 0.5, 0.25, 0.125])
        error = float(np.max(np.abs(half - S[1::2])))
        if error < TABLE_ERROR * float(np.max(S)):
            break
    if not error < WORST_ERROR:
        raise ValueError(
            f"heights are too narrow against the overlap of {r0:g} m to tabulate: the virgin curve "
            f"is off by {error:.1e} with {cells} cells; drop them (heights=None) or widen them"
        )
    return Curve(eta, scale, table, _energy_table(eta, scale, table), error)


def exact_force(y: Array, eta: float, heights: HeightDistribution | None) -> tuple[Array, Array]:
    """Phi and Phi' at y > 0 (m) without a table: the reference that the table is tested against."""
    if heights is None:
        return y ** (1 + eta), (1 + eta) * y**eta
    points = heights.breakpoints()
    S, DS = _factor(y, eta, heights, points[points > heights.overlap] - heights.overlap)
    return y ** (1 + eta) * S, y**eta * ((1 + eta) * S + DS)


def _factor(
    y: Array, eta: float, heights: HeightDistribution, beyond: Array
) -> tuple[Array, Array]:
    """S and D S at y >= 0, infinity included; `beyond` holds the breakpoints above the overlap."""
    r0 = heights.overlap
    S, DS = np.ones_like(y), np.zeros_like(y)
    finite = np.isfinite(y)
    yf = y[finite]
    if heights.formation == "population":
        S[finite] = heights.cdf(r0 + yf)
        with np.errstate(invalid="ignore"):  # 0 times an infinite density at r = 0
            DS[finite] = np.where(yf > 0, yf * heights.pdf(r0 + yf), 0.0)
        return S, DS
    base = float(heights.cdf(r0))
    grown, slope = _individual(yf, eta, heights, beyond)
    S[finite] = base + grown
    DS[finite] = (1 + eta) * (slope - grown)
    return S, DS


def _individual(
    y: Array, eta: float, heights: HeightDistribution, beyond: Array
) -> tuple[Array, Array]:
    """int_0^y H(r0 + s) (1 - s/y)^p ds for p = 1 + eta and p = eta.

    Gauss-Legendre on panels between the breakpoints, and a Gauss-Jacobi rule that knows the power
    on the panel in which y lies together with the one below it, so that the end singularity of
    (1 - s/y)^p is never seen by an ordinary rule.
    """
    r0 = heights.overlap
    edges = _panels(r0, beyond)
    x, w = np.polynomial.legendre.leggauss(16)
    x, w = 0.5 * (x + 1), 0.5 * w
    widths = np.diff(edges)
    nodes = edges[:-1, None] + widths[:, None] * x
    mass = widths[:, None] * w * heights.pdf(r0 + nodes)
    panel = np.searchsorted(edges, y, side="left") - 1  # edges[panel] < y
    panel = np.minimum(panel, len(widths))  # beyond the last edge every panel is an ordinary one
    start = edges[np.maximum(panel - 1, 0)]
    start = np.where(panel >= len(widths), edges[np.minimum(panel, len(edges) - 1)], start)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.clip(1 - nodes.ravel() / y[:, None], 0.0, None)
    below = (
        np.repeat(np.arange(len(widths)), 16)
        < np.where(panel >= len(widths), len(widths), panel - 1)[:, None]
    )
    ratio = np.where(below & (y[:, None] > 0), ratio, 0.0)
    power = np.where(ratio > 0, ratio**eta, 0.0)
    results = []
    for p, bed in ((1 + eta, power * ratio), (eta, power)):
        far = bed @ mass.ravel()
        xj, wj = special.roots_jacobi(40, p, 0.0)
        xj, wj = 0.5 * (xj + 1), wj / 2 ** (p + 1)
        span = np.maximum(y - start, 0.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(y > 0, span / y, 0.0)
        near = span * share**p * (heights.pdf(r0 + start[:, None] + span[:, None] * xj) @ wj)
        results.append(far + np.where(panel < len(widths), near, 0.0))
    return results[0], results[1]


def _panels(r0: float, beyond: Array) -> Array:
    """Panel edges in s = r - r0: the breakpoints, and halvings towards r = 0 (H may blow up)."""
    if beyond.size == 0:
        return np.array([0.0, 1.0])
    top = r0 + beyond[-1]
    halvings = top * 0.5 ** np.arange(1.0, 50.0)
    edges = np.concatenate([[0.0], beyond, halvings[halvings > r0] - r0])
    return np.unique(edges)


def _hermite(value: Array, slope: Array) -> Array:
    """Cubic coefficients (cells, 4) through node values and slopes per cell."""
    rise = np.diff(value)
    left, right = slope[:-1], slope[1:]
    return np.stack([value[:-1], left, 3 * rise - 2 * left - right, left + right - 2 * rise], -1)


def _energy_table(eta: float, scale: float, S: Array) -> Array:
    """Table of T = Psi / y^(2+eta) by exact integration of the tabulated force, cell by cell."""
    cells = len(S)
    t = np.arange(cells + 1) / cells
    with np.errstate(divide="ignore"):
        y = (scale * t / (1 - t)) ** 2
    x, w = np.polynomial.legendre.leggauss(12)
    x, w = 0.5 * (x + 1), 0.5 * w
    inner = (np.arange(cells - 1)[:, None] + x) / cells  # the last cell ends at y = infinity
    yi = (scale * inner / (1 - inner)) ** 2
    dy = 2 * scale**2 * inner / (1 - inner) ** 3 / cells
    Si = S[:-1, :1] + x * (S[:-1, 1:2] + x * (S[:-1, 2:3] + x * S[:-1, 3:]))
    top = y[1:-1, None]
    piece = ((yi / top) ** (1 + eta) * Si * dy / top) @ w
    T = np.empty(cells + 1)
    T[0], T[-1] = S[0, 0] / (2 + eta), S[-1].sum() / (2 + eta)
    for k in range(1, cells):
        T[k] = (y[k - 1] / y[k]) ** (2 + eta) * T[k - 1] + piece[k - 1]
    nodes = np.append(S[:, 0], S[-1].sum())
    slope = np.zeros(cells + 1)
    inside = t[1:-1]
    slope[1:-1] = (nodes[1:-1] - (2 + eta) * T[1:-1]) / (0.5 * inside * (1 - inside))
    return _hermite(T, slope / cells)


def _require_convex(eta: float, heights: HeightDistribution, far: float) -> None:
    """Refuse a "population" curve whose slope falls anywhere up to the last asperity."""
    if heights.formation == "individual":
        return
    y = far * np.concatenate([np.geomspace(1e-9, 1e-3, 200), np.linspace(1e-3, 1.0, 4000)[1:]])
    _, slope = exact_force(y, eta, heights)
    fall = np.diff(slope) < -1e-12 * np.max(slope)
    if fall.any():
        at = y[int(np.argmax(fall))]
        raise ValueError(
            f'heights with formation = "population" and asperity.eta = {eta:g} give a virgin curve '
            f"that is not convex near y = {at:.3g} m, so contacts would lose stiffness on closure "
            'and make energy; use formation = "individual" (always convex), a broader height '
            "distribution, a larger overlap or a larger eta"
        )
