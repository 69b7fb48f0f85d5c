"""A gamma distribution through the depths of summits below the highest one.

The highest summit of a specimen is a draw like any other: the distribution begins some way above
it, and that distance is fitted too (it becomes the overlap at first touch). Likelihood fails for
an end point, so the product of spacings is maximised (Cheng & Amin 1983), which is as precise and
never unbounded.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import optimize, special

from ..support.checks import Array

_LOW, _HIGH = np.log([0.05, 1e-3, 1e-6]), np.log([200.0, 1e3, 1e3])


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
