"""How noisy what was measured is: expected levels, and those that the scatter about a fit shows."""

from typing import NamedTuple

import numpy as np

from ..support.checks import Array

FACTOR = 4.0  # 95 % range of a level about the expected one, either way
_SD = np.log(FACTOR) / 1.96
_GRID = np.linspace(-3.2, 3.2, 33)


class Noise(NamedTuple):
    """How noisy a measured curve is: two levels, estimated from the scatter about the fit.

    The variance of a residual is share^2 + (absolute * steepness)^2. `share` is the error of the
    measured stress relative to its scale, `absolute` that of the closure (m), which `steepness`
    (1/m) turns into one of stress; a curve without a steepness has the first alone. Levels that
    are `known` are not estimated.
    """

    share: float
    absolute: float = 0.0
    known: bool = False


class Series(NamedTuple):
    """One measured quantity of a test: what it is, the noise it is expected to carry, for each of
    its residuals, (n,), the steepness of the curve there (1/m), and the number of points.
    """

    what: str
    expected: Noise
    steepness: Array
    points: int


def estimate_noise(series: Series, residual: Array, leverage: Array) -> Noise:
    """Levels that the residuals (n,) of a fit with these leverages (n,) make most likely.

    Both have wide priors from what instruments do, because eight points cannot tell two levels by
    themselves. Restricted likelihood: a point of leverage h has the residual variance
    (1 - h) sigma^2.
    """
    expected = series.expected
    if expected.known:
        return expected
    free = np.clip(1 - leverage, 0.02, 1.0)
    share, absolute = (level * np.exp(_GRID * _SD) for level in expected[:2])
    variance = share[:, None, None] ** 2 + (absolute[:, None] * series.steepness) ** 2
    loss = np.sum(free * np.log(variance) + residual**2 / variance, axis=-1)
    loss = loss + _GRID[:, None] ** 2 + _GRID[None, :] ** 2
    i, j = np.unravel_index(int(np.argmin(loss)), loss.shape)
    return Noise(float(share[i]), float(absolute[j]))
