"""The densities of the law through a scan: heights through summits, directions through facets."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from ..parameters.orientation import Orientation, largest_c
from ..support.checks import Array

_LOW, _HIGH = np.log([0.05, 1e-3, 1e-6]), np.log([200.0, 1e3, 1e3])
HEIGHTS = ("alpha", "beta", "overlap")
WIDEST = math.log(2) / 1.96  # standard error of a logarithm: a factor of 2 either way
VAGUE = 0.25  # standard error over the whole range of a parameter: beyond it says nothing
MOST_SPREAD = 1.5759  # the b of the largest variance over squared mean, Eq. 17


class Estimate(NamedTuple):
    """A parameter in SI units, its standard error, the ends of its 95 % interval.

    left_open: why the scan does not fix it, "" where it does.
    """

    value: float
    standard_error: float
    low: float
    high: float
    left_open: str = ""


def fit_heights(depth: Array) -> dict[str, Estimate]:
    """alpha, beta and overlap of gamma heights through depths (n,) in m below the highest summit.

    The highest summit of a specimen is a draw like any other: the distribution begins some way
    above it, and that distance is fitted too (it becomes the overlap at first touch). Likelihood
    fails for an end point, so the product of spacings is maximised (Cheng & Amin 1983), which is as
    precise and never unbounded. The errors are those of the logarithms of alpha + 1, beta and
    overlap.
    """
    scale = float(np.mean(depth))
    x = np.sort(depth) / scale

    def loss(q: Array) -> float:
        shape, beta, start = np.exp(q)
        below = np.concatenate([[0.0], special.gammainc(shape, (x + start) / beta)])
        above = np.concatenate([special.gammaincc(shape, (x + start) / beta), [0.0]])
        low = np.diff(below, append=1.0)
        high = -np.diff(above, prepend=1.0)
        spacing = np.where(below < 0.5, low, high)  # no cancellation in either tail
        return -float(np.sum(np.log(np.maximum(spacing, 1e-14))))

    guesses = [
        np.log([shape, (1 + start) / shape, start])
        for shape, start in ((2.0, 0.05), (5.0, 0.2), (12.0, 0.5))
    ]
    q = optimize.minimize(
        loss, min(guesses, key=loss), method="Nelder-Mead",
        bounds=list(zip(_LOW, _HIGH, strict=True)),
        options={"xatol": 1e-4, "fatol": 1e-5, "maxiter": 2000, "adaptive": True},
    ).x  # fmt: skip
    errors = np.sqrt(np.diag(np.linalg.pinv(_hessian(loss, q), hermitian=True)))
    at_bound = np.any(np.minimum(q - _LOW, _HIGH - q) < 0.05)
    found = {}
    for k, (unit, shift) in enumerate(((1.0, 1.0), (scale, 0.0), (scale, 0.0))):
        size, error = float(np.exp(q[k])) * unit, float(errors[k])
        low, high = (size * math.exp(sign * 1.96 * error) - shift for sign in (-1, 1))
        left = f"these summits leave it anywhere from {low:.3g} to {high:.3g}"
        vague = error > WIDEST or at_bound
        found[HEIGHTS[k]] = Estimate(size - shift, error * size, low, high, left if vague else "")
    return found


def fit_directions(slope: Array, summit: NDArray[np.intp], noise: float) -> dict[str, Estimate]:
    """a, b and c of Eq. 14 through facet gradients (n, 2) of the summits (n,).

    a and b give the measured mean and variance of the inclination, Eq. 17, the variance less that
    of the error `noise` of a gradient; c is the mean of cos 2 phi over the facets, which follows
    from Eq. 14. The errors are those of the jackknife over summits, whose facets are kin.
    """
    theta = np.arctan(np.linalg.norm(slope, axis=-1))
    cosine = np.cos(2 * np.arctan2(slope[:, 0], slope[:, 1]))
    of_facets = np.stack([np.ones(theta.size), theta, theta**2 - noise**2, cosine], -1)
    of_summits = np.zeros((int(summit.max()) + 1, 4))
    np.add.at(of_summits, summit, of_facets)
    total = of_summits.sum(axis=0)
    values, outside = _orientation(total)
    left_out = np.array([_orientation(total - one)[0] for one in of_summits])
    n = len(of_summits)
    errors = np.sqrt((n - 1) ** 2 / n * np.var(left_out, axis=0, ddof=1))
    found = {}
    # a to a factor of 2, b and c against all that Eq. 18 allows
    for k, reach in enumerate((values[0], 3.0, 2 / 3)):
        x, error = float(values[k]), float(errors[k])
        left = f"its standard error is {error:.2g}" if error > VAGUE * reach else ""
        left = "no density of Eq. 14 and 18 has these inclinations" if outside[k] else left
        found["abc"[k]] = Estimate(x, error, x - 1.96 * error, x + 1.96 * error, left)
    return found


def _orientation(sums: Array) -> tuple[Array, tuple[bool, bool, bool]]:
    """a, b, c of these sums over facets (number, theta, theta^2, cos 2 phi); which are at a bound.

    Moments that no density of Eq. 14 has take the nearest b, and c its bound of Eq. 18.
    """
    mean, square, c = sums[1:] / sums[0]
    variance = max(square - mean**2, 1e-12 * mean**2)
    try:
        found = Orientation.from_moments(mean, variance)
        a, b, outside = found.a, found.b, False
    except ValueError:
        b = -1.0 if variance < 0.14 * mean**2 else MOST_SPREAD
        a, outside = max((6 - b) / (6 * mean), 1.0), True
    bound = largest_c(b)
    return np.array([a, b, np.clip(c, -bound, bound)]), (outside, outside, abs(c) > bound)


def _hessian(f: Callable[[Array], float], x: Array) -> Array:
    """Second derivatives by central differences."""
    steps = 1e-3 * np.eye(x.size)
    rows = [
        [f(x + s + t) - f(x + s - t) - f(x - s + t) + f(x - s - t) for t in steps] for s in steps
    ]
    return np.array(rows) / 4e-6
