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

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..parameters.heights import HeightDistribution
from ..support.checks import Array, read_only
from .formation import factor, rise

TABLE_ERROR = 1e-10  # asked of S, relative to its largest value
WORST_ERROR = 1e-6  # refused beyond
_FARTHEST = 1e300  # m; S is 1 long before
_NEARLY = 1e-20  # of the first cell: where the limit at y = 0 is taken
_CELLS = (128, 256, 512, 1024, 2048, 4096, 8192)


class VirginCurve(NamedTuple):
    """Table of the virgin curve: cubic pieces on equal cells of t, coefficients (cells, 4)."""

    eta: float
    scale: float  # V, in m^(1/2)
    S: Array
    T: Array
    error: float  # largest error of S seen between the nodes
    rise: float = 0.0  # p: S and T are tabulated over w^p

    @property
    def linear(self) -> bool:
        """Whether one linear spring that touches at once is all: eta = 0, no heights."""
        return self.eta == 0.0 and len(self.S) == 1

    def force(self, y: Array) -> tuple[Array, Array]:
        """Phi and its slope Phi' at y (m); both zero where y <= 0."""
        S, DS, _ = self._factor(y)
        power = np.where(y > 0, np.maximum(y, 0.0) ** self.eta, 0.0)
        return power * y * S, power * ((1 + self.eta) * S + DS)

    def curvature(self, y: Array) -> Array:
        """Phi'' at y (m); zero where y <= 0."""
        S, DS, DDS = self._factor(y)
        value = self.eta * (1 + self.eta) * S + (1 + 2 * self.eta) * DS + DDS
        power = np.where(y > 0, y, 1.0) ** (self.eta - 1)
        return np.where(y > 0, power * value, 0.0)

    def energy(self, y: Array) -> Array:
        """Psi = int_0^y Phi at y (m); zero where y <= 0."""
        x, i, _, _ = self._cell(y)
        c = self.T[i]
        T = c[..., 0] + x * (c[..., 1] + x * (c[..., 2] + x * c[..., 3]))
        if self.rise:
            T = self._lift(y)[0] * T
        return np.maximum(y, 0.0) ** (2 + self.eta) * T

    def _factor(self, y: Array) -> tuple[Array, Array, Array]:
        """S, D S and D D S at y."""
        x, i, t, s = self._cell(y)
        c, weight = self.S[i], 0.5 * t * s * len(self.S)  # D in units of the place within a cell
        S = c[..., 0] + x * (c[..., 1] + x * (c[..., 2] + x * c[..., 3]))
        DS = weight * (c[..., 1] + x * (2 * c[..., 2] + x * (3 * c[..., 3])))
        DDS = weight**2 * (2 * c[..., 2] + x * (6 * c[..., 3])) + 0.5 * (s - t) * DS
        if not self.rise:
            return S, DS, DDS
        lift, slope, bend = self._lift(y)
        DDS = lift * (DDS + 2 * slope * DS + (slope**2 + bend) * S)
        return lift * S, lift * (DS + slope * S), DDS

    def _cell(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Place within its cell, cell number, t and 1 - t of each y."""
        # the bounds keep the place in the table for an infinite or NaN y, whose force shows it
        v = np.sqrt(np.fmin(np.fmax(y, 0.0), _FARTHEST))
        t, s = v / (v + self.scale), self.scale / (v + self.scale)
        cells = len(self.S)
        i = np.minimum((t * cells).astype(np.intp), cells - 1)
        return t * cells - i, i, t, s

    def _lift(self, y: Array) -> tuple[Array, Array, Array]:
        """w^p, and D w^p / w^p with its own D."""
        w, rest = shares(y, self.scale)
        slope = self.rise * rest
        return w**self.rise, slope, -slope * w


def shares(y: Array, scale: float) -> tuple[Array, Array]:
    """w = y/(y + V^2) and 1 - w of each y."""
    y, W = np.fmin(np.fmax(y, 0.0), _FARTHEST), scale * scale
    return y / (y + W), W / (y + W)


@lru_cache(maxsize=256)
def virgin_curve(eta: float, heights: HeightDistribution | None) -> VirginCurve:
    """Tabulate the virgin curve; laws that differ in other parameters share the table.

    Raises ValueError when Phi is not convex (the touch-depth density would turn negative and the
    energy guarantee would be lost), or when the heights are too narrow or too wide to tabulate.
    """
    if heights is None:
        flat = np.array([[1.0, 0.0, 0.0, 0.0]])
        return read_only(VirginCurve(eta, 1.0, flat, flat / (2 + eta), 0.0))
    r0, points = heights.overlap, heights.breakpoints()
    far = float(points[-1]) - r0 if points[-1] > r0 else r0
    middle = float(points[len(points) // 2]) - r0
    scale = float(np.sqrt(max(middle, far / 30)))
    power = rise(heights)
    _require_convex(eta, heights, far)
    shape = (eta, heights, scale, power)
    # what is too steep for the finest table is so at the very start: no need for all of it
    error = _tabulate(*shape, _CELLS[-1], 16)[1]
    for cells in _CELLS if error < WORST_ERROR else ():
        table, error = _tabulate(*shape, cells, cells)
        if error < TABLE_ERROR * float(np.max(table[:, 0])):
            break
    if not error < WORST_ERROR:
        raise ValueError(
            f"heights cannot be tabulated: the virgin curve is off by {error:.1e} with "
            f"{_CELLS[-1]} cells; they rise too steeply at the overlap of {r0:g} m (widen them, "
            "begin them exactly there, or drop them with heights=None) or have too long a tail "
            "(cut it)"
        )
    energy = _energy_table(eta, scale, table, power)
    return read_only(VirginCurve(eta, scale, table, energy, error, power))


def exact_force(y: Array, eta: float, heights: HeightDistribution | None) -> tuple[Array, Array]:
    """Phi and Phi' at y > 0 (m) without a table: the reference that the table is tested against."""
    if heights is None:
        return y ** (1 + eta), (1 + eta) * y**eta
    S, DS = factor(y, eta, heights)
    return y ** (1 + eta) * S, y**eta * ((1 + eta) * S + DS)


def _tabulate(
    eta: float, heights: HeightDistribution, scale: float, power: float, cells: int, first: int
) -> tuple[Array, float]:
    """The first so many cells of the table of S/w^p, and its largest error between the nodes."""
    t = np.arange(2 * first + 1) / (2 * cells)  # nodes and, between them, the points that test
    with np.errstate(divide="ignore"):
        y = (scale * t / (1 - t)) ** 2
    if power:
        y[0] = _NEARLY * y[1]
    S, DS = factor(y, eta, heights)
    if power:
        w, rest = shares(y, scale)
        S = S / w**power
        DS = DS / w**power - power * rest * S
    inside = (t > 0) & (t < 1)
    St = np.zeros_like(t)  # S is smooth in y, hence flat in t at both ends
    St[inside] = 2 * DS[inside] / (t * (1 - t))[inside]
    table = _hermite(S[::2], St[::2] / cells, rises=not power)
    half = table @ np.array([1.0, 0.5, 0.25, 0.125])
    return table, float(np.max(np.abs(half - S[1::2])))


def _hermite(value: Array, slope: Array, rises: bool) -> Array:
    """Cubic coefficients (cells, 4) through node values and slopes per cell.

    Slopes of what `rises` are held below three times the rise of either neighbour, so that the
    cubics rise too: where nearly no asperity touches yet, S grows too steeply for its cells, and an
    overshoot below zero would be tension.
    """
    step = np.diff(value)
    if rises:
        most = 3 * np.maximum(step, 0.0)
        slope = np.clip(slope, 0.0, np.minimum(np.append(most, np.inf), np.append(np.inf, most)))
    left, right = slope[:-1], slope[1:]
    return np.stack([value[:-1], left, 3 * step - 2 * left - right, left + right - 2 * step], -1)


def _energy_table(eta: float, scale: float, S: Array, power: float) -> Array:
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
    # T is that of Phi = y^(1+eta) w^p S over y^(2+eta) w^p
    lift = np.divide(*(shares(v, scale)[0] for v in (yi, top))) ** power
    piece = ((yi / top) ** (1 + eta) * lift * Si * dy / top) @ w
    T, nodes = np.empty(cells + 1), np.append(S[:, 0], S[-1].sum())
    T[0], T[-1] = nodes[0] / (2 + eta + power), nodes[-1] / (2 + eta)
    grown = shares(y, scale)[0] ** power
    for k in range(1, cells):
        T[k] = (y[k - 1] / y[k]) ** (2 + eta) * grown[k - 1] / grown[k] * T[k - 1] + piece[k - 1]
    slope = np.zeros(cells + 1)
    inside = t[1:-1]
    away = (2 + eta + power * shares(y[1:-1], scale)[1]) * T[1:-1]
    slope[1:-1] = (nodes[1:-1] - away) / (0.5 * inside * (1 - inside))
    return _hermite(T, slope / cells, rises=not power)


def _require_convex(eta: float, heights: HeightDistribution, far: float) -> None:
    """Refuse a "population" curve whose slope falls anywhere up to, or at, the last asperity."""
    if heights.formation == "individual":
        return
    near, body = np.geomspace(1e-9, 1e-3, 200), np.linspace(1e-3, 1.0, 4000)[1:]
    past = np.array([1 + 1e-9, 1 + 1e-6, 1.001, 1.01])  # a density may end in a step
    y = far * np.concatenate([near, body, past])
    _, slope = exact_force(y, eta, heights)
    fall = np.diff(slope) < -1e-12 * np.max(slope)
    if fall.any():
        at = y[int(np.argmax(fall))]
        raise ValueError(
            f'heights with formation = "population" and asperity.eta = {eta:g} give a virgin curve '
            f"that is not convex near y = {at:.3g} m, so contacts would lose stiffness on closure "
            'and create energy; use formation = "individual" (always convex), a broader height '
            "distribution, a larger overlap or a larger eta"
        )
