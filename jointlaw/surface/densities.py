"""The densities of the law through a scan: heights through summits, directions through facets.

Heights. A gamma distribution through the depths of summits below the highest one.

The highest summit of a specimen is a draw like any other: the distribution begins some way above
it, and that distance is fitted too (it becomes the overlap at first touch). Likelihood fails for
an end point, so the product of spacings is maximised (Cheng & Amin 1983), which is as precise and
never unbounded.

Directions. Eq. 14 through measured facet slopes, the error of the slopes included.

A density that ends at theta = pi/(2a) has no usual likelihood: one noisy facet beyond the end rules
it out. So the density of gradients is the law's, ring by ring of equal inclination, blurred by the
error of a measured gradient (sd s in each component; the gradients of a good scan are blurred on
purpose, by 3 % of the largest, so that the likelihood is smooth in a). In polar coordinates the
blur of a ring of radius R keeps its azimuthal harmonic h,

    p(r, phi) = r/(2 pi s^2) sum_k w_k exp(-(r - R_k)^2/(2 s^2)) [i0 (1 + b/2 (3u^2 - 1))
                + i2 3c (1 - u^2) cos 2 phi],   R_k = tan(arccos(u_k)/a),

with ih the exponentially scaled Bessel functions of r R_k/s^2. Facets of one summit are kin, so
the errors are summed over summits first (sandwich).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from ..parameters.orientation import largest_c
from ..support.checks import Array

_LOW, _HIGH = np.log([0.05, 1e-3, 1e-6]), np.log([200.0, 1e3, 1e3])
BLUR = 0.03
_RADII, _SECTORS = 160, 9
_X, _W = np.polynomial.legendre.leggauss(96)
_U, _WEIGHT = 0.5 * (_X + 1), 0.5 * _W


class HeightFit(NamedTuple):
    """alpha, beta (m) and overlap (m), covariance of their logarithms (of alpha + 1), distance."""

    alpha: float
    beta: float
    overlap: float
    covariance: Array  # (3, 3)
    distance: float  # largest difference of the two cumulative curves
    at_bound: bool


def fit_heights(depth: Array, reference: float | None = None) -> HeightFit:
    """Fit the depths (n,) in m; `reference` is the known start of the distribution above the
    highest summit (m), or None."""
    x = np.sort(depth)
    scale = float(np.mean(x))
    x = x / scale
    known = None if reference is None else np.log(max(reference / scale, 1e-9))

    def loss(q: Array) -> float:
        shape, beta = np.exp(q[0]), np.exp(q[1])
        start = np.exp(q[2] if known is None else known)
        below = np.concatenate([[0.0], special.gammainc(shape, (x + start) / beta)])
        above = np.concatenate([special.gammaincc(shape, (x + start) / beta), [0.0]])
        low = np.diff(below, append=1.0)
        high = -np.diff(above, prepend=1.0)
        spacing = np.where(below < 0.5, low, high)  # no cancellation in either tail
        return -float(np.sum(np.log(np.maximum(spacing, 1e-14))))

    free = 3 if known is None else 2
    bounds = list(zip(_LOW[:free], _HIGH[:free], strict=True))
    guesses = [
        np.log([shape, (1 + start) / shape, start])[:free]
        for shape, start in ((2.0, 0.05), (5.0, 0.2), (12.0, 0.5))
    ]
    best = optimize.minimize(
        loss, min(guesses, key=loss), method="Nelder-Mead", bounds=bounds,
        options={"xatol": 1e-4, "fatol": 1e-5, "maxiter": 2000, "adaptive": True},
    )  # fmt: skip
    q = best.x
    covariance = np.zeros((3, 3))
    covariance[:free, :free] = np.linalg.pinv(_hessian(loss, q), hermitian=True)
    shape, beta = float(np.exp(q[0])), float(np.exp(q[1]))
    start = float(np.exp(q[2] if known is None else known))
    model = special.gammainc(shape, (x + start) / beta)
    step = np.arange(x.size + 1) / x.size
    distance = float(np.max(np.maximum(np.abs(model - step[1:]), np.abs(model - step[:-1]))))
    at_bound = bool(np.any(np.minimum(q - _LOW[:free], _HIGH[:free] - q) < 0.05))
    return HeightFit(shape - 1, beta * scale, start * scale, covariance, distance, at_bound)


def _hessian(f: Callable[[Array], float], x: Array) -> Array:
    """Second derivatives by central differences."""
    n, h = x.size, 1e-3
    steps = h * np.eye(n)
    H = np.empty((n, n))
    for i in range(n):
        for j in range(i, n):
            a, b = steps[i], steps[j]
            H[i, j] = H[j, i] = (f(x + a + b) - f(x + a - b) - f(x - a + b) + f(x - a - b)) / (
                4 * h * h
            )
    return H


# ---------------------------------------------------------------------------- directions


class DirectionFit(NamedTuple):
    """a, b, c of Eq. 14, and the shares of facets by class of inclination."""

    a: float
    b: float
    c: float
    covariance: Array  # (3, 3)
    distance: float  # largest difference of the two cumulative curves
    at_bound: bool
    inclination: Array  # (classes,) rad
    measured: Array  # (classes,) shares of the facets
    fitted: Array  # (classes,) the same of the fit, error of the slopes included


class _Bins(NamedTuple):
    """Counts over slope and folded azimuth, and the place of every facet in them."""

    radius: Array  # (bins,) middle of the slope classes
    width: float
    counts: Array  # (bins, sectors)
    place: NDArray[np.intp]  # (n,) flat index
    blur: float
    profile: bool


def fit_directions(slope: Array, summit: NDArray[np.intp], noise: float) -> DirectionFit:
    """Fit facet gradients (n, dim), of the summits (n,), with the standard error `noise`."""
    bins = _count(slope, noise)
    mean = float(np.mean(np.arctan(np.linalg.norm(slope, axis=-1))))
    mean *= np.pi / 2 if bins.profile else 1.0  # a profile sees 2/pi of it

    def loss(log_a: float) -> float:
        return _shape(bins, _components(bins, np.exp(log_a)))[0]

    low, high = max(0.0, np.log(0.5 / mean)), max(0.1, np.log(1.5 / mean))  # Eq. 17 with a margin
    grid = np.linspace(low, high, 9)
    start = int(np.argmin([loss(g) for g in grid]))
    found = optimize.minimize_scalar(
        loss, bounds=(grid[max(start - 1, 0)], grid[min(start + 1, 8)]), method="bounded",
        options={"xatol": 1e-4},
    )  # fmt: skip
    a = float(np.exp(found.x))
    _, b, c = _shape(bins, _components(bins, a))
    x = np.array([a, b, c])
    covariance = _covariance(bins, x, summit)
    p = _density(_components(bins, a), b, c).sum(axis=1)
    counts = bins.counts.sum(axis=1)
    distance = float(np.max(np.abs(np.cumsum(p) - np.cumsum(counts) / counts.sum())))
    bound = largest_c(b)
    at_bound = b < -0.98 or b > 1.98 or (abs(c) > 0.99 * bound and not bins.profile) or a < 1.001
    inclination, measured = np.arctan(bins.radius), counts / counts.sum()
    return DirectionFit(
        a, b, c, covariance, distance, bool(at_bound), inclination, measured, p
    )  # fmt: skip


def _count(slope: Array, noise: float) -> _Bins:
    added = BLUR * float(np.quantile(np.linalg.norm(slope, axis=-1), 0.99))
    slope = slope + added * np.random.default_rng(0).standard_normal(slope.shape)
    radius = np.asarray(np.linalg.norm(slope, axis=-1), np.float64)
    profile = slope.shape[-1] == 1
    blur = float(np.hypot(noise, added))
    end = 1.2 * float(radius.max()) + 4 * blur
    width = end / _RADII
    i = np.minimum((radius / width).astype(np.intp), _RADII - 1)
    sectors = 1 if profile else _SECTORS
    j = np.zeros_like(i)
    if not profile:
        azimuth = np.arctan2(np.abs(slope[..., 0]), np.abs(slope[..., 1]))  # cos 2 phi is even
        j = np.minimum((azimuth / (np.pi / 2) * sectors).astype(np.intp), sectors - 1)
    place = i * sectors + j
    counts = np.bincount(place.ravel(), minlength=_RADII * sectors).reshape(_RADII, sectors)
    middle: Array = (0.5 + np.arange(_RADII, dtype=np.float64)) * float(width)
    return _Bins(middle, width, counts.astype(float), place, blur, profile)


def _components(bins: _Bins, a: float) -> Array:
    """Probabilities (3, bins, sectors) of the classes that go with 1, b and c."""
    u, w = _U, _WEIGHT
    ring = np.tan(np.minimum(np.arccos(u) / a, 1.5))
    s, r = bins.blur, bins.radius[:, None]
    weights = np.stack([w, w * (3 * u**2 - 1) / 2, w * 3 * (1 - u**2)])
    if bins.profile:  # only the slope along the profile is seen: rings are projected on it
        angle = (np.arange(16) + 0.5) * np.pi / 32
        seen = ring[:, None] * np.cos(angle)  # (rings, 16)
        bell = sum(
            np.exp(-0.5 * ((r[..., None] - side * seen) / s) ** 2).mean(axis=-1) for side in (1, -1)
        )
        part = np.asarray(bell) @ weights[:2].T * (bins.width / (s * np.sqrt(2 * np.pi)))
        return np.stack([part[:, 0], part[:, 1], np.zeros(_RADII)])[:, :, None]
    z = r * ring / s**2
    bell = r / s**2 * np.exp(-0.5 * ((r - ring) / s) ** 2) * bins.width
    mean = (bell * special.ive(0, z)) @ weights[:2].T
    second = (bell * special.ive(2, z)) @ weights[2]
    edge = np.linspace(0, np.pi / 2, _SECTORS + 1)
    harmonic = np.diff(np.sin(2 * edge)) / 2 / (np.pi / 2)  # cos 2 phi over a sector
    flat = np.full(_SECTORS, 1 / _SECTORS)
    return np.stack(
        [np.outer(mean[:, 0], flat), np.outer(mean[:, 1], flat), np.outer(second, harmonic)]
    )


def _density(parts: Array, b: float, c: float) -> Array:
    return np.asarray(np.maximum(parts[0] + b * parts[1] + c * parts[2], 1e-14))


def _shape(bins: _Bins, parts: Array) -> tuple[float, float, float]:
    """Least negative log-likelihood at this a, with its b and c (within Eq. 18)."""
    full = bins.counts > 0
    n, parts = bins.counts[full], parts[:, full]
    b, c = 0.0, 0.0
    for _ in range(60):  # Newton on a concave likelihood
        p = _density(parts, b, c)
        q1, q2 = parts[1] / p, parts[2] / p
        g = np.array([n @ q1, n @ q2])
        H = np.array([[n @ q1**2, n @ (q1 * q2)], [n @ (q1 * q2), n @ q2**2]])
        step = np.array([g[0] / H[0, 0], 0.0]) if bins.profile else np.linalg.solve(H, g)
        at = _inside(b + step[0], c + step[1])
        moved = max(abs(at[0] - b), abs(at[1] - c))
        b, c = at
        if moved < 1e-7:
            break
    return -float(n @ np.log(_density(parts, b, c))), b, c


def _inside(b: float, c: float) -> tuple[float, float]:
    """The nearest b and c that Eq. 18 allows."""
    b = float(min(max(b, -1.0), 2.0))
    bound = largest_c(b)
    return b, float(min(max(c, -bound), bound))


def _covariance(bins: _Bins, x: Array, summit: NDArray[np.intp]) -> Array:
    """Sandwich covariance of a, b, c; c of a profile has none."""
    p = _density(_components(bins, x[0]), x[1], x[2])
    scores = []
    for k, step in enumerate((1e-3 * x[0], 1e-3, 1e-3)):
        up, down = x.copy(), x.copy()
        up[k], down[k] = x[k] + step, x[k] - step
        high = _density(_components(bins, up[0]), up[1], up[2])
        low = _density(_components(bins, down[0]), down[1], down[2])
        scores.append((np.log(high) - np.log(low)) / (2 * step))
    score = np.stack(scores, -1)  # (bins, sectors, 3)
    free = 2 if bins.profile else 3
    score = score[..., :free]
    information = bins.counts.sum() * np.einsum("ij,ijk,ijl->kl", p, score, score)
    per_summit = np.zeros((int(summit.max()) + 1, free))
    np.add.at(per_summit, summit, score.reshape(-1, free)[bins.place])
    meat = per_summit.T @ per_summit
    bread = np.linalg.pinv(information, hermitian=True)
    covariance = np.zeros((3, 3))
    covariance[:free, :free] = bread @ meat @ bread
    return covariance
