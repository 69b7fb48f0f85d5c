"""Measurement noise: expected levels, and levels estimated from the residuals of a fit."""

from typing import NamedTuple

import numpy as np

from ..support.checks import Array

FACTOR = 4.0  # the 95 % range of a level is from 1/4 to 4 times the expected one
_LOG_SD = np.log(FACTOR) / 1.96
_GRID = np.linspace(-3.2, 3.2, 33)  # standard deviations of the logarithm of a level
_MIN_FREEDOM = 0.02  # of a residual, 1 - leverage


class Noise(NamedTuple):
    """Noise level of a measured curve.

    The variance of a residual is relative^2 + (absolute * log_slope)^2.

    relative: standard error of the stress relative to its scale.
    absolute: standard error of the closure in m; `Series.log_slope` (1/m) converts it to one of
        the stress. Zero for a curve whose displacement is taken as exact.
    is_known: whether the levels are known and not estimated.
    """

    relative: float
    absolute: float = 0.0
    is_known: bool = False


class Series(NamedTuple):
    """One measured quantity of a test.

    quantity: its name.
    expected: the expected noise.
    log_slope: slope of the curve (1/m) at each residual, (n,).
    n_points: number of measured points.
    """

    quantity: str
    expected: Noise
    log_slope: Array
    n_points: int


def estimate_noise(series: Series, residual: Array, leverage: Array) -> Noise:
    """Estimate the noise levels of a series from the residuals of a fit.

    Both levels have wide priors from the accuracy of instruments, because eight points cannot
    determine two levels. Restricted likelihood: the residual of a point of leverage h has the
    variance (1 - h) sigma^2.

    Parameters
    ----------
    series: the measured quantity.
    residual, leverage: (n,) each.
    """
    expected = series.expected
    if expected.is_known:
        return expected
    freedom = np.clip(1 - leverage, _MIN_FREEDOM, 1.0)
    relative, absolute = (level * np.exp(_GRID * _LOG_SD) for level in expected[:2])
    variance = relative[:, None, None] ** 2 + (absolute[:, None] * series.log_slope) ** 2
    loss = np.sum(freedom * np.log(variance) + residual**2 / variance, axis=-1)
    loss = loss + _GRID[:, None] ** 2 + _GRID[None, :] ** 2
    i, j = np.unravel_index(int(np.argmin(loss)), loss.shape)
    return Noise(float(relative[i]), float(absolute[j]))
