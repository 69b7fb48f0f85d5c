"""The densities of the law fitted to a scan: heights from summits, directions from facets."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import optimize, special

from ..parameters.orientation import Orientation, largest_c
from ..support.checks import Array

HEIGHT_PARAMETERS = ("alpha", "beta", "overlap")
# bounds of the logarithms of alpha + 1, beta and overlap, the lengths over the mean depth
_LOWER_BOUNDS = np.log([0.05, 1e-3, 1e-6])
_UPPER_BOUNDS = np.log([200.0, 1e3, 1e3])
_BOUND_MARGIN = 0.05
MAX_LOG_ERROR = math.log(2) / 1.96  # standard error of a logarithm: 95 % interval of a factor of 2
MAX_RELATIVE_ERROR = 0.25  # standard error over the admissible range of an orientation parameter
MAX_VARIANCE_B = 1.5759  # b of the largest variance over squared mean, Eq. 17


class Estimate(NamedTuple):
    """A parameter in SI units with its standard error and 95 % interval.

    not_identifiable: the reason why the scan does not determine it, "" if it does.
    """

    value: float
    standard_error: float
    low: float
    high: float
    not_identifiable: str = ""


def fit_heights(depth: Array) -> dict[str, Estimate]:
    """Fit alpha, beta and overlap of a gamma density of heights to summit depths.

    The highest summit of a specimen is a random draw like any other: the density begins at an
    unknown distance above it, which is fitted too (it becomes the overlap at first contact). The
    likelihood is unbounded for such an end point, so the product of spacings is maximised (Cheng &
    Amin 1983), which is as precise and always bounded. The standard errors are errors of the
    logarithms of alpha + 1, beta and overlap.

    depth: (n,) in m below the highest summit.
    """
    scale = float(np.mean(depth))
    x = np.sort(depth) / scale

    def loss(q: Array) -> float:
        shape, beta, start = np.exp(q)
        below = np.concatenate([[0.0], special.gammainc(shape, (x + start) / beta)])
        above = np.concatenate([special.gammaincc(shape, (x + start) / beta), [0.0]])
        lower_tail = np.diff(below, append=1.0)
        upper_tail = -np.diff(above, prepend=1.0)
        spacing = np.where(below < 0.5, lower_tail, upper_tail)  # no cancellation in either tail
        return -float(np.sum(np.log(np.maximum(spacing, 1e-14))))

    guesses = [
        np.log([shape, (1 + start) / shape, start])
        for shape, start in ((2.0, 0.05), (5.0, 0.2), (12.0, 0.5))
    ]
    q = optimize.minimize(
        loss,
        min(guesses, key=loss),
        method="Nelder-Mead",
        bounds=list(zip(_LOWER_BOUNDS, _UPPER_BOUNDS, strict=True)),
        options={"xatol": 1e-4, "fatol": 1e-5, "maxiter": 2000, "adaptive": True},
    ).x
    errors = np.sqrt(np.diag(np.linalg.pinv(_hessian(loss, q), hermitian=True)))
    is_at_bound = np.any(np.minimum(q - _LOWER_BOUNDS, _UPPER_BOUNDS - q) < _BOUND_MARGIN)
    estimates = {}
    units = (1.0, scale, scale)
    shifts = (1.0, 0.0, 0.0)  # the logarithm of alpha + 1 is fitted
    for k, name in enumerate(HEIGHT_PARAMETERS):
        shifted_value = float(np.exp(q[k])) * units[k]
        error = float(errors[k])
        low, high = (shifted_value * math.exp(sign * 1.96 * error) - shifts[k] for sign in (-1, 1))
        reason = ""
        if error > MAX_LOG_ERROR or is_at_bound:
            reason = f"its 95 % interval from these summits is {low:.3g} to {high:.3g}"
        estimates[name] = Estimate(
            shifted_value - shifts[k], error * shifted_value, low, high, reason
        )
    return estimates


def fit_directions(slope: Array, summit: NDArray[np.intp], noise: float) -> dict[str, Estimate]:
    """Fit a, b and c of Eq. 14 to the gradients of facets.

    a and b follow from the measured mean and variance of the inclination (Eq. 17), the variance
    without the contribution of noise; c is the mean of cos 2 phi over the facets, by Eq. 14. The
    standard errors are jackknife errors over summits, because facets of one summit are correlated.

    Parameters
    ----------
    slope: gradients (n, 2).
    summit: index of the summit of each facet, (n,).
    noise: standard error of one component of a gradient.
    """
    theta = np.arctan(np.linalg.norm(slope, axis=-1))
    cosine = np.cos(2 * np.arctan2(slope[:, 0], slope[:, 1]))
    facet_moments = np.stack([np.ones(theta.size), theta, theta**2 - noise**2, cosine], -1)
    summit_moments = np.zeros((int(summit.max()) + 1, 4))
    np.add.at(summit_moments, summit, facet_moments)
    total = summit_moments.sum(axis=0)
    values, is_outside = _orientation_parameters(total)
    jackknife = np.array([_orientation_parameters(total - one)[0] for one in summit_moments])
    n = len(summit_moments)
    errors = np.sqrt((n - 1) ** 2 / n * np.var(jackknife, axis=0, ddof=1))
    # a relative to its value, b and c relative to the range of Eq. 18
    admissible_ranges = (values[0], 3.0, 2 / 3)
    estimates = {}
    for k, name in enumerate("abc"):
        value = float(values[k])
        error = float(errors[k])
        reason = ""
        if is_outside[k]:
            reason = "no density of Eq. 14 and 18 has these inclinations"
        elif error > MAX_RELATIVE_ERROR * admissible_ranges[k]:
            reason = f"its standard error is {error:.2g}"
        low = value - 1.96 * error
        high = value + 1.96 * error
        estimates[name] = Estimate(value, error, low, high, reason)
    return estimates


def _orientation_parameters(sums: Array) -> tuple[Array, tuple[bool, bool, bool]]:
    """a, b and c from sums over facets of 1, theta, theta^2 and cos 2 phi; which are at a bound.

    Moments outside the range of Eq. 14 give the nearest b, and c is limited to the bound of Eq. 18.
    """
    mean, square, c = sums[1:] / sums[0]
    variance = max(square - mean**2, 1e-12 * mean**2)
    try:
        orientation = Orientation.from_moments(mean, variance)
        a = orientation.a
        b = orientation.b
        is_outside = False
    except ValueError:
        b = -1.0 if variance < 0.14 * mean**2 else MAX_VARIANCE_B
        a = max((6 - b) / (6 * mean), 1.0)
        is_outside = True
    bound = largest_c(b)
    return np.array([a, b, np.clip(c, -bound, bound)]), (is_outside, is_outside, abs(c) > bound)


def _hessian(f: Callable[[Array], float], x: Array) -> Array:
    """Second derivatives by central differences."""
    steps = 1e-3 * np.eye(x.size)
    rows = [
        [f(x + s + t) - f(x + s - t) - f(x - s + t) + f(x - s - t) for t in steps] for s in steps
    ]
    return np.array(rows) / 4e-6
