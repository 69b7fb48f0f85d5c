"""The first-loading curve Phi: normal force of one asperity against its effective closure y.

    no heights:     Phi = y^(1+eta)
    population:     Phi = P(r0 + y) y^(1+eta)                                        (Eq. 37)
    individual:     Phi = P(r0) y^(1+eta) + int_0^y H(r0 + s) (y - s)^(1+eta) ds

Phi is in units of lam K cos(theta)^(1+eta). The table holds the smooth factor S = Phi / y^(1+eta)
on the half line y >= 0, mapped to 0 <= t <= 1 by sqrt(y) = V t/(1 - t), so no closure is beyond the
table. With D = y d/dy = t (1 - t)/2 d/dt,

    Phi'  = y^eta       [(1 + eta) S + D S]
    Phi'' = y^(eta - 1) [eta (1 + eta) S + (1 + 2 eta) D S + D D S]
    Psi   = int Phi dy = y^(2+eta) T,     D T = S - (2 + eta) T

Where the density of heights is infinite at the very point of contact, S ~ y^p is steep there; then
S/w^p and T/w^p are tabulated, with w = y/(y + V^2) and the exponent p.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..parameters.heights import HeightDistribution
from ..support.checks import Array, read_only
from .formation import contact_exponent, smooth_factor

TABLE_ERROR = 1e-10  # target for S, relative to its largest value
MAX_TABLE_ERROR = 1e-6  # larger errors raise ValueError
_MAX_CLOSURE = 1e300  # m; S is 1 long before
_LIMIT_AT_ZERO = 1e-20  # of the first node: where the limit at y = 0 is evaluated
_PIECES = (128, 256, 512, 1024, 2048, 4096, 8192)


class FirstLoadingCurve(NamedTuple):
    """Table of the first-loading curve: cubics on equal pieces of t, coefficients (pieces, 4)."""

    eta: float
    scale: float  # V, in m^(1/2)
    S: Array
    T: Array
    error: float  # largest error of S found between the nodes
    exponent: float = 0.0  # p: S and T are tabulated over w^p

    @property
    def is_linear(self) -> bool:
        """Whether the curve is one linear spring that engages at zero: eta = 0, no heights."""
        return self.eta == 0.0 and len(self.S) == 1

    def force(self, y: Array) -> tuple[Array, Array]:
        """Phi and its slope Phi' at y (m); both zero where y <= 0."""
        S, DS, _ = self._factor(y)
        power = np.where(y > 0, np.maximum(y, 0.0) ** self.eta, 0.0)
        return power * y * S, power * ((1 + self.eta) * S + DS)

    def curvature(self, y: Array) -> Array:
        """Second derivative Phi'' at y (m); zero where y <= 0."""
        S, DS, DDS = self._factor(y)
        value = self.eta * (1 + self.eta) * S + (1 + 2 * self.eta) * DS + DDS
        power = np.where(y > 0, y, 1.0) ** (self.eta - 1)
        return np.where(y > 0, power * value, 0.0)

    def energy(self, y: Array) -> Array:
        """Psi = int_0^y Phi at y (m); zero where y <= 0."""
        x, i, _, _ = self._piece(y)
        c = self.T[i]
        T = c[..., 0] + x * (c[..., 1] + x * (c[..., 2] + x * c[..., 3]))
        if self.exponent:
            T = self._power(y)[0] * T
        return np.maximum(y, 0.0) ** (2 + self.eta) * T

    def _factor(self, y: Array) -> tuple[Array, Array, Array]:
        """S, D S and D D S at y."""
        x, i, t, s = self._piece(y)
        c = self.S[i]
        weight = 0.5 * t * s * len(self.S)  # of D, for derivatives by the place in a piece
        S = c[..., 0] + x * (c[..., 1] + x * (c[..., 2] + x * c[..., 3]))
        DS = weight * (c[..., 1] + x * (2 * c[..., 2] + x * (3 * c[..., 3])))
        DDS = weight**2 * (2 * c[..., 2] + x * (6 * c[..., 3])) + 0.5 * (s - t) * DS
        if not self.exponent:
            return S, DS, DDS
        power, slope, curvature = self._power(y)
        DDS = power * (DDS + 2 * slope * DS + (slope**2 + curvature) * S)
        return power * S, power * (DS + slope * S), DDS

    def _piece(self, y: Array) -> tuple[Array, Array, Array, Array]:
        """Place of each y (m) in the table.

        Returns the position within its piece (0 to 1), the index of the piece, and t = v/(v + V)
        and 1 - t, where v = sqrt(y).
        """
        # the bounds keep the index in the table for an infinite or NaN y, whose force shows it
        v = np.sqrt(np.fmin(np.fmax(y, 0.0), _MAX_CLOSURE))
        t = v / (v + self.scale)
        s = self.scale / (v + self.scale)
        pieces = len(self.S)
        i = np.minimum((t * pieces).astype(np.intp), pieces - 1)
        return t * pieces - i, i, t, s

    def _power(self, y: Array) -> tuple[Array, Array, Array]:
        """w^p, its logarithmic derivative D w^p / w^p, and D of that."""
        w, complement = normalised_closure(y, self.scale)
        slope = self.exponent * complement
        return w**self.exponent, slope, -slope * w


def normalised_closure(y: Array, scale: float) -> tuple[Array, Array]:
    """w = y/(y + V^2) and 1 - w of each y."""
    y = np.fmin(np.fmax(y, 0.0), _MAX_CLOSURE)
    W = scale * scale
    return y / (y + W), W / (y + W)


@lru_cache(maxsize=256)
def first_loading_curve(eta: float, heights: HeightDistribution | None) -> FirstLoadingCurve:
    """Tabulate the first-loading curve; laws that differ in other parameters share the table.

    Raises ValueError when Phi is not convex (the touch-depth density would turn negative and the
    energy guarantee would be lost), or when the heights are too narrow or too wide to tabulate.
    """
    if heights is None:
        flat = np.array([[1.0, 0.0, 0.0, 0.0]])
        return read_only(FirstLoadingCurve(eta, 1.0, flat, flat / (2 + eta), 0.0))
    r0 = heights.overlap
    points = heights.breakpoints()
    highest = float(points[-1]) - r0 if points[-1] > r0 else r0
    middle = float(points[len(points) // 2]) - r0
    scale = float(np.sqrt(max(middle, highest / 30)))
    exponent = contact_exponent(heights)
    _require_convex(eta, heights, highest)
    shape = (eta, heights, scale, exponent)
    # a curve that is too steep for the finest table is so at its very start: 16 pieces show it
    error = _tabulate(*shape, _PIECES[-1], 16)[1]
    for pieces in _PIECES if error < MAX_TABLE_ERROR else ():
        table, error = _tabulate(*shape, pieces, pieces)
        if error < TABLE_ERROR * float(np.max(table[:, 0])):
            break
    if not error < MAX_TABLE_ERROR:
        raise ValueError(
            f"heights cannot be tabulated: the first-loading curve is off by {error:.1e} with "
            f"{_PIECES[-1]} cells; they rise too steeply at the overlap of {r0:g} m (widen them, "
            "begin them exactly there, or drop them with heights=None) or have too long a tail "
            "(cut it)"
        )
    energy = _tabulate_energy(eta, scale, table, exponent)
    return read_only(FirstLoadingCurve(eta, scale, table, energy, error, exponent))


def exact_force(y: Array, eta: float, heights: HeightDistribution | None) -> tuple[Array, Array]:
    """Phi and Phi' at y > 0 (m) without a table: the reference that the table is tested against."""
    if heights is None:
        return y ** (1 + eta), (1 + eta) * y**eta
    S, DS = smooth_factor(y, eta, heights)
    return y ** (1 + eta) * S, y**eta * ((1 + eta) * S + DS)


def _tabulate(
    eta: float,
    heights: HeightDistribution,
    scale: float,
    exponent: float,
    pieces: int,
    count: int,
) -> tuple[Array, float]:
    """The first `count` pieces of the table of S/w^p, and its largest error between the nodes."""
    t = np.arange(2 * count + 1) / (2 * pieces)  # nodes, and test points between them
    with np.errstate(divide="ignore"):
        y = (scale * t / (1 - t)) ** 2
    if exponent:
        y[0] = _LIMIT_AT_ZERO * y[1]
    S, DS = smooth_factor(y, eta, heights)
    if exponent:
        w, complement = normalised_closure(y, scale)
        S = S / w**exponent
        DS = DS / w**exponent - exponent * complement * S
    inside = (t > 0) & (t < 1)
    St = np.zeros_like(t)  # S is smooth in y, hence flat in t at both ends
    St[inside] = 2 * DS[inside] / (t * (1 - t))[inside]
    table = _hermite(S[::2], St[::2] / pieces, is_increasing=not exponent)
    half = table @ np.array([1.0, 0.5, 0.25, 0.125])
    return table, float(np.max(np.abs(half - S[1::2])))


def _hermite(value: Array, slope: Array, is_increasing: bool) -> Array:
    """Cubic coefficients (pieces, 4) through node values and slopes per piece.

    If the values are increasing, slopes are limited to three times the increase on either side, so
    that the cubics increase too: where nearly no asperity is in contact, S grows too steeply for
    its pieces, and an overshoot below zero would be tension.
    """
    step = np.diff(value)
    if is_increasing:
        bound = 3 * np.maximum(step, 0.0)
        upper = np.minimum(np.append(bound, np.inf), np.append(np.inf, bound))
        slope = np.clip(slope, 0.0, upper)
    slope0 = slope[:-1]
    slope1 = slope[1:]
    quadratic = 3 * step - 2 * slope0 - slope1
    return np.stack([value[:-1], slope0, quadratic, slope0 + slope1 - 2 * step], -1)


def _tabulate_energy(eta: float, scale: float, S: Array, exponent: float) -> Array:
    """Table of T = Psi / y^(2+eta) by exact integration of the tabulated force, piece by piece."""
    pieces = len(S)
    t = np.arange(pieces + 1) / pieces
    with np.errstate(divide="ignore"):
        y = (scale * t / (1 - t)) ** 2
    x, w = np.polynomial.legendre.leggauss(12)
    x = 0.5 * (x + 1)
    w = 0.5 * w
    inner = (np.arange(pieces - 1)[:, None] + x) / pieces  # the last piece ends at y = infinity
    yi = (scale * inner / (1 - inner)) ** 2
    dy = 2 * scale**2 * inner / (1 - inner) ** 3 / pieces
    Si = S[:-1, :1] + x * (S[:-1, 1:2] + x * (S[:-1, 2:3] + x * S[:-1, 3:]))
    top = y[1:-1, None]
    # T belongs to Phi = y^(1+eta) w^p S, over y^(2+eta) w^p
    w_ratio = normalised_closure(yi, scale)[0] / normalised_closure(top, scale)[0]
    energy = ((yi / top) ** (1 + eta) * w_ratio**exponent * Si * dy / top) @ w
    nodes = np.append(S[:, 0], S[-1].sum())
    T = np.empty(pieces + 1)
    T[0] = nodes[0] / (2 + eta + exponent)
    T[-1] = nodes[-1] / (2 + eta)
    power = normalised_closure(y, scale)[0] ** exponent
    for k in range(1, pieces):
        carried = (y[k - 1] / y[k]) ** (2 + eta) * power[k - 1] / power[k] * T[k - 1]
        T[k] = carried + energy[k - 1]
    slope = np.zeros(pieces + 1)
    inside = t[1:-1]
    complement = normalised_closure(y[1:-1], scale)[1]
    outflow = (2 + eta + exponent * complement) * T[1:-1]
    slope[1:-1] = (nodes[1:-1] - outflow) / (0.5 * inside * (1 - inside))
    return _hermite(T, slope / pieces, is_increasing=not exponent)


def _require_convex(eta: float, heights: HeightDistribution, highest: float) -> None:
    """Raise ValueError if the slope of a "population" curve decreases on closure.

    The curve is checked at closures up to slightly beyond `highest` (m), at which the last asperity
    touches. "individual" curves are always convex and pass unchecked.
    """
    if heights.formation == "individual":
        return
    start = np.geomspace(1e-9, 1e-3, 200)
    body = np.linspace(1e-3, 1.0, 4000)[1:]
    end = np.array([1 + 1e-9, 1 + 1e-6, 1.001, 1.01])  # a density may end in a step
    y = highest * np.concatenate([start, body, end])
    _, slope = exact_force(y, eta, heights)
    decreases = np.diff(slope) < -1e-12 * np.max(slope)
    if decreases.any():
        concave_at = y[int(np.argmax(decreases))]
        raise ValueError(
            f'heights with formation = "population" and asperity.eta = {eta:g} give a '
            f"first-loading curve that is not convex near y = {concave_at:.3g} m, so contacts "
            "would lose stiffness on closure "
            'and create energy; use formation = "individual" (always convex), a broader height '
            "distribution, a larger overlap or a larger eta"
        )
